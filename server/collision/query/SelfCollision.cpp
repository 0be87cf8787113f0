#include "server/collision/query/SelfCollision.h"

#include <algorithm>
#include <array>
#include <utility>

#include "server/collision/mesh/Predicates.h"
#include "server/collision/query/PairFrame.h"
#include "server/collision/tree/Kernels.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

/// Leaves out one coordinate.
/// The side of p, q on which r lies in a projection that is one to one on the plane of the triangle t, which has area.
class PlaneOf {
public:
    explicit PlaneOf(const Triangle& t) {
        const Vec3d n = (t[1] - t[0]).cross(t[2] - t[0]).cwiseAbs();
        n.maxCoeff(&axis_);
        // The largest may be rounding's.
        for (int i = 0; i < 3 && side(t[0], t[1], t[2]) == 0; ++i) axis_ = i;
    }
    [[nodiscard]] int side(const Vec3d& p, const Vec3d& q, const Vec3d& r) const {
        return orient2d(project(p, axis_), project(q, axis_), project(r, axis_));
    }
    /// Does the ray from p through x, all in the plane, run in the closed cone of p, a, b, which has area?
    [[nodiscard]] bool inCone(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& x) const {
        const int turn = side(p, a, b);
        return side(p, a, x) * turn >= 0 && side(p, x, b) * turn >= 0;
    }

private:
    int axis_ = 0;
};

/// What a triangle is as seen from its corner p: one or two parts, each the hull of p and a far side that p is not on.
struct Sector {
    Triangle whole, far;
};

std::size_t sectorsOf(const Vec3d& p, const Vec3d& a, const Vec3d& b, std::array<Sector, 2>& out) {
    if (!isDegenerate({p, a, b})) {
        out[0] = {{p, a, b}, {a, b, b}};
        return 1;
    }
    std::size_t count = 0;
    if (a != p) out[count++] = {{p, a, a}, {a, a, a}};
    if (b != p) out[count++] = {{p, b, b}, {b, b, b}};
    return count;
}

/// By what ends first along a ray from p that is in both: a far side of one, which then lies in the other. For any
/// triangles, but slow.
bool sectorsMeet(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    std::array<Sector, 2> ofA, ofB;
    const std::size_t countA = sectorsOf(p, a, b, ofA), countB = sectorsOf(p, c, d, ofB);
    for (std::size_t i = 0; i < countA; ++i)
        for (std::size_t j = 0; j < countB; ++j)
            if (trianglesIntersect(ofA[i].far, ofB[j].whole) || trianglesIntersect(ofB[j].far, ofA[i].whole))
                return true;
    return false;
}

/// Triangles p a b and p c d: do they meet besides in p?
bool meetBesidesCorner(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    const int sa = orient3d(p, c, d, a), sb = orient3d(p, c, d, b);
    if (sa * sb > 0) return false;
    const int tc = orient3d(p, a, b, c), td = orient3d(p, a, b, d);
    if (tc * td > 0) return false;
    // Each crosses the other's plane in a part of the line through p that both planes share, from p along
    // ± n1 × n2: the same way iff these signs differ.
    if (sa * sb < 0 && tc * td < 0) return sa * tc < 0;
    const bool areaOfA = tc != 0 || td != 0, areaOfB = sa != 0 || sb != 0;
    if (areaOfA && areaOfB) {
        // An edge from p lies in the other's plane, and nothing else of its triangle does.
        if (sa == 0) return PlaneOf({p, c, d}).inCone(p, c, d, a);
        if (sb == 0) return PlaneOf({p, c, d}).inCone(p, c, d, b);
        return PlaneOf({p, a, b}).inCone(p, a, b, tc == 0 ? c : d);
    }
    if (areaOfA || areaOfB || isDegenerate({p, a, b}) || isDegenerate({p, c, d})) return sectorsMeet(p, a, b, c, d);
    const PlaneOf plane({p, a, b});
    return plane.inCone(p, a, b, c) || plane.inCone(p, a, b, d) || plane.inCone(p, c, d, a) || plane.inCone(p, c, d, b);
}

/// For a point on the line through p and q: beyond which of them, -1 or 1, or 0 between them.
int beyond(const Vec3d& p, const Vec3d& q, const Vec3d& x) {
    const auto [low, high] = std::minmax(p, q, lexicographicallyLess);
    return lexicographicallyLess(x, low) ? -1 : lexicographicallyLess(high, x) ? 1 : 0;
}

/// Triangles p q a and p q b, p other than q: do they meet besides in the edge?
bool meetBesidesEdge(const Vec3d& p, const Vec3d& q, const Vec3d& a, const Vec3d& b) {
    if (orient3d(p, q, a, b) != 0) return false;
    const bool flatA = isDegenerate({p, q, a}), flatB = isDegenerate({p, q, b});
    if (flatA != flatB) return false;  // one has only the edge on the edge's line, the other nothing beside that line
    if (flatA) return beyond(p, q, a) != 0 && beyond(p, q, a) == beyond(p, q, b);
    const PlaneOf plane({p, q, a});
    return plane.side(p, q, a) == plane.side(p, q, b);
}

/// Two faces of one mesh, the corners that they share first: positions, each once.
struct Shared {
    Triangle a, b;
    std::size_t count = 0;

    Shared(const TriangleMesh& mesh, std::uint32_t faceA, std::uint32_t faceB, bool byPosition)
        : a(mesh.triangle(faceA)), b(mesh.triangle(faceB)) {
        const std::uint32_t *ia = &mesh.indices()[3 * std::size_t{faceA}],
                            *ib = &mesh.indices()[3 * std::size_t{faceB}];
        std::array<std::uint32_t, 3> indexA{ia[0], ia[1], ia[2]}, indexB{ib[0], ib[1], ib[2]};
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = count; j < 3; ++j) {
                if (byPosition ? a[i] != b[j] : indexA[i] != indexB[j]) continue;
                const auto known = a.begin() + static_cast<std::ptrdiff_t>(count);
                if (std::find(a.begin(), known, a[i]) != known) break;
                std::swap(a[i], a[count]);
                std::swap(indexA[i], indexA[count]);
                std::swap(b[j], b[count]);
                std::swap(indexB[j], indexB[count]);
                ++count;
                break;
            }
    }
};

/// A list of candidates and the decision that empties it.
class Candidates {
public:
    Candidates(const TriangleMesh& mesh, const SelfTouchOptions& options, const QueryWork& work)
        : mesh_(mesh), options_(options) {
        sink_.facesA = facesA_.data();
        sink_.facesB = facesB_.data();
        sink_.enough = kCapacity - kernel::kLeafPairs;
        sink_.enoughLeaves = 16;
        sink_.flush = [](kernel::TouchSink&, void* self) { return static_cast<Candidates*>(self)->flush(); };
        sink_.context = this;
        sink_.nodeTests = work.boxTests;
        sink_.triangleTests = work.triangleTests;
        sink_.limit = work.limit;
    }
    [[nodiscard]] kernel::TouchSink& sink() { return sink_; }
    [[nodiscard]] std::vector<FacePair>& pairs() { return pairs_; }

    bool flush() {
        for (std::uint32_t i = 0; i < sink_.count; ++i)
            // The tree against itself finds each pair both ways round, and each face with itself.
            if (facesA_[i] < facesB_[i] && touchBeyondAdjacency(mesh_, facesA_[i], facesB_[i], options_))
                pairs_.push_back({facesA_[i], facesB_[i]});
        sink_.count = 0;
        return false;
    }

private:
    const TriangleMesh& mesh_;
    const SelfTouchOptions& options_;
    static constexpr std::uint32_t kCapacity = 256;
    std::array<std::uint32_t, kCapacity> facesA_, facesB_;
    kernel::TouchSink sink_{};
    std::vector<FacePair> pairs_;
};

}  // namespace

bool touchBeyondAdjacency(const TriangleMesh& mesh, std::uint32_t faceA, std::uint32_t faceB,
                          const SelfTouchOptions& options) {
    const Shared f(mesh, faceA, faceB, options.weldEqualPositions);
    switch (f.count) {
        case 0:
            return trianglesIntersect(f.a, f.b);
        case 1:
            return meetBesidesCorner(f.a[0], f.a[1], f.a[2], f.b[1], f.b[2]);
        case 2:
            return meetBesidesEdge(f.a[0], f.a[1], f.a[2], f.b[2]);
        default:
            return !isDegenerate(f.a);
    }
}

FacePairs selfTouching(const TriangleTree& tree, QueryWork& work, const SelfTouchOptions& options) {
    FacePairs out;
    const TreeStorage& storage = tree.storage();
    if (storage.empty()) return out;
    if (work.exhausted()) {
        out.complete = false;
        return out;
    }
    Candidates candidates(tree.mesh(), options, work);
    const kernel::PairFrame frame = pairFrame(tree, tree, Affine3d::Identity());
    const auto shape = static_cast<std::size_t>(shapeOf(tree.options().volume));
    constexpr unsigned kAllLevels = ~0u;
    kernel::treeKernels().touch[shape](storage.view(), storage.view(), frame, {0, 0}, kAllLevels, candidates.sink());
    candidates.flush();
    work.boxTests = candidates.sink().nodeTests;
    work.triangleTests = candidates.sink().triangleTests;
    out.complete = !candidates.sink().exhausted;
    out.pairs = std::move(candidates.pairs());
    std::sort(out.pairs.begin(), out.pairs.end());
    return out;
}

}  // namespace tessera
