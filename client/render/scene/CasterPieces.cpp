#include "client/render/scene/CasterPieces.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/base/Error.h"

namespace tessera {

CasterRank rankOf(const ShadowCaster& caster) {
    const DrawItem& item = caster.item;
    return {.material = item.material, .mesh = item.mesh->serial, .mirrored = item.mirrored, .node = item.node};
}

const ShadowCaster& CasterPieces::at(const CasterRank& rank) const {
    const auto behind = std::ranges::upper_bound(pieces_, rank, {}, &Place::first);
    TESSERA_CHECK(behind != pieces_.begin(), "a caster that is there");
    const Piece& piece = *std::prev(behind)->piece;
    const auto found = std::ranges::lower_bound(piece, rank, {}, rankOf);
    TESSERA_CHECK(found != piece.end() && rankOf(*found) == rank, "a caster that is there");
    return *found;
}

std::size_t CasterPieces::edit(std::vector<CasterRank> gone, std::vector<ShadowCaster> come) {
    std::ranges::sort(gone);
    std::ranges::sort(come, {}, rankOf);
    size_ += come.size();
    size_ -= gone.size();
    std::vector<Place> edited;
    edited.reserve(pieces_.size() + 1);
    std::size_t copied = 0;
    auto out = gone.begin();
    auto in = come.begin();
    const auto finish = [&](Piece&& rest, auto end) {
        rest.insert(rest.end(), std::make_move_iterator(in), std::make_move_iterator(end));
        in = end;
        copied += append(edited, std::move(rest));
    };
    if (pieces_.empty()) finish({}, come.end());
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
        // What belongs to this piece comes before the next one begins.
        const bool last = i + 1 == pieces_.size();
        const auto outEnd = last ? gone.end() : std::lower_bound(out, gone.end(), pieces_[i + 1].first);
        const auto inEnd = last ? come.end()
                                : std::lower_bound(in, come.end(), pieces_[i + 1].first,
                                                   [](const ShadowCaster& caster, const CasterRank& rank) {
                                                       return rankOf(caster) < rank;
                                                   });
        if (out == outEnd && in == inEnd) {
            edited.push_back(pieces_[i]);
            continue;
        }
        Piece piece;
        piece.reserve(pieces_[i].piece->size() + static_cast<std::size_t>(inEnd - in));
        for (const ShadowCaster& caster : *pieces_[i].piece) {
            const CasterRank rank = rankOf(caster);
            for (; in != inEnd && rankOf(*in) < rank; ++in) piece.push_back(std::move(*in));
            if (out != outEnd && *out == rank)
                ++out;
            else
                piece.push_back(caster);
        }
        TESSERA_CHECK(out == outEnd, "what goes is there");
        finish(std::move(piece), inEnd);
    }
    pieces_ = std::move(edited);
    return copied;
}

/// In pieces of the right size; a small one together with the one before.
std::size_t CasterPieces::append(std::vector<Place>& to, Piece casters) {
    if (casters.empty()) return 0;
    if (casters.size() < kFew && !to.empty() && to.back().piece->size() + casters.size() <= kMost) {
        const std::shared_ptr<const Piece> before = std::move(to.back().piece);
        to.pop_back();
        casters.insert(casters.begin(), before->begin(), before->end());
    }
    const std::size_t count = casters.size(), parts = (count + kMost - 1) / kMost;
    for (std::size_t part = 0; part < parts; ++part) {
        const auto from = casters.begin() + static_cast<std::ptrdiff_t>(count * part / parts),
                   end = casters.begin() + static_cast<std::ptrdiff_t>(count * (part + 1) / parts);
        auto piece = std::make_shared<const Piece>(std::make_move_iterator(from), std::make_move_iterator(end));
        const CasterRank first = rankOf(piece->front());
        to.push_back({first, std::move(piece)});
    }
    return count;
}

}  // namespace tessera
