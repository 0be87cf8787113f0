/// Where the lines of a grid are along one axis.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace tessera {

/// At least two coordinates, strictly ascending; between each two lies a cell.
class GridAxis {
public:
    GridAxis() = default;
    explicit GridAxis(std::vector<double> lines) : at_(std::move(lines)) {
        const double step = (at_.back() - at_.front()) / static_cast<double>(cells());
        even_ = step > 0 && std::isfinite(1 / step);
        for (std::size_t i = 0; even_ && i < at_.size(); ++i)
            even_ = std::abs(at_[i] - at_.front() - static_cast<double>(i) * step) <= step;
        perCell_ = even_ ? 1 / step : 0;
    }

    [[nodiscard]] std::uint32_t lines() const { return static_cast<std::uint32_t>(at_.size()); }
    [[nodiscard]] std::uint32_t cells() const { return lines() - 1; }
    [[nodiscard]] double operator[](std::size_t line) const { return at_[line]; }
    [[nodiscard]] std::size_t memoryBytes() const { return at_.capacity() * sizeof(double); }

    /// From the first to before the end.
    struct Cells {
        std::uint32_t first = 0, end = 0;
        [[nodiscard]] bool empty() const { return first >= end; }
        [[nodiscard]] std::uint32_t count() const { return end - first; }
    };
    /// Those that [low, high] meets, touching included; all for what is no number.
    [[nodiscard]] Cells over(double low, double high) const {
        if (!(low <= high)) return {0, cells()};
        const std::size_t first = firstLine(low, [](double line, double x) { return line >= x; }),
                          end = firstLine(high, [](double line, double x) { return line > x; });
        if (first == at_.size() || end == 0) return {};
        return {static_cast<std::uint32_t>(first == 0 ? 0 : first - 1),
                static_cast<std::uint32_t>(end == at_.size() ? end - 1 : end)};
    }

private:
    /// The first for which `beyond` holds, and all after it; their number where there is none.
    template <typename Beyond>
    [[nodiscard]] std::size_t firstLine(double x, Beyond&& beyond) const {
        const std::size_t n = at_.size();
        std::size_t i = 0;
        if (even_) {
            // At most a step or two off.
            const double guess = (x - at_.front()) * perCell_;
            i = guess >= static_cast<double>(n) ? n : guess > 0 ? static_cast<std::size_t>(guess) : 0;
            while (i > 0 && beyond(at_[i - 1], x)) --i;
            while (i < n && !beyond(at_[i], x)) ++i;
            return i;
        }
        for (std::size_t left = n; left > 0;) {
            const std::size_t half = left / 2;
            const bool before = !beyond(at_[i + half], x);
            i = before ? i + half + 1 : i;
            left = before ? left - half - 1 : half;
        }
        return i;
    }

    std::vector<double> at_;
    bool even_ = false;   ///< no line is farther than a cell from where even spacing would have it
    double perCell_ = 0;  ///< of even ones: cells per unit
};

}  // namespace tessera
