#include "server/collision/query/TouchSearch.h"

#include <algorithm>
#include <bit>

#include "server/collision/query/PairFrame.h"
#include "server/collision/tree/Kernels.h"
#include "server/collision/tree/TreeStorage.h"
#include "server/collision/volume/PolytopeVolume.h"

namespace tessera::touch {

namespace {

bool alike(const TriangleTree& a, const TriangleTree& b) {
    return shapeOf(a.options().volume) == shapeOf(b.options().volume);
}

bool isDop(VolumeKind kind) {
    return kind != VolumeKind::kSphere && kind != VolumeKind::kObb;
}

}  // namespace

std::optional<TriangleTree> ofOneShape(const TriangleTree& a, const TriangleTree& b) {
    if (alike(a, b)) return std::nullopt;
    const TriangleTree &smaller = smallerIsA(a, b) ? a : b, &larger = smallerIsA(a, b) ? b : a;
    return TriangleTree(smaller.mesh(), {.volume = larger.options().volume, .split = smaller.options().split});
}

TreePair::TreePair(const TriangleTree& ta, const TriangleTree& tb, const Affine3d& a_from_b,
                   const TouchOptions& options)
    : ofOneShape_(ofOneShape(ta, tb)),
      treeA(ofOneShape_ && smallerIsA(ta, tb) ? *ofOneShape_ : ta),
      treeB(ofOneShape_ && &treeA == &ta ? *ofOneShape_ : tb),
      meshA(treeA.mesh()),
      meshB(treeB.mesh()),
      a_T_b(a_from_b),
      a(treeA.storage().view()),
      b(treeB.storage().view()),
      viewA(meshView(meshA)),
      viewB(meshView(meshB)),
      frame(pairFrame(treeA, treeB, a_from_b, options.realignment)),
      map(pairMap(treeA, treeB, a_from_b)),
      kernels(kernel::treeKernels(options.instructions)),
      shape(static_cast<std::size_t>(shapeOf(treeA.options().volume))),
      touch(kernels.touch[shape]),
      placed(isDop(treeA.options().volume) ? options.placed : nullptr),
      overlap_(kernels.overlap[shape]) {
    // A map that no float can hold has no look-ups either (pairFrame gives it a slack that lets everything pass).
    if (options.realignment == Realignment::kTable && b.profileRows != nullptr && frame.slack < 1e29f) {
        lookups_ = profileLookups(treeA, treeB, a_from_b);
        frame.lookups = &lookups_;
        touch = kernels.touchByTable[shape];
        overlap_ = kernels.overlapByTable[shape];
    }
}

bool TreePair::rootsOverlap() const {
    return overlap_(a, b, frame, kRoots);
}

bool TreePair::meets(FacePair pair) const {
    return trianglesIntersect(meshA.triangle(pair.a), transformed(a_T_b, meshB.triangle(pair.b)));
}

void TreePair::measure(const float* rows, const kernel::ChildRef* children) const {
    KDop dop(directionsOf(treeA.options().volume));
    const std::size_t n = dop.count();
    const double unit = treeA.storage().unit;
    for (std::size_t lane = 0; lane < kernel::kWidth; ++lane) {
        if (children[lane] == kernel::kNoChild) continue;
        for (std::size_t i = 0; i < n; ++i) {
            dop.upper[i] = static_cast<double>(rows[i * kernel::kWidth + lane]) / unit;
            dop.lower[i] = -static_cast<double>(rows[(n + i) * kernel::kWidth + lane]) / unit;
        }
        placed->volume += polytopeVolume(dop);
        ++placed->count;
    }
}

namespace {
/// Deciding eight costs as much as deciding one; to wait for eight would cost more.
constexpr std::uint32_t kEnoughForAny = 3;
constexpr std::uint32_t kLeavesForAny = 8;
}  // namespace

Search::Search(const TreePair& pair, For what, const QueryWork& work) : pair_(pair), any_(what == For::kAny) {
    sink_.facesA = facesA_.data();
    sink_.facesB = facesB_.data();
    sink_.enough = any_ ? kEnoughForAny : kCapacity - kernel::kLeafPairs;
    sink_.deepestFirst = any_;
    sink_.enoughLeaves = any_ ? kLeavesForAny : 16;
    sink_.flush = [](kernel::TouchSink&, void* self) { return static_cast<Search*>(self)->decide(); };
    sink_.context = this;
    sink_.nodeTests = work.boxTests;
    sink_.triangleTests = work.triangleTests;
    sink_.limit = work.limit;
    if (pair.placed != nullptr) {
        sink_.placed = [](const float* rows, const kernel::ChildRef* children, void* of) {
            static_cast<const TreePair*>(of)->measure(rows, children);
        };
        sink_.placedContext = const_cast<TreePair*>(&pair);
    }
    if (!any_) pairs_.reserve(kCapacity);
}

bool Search::walk(kernel::SlotPair from, unsigned levels) {
    return pair_.touch(pair_.a, pair_.b, pair_.frame, from, levels, sink_);
}

void Search::finish() {
    if (!any_ || pairs_.empty()) decide();
}

void Search::putOff(kernel::SlotPair* to, std::uint32_t capacity) {
    sink_.later = to;
    sink_.laterCount = 0;
    sink_.laterCapacity = capacity;
}

void Search::take(QueryWork& work) const {
    work.boxTests = sink_.nodeTests;
    work.triangleTests = sink_.triangleTests;
}

bool Search::decide() {
    std::array<std::uint8_t, kCapacity / 8> meeting, open;
    pair_.kernels.decide(pair_.viewA, pair_.viewB, pair_.map, facesA_.data(), facesB_.data(), sink_.count,
                         meeting.data(), open.data());
    for (std::uint32_t group = 0; 8 * group < sink_.count; ++group) {
        for (unsigned left = meeting[group] | open[group]; left != 0; left &= left - 1) {
            const unsigned bit = static_cast<unsigned>(std::countr_zero(left));
            const FacePair pair{facesA_[8 * group + bit], facesB_[8 * group + bit]};
            if ((open[group] >> bit & 1U) != 0) {
                sink_.triangleTests += kExactTests;
                if (!pair_.meets(pair)) continue;
            }
            pairs_.push_back(pair);
            if (any_) return true;
        }
    }
    sink_.count = 0;
    return false;
}

void sort(std::vector<FacePair>& pairs, std::size_t facesA) {
    // By A's digits, the last first, then each face's few: a third of the time of comparisons.
    constexpr std::size_t kFewPairs = 64;
    constexpr int kMostBits = 11;
    if (pairs.size() < kFewPairs) {
        std::sort(pairs.begin(), pairs.end());
        return;
    }
    std::vector<FacePair> other(pairs.size());
    std::array<std::uint32_t, (1U << kMostBits) + 1> start;
    const int bits = static_cast<int>(std::bit_width(facesA - 1));
    const int passes = (bits + kMostBits - 1) / kMostBits;
    for (int pass = 0; pass < passes; ++pass) {
        const int digit = (bits + passes - 1) / passes, shift = pass * digit;
        const std::uint32_t mask = (1U << digit) - 1;
        std::fill_n(start.begin(), mask + 2, 0U);
        for (const FacePair& p : pairs) ++start[(p.a >> shift & mask) + 1];
        for (std::uint32_t i = 1; i <= mask; ++i) start[i] += start[i - 1];
        for (const FacePair& p : pairs) other[start[p.a >> shift & mask]++] = p;
        pairs.swap(other);
    }
    // A face meets few others as a rule.
    constexpr std::ptrdiff_t kFew = 12;
    for (auto first = pairs.begin(); first != pairs.end();) {
        auto end = first + 1;
        for (; end != pairs.end() && end->a == first->a; ++end)
            if (end - first < kFew)
                for (auto at = end; at != first && *at < at[-1]; --at) std::iter_swap(at, at - 1);
        if (end - first > kFew) std::sort(first, end);
        first = end;
    }
}

}  // namespace tessera::touch
