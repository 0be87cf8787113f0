#include "client/render/scene/CasterPieces.h"

#include <algorithm>
#include <iterator>
#include <span>
#include <utility>

#include "common/base/Error.h"

namespace tessera {
namespace {

template <typename Element>
using Part = CasterPieces::Part<Element>;

/// Elements of a row, at most, and of one that is not joined to its neighbour.
constexpr std::size_t kMostInRow = 64, kFewInRow = 16;

/// What is to go and to come, each in order.
struct Edits {
    std::span<const CasterRank> gone;
    std::span<ShadowCaster> come;

    [[nodiscard]] bool empty() const { return gone.empty() && come.empty(); }
    /// Takes those before this rank away from here.
    Edits takeBefore(const CasterRank& rank) {
        const auto out = static_cast<std::size_t>(std::ranges::lower_bound(gone, rank) - gone.begin());
        const auto in = static_cast<std::size_t>(std::ranges::lower_bound(come, rank, {}, rankOf) - come.begin());
        const Edits taken{gone.first(out), come.first(in)};
        gone = gone.subspan(out);
        come = come.subspan(in);
        return taken;
    }
};

CasterRank firstOf(const ShadowCaster& caster) {
    return rankOf(caster);
}
template <typename Element>
CasterRank firstOf(const Part<Element>& part) {
    return part.first;
}

PixelRect aroundOf(const ShadowCaster& caster) {
    return caster.rect;
}
template <typename Element>
PixelRect aroundOf(const Part<Element>& part) {
    return part.around;
}

PixelRect aroundBoth(const PixelRect& a, const PixelRect& b) {
    const int x = std::min(a.x, b.x), y = std::min(a.y, b.y);
    return {.x = x,
            .y = y,
            .width = std::max(a.x + a.width, b.x + b.width) - x,
            .height = std::max(a.y + a.height, b.y + b.height) - y};
}

/// In parts of the right size; a small one together with the one before. Returns how many elements it has moved.
template <typename Element>
std::size_t append(std::vector<Part<Element>>& to, std::vector<Element> row) {
    if (row.empty()) return 0;
    if (row.size() < kFewInRow && !to.empty() && to.back().row->size() + row.size() <= kMostInRow) {
        const auto before = std::move(to.back().row);
        to.pop_back();
        row.insert(row.begin(), before->begin(), before->end());
    }
    const std::size_t count = row.size(), parts = (count + kMostInRow - 1) / kMostInRow;
    for (std::size_t part = 0; part < parts; ++part) {
        const auto from = row.begin() + static_cast<std::ptrdiff_t>(count * part / parts),
                   end = row.begin() + static_cast<std::ptrdiff_t>(count * (part + 1) / parts);
        auto own =
            std::make_shared<const std::vector<Element>>(std::make_move_iterator(from), std::make_move_iterator(end));
        PixelRect around = aroundOf(own->front());
        for (const Element& element : *own) around = aroundBoth(around, aroundOf(element));
        const CasterRank first = firstOf(own->front());
        to.push_back({first, around, std::move(own)});
    }
    return count;
}

std::vector<ShadowCaster> edited(const std::vector<ShadowCaster>& row, Edits edits, std::size_t& /*copied*/) {
    std::vector<ShadowCaster> now;
    now.reserve(row.size() + edits.come.size());
    auto out = edits.gone.begin();
    auto in = edits.come.begin();
    for (const ShadowCaster& caster : row) {
        const CasterRank rank = rankOf(caster);
        for (; in != edits.come.end() && rankOf(*in) < rank; ++in) now.push_back(std::move(*in));
        if (out != edits.gone.end() && *out == rank)
            ++out;
        else
            now.push_back(caster);
    }
    TESSERA_CHECK(out == edits.gone.end(), "what goes is there");
    now.insert(now.end(), std::make_move_iterator(in), std::make_move_iterator(edits.come.end()));
    return now;
}

template <typename Element>
std::vector<Part<Element>> edited(const std::vector<Part<Element>>& parts, Edits edits, std::size_t& copied) {
    std::vector<Part<Element>> now;
    now.reserve(parts.size() + 1);
    if (parts.empty()) copied += append(now, edited(std::vector<Element>(), edits, copied));
    for (std::size_t i = 0; i < parts.size(); ++i) {
        // What belongs to this one comes before the next one begins.
        const Edits own = i + 1 == parts.size() ? edits : edits.takeBefore(parts[i + 1].first);
        if (own.empty())
            now.push_back(parts[i]);
        else
            copied += append(now, edited(*parts[i].row, own, copied));
    }
    return now;
}

template <typename Element>
const Element& partOf(const std::vector<Element>& row, const CasterRank& rank) {
    const auto behind =
        std::ranges::upper_bound(row, rank, {}, [](const Element& element) { return firstOf(element); });
    TESSERA_CHECK(behind != row.begin(), "a caster that is there");
    return *std::prev(behind);
}

}  // namespace

CasterRank rankOf(const ShadowCaster& caster) {
    const DrawItem& item = caster.item;
    return {.material = item.material, .mesh = item.mesh->serial, .mirrored = item.mirrored, .node = item.node};
}

const ShadowCaster& CasterPieces::at(const CasterRank& rank) const {
    const ShadowCaster& found = partOf(*partOf(*partOf(bundles_, rank).row, rank).row, rank);
    TESSERA_CHECK(rankOf(found) == rank, "a caster that is there");
    return found;
}

std::size_t CasterPieces::edit(std::vector<CasterRank> gone, std::vector<ShadowCaster> come) {
    std::ranges::sort(gone);
    std::ranges::sort(come, {}, rankOf);
    std::size_t copied = 0;
    bundles_ = edited(bundles_, {gone, come}, copied);
    return copied + bundles_.size();
}

std::size_t StillChanges::add(std::uint64_t state, std::vector<PixelRect> rects) {
    if (rects.empty()) return 0;
    Row row;
    if (!rows_.empty() && rows_.back()->size() < kFew) {
        row = *rows_.back();
        rows_.pop_back();
    }
    for (const PixelRect& rect : rects) row.push_back({state, rect});
    const std::size_t copied = row.size() + rows_.size();
    size_ += rects.size();
    rows_.push_back(std::make_shared<const Row>(std::move(row)));
    if (size_ <= kMost) return copied;
    auto keptFrom = rows_.begin();
    for (; size_ > kMost / 2; ++keptFrom) {
        size_ -= (*keptFrom)->size();
        knownAfter_ = (*keptFrom)->back().state;
    }
    rows_.erase(rows_.begin(), keptFrom);
    return copied;
}

}  // namespace tessera
