#include "server/collision/query/TouchQuery.h"

#include <algorithm>
#include <array>

#include "common/base/Error.h"
#include "common/base/Workers.h"
#include "server/collision/query/PairFrame.h"
#include "server/collision/tree/Kernels.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

using kernel::SlotPair;
using kernel::TouchSink;

/// A list of candidates and the exact test that empties it.
class Candidates {
public:
    Candidates(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b, bool any, const QueryWork& work)
        : a_(a.mesh()), b_(b.mesh()), a_T_b_(a_T_b), any_(any) {
        sink_.facesA = facesA_.data();
        sink_.facesB = facesB_.data();
        sink_.capacity = static_cast<std::uint32_t>(facesA_.size());
        sink_.eager = any;
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
        for (std::uint32_t i = 0; i < sink_.count; ++i) {
            if (!trianglesIntersect(a_.triangle(facesA_[i]), transformed(a_T_b_, b_.triangle(facesB_[i])))) continue;
            pairs_.push_back({facesA_[i], facesB_[i]});
            if (any_) return true;
        }
        sink_.count = 0;
        return false;
    }

private:
    const TriangleMesh &a_, &b_;
    const Affine3d& a_T_b_;
    bool any_;
    std::array<std::uint32_t, 256> facesA_, facesB_;
    TouchSink sink_{};
    std::vector<FacePair> pairs_;
};

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
    if (a.storage().empty() || b.storage().empty()) return Touch::kNo;
    if (work.exhausted()) return Touch::kUnknown;
    const Pair pair(a, b, a_T_b, options.realignment);
    ++work.boxTests;
    if (!pair.rootsOverlap()) return Touch::kNo;
    Candidates candidates(a, b, a_T_b, true, work);
    pair.walk(kRoots, kAllLevels, candidates.sink());
    take(work, candidates.sink());
    if (candidates.found()) return Touch::kYes;
    return candidates.sink().exhausted ? Touch::kUnknown : Touch::kNo;
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
    std::sort(out.pairs.begin(), out.pairs.end());
    return out;
}

}  // namespace tessera
