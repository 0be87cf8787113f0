#include "common/export/ExportNotes.h"

#include <fmt/format.h>

namespace tessera {

void ExportNotes::add(std::string_view what, ObjectId node) {
    auto found = nodes_.find(what);
    if (found == nodes_.end()) {
        order_.emplace_back(what);
        found = nodes_.emplace(what, Nodes()).first;
    }
    Nodes& nodes = found->second;
    if (!node || nodes.last == node) return;
    nodes.last = node;
    ++nodes.count;
    if (nodes.first.size() < kMostNodes) nodes.first.push_back(node);
}

std::vector<std::string> ExportNotes::lines(const Aspect& scene) const {
    std::vector<std::string> lines;
    for (const std::string& what : order_) {
        if (lines.size() == kMostLines) {
            lines.push_back(fmt::format("and {} kinds of losses more", order_.size() - kMostLines));
            break;
        }
        const Nodes& nodes = nodes_.find(what)->second;
        std::string line = what;
        if (!nodes.first.empty()) line += fmt::format(": {}", fmt::join(pathsOf(scene, nodes.first), ", "));
        if (nodes.count > nodes.first.size()) line += fmt::format(" and {} more", nodes.count - nodes.first.size());
        lines.push_back(std::move(line));
    }
    return lines;
}

}  // namespace tessera
