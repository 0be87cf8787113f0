#include "server/collision/rigid_bodies/FaceContacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "server/collision/mesh/TriangleContact.h"

namespace tessera::rigid {

namespace {

constexpr std::array<std::uint32_t, 3> kOutline{0, 1, 2};
constexpr std::uint32_t kNoFace = ~std::uint32_t{0};
/// Faces that turn by less (sine) at their common edge go on smoothly.
constexpr double kSmooth = 0.05;
/// By how much (cosine) a direction may leave the arc between two faces' normals.
constexpr double kArcSlack = 0.01;

/// The neighbour across an edge, seen from a triangle.
struct Across {
    bool open = true;  ///< there is none
    double bend = 0;   ///< sine: above 0 it rises on the side of the winding's normal, below 0 it falls
    Vec3d normal = Vec3d::Zero();
    Vec3d onEdge = Vec3d::Zero();
};

class FaceContact {
public:
    FaceContact(const PlacedSolid& solid, const PlacedSurface& surface, const FaceQuery& query, ClipScratch& scratch,
                std::vector<NearFace>& within, std::vector<ContactPoint>& out)
        : solid_(solid), surface_(surface), query_(query), scratch_(scratch), within_(within), out_(out) {
        scratch.heights.resize(solid.corners.size());
        // Of a flat one the directions outwards come after the two sides.
        const std::size_t normals = solid.sides.size() + (solid.shape->flat ? solid.shape->edges.size() : 0);
        scratch.across.resize(normals);
        scratch.acrossOf.assign(normals, kNoFace);
    }

    void find(std::uint32_t face) {
        face_ = face;
        for (unsigned i = 0; i < 3; ++i) t_[i] = surface_.world * surface_.mesh->corner(face_, i);
        const Vec3d area = (t_[1] - t_[0]).cross(t_[2] - t_[0]);
        const double square = area.squaredNorm();
        const double longest =
            std::max({(t_[1] - t_[0]).squaredNorm(), (t_[2] - t_[1]).squaredNorm(), (t_[0] - t_[2]).squaredNorm()});
        if (!(square > 1e-20 * longest * longest)) return;
        nearest_ = nearestOnTriangle({t_[0], t_[1], t_[2]}, solid_.centre);
        // Most faces near a fast body are not in its way: a ball around it tells.
        if (besideReach()) return;
        winding_ = area / std::sqrt(square);
        const double height = winding_.dot(solid_.centre - t_[0]);
        front_ = height >= 0;
        normal_ = front_ ? winding_ : Vec3d(-winding_);
        if (outOfReach(std::abs(height) - solid_.radius, normal_)) return;
        offset_ = normal_.dot(t_[0]);
        if (!findAxis()) return;
        within_.push_back({face_, kind_ == Kind::kFace ? faceGap_ : gap_});
        if (kind_ == Kind::kFace)
            touchFace(faceGap_);
        else
            touchRim();
    }

private:
    enum class Kind : std::uint8_t { kFace, kSide, kEdges };

    /// Parted by so much along an axis (from the surface to the solid) that this frame's motion does not close it.
    [[nodiscard]] bool outOfReach(double gap, const Vec3d& axis) const {
        return gap > std::min(query_.margin, query_.slack + std::max(0.0, -axis.dot(query_.approach)));
    }

    [[nodiscard]] bool besideReach() const {
        const Vec3d away = solid_.centre - nearest_;
        const double distance = away.norm();
        if (distance > solid_.radius && besideWay(away)) return true;
        return distance > solid_.radius && outOfReach(distance - solid_.radius, away / distance);
    }

    /// On its straight way the ball goes past it. `away`: from the nearest point to the ball's centre.
    [[nodiscard]] bool besideWay(const Vec3d& away) const {
        const double square = query_.approach.squaredNorm();
        if (!(square > 0)) return false;
        const Vec3d aside = away - query_.approach * (query_.approach.dot(away) / square);
        const double length = aside.norm();
        if (!(length > 0.1 * away.norm())) return false;
        const double most = std::max({aside.dot(t_[0]), aside.dot(t_[1]), aside.dot(t_[2])});
        const double gap = (aside.dot(solid_.centre) - most) / length - solid_.radius;
        return gap > std::min(query_.margin, query_.slack);
    }

    /// False: out of reach.
    bool findAxis() {
        faceGap_ = std::numeric_limits<double>::infinity();
        std::size_t lowest = 0;
        for (std::size_t i = 0; i < solid_.corners.size(); ++i) {
            scratch_.heights[i] = normal_.dot(solid_.corners[i]) - offset_;
            if (!(scratch_.heights[i] < faceGap_)) continue;
            faceGap_ = scratch_.heights[i];
            lowest = i;
        }
        if (outOfReach(faceGap_, normal_)) return false;
        // The side that kept the face before away mostly does so again: they are neighbours.
        if (lastSide_ < solid_.sides.size() && parts(solid_.sides[lastSide_])) return false;
        kind_ = Kind::kFace;
        gap_ = faceGap_ + query_.fine;
        const double reach = std::min(query_.margin, query_.slack);
        for (std::uint32_t s = 0; s < solid_.sides.size(); ++s) {
            const PlacedSide& side = solid_.sides[s];
            // No triangle is farther beyond a side than one of its points.
            if (side.normal.dot(nearest_) - side.offset <= std::min(gap_, reach)) continue;
            const double gap = gapBeyond(side);
            if (outOfReach(gap, -side.normal)) {
                lastSide_ = s;
                return false;
            }
            if (!(gap > gap_) || side.normal.dot(normal_) > kArcSlack) continue;
            kind_ = Kind::kSide;
            gap_ = gap;
            side_ = s;
            axis_ = -side.normal;
        }
        double least = gap_ + (kind_ == Kind::kSide ? query_.fine : 0);
        const double low = std::max(query_.margin, 0.0);
        std::array<Vec3d, 3> along, outwards, crossed;
        std::array<bool, 3> may;
        for (unsigned i = 0; i < 3; ++i) {
            along[i] = t_[(i + 1) % 3] - t_[i];
            outwards[i] = along[i].cross(winding_).normalized();
            crossed[i] = normal_.cross(outwards[i]);
            may[i] = mostOverRim(faceGap_, outwards[i].dot(solid_.corners[lowest] - t_[i])) > least;
        }
        if (!may[0] && !may[1] && !may[2]) return true;
        // Edges share their sides.
        const auto acrossRims = [&](std::uint32_t k, const Vec3d& n) -> const std::array<double, 3>& {
            std::array<double, 3>& out = scratch_.across[k];
            if (scratch_.acrossOf[k] != face_) {
                scratch_.acrossOf[k] = face_;
                out = {n.dot(crossed[0]), n.dot(crossed[1]), n.dot(crossed[2])};
            }
            return out;
        };
        const SolidShape& shape = *solid_.shape;
        const auto sides = static_cast<std::uint32_t>(solid_.sides.size());
        listEdgesDownTo(low);
        for (const std::uint32_t e : scratch_.edgesA) {
            const std::uint32_t of = shape.flat ? e / 2 : e;
            const SolidShape::Edge& ends = shape.edges[of];
            const PlacedEdge& edge = solid_.edges[e];
            const std::array<double, 3>&first =
                                         acrossRims(shape.flat && e % 2 == 1 ? sides + of : ends.left, edge.first),
                                     &second =
                                         acrossRims(shape.flat && e % 2 == 0 ? sides + of : ends.right, edge.second);
            for (unsigned i = 0; i < 3; ++i) {
                if (!may[i]) continue;
                const double b1 = first[i], b2 = second[i];
                if (!(b1 * b2 < 0)) continue;
                const double a1 = normal_.dot(edge.crossed), a2 = outwards[i].dot(edge.crossed);
                if (!(a1 * a2 < 0 && b1 * a2 < 0)) continue;
                Vec3d n = along[i].cross(edge.along);
                const double square = n.squaredNorm();
                if (!(square > 1e-8 * along[i].squaredNorm() * edge.along.squaredNorm())) continue;
                n /= std::sqrt(square);
                if (n.dot(normal_ + outwards[i]) < 0) n = -n;
                const double gap = n.dot(edge.from - t_[i]);
                if (outOfReach(gap, n)) return false;
                if (!(gap > least)) continue;
                kind_ = Kind::kEdges;
                gap_ = least = gap;
                axis_ = n;
                rim_ = i;
                edge_ = e;
            }
        }
        return true;
    }

    /// Only edges that come down to the face's plane, or as near as it matters, can meet its rim.
    void listEdgesDownTo(double low) {
        const SolidShape& shape = *solid_.shape;
        const std::vector<double>& heights = scratch_.heights;
        scratch_.edgesA.clear();
        for (std::uint32_t c = 0; c < heights.size(); ++c) {
            if (heights[c] > low) continue;
            for (const std::uint32_t e : shape.edgesOf(c)) {
                const std::uint32_t other = shape.edges[e].from == c ? shape.edges[e].to : shape.edges[e].from;
                // It was that one's already.
                if (other < c && heights[other] <= low) continue;
                if (shape.flat) scratch_.edgesA.push_back(2 * e);
                scratch_.edgesA.push_back(shape.flat ? 2 * e + 1 : e);
            }
        }
    }

    /// Along directions between the face's normal and the one outwards over a rim a corner so high above the face's
    /// plane and so far outside the rim is no farther from the rim than this: nor is the solid.
    static double mostOverRim(double height, double outside) {
        if (height > 0 && outside > 0) return std::sqrt(height * height + outside * outside);
        return std::max(height, outside);
    }
    [[nodiscard]] double gapBeyond(const PlacedSide& side) const {
        return std::min({side.normal.dot(t_[0]), side.normal.dot(t_[1]), side.normal.dot(t_[2])}) - side.offset;
    }
    [[nodiscard]] bool parts(const PlacedSide& side) const { return outOfReach(gapBeyond(side), -side.normal); }

    void put(const Vec3d& position, const Vec3d& fromSurface, double gap) {
        if (outOfReach(gap, fromSurface)) return;
        out_.push_back({position, query_.solidIsA ? Vec3d(-fromSurface) : fromSurface, gap});
    }

    /// The solid's lower side over the triangle.
    void touchFace(double gap) {
        const std::uint32_t side = sideAlong(solid_, -normal_);
        const std::size_t first = out_.size();
        clipOverFace(side, Vec3d::Zero());
        const double closing = -normal_.dot(query_.approach);
        // It is beside the triangle, and may be above it when it has come down to its plane.
        if (scratch_.polygon.empty() && gap > 0 && closing > gap) clipOverFace(side, query_.approach * (gap / closing));
        if (out_.size() > first) dropBehindRidges(first);
    }

    void clipOverFace(std::uint32_t side, const Vec3d& shift) {
        scratch_.polygon.clear();
        for (const std::uint32_t c : solid_.shape->outline(side)) scratch_.polygon.push_back(solid_.corners[c] + shift);
        clipToOutline(t_, kOutline, winding_, 1, scratch_);
        for (const Vec3d& shifted : scratch_.polygon) {
            const Vec3d p = shifted - shift;
            const double gap = normal_.dot(p) - offset_;
            put(p - 0.5 * gap * normal_, normal_, gap);
        }
    }

    /// What rests on a body sinks into it a little. Seen from there the next face down the ridge is an inner wall; it
    /// must not stop what slides over the ridge. So near an edge that bends away from the solid's side, the back of a
    /// face does not count for a solid that is in front of the face beyond the edge.
    void dropBehindRidges(std::size_t first) {
        for (unsigned i = 0; i < 3; ++i) {
            const Across other = across(i);
            if (other.open || std::abs(other.bend) < kSmooth || (other.bend > 0) != front_) continue;
            const bool beyond = other.normal.dot(solid_.centre - other.onEdge) >= 0;
            if (beyond == front_) continue;
            Vec3d outwards = (t_[(i + 1) % 3] - t_[i]).cross(winding_);
            outwards.normalize();
            const double limit = outwards.dot(t_[i]) - 24 * query_.fine;
            std::erase_if(out_, [&, index = std::size_t{0}](const ContactPoint& p) mutable {
                return index++ >= first && outwards.dot(p.position) > limit;
            });
        }
    }

    /// An edge or a corner of the triangle is nearest.
    void touchRim() {
        if (!holds()) {
            // Not a direction in which this edge can push: the face does, unless only its neighbours can be meant.
            if (faceGap_ > gap_ - 32 * query_.near) touchFace(faceGap_);
            return;
        }
        if (kind_ == Kind::kEdges) {
            const PlacedEdge& edge = solid_.edges[edge_];
            Vec3d onFace, onSolid;
            nearestOfSegments(t_[rim_], t_[(rim_ + 1) % 3] - t_[rim_], edge.from, edge.along, onFace, onSolid);
            put(0.5 * (onFace + onSolid), axis_, gap_);
            return;
        }
        clipUnderSide(Vec3d::Zero());
        const double closing = -axis_.dot(query_.approach);
        if (scratch_.polygon.empty() && gap_ > 0 && closing > gap_) clipUnderSide(-query_.approach * (gap_ / closing));
    }

    void clipUnderSide(const Vec3d& shift) {
        const PlacedSide& side = solid_.sides[side_];
        scratch_.polygon.clear();
        for (const Vec3d& c : t_) scratch_.polygon.push_back(c + shift);
        clipToOutline(solid_.corners, solid_.shape->outline(side_), side.normal, solid_.turn, scratch_);
        for (const Vec3d& shifted : scratch_.polygon) {
            const Vec3d p = shifted - shift;
            const double gap = side.normal.dot(p) - side.offset;
            put(p - 0.5 * gap * side.normal, axis_, gap);
        }
    }

    /// May the part of the rim that is farthest along the axis push in its direction?
    [[nodiscard]] bool holds() const {
        if (kind_ == Kind::kEdges) return edgeHolds(rim_);
        std::array<double, 3> along;
        for (unsigned i = 0; i < 3; ++i) along[i] = axis_.dot(t_[i]);
        const double most = std::max({along[0], along[1], along[2]});
        unsigned tops = 0, last = 0;
        for (unsigned i = 0; i < 3; ++i)
            if (most - along[i] <= 4 * query_.fine) {
                ++tops;
                last = i;
            }
        if (tops == 3) return false;
        if (tops == 2) {
            const unsigned low = most - along[0] > 4 * query_.fine ? 0 : most - along[1] > 4 * query_.fine ? 1 : 2;
            return edgeHolds((low + 1) % 3);
        }
        return cornerHolds(last) || cornerHolds((last + 2) % 3);
    }

    [[nodiscard]] bool cornerHolds(unsigned edge) const {
        const Across other = across(edge);
        return other.open || std::abs(other.bend) >= kSmooth;
    }

    [[nodiscard]] bool edgeHolds(unsigned edge) const {
        const Across other = across(edge);
        if (other.open) return true;
        if (std::abs(other.bend) < kSmooth) return false;
        const double sign = other.bend < 0 ? 1 : -1;
        const Vec3d u = (t_[(edge + 1) % 3] - t_[edge]).normalized();
        Vec3d n = axis_ - u.dot(axis_) * u;
        Vec3d middle = sign * (winding_ + other.normal);
        const double nn = n.norm(), mm = middle.norm();
        if (!(nn > 0) || !(mm > 0)) return true;
        // The middle is as far from both normals: half its length is the cosine.
        return n.dot(middle) >= (0.5 * mm - kArcSlack) * nn * mm;
    }

    [[nodiscard]] Across across(unsigned edge) const {
        Across out;
        const std::uint32_t other = surface_.topology->across(face_, edge);
        if (other == SurfaceTopology::kNone) return out;
        std::array<Vec3d, 3> g;
        for (unsigned i = 0; i < 3; ++i) g[i] = surface_.world * surface_.mesh->corner(other, i);
        const Vec3d area = (g[1] - g[0]).cross(g[2] - g[0]);
        const double length = area.norm();
        if (!(length > 0)) return out;
        out.open = false;
        out.normal = area / length;
        out.onEdge = t_[edge];
        // The corner that is off the edge, by how it rises over this triangle's plane.
        Vec3d outwards = (t_[(edge + 1) % 3] - t_[edge]).cross(winding_);
        outwards.normalize();
        out.bend = -out.normal.dot(outwards);
        if (out.normal.dot(winding_) < 0)
            out.bend = out.bend < 0 ? std::min(out.bend, -kSmooth) : std::max(out.bend, kSmooth);
        return out;
    }

    const PlacedSolid& solid_;
    const PlacedSurface& surface_;
    const FaceQuery& query_;
    ClipScratch& scratch_;
    std::vector<NearFace>& within_;
    std::vector<ContactPoint>& out_;

    std::uint32_t face_ = 0;
    std::array<Vec3d, 3> t_;
    Vec3d winding_ = Vec3d::Zero(), normal_ = Vec3d::Zero(), axis_ = Vec3d::Zero();
    bool front_ = true;
    Vec3d nearest_ = Vec3d::Zero();  ///< of the triangle's points, to the solid's centre
    double offset_ = 0, faceGap_ = 0, gap_ = 0;
    Kind kind_ = Kind::kFace;
    std::uint32_t side_ = 0, edge_ = 0;
    std::uint32_t lastSide_ = 0;  ///< that parted a face from the solid
    unsigned rim_ = 0;
};

}  // namespace

void contactsWithFaces(const PlacedSolid& solid, const PlacedSurface& surface, std::span<const std::uint32_t> faces,
                       const FaceQuery& query, ClipScratch& scratch, std::vector<NearFace>& within,
                       std::vector<ContactPoint>& out) {
    if (solid.sides.empty()) return;
    const std::size_t first = out.size();
    FaceContact contact(solid, surface, query, scratch, within, out);
    for (const std::uint32_t face : faces) contact.find(face);
    reduceContacts(out, first, query.near);
}

}  // namespace tessera::rigid
