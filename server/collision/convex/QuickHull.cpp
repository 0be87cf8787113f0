#include "server/collision/convex/QuickHull.h"

#include <algorithm>
#include <utility>

#include "server/collision/mesh/Predicates.h"

namespace tessera {

namespace {

constexpr std::uint32_t kNone = ~std::uint32_t{0};

struct Face {
    std::array<std::uint32_t, 3> corners;
    std::array<std::uint32_t, 3> across;  ///< the face behind the edge from corner i to corner i + 1
    std::uint32_t outside = kNone;        ///< first of the points that are to be looked at from here
    std::uint32_t farthest = kNone;       ///< of them, by rounded distance: a choice, no decision
    double reach = 0;
    Vec3d origin = Vec3d::Zero(), normal = Vec3d::Zero();  ///< not of unit length
    double doubt = 0;                                      ///< beyond this a rounded side is certain
    bool alive = true;
    std::uint32_t seenIn = 0;  ///< the round in which the face was found visible
};

class Builder {
public:
    explicit Builder(std::span<const Vec3d> points)
        : points_(points), next_(points.size(), kNone), faceFrom_(points.size(), kNone) {
        Vec3d lower = points.front(), upper = points.front();
        for (const Vec3d& p : points) {
            lower = lower.cwiseMin(p);
            upper = upper.cwiseMax(p);
        }
        extent_ = (upper - lower).norm();
    }

    HullSurface run(std::array<std::uint32_t, 4> start) {
        makeStart(start);
        while (!pending_.empty()) {
            const std::uint32_t face = pending_.back();
            pending_.pop_back();
            if (faces_[face].alive && faces_[face].outside != kNone) include(faces_[face].farthest, face);
        }
        return surface();
    }

private:
    [[nodiscard]] HullSurface surface() const {
        std::vector<std::uint32_t> place(faces_.size(), kNone);
        HullSurface out;
        for (std::uint32_t f = 0; f < faces_.size(); ++f)
            if (faces_[f].alive) {
                place[f] = static_cast<std::uint32_t>(out.triangles.size());
                out.triangles.push_back(faces_[f].corners);
            }
        for (const Face& f : faces_)
            if (f.alive) out.across.push_back({place[f.across[0]], place[f.across[1]], place[f.across[2]]});
        return out;
    }

    std::uint32_t addFace(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        std::uint32_t index = 0;
        if (free_.empty()) {
            index = static_cast<std::uint32_t>(faces_.size());
            faces_.emplace_back();
        } else {
            index = free_.back();
            free_.pop_back();
            faces_[index] = Face{};
        }
        Face& f = faces_[index];
        f.corners = {a, b, c};
        f.origin = points_[a];
        const Vec3d ab = points_[b] - points_[a], ac = points_[c] - points_[a];
        f.normal = ab.cross(ac);
        // Differences, products and sums of the dot product each round once: well under 32 of them.
        f.doubt = 32 * exact::kRounding * ab.norm() * ac.norm() * extent_;
        return index;
    }

    void makeStart(std::array<std::uint32_t, 4> s) {
        if (orient3d(points_[s[0]], points_[s[1]], points_[s[2]], points_[s[3]]) > 0) std::swap(s[0], s[1]);
        // The fourth now lies behind the first three.
        const std::uint32_t base = addFace(s[0], s[1], s[2]);
        std::array<std::uint32_t, 3> sides;
        for (std::size_t i = 0; i < 3; ++i) sides[i] = addFace(s[(i + 1) % 3], s[i], s[3]);
        for (std::size_t i = 0; i < 3; ++i) {
            faces_[base].across[i] = sides[i];
            faces_[sides[i]].across = {base, sides[(i + 2) % 3], sides[(i + 1) % 3]};
        }
        for (std::uint32_t p = 0; p < points_.size(); ++p)
            if (std::find(s.begin(), s.end(), p) == s.end()) assign(p, {base, sides[0], sides[1], sides[2]});
        for (const std::uint32_t f : {base, sides[0], sides[1], sides[2]}) pending_.push_back(f);
    }

    [[nodiscard]] bool strictlyOutside(const Face& f, const Vec3d& p, double& height) const {
        height = f.normal.dot(p - f.origin);
        if (height > f.doubt) return true;
        if (height < -f.doubt) return false;
        return orient3d(points_[f.corners[0]], points_[f.corners[1]], points_[f.corners[2]], p) > 0;
    }

    /// To the first of the faces that the point lies outside of. A point outside none of a new cone's faces, but
    /// outside a face that the cone replaced, lies inside the hull now.
    template <typename FaceList>
    void assign(std::uint32_t point, const FaceList& candidates) {
        double height = 0;
        for (const std::uint32_t index : candidates) {
            Face& f = faces_[index];
            if (!strictlyOutside(f, points_[point], height)) continue;
            next_[point] = f.outside;
            f.outside = point;
            if (f.farthest == kNone || height > f.reach) {
                f.farthest = point;
                f.reach = height;
            }
            return;
        }
    }
    void assign(std::uint32_t point, std::initializer_list<std::uint32_t> candidates) {
        assign<std::initializer_list<std::uint32_t>>(point, candidates);
    }

    /// Replaces what `point` sees of the surface by its cone over the rim.
    void include(std::uint32_t point, std::uint32_t firstSeen) {
        ++round_;
        seen_.assign(1, firstSeen);
        faces_[firstSeen].seenIn = round_;
        rim_.clear();
        double height = 0;
        for (std::size_t k = 0; k < seen_.size(); ++k) {
            const Face& f = faces_[seen_[k]];
            for (std::size_t i = 0; i < 3; ++i) {
                const std::uint32_t other = f.across[i];
                if (faces_[other].seenIn == round_) continue;
                if (strictlyOutside(faces_[other], points_[point], height)) {
                    faces_[other].seenIn = round_;
                    seen_.push_back(other);
                } else {
                    rim_.push_back({f.corners[i], f.corners[(i + 1) % 3], other});
                }
            }
        }
        orphans_.clear();
        for (const std::uint32_t f : seen_) {
            for (std::uint32_t p = faces_[f].outside; p != kNone; p = next_[p])
                if (p != point) orphans_.push_back(p);
            faces_[f].alive = false;
            faces_[f].outside = kNone;
        }
        cone_.clear();
        for (const RimEdge& e : rim_) {
            const std::uint32_t f = addFace(e.from, e.to, point);
            faces_[f].across[0] = e.behind;
            Face& behind = faces_[e.behind];
            for (std::size_t i = 0; i < 3; ++i)
                if (behind.corners[i] == e.to && behind.corners[(i + 1) % 3] == e.from) behind.across[i] = f;
            faceFrom_[e.from] = f;
            cone_.push_back(f);
        }
        for (std::size_t k = 0; k < rim_.size(); ++k) {
            const std::uint32_t following = faceFrom_[rim_[k].to];
            faces_[cone_[k]].across[1] = following;
            faces_[following].across[2] = cone_[k];
        }
        for (const std::uint32_t p : orphans_) assign(p, cone_);
        for (const std::uint32_t f : cone_)
            if (faces_[f].outside != kNone) pending_.push_back(f);
        // Only now may their places be taken: `seen_` was still being read, and pending ones check `alive`.
        free_.insert(free_.end(), seen_.begin(), seen_.end());
    }

    struct RimEdge {
        std::uint32_t from, to;
        std::uint32_t behind;  ///< the face that stays
    };

    std::span<const Vec3d> points_;
    double extent_ = 0;
    std::vector<Face> faces_;
    std::vector<std::uint32_t> free_, pending_;
    std::vector<std::uint32_t> next_;      ///< per point: the next in its face's list
    std::vector<std::uint32_t> faceFrom_;  ///< per rim point: the new face whose rim edge starts there
    std::vector<std::uint32_t> seen_, cone_, orphans_;
    std::vector<RimEdge> rim_;
    std::uint32_t round_ = 0;
};

}  // namespace

HullSurface quickHull(std::span<const Vec3d> points, std::array<std::uint32_t, 4> start) {
    return Builder(points).run(start);
}

}  // namespace tessera
