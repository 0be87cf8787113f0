#include "server/sim/display/ContactDisplayMarks.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "common/geometry/Points.h"
#include "common/scene/Action.h"

namespace tessera {
namespace {

/// The size that marks follow is that of the larger of the two objects, but at most so many times the smaller one's: an
/// engine may meet a batten of a crate, a ball the floor of a hall.
constexpr double kMostOfSmaller = 4;
// In such sizes.
constexpr double kBallRadius = 0.016;
constexpr double kArrowLength = 0.3;
/// Of its length, before the point: what lies wholly within B would not be seen.
constexpr double kArrowTail = 0.5;
/// Enough for a depth buffer of a whole hall to tell them from the faces that they lie on.
constexpr double kLift = 0.002;
constexpr std::size_t kMostExtents = 4096;

/// A rotation that leads +Z to `z`, a unit vector.
Quatd turnTo(const Vec3d& z) {
    const Vec3d other = std::abs(z.x()) < 0.6 ? Vec3d::UnitX() : Vec3d::UnitY();
    Mat3d axes;
    axes.col(0) = other.cross(z).normalized();
    axes.col(1) = z.cross(axes.col(0));
    axes.col(2) = z;
    return Quatd(axes).normalized();
}

/// Entry i of `wanted` evenly taken ones.
std::size_t evenly(std::size_t i, std::size_t wanted, std::size_t all) {
    return wanted == all ? i : i * all / wanted;
}

/// One call of MarkMaker::make: what is looked up once per frame.
class MarkRun {
public:
    MarkRun(const Aspect& scene, const StepResult& step, std::span<const InterestShow> asked, ObjectId display,
            std::unordered_map<MeshKey, DrawableExtent, MeshKeyHash>& extents)
        : scene_(scene), step_(step), asked_(asked), display_(display), extents_(extents) {
        const Affine3d world_T_root = worldTransform(scene, kRootNode);
        visible_ = std::abs(world_T_root.linear().determinant()) > 0;
        if (visible_) root_T_world_ = world_T_root.inverse();
        for (const PairEvent& event : step.events) {
            if (!showOf(event.interest)) continue;
            objects_.insert({event.interest, event.objectA});
            objects_.insert({event.interest, event.objectB});
        }
    }

    [[nodiscard]] Marks make() {
        Marks marks;
        if (!visible_) return marks;
        std::array<std::vector<const Contact*>, 2> shown;  // points, normals
        std::map<std::pair<ObjectId, std::uint32_t>, const Contact*> faces;
        for (const Contact& contact : step_.contacts) {
            const std::int64_t show = showOf(contact.interest);
            if (show & Interest::kShowPoints) shown[0].push_back(&contact);
            if (show & Interest::kShowNormals) shown[1].push_back(&contact);
            if (show & Interest::kShowFaces) {
                faces.try_emplace({contact.objectA, contact.faceA}, &contact);
                faces.try_emplace({contact.objectB, contact.faceB}, &contact);
            }
        }
        for (const MarkKind kind : {MarkKind::kPoint, MarkKind::kNormal}) {
            const auto index = static_cast<std::size_t>(kind);
            const std::size_t drawn = std::min(shown[index].size(), kMaxMarks[index]);
            marks.leftOut[index] = shown[index].size() - drawn;
            for (std::size_t i = 0; i < drawn; ++i)
                if (const std::optional<Mark> mark = markOf(*shown[index][evenly(i, drawn, shown[index].size())], kind))
                    marks.of[index].push_back(*mark);
        }
        constexpr auto kFaces = static_cast<std::size_t>(MarkKind::kFace);
        std::vector<std::tuple<ObjectId, std::uint32_t, const Contact*>> listed;
        for (const auto& [face, contact] : faces) listed.emplace_back(face.first, face.second, contact);
        const std::size_t drawn = std::min(listed.size(), kMaxMarks[kFaces]);
        marks.leftOut[kFaces] = listed.size() - drawn;
        for (std::size_t i = 0; i < drawn; ++i) {
            const auto& [node, face, contact] = listed[evenly(i, drawn, listed.size())];
            if (const std::optional<Mark> mark = markOfFace(node, face, *contact)) marks.of[kFaces].push_back(*mark);
        }
        return marks;
    }

private:
    [[nodiscard]] std::int64_t showOf(ObjectId interest) const {
        const auto it = std::ranges::lower_bound(asked_, interest, {}, &InterestShow::interest);
        return it != asked_.end() && it->interest == interest ? it->show : 0;
    }

    [[nodiscard]] const Affine3d& placeOf(ObjectId node) {
        const auto [it, isNew] = places_.try_emplace(node);
        if (isNew) it->second = root_T_world_ * worldTransform(scene_, node);
        return it->second;
    }

    [[nodiscard]] const DrawableExtent& extentOf(const Drawable& drawable) {
        if (extents_.size() > kMostExtents) extents_.clear();
        const auto [it, isNew] = extents_.try_emplace(drawable.key());
        if (isNew) it->second = {drawable.bounds(), shownRadius(drawable.arrays())};
        return it->second;
    }

    /// The box diagonal of all that a node shows, in the root's coordinates.
    [[nodiscard]] double sizeOf(ObjectId node) {
        const auto [it, isNew] = sizes_.try_emplace(node, 0.0);
        if (!isNew) return it->second;
        Box bounds;
        Action action;
        action.onNode([&](const Visit& visit) {
            if (visit.nodeId == display_) return Descend::kPast;
            if (const Drawable drawable = drawableOf(scene_, visit.node))
                bounds.extend(extentOf(drawable).bounds.transformed(root_T_world_ * visit.world_T_node));
            return Descend::kInto;
        });
        action.run(scene_, node);
        return it->second = bounds.empty() ? 0.0 : bounds.size().norm();
    }

    /// The object of the contact's interest that a geometry-bearing node is part of: one of its events, else
    /// `otherwise`, where the node is below that, else the node itself.
    [[nodiscard]] ObjectId objectOf(ObjectId interest, ObjectId node, ObjectId otherwise) const {
        for (ObjectId above = node; above;) {
            if (above == otherwise || objects_.contains({interest, above})) return above;
            const Node* there = scene_.get<Node>(above);
            if (!there) break;
            above = there->parent;
        }
        return node;
    }

    /// 0 where there is nothing to measure.
    [[nodiscard]] double sizeOf(const Contact& contact) {
        double least = 0, most = 0;
        const Interest* interest = scene_.get<Interest>(contact.interest);
        const ObjectId object = interest ? interest->object : ObjectId();
        for (const auto& [node, otherwise] :
             {std::pair(contact.objectA, object), std::pair(contact.objectB, ObjectId())}) {
            if (!scene_.get<Node>(node)) continue;
            const double own = sizeOf(objectOf(contact.interest, node, otherwise));
            if (!std::isfinite(own) || own <= 0) continue;
            least = least == 0 ? own : std::min(least, own);
            most = std::max(most, own);
        }
        return std::min(most, kMostOfSmaller * least);
    }

    [[nodiscard]] std::optional<Mark> markOf(const Contact& contact, MarkKind kind) {
        const double size = sizeOf(contact);
        const Vec3d point = root_T_world_ * contact.point;
        if (size == 0 || !point.allFinite()) return {};
        if (kind == MarkKind::kPoint) return Mark{.translation = point, .scale = Vec3d::Constant(kBallRadius * size)};
        const Vec3d along = root_T_world_.linear() * contact.normal;
        if (!along.allFinite() || along.squaredNorm() < 1e-12) return {};
        const double length = kArrowLength * size;
        return Mark{.translation = point - kArrowTail * length * along.normalized(),
                    .rotation = turnTo(along.normalized()),
                    .scale = Vec3d::Constant(length)};
    }

    [[nodiscard]] std::optional<Mark> markOfFace(ObjectId nodeId, std::uint32_t face, const Contact& contact) {
        const Node* node = scene_.get<Node>(nodeId);
        const Drawable drawable = node ? drawableOf(scene_, *node) : Drawable();
        if (!drawable || face == Contact::kNoFace) return {};
        const std::optional<std::array<Vec3f, 3>> local =
            cornersOf(drawable.arrays(), face, extentOf(drawable).pointRadius);
        if (!local) return {};
        const Affine3d& place = placeOf(nodeId);
        std::array<Vec3d, 3> corners;
        for (std::size_t i = 0; i < 3; ++i) {
            corners[i] = place * (*local)[i].cast<double>();
            if (!corners[i].allFinite()) return {};
        }
        // In a mirrored place counter-clockwise is seen from inside.
        if (place.linear().determinant() < 0) std::swap(corners[1], corners[2]);
        return markOfTriangle(corners[0], corners[1], corners[2], kLift * sizeOf(contact));
    }

    const Aspect& scene_;
    const StepResult& step_;
    std::span<const InterestShow> asked_;
    ObjectId display_;
    std::unordered_map<MeshKey, DrawableExtent, MeshKeyHash>& extents_;
    bool visible_ = false;
    Affine3d root_T_world_ = Affine3d::Identity();
    std::set<std::pair<ObjectId, ObjectId>> objects_;  ///< of interests that are drawn: interest, topmost node
    std::map<ObjectId, Affine3d> places_;              ///< root_T_node
    std::map<ObjectId, double> sizes_;
};

}  // namespace

Marks MarkMaker::make(const Aspect& scene, const StepResult& step, std::span<const InterestShow> asked,
                      ObjectId display) {
    return MarkRun(scene, step, asked, display, extents_).make();
}

/// The edges of the triangle are the columns of a 3 × 2 matrix, the images of X and Y. Its singular value decomposition
/// is what two transforms can say: rotation · scale · turn. The turn comes from one Jacobi rotation of the 2 × 2 Gram
/// matrix (Golub and Van Loan, Matrix Computations, 8.5), with square roots alone, so that every machine finds the same
/// bits.
std::optional<Mark> markOfTriangle(const Vec3d& a, const Vec3d& b, const Vec3d& c, double lift) {
    const Vec3d u = b - a, v = c - a;
    const Vec3d across = u.cross(v);
    const double uu = u.squaredNorm(), uv = u.dot(v), vv = v.squaredNorm();
    const double area = across.norm();
    // Also what is so thin that its normal is noise.
    if (!(area > 1e-12 * std::max(uu, vv))) return {};
    const Vec3d normal = across / area;

    double cosine = 1, sine = 0;
    if (uv != 0) {
        const double tau = (vv - uu) / (2 * uv);
        const double tangent = (tau < 0 ? -1.0 : 1.0) / (std::abs(tau) + std::sqrt(1 + tau * tau));
        cosine = 1 / std::sqrt(1 + tangent * tangent);
        sine = tangent * cosine;
    }
    const Vec3d first = cosine * u - sine * v, second = sine * u + cosine * v;
    Mat3d axes;
    axes.col(0) = first.normalized();
    axes.col(1) = normal.cross(axes.col(0));
    axes.col(2) = normal;
    const double halfCosine = std::sqrt((1 + cosine) / 2);
    return Mark{.translation = a + lift * normal,
                .rotation = Quatd(axes).normalized(),
                .scale = Vec3d(first.norm(), second.dot(axes.col(1)), 1),
                .turn = Quatd(halfCosine, 0, 0, sine / (2 * halfCosine))};
}

}  // namespace tessera
