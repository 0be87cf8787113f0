#include "server/collision/convex/ExpandingPolytope.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <vector>

#include "server/collision/mesh/TriangleTriangle.h"

namespace tessera {

namespace {

Vec3d unit(const Vec3d& v) {
    const double largest = v.cwiseAbs().maxCoeff();
    if (!(largest > 0)) return Vec3d::Zero();
    return (v / largest).normalized();
}

struct Side {
    std::array<std::uint32_t, 3> corners;
    std::array<std::uint32_t, 3> across;
    Vec3d normal = Vec3d::Zero();  ///< unit length, outwards; zero for a sliver that has none in double
    bool alive = true;
    std::uint32_t seenIn = 0;
};

class Polytope {
public:
    Polytope(const MinkowskiDifference& difference, const Simplex& start, ConvexWork& work,
             const HullDepthOptions& options)
        : difference_(difference), work_(work), options_(options), first_(work.supports) {
        // Ordinary pairs end within these.
        corners_.reserve(32);
        sides_.reserve(96);
        faceFrom_.reserve(32);
        seen_.reserve(32);
        rim_.reserve(32);
        std::vector<Candidate> candidates;
        candidates.reserve(96);
        queue_ = Queue(std::less<Candidate>(), std::move(candidates));
        for (int i = 0; i < start.size; ++i) corners_.push_back(start.points[static_cast<std::size_t>(i)]);
        last_ = corners_.front().from;
        best_.depth = std::numeric_limits<double>::infinity();
    }

    DepthOfOrigin run() {
        if (span()) {
            forget();
            expand();
        }
        best_.depth = std::max(0.0, best_.depth);
        return best_;
    }

private:
    void forget() { best_.depth = std::numeric_limits<double>::infinity(); }

    /// The farthest corner along a direction; each bounds the depth from above.
    DifferencePoint farthest(const Vec3d& direction) {
        const DifferencePoint p = difference_.lowest(-direction, last_, work_);
        const double height = direction.dot(p.w);
        if (height < best_.depth) {
            best_.depth = height;
            best_.normal = direction;
            best_.onA = p.a;
            best_.onB = p.b;
        }
        return p;
    }

    [[nodiscard]] bool exhausted() const {
        return work_.exhausted() || work_.supports - first_ >= options_.maxSupports;
    }

    /// Finds four corners that are not in one plane and makes a tetrahedron of them. False: the difference is flat, or
    /// so flat that its corners in double are; then the last directions tried lead out of it.
    bool span() {
        const std::vector<DifferencePoint> found = corners_;
        corners_.assign(1, found.front());
        const Vec3d p = corners_[0].w;
        const auto take = [&](const auto& fits, std::initializer_list<Vec3d> directions) {
            for (const DifferencePoint& q : found)
                if (fits(q.w)) {
                    corners_.push_back(q);
                    return true;
                }
            forget();
            for (const Vec3d& direction : directions)
                for (const double sign : {1.0, -1.0}) {
                    const DifferencePoint q = farthest(sign * direction);
                    if (!fits(q.w)) continue;
                    corners_.push_back(q);
                    return true;
                }
            return false;
        };
        if (!take([&](const Vec3d& q) { return q != p; }, {Vec3d::UnitX(), Vec3d::UnitY(), Vec3d::UnitZ()}))
            return false;
        const Vec3d along = unit(corners_[1].w - p);
        const Vec3d across = along.unitOrthogonal();
        if (!take(
                [&](const Vec3d& q) {
                    return !isDegenerate({p, corners_[1].w, q});
                },
                {across, unit(along.cross(across))}))
            return false;
        Vec3d normal = unit((corners_[1].w - p).cross(corners_[2].w - p));
        if (normal == Vec3d::Zero()) normal = across;
        if (!take([&](const Vec3d& q) { return orient3d(p, corners_[1].w, corners_[2].w, q) != 0; }, {normal}))
            return false;
        if (orient3d(p, corners_[1].w, corners_[2].w, corners_[3].w) > 0) std::swap(corners_[0], corners_[1]);
        for (const auto& c : {std::array<std::uint32_t, 3>{0, 1, 2}, {1, 0, 3}, {2, 1, 3}, {0, 2, 3}}) add(c);
        sides_[0].across = {1, 2, 3};
        sides_[1].across = {0, 3, 2};
        sides_[2].across = {0, 1, 3};
        sides_[3].across = {0, 2, 1};
        return true;
    }

    void expand() {
        const double tolerance = std::max(options_.tolerance, difference_.margin());
        best_.complete = false;
        while (!queue_.empty()) {
            const Candidate candidate = queue_.top();
            queue_.pop();
            if (!sides_[candidate.side].alive) continue;
            if (std::isfinite(best_.depth) && exhausted()) return;
            const Side side = sides_[candidate.side];
            const DifferencePoint p = farthest(side.normal);
            const double height = side.normal.dot(p.w);
            if (height - candidate.distance <= tolerance) {
                // The nearest side of all is one of the difference's own.
                best_.depth = height;
                best_.normal = side.normal;
                best_.complete = true;
                placeWitnesses(tolerance);
                return;
            }
            // A sliver whose normal is rounding: what seems to lie beyond it does not.
            if (orient3d(at(side, 0), at(side, 1), at(side, 2), p.w) <= 0) continue;
            include(p, candidate.side);
        }
    }

    [[nodiscard]] const Vec3d& at(const Side& side, std::size_t i) const { return corners_[side.corners[i]].w; }

    std::uint32_t add(const std::array<std::uint32_t, 3>& corners) {
        const auto index = static_cast<std::uint32_t>(sides_.size());
        Side side{corners, {}};
        side.normal = unit(
            (corners_[corners[1]].w - corners_[corners[0]].w).cross(corners_[corners[2]].w - corners_[corners[0]].w));
        // A sliver's plane passes through the long edges of its neighbours and is never nearer than both of theirs.
        if (side.normal != Vec3d::Zero()) queue_.push({side.normal.dot(corners_[corners[0]].w), index});
        sides_.push_back(side);
        return index;
    }

    void include(const DifferencePoint& p, std::uint32_t firstSeen) {
        const auto apex = static_cast<std::uint32_t>(corners_.size());
        corners_.push_back(p);
        faceFrom_.resize(corners_.size());
        ++round_;
        seen_.assign(1, firstSeen);
        sides_[firstSeen].seenIn = round_;
        rim_.clear();
        for (std::size_t k = 0; k < seen_.size(); ++k) {
            sides_[seen_[k]].alive = false;
            for (std::size_t i = 0; i < 3; ++i) {
                const Side& side = sides_[seen_[k]];
                Side& other = sides_[side.across[i]];
                if (other.seenIn == round_) continue;
                if (orient3d(at(other, 0), at(other, 1), at(other, 2), p.w) > 0) {
                    other.seenIn = round_;
                    seen_.push_back(side.across[i]);
                } else {
                    rim_.push_back({side.corners[i], side.corners[(i + 1) % 3], side.across[i]});
                }
            }
        }
        const auto base = static_cast<std::uint32_t>(sides_.size());
        for (const RimEdge& e : rim_) {
            const std::uint32_t side = add({e.from, e.to, apex});
            sides_[side].across[0] = e.behind;
            Side& behind = sides_[e.behind];
            for (std::size_t i = 0; i < 3; ++i)
                if (behind.corners[i] == e.to && behind.corners[(i + 1) % 3] == e.from) behind.across[i] = side;
            faceFrom_[e.from] = side;
        }
        for (std::uint32_t k = 0; k < rim_.size(); ++k) {
            const std::uint32_t following = faceFrom_[rim_[k].to];
            sides_[base + k].across[1] = following;
            sides_[following].across[2] = base + k;
        }
    }

    /// The points of A and of B that come together where the surface is nearest to the origin: in one of the sides in
    /// the best plane, which may be several.
    void placeWitnesses(double tolerance) {
        Simplex simplex;
        double least = std::numeric_limits<double>::infinity();
        for (const Side& side : sides_) {
            if (!side.alive) continue;
            Simplex candidate;
            double lowest = best_.depth;
            for (const std::uint32_t c : side.corners) {
                lowest = std::min(lowest, best_.normal.dot(corners_[c].w));
                candidate.push(corners_[c]);
            }
            if (lowest < best_.depth - 4 * tolerance) continue;
            if (const double distance = reduce(candidate).distance; distance < least) {
                least = distance;
                simplex = candidate;
            }
        }
        if (simplex.size == 0) return;
        const auto& p = simplex.points;
        std::array<double, 3> weights{1, 0, 0};
        if (simplex.size == 2) {
            const Vec3d e = p[1].w - p[0].w;
            weights[1] = std::clamp(-p[0].w.dot(e) / e.squaredNorm(), 0.0, 1.0);
            weights[0] = 1 - weights[1];
        } else if (simplex.size == 3) {
            const Vec3d n = (p[1].w - p[0].w).cross(p[2].w - p[0].w);
            double total = 0;
            for (std::size_t i = 0; i < 3; ++i) {
                weights[i] = std::max(0.0, p[(i + 1) % 3].w.cross(p[(i + 2) % 3].w).dot(n));
                total += weights[i];
            }
            if (!(total > 0)) return;
            for (double& w : weights) w /= total;
        }
        best_.onA = best_.onB = Vec3d::Zero();
        for (std::size_t i = 0; i < static_cast<std::size_t>(simplex.size); ++i) {
            best_.onA += weights[i] * p[i].a;
            best_.onB += weights[i] * p[i].b;
        }
    }

    struct Candidate {
        double distance;
        std::uint32_t side;
        /// The nearest is served first; of equally near ones the oldest.
        bool operator<(const Candidate& o) const {
            return distance != o.distance ? distance > o.distance : side > o.side;
        }
    };

    const MinkowskiDifference& difference_;
    ConvexWork& work_;
    const HullDepthOptions& options_;
    std::uint64_t first_;
    VertexPair last_;
    DepthOfOrigin best_;
    std::vector<DifferencePoint> corners_;
    std::vector<Side> sides_;
    std::vector<std::uint32_t> faceFrom_;
    struct RimEdge {
        std::uint32_t from, to;
        std::uint32_t behind;  ///< the side that stays
    };
    using Queue = std::priority_queue<Candidate>;
    Queue queue_;
    std::vector<std::uint32_t> seen_;
    std::vector<RimEdge> rim_;
    std::uint32_t round_ = 0;
};

}  // namespace

DepthOfOrigin depthOfOrigin(const MinkowskiDifference& difference, const Simplex& start, ConvexWork& work,
                            const HullDepthOptions& options) {
    return Polytope(difference, start, work, options).run();
}

}  // namespace tessera
