#include "client/render/cull/PlateCuts.h"

#include <algorithm>

namespace tessera {

namespace {

using Plate = VisibilityDevice::Plate;

/// A plate in more pieces costs more than the pixels that are saved.
constexpr std::size_t kMostPieces = 64;

bool overlap(const Plate& a, const Plate& b) {
    return a.left < b.right && b.left < a.right && a.bottom < b.top && b.bottom < a.top;
}
bool covers(const Plate& a, const Plate& b) {
    return a.left <= b.left && b.right <= a.right && a.bottom <= b.bottom && b.top <= a.top;
}

}  // namespace

void PlateCuts::cutAway(const Plate& nearer) {
    before_.swap(pieces_);
    pieces_.clear();
    for (Plate piece : before_) {
        if (!overlap(piece, nearer)) {
            pieces_.push_back(piece);
            continue;
        }
        const auto keep = [&](int left, int bottom, int right, int top) {
            if (left < right && bottom < top) pieces_.push_back({left, bottom, right, top, piece.depth});
        };
        // Below and above over the whole width, then what is left on both sides.
        keep(piece.left, piece.bottom, piece.right, nearer.bottom);
        keep(piece.left, nearer.top, piece.right, piece.top);
        const int bottom = std::max(piece.bottom, nearer.bottom), top = std::min(piece.top, nearer.top);
        keep(piece.left, bottom, nearer.left, top);
        keep(nearer.right, bottom, piece.right, top);
    }
}

void PlateCuts::cut(std::vector<Asked> plates, std::size_t questions) {
    std::stable_sort(plates.begin(), plates.end(),
                     [](const Asked& a, const Asked& b) { return a.plate.depth > b.plate.depth; });
    left_.assign(questions, {});
    restsOn_.assign(questions, {});
    std::vector<const Asked*> cutters;
    for (const Asked& asked : plates) {
        pieces_.assign(1, asked.plate);
        bool whollyCovered = false;
        for (const Asked* nearer : cutters) {
            if (!overlap(nearer->plate, asked.plate)) continue;
            if (nearer->question != asked.question) restsOn_[asked.question].push_back(nearer->question);
            whollyCovered = covers(nearer->plate, asked.plate);
            cutAway(nearer->plate);
            if (pieces_.empty() || pieces_.size() > kMostPieces) break;
        }
        auto& left = left_[asked.question];
        left.insert(left.end(), pieces_.begin(), pieces_.end());
        if (asked.cuts && !whollyCovered) cutters.push_back(&asked);
    }
    plates_.clear();
    sizes_.clear();
    for (const auto& left : left_) {
        plates_.insert(plates_.end(), left.begin(), left.end());
        sizes_.push_back(static_cast<std::uint32_t>(left.size()));
    }
    for (auto& others : restsOn_) {
        std::sort(others.begin(), others.end());
        others.erase(std::unique(others.begin(), others.end()), others.end());
    }
}

}  // namespace tessera
