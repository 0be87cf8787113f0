#include "common/output/MeshFile.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>

namespace tessera {
namespace {

/// The numbers of a text, line by line.
class MeshLines {
public:
    explicit MeshLines(std::string_view text) : rest_(text) {}

    /// The words of the next line that says something; none at the end.
    std::vector<std::string_view> next() {
        std::vector<std::string_view> words;
        while (!rest_.empty() && words.empty()) {
            const std::size_t end = std::min(rest_.find('\n'), rest_.size());
            std::string_view line = rest_.substr(0, end);
            rest_.remove_prefix(std::min(end + 1, rest_.size()));
            ++number_;
            while (true) {
                const std::size_t start = line.find_first_not_of(" \t\r,");
                if (start == std::string_view::npos) break;
                line.remove_prefix(start);
                const std::size_t length = std::min(line.find_first_of(" \t\r,"), line.size());
                words.push_back(line.substr(0, length));
                line.remove_prefix(length);
            }
            if (!words.empty() && words[0].starts_with('#')) words.clear();
        }
        return words;
    }
    [[nodiscard]] int number() const { return number_; }

private:
    std::string_view rest_;
    int number_ = 0;
};

template <typename Number>
std::optional<Number> numberIn(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    Number value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return value;
}

}  // namespace

Expected<WarpMesh> readMesh(std::string_view text, std::string_view name, double aspect) {
    // As some editors of Windows begin a text.
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    MeshLines lines(text);
    const auto wrong = [&](std::string what) {
        return fail(ErrorCode::kBadInput, fmt::format("{}:{}: {}", name, std::max(1, lines.number()), what));
    };

    auto words = lines.next();
    const auto type = words.size() == 1 ? numberIn<int>(words[0]) : std::nullopt;
    if (!type) return wrong("not a warp mesh: the first line is its type, 2 for a rectangular mesh");
    if (*type != 2) return wrong(fmt::format("a mesh of type {}: only rectangular ones, type 2, are read", *type));
    words = lines.next();
    const auto columns = words.size() == 2 ? numberIn<int>(words[0]) : std::nullopt,
               rows = words.size() == 2 ? numberIn<int>(words[1]) : std::nullopt;
    if (!columns || !rows) return wrong("the second line has to be the numbers of columns and rows of nodes");
    const OutputLimits limits;
    WarpMesh mesh{.columns = *columns, .rows = *rows, .nodes = {}};
    if (mesh.columns < 2 || mesh.rows < 2 || mesh.columns > limits.maxWarpSide || mesh.rows > limits.maxWarpSide ||
        static_cast<std::size_t>(mesh.columns) * static_cast<std::size_t>(mesh.rows) > limits.maxWarpNodes)
        return wrong("a mesh that " + findWarpFault(mesh).value_or("is too large"));
    const std::size_t count = static_cast<std::size_t>(mesh.columns) * static_cast<std::size_t>(mesh.rows);
    while (true) {
        words = lines.next();
        if (words.empty()) break;
        const auto node = [&] {
            const auto at = static_cast<int>(mesh.nodes.size());
            return fmt::format("node column {} row {}", at % mesh.columns, at / mesh.columns);
        };
        if (mesh.nodes.size() == count) return wrong(fmt::format("more than {} x {} nodes", mesh.columns, mesh.rows));
        if (words.size() != 5)
            return wrong(fmt::format("{} has {} numbers instead of 5: x y u v intensity", node(), words.size()));
        double values[5] = {};
        for (std::size_t i = 0; i < 5; ++i) {
            const auto value = numberIn<double>(words[i]);
            if (!value) return wrong(fmt::format("{}: \"{}\" is no number", node(), words[i].substr(0, 40)));
            values[i] = *value;
        }
        if (values[4] < 0)
            return wrong(fmt::format("a hole: {} is marked as missing (intensity {:.6g})", node(), values[4]));
        mesh.nodes.push_back({.x = static_cast<float>(values[0] / aspect),
                              .y = static_cast<float>(values[1]),
                              .u = static_cast<float>(values[2]),
                              .v = static_cast<float>(values[3]),
                              .intensity = static_cast<float>(values[4])});
    }
    if (mesh.nodes.size() < count)
        return wrong(fmt::format("ends after {} of {} x {} nodes: node column {} row {} is missing", mesh.nodes.size(),
                                 mesh.columns, mesh.rows, static_cast<int>(mesh.nodes.size()) % mesh.columns,
                                 static_cast<int>(mesh.nodes.size()) / mesh.columns));
    if (auto fault = findWarpFault(mesh))
        return fail(ErrorCode::kBadInput, fmt::format("{}: a mesh that {}", name, *fault));
    return mesh;
}

std::string meshText(const WarpMesh& mesh, double aspect) {
    std::string text = fmt::format("2\n{} {}\n", mesh.columns, mesh.rows);
    for (const WarpNode& n : mesh.nodes)
        text += fmt::format("{:.9g} {:.9g} {:.9g} {:.9g} {:.9g}\n", n.x * aspect, n.y, n.u, n.v, n.intensity);
    return text;
}

}  // namespace tessera
