/// Points as weighted sums of others: what a step of subdivision is, whatever the points are.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/math/Types.h"

namespace tessera {

struct SparseRows {
    std::vector<std::uint32_t> begin{0}, columns;
    std::vector<double> weights;

    [[nodiscard]] std::size_t count() const { return begin.size() - 1; }
    void endRow() { begin.push_back(static_cast<std::uint32_t>(columns.size())); }
    [[nodiscard]] Vec3d apply(std::size_t row, std::span<const Vec3d> points) const {
        Vec3d sum = Vec3d::Zero();
        for (std::uint32_t i = begin[row]; i < begin[row + 1]; ++i) sum += weights[i] * points[columns[i]];
        return sum;
    }
    /// Not into the points themselves.
    void apply(std::span<const Vec3d> points, std::vector<Vec3d>& out) const {
        out.resize(count());
        for (std::size_t row = 0; row < count(); ++row) out[row] = apply(row, points);
    }
};

/// A row while it is added up, of a known number of columns.
class RowSum {
public:
    explicit RowSum(std::size_t columns) : weights_(columns, 0), isUsed_(columns, false) {}
    void add(std::uint32_t column, double weight) {
        if (!isUsed_[column]) {
            isUsed_[column] = true;
            used_.push_back(column);
        }
        weights_[column] += weight;
    }
    [[nodiscard]] const std::vector<std::uint32_t>& used() const { return used_; }
    [[nodiscard]] double weight(std::uint32_t column) const { return weights_[column]; }
    /// Appends the row, in the order in which columns were named, and begins the next.
    void moveInto(SparseRows& rows) {
        for (const std::uint32_t c : used_) {
            if (weights_[c] != 0) {
                rows.columns.push_back(c);
                rows.weights.push_back(weights_[c]);
            }
        }
        rows.endRow();
        clear();
    }
    void clear() {
        for (const std::uint32_t c : used_) {
            weights_[c] = 0;
            isUsed_[c] = false;
        }
        used_.clear();
    }

private:
    std::vector<double> weights_;
    std::vector<bool> isUsed_;
    std::vector<std::uint32_t> used_;
};

}  // namespace tessera
