#include "server/collision/query/TouchQuery.h"

#include <algorithm>
#include <array>
#include <bit>

#include "common/base/Error.h"
#include "common/base/Workers.h"
#include "server/collision/query/PairFrame.h"
#include "server/collision/tree/Kernels.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

using kernel::SlotPair;
using kernel::TouchSink;

/// A list of candidates and the test that empties it: eight at once in double, and exactly where that cannot tell.
class Candidates {
public:
    Candidates(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b, bool any, const QueryWork& work)
        : a_(a.mesh()),
          b_(b.mesh()),
          a_T_b_(a_T_b),
          any_(any),
          viewA_(meshView(a_)),
          viewB_(meshView(b_)),
          map_(pairMap(a, b, a_T_b)),
          decide_(kernel::treeKernels().decide) {
        sink_.facesA = facesA_.data();
        sink_.facesB = facesB_.data();
        sink_.enough = any ? kEnoughForAny : kCapacity - kernel::kLeafPairs;
        sink_.flush = [](TouchSink&, void* self) { return static_cast<Candidates*>(self)->flush(); };
        sink_.context = this;
        sink_.nodeTests = work.boxTests;
        sink_.triangleTests = work.triangleTests;
        sink_.limit = work.limit;
    }

    [[nodiscard]] TouchSink& sink() { return sink_; }
    [[nodiscard]] std::vector<FacePair>& pairs() { return pairs_; }
    [[nodiscard]] bool found() const { return !pairs_.empty(); }

    bool flush() {
        std::array<std::uint8_t, kCapacity / 8> meeting, open;
        decide_(viewA_, viewB_, map_, facesA_.data(), facesB_.data(), sink_.count, meeting.data(), open.data());
        for (std::uint32_t group = 0; 8 * group < sink_.count; ++group) {
            for (unsigned left = meeting[group] | open[group]; left != 0; left &= left - 1) {
                const unsigned bit = static_cast<unsigned>(std::countr_zero(left));
                const FacePair pair{facesA_[8 * group + bit], facesB_[8 * group + bit]};
                if ((open[group] >> bit & 1U) != 0 &&
                    !trianglesIntersect(a_.triangle(pair.a), transformed(a_T_b_, b_.triangle(pair.b))))
                    continue;
                pairs_.push_back(pair);
                if (any_) return true;
            }
        }
        sink_.count = 0;
        return false;
    }

private:
    const TriangleMesh &a_, &b_;
    const Affine3d& a_T_b_;
    bool any_;
    kernel::MeshView viewA_, viewB_;
    kernel::PairMap map_;
    kernel::DecidePairs decide_;
    static constexpr std::uint32_t kCapacity = 256;
    /// Deciding eight costs as much as deciding one; waiting for eight would cost more.
    static constexpr std::uint32_t kEnoughForAny = 3;
    std::array<std::uint32_t, kCapacity> facesA_, facesB_;
    TouchSink sink_{};
    std::vector<FacePair> pairs_;
};

/// By ascending faces. Digit after digit, the last first: a third of the time of comparisons.
void sort(std::vector<FacePair>& pairs, std::size_t facesA, std::size_t facesB) {
    constexpr std::size_t kFewPairs = 64;
    constexpr int kMostBits = 11;
    if (pairs.size() < kFewPairs) {
        std::sort(pairs.begin(), pairs.end());
        return;
    }
    std::vector<FacePair> other(pairs.size());
    std::array<std::uint32_t, (1U << kMostBits) + 1> start;
    const auto by = [&](std::uint32_t FacePair::*face, std::size_t faces) {
        const int bits = static_cast<int>(std::bit_width(faces - 1));
        const int passes = (bits + kMostBits - 1) / kMostBits;
        for (int pass = 0; pass < passes; ++pass) {
            const int digit = (bits + passes - 1) / passes, shift = pass * digit;
            const std::uint32_t mask = (1U << digit) - 1;
            std::fill_n(start.begin(), mask + 2, 0U);
            for (const FacePair& p : pairs) ++start[(p.*face >> shift & mask) + 1];
            for (std::uint32_t i = 1; i <= mask; ++i) start[i] += start[i - 1];
            for (const FacePair& p : pairs) other[start[p.*face >> shift & mask]++] = p;
            pairs.swap(other);
        }
    };
    by(&FacePair::b, facesB);
    by(&FacePair::a, facesA);
}

constexpr unsigned kAllLevels = ~0u;
constexpr SlotPair kRoots{0, 0};

/// Both trees as the kernels see them; trees of different kinds cannot be compared.
struct Pair {
    kernel::TreeView a, b;
    kernel::PairFrame frame;
    std::size_t shape;

    Pair(const TriangleTree& ta, const TriangleTree& tb, const Affine3d& a_T_b, Realignment realignment)
        : a(ta.storage().view()),
          b(tb.storage().view()),
          frame(pairFrame(ta, tb, a_T_b, realignment)),
          shape(static_cast<std::size_t>(shapeOf(ta.options().volume))) {
        TESSERA_CHECK(shapeOf(ta.options().volume) == shapeOf(tb.options().volume), "two trees of one kind");
    }
    bool walk(SlotPair from, unsigned levels, TouchSink& sink) const {
        return kernel::treeKernels().touch[shape](a, b, frame, from, levels, sink);
    }
    [[nodiscard]] bool rootsOverlap() const { return kernel::treeKernels().overlap[shape](a, b, frame, kRoots); }
};

void take(QueryWork& work, const TouchSink& sink) {
    work.boxTests = sink.nodeTests;
    work.triangleTests = sink.triangleTests;
}

}  // namespace

Touch anyTouching(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b, QueryWork& work,
                  const TouchOptions& options) {
    return firstTouching(a, b, a_T_b, work, options).touch;
}

TouchedPair firstTouching(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b, QueryWork& work,
                          const TouchOptions& options) {
    if (a.storage().empty() || b.storage().empty()) return {};
    if (work.exhausted()) return {Touch::kUnknown, {}};
    const Pair pair(a, b, a_T_b, options.realignment);
    ++work.boxTests;
    if (!pair.rootsOverlap()) return {};
    Candidates candidates(a, b, a_T_b, true, work);
    if (!pair.walk(kRoots, kAllLevels, candidates.sink()) || candidates.sink().exhausted) candidates.flush();
    take(work, candidates.sink());
    if (candidates.found()) return {Touch::kYes, candidates.pairs().front()};
    return {candidates.sink().exhausted ? Touch::kUnknown : Touch::kNo, {}};
}

FacePairs allTouching(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b, QueryWork& work,
                      const TouchOptions& options) {
    FacePairs out;
    if (a.storage().empty() || b.storage().empty()) return out;
    if (work.exhausted()) {
        out.complete = false;
        return out;
    }
    const Pair pair(a, b, a_T_b, options.realignment);
    ++work.boxTests;
    if (!pair.rootsOverlap()) return out;
    Candidates candidates(a, b, a_T_b, false, work);
    pair.walk(kRoots, kAllLevels, candidates.sink());
    candidates.flush();
    take(work, candidates.sink());
    out.complete = !candidates.sink().exhausted;
    out.pairs = std::move(candidates.pairs());
    sort(out.pairs, a.mesh().faceCount(), b.mesh().faceCount());
    return out;
}

}  // namespace tessera
