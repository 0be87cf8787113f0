#include "server/sim/display/ContactDisplayMarks.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "common/cores/Interest.h"
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
// Of distances, in such sizes: at most this thick, and less where the two are so near that it would hide the gap.
constexpr double kEndRadius = 0.012, kLineRadius = 0.004, kThinnest = 0.25;
/// Of the distance.
constexpr double kEndOfDistance = 0.12, kLineOfDistance = 0.03;
/// Of the line's radius: how far a tick stands out, how thick it is.
constexpr double kLargeTick = 2.6, kSmallTick = 1.6, kTickThickness = 0.5;
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
        if (!visible_) return {};
        bool wantsContacts = false, wantsDistances = false;
        for (const InterestShow& asked : asked_) (ofDistances(asked.interest) ? wantsDistances : wantsContacts) = true;
        // Lists are made when they are looked at.
        if (wantsContacts) addContacts();
        if (wantsDistances) addDistances();
        return std::move(marks_);
    }

private:
    using Face = std::pair<ObjectId, std::uint32_t>;

    void addContacts() {
        std::array<std::vector<const Contact*>, 2> shown;  // points, normals
        std::map<Face, const Contact*> faces;
        for (const Contact& contact : step_.contacts) {
            const std::int64_t show = showOf(contact.interest);
            if (show & InterestWords::kShowPoints) shown[0].push_back(&contact);
            if (show & InterestWords::kShowNormals) shown[1].push_back(&contact);
            if (show & InterestWords::kShowFaces) {
                faces.try_emplace({contact.objectA, contact.faceA}, &contact);
                faces.try_emplace({contact.objectB, contact.faceB}, &contact);
            }
        }
        for (const MarkKind kind : {MarkKind::kPoint, MarkKind::kNormal})
            addSome(kind, shown[static_cast<std::size_t>(kind)],
                    [&](const Contact* contact) { return markOf(*contact, kind); });
        const std::vector<std::pair<Face, const Contact*>> listed(faces.begin(), faces.end());
        addSome(MarkKind::kFace, listed, [&](const std::pair<Face, const Contact*>& face) {
            return markOfFace(face.first, sizeOf(*face.second));
        });
    }

    void addDistances() {
        std::vector<std::pair<const PairDistance*, bool>> ends;  // and whether it is B's
        std::vector<const PairDistance*> lines;
        std::map<Face, const PairDistance*> faces;
        for (const PairDistance& pair : step_.distances) {
            const std::int64_t show = showOf(pair.interest);
            if (!show || pair.phase == Phase::kEnded || !pair.pointA.allFinite() || !pair.pointB.allFinite()) continue;
            if (show & InterestWords::kShowPoints) {
                ends.emplace_back(&pair, false);
                if (pair.distance > 0) ends.emplace_back(&pair, true);
            }
            if (show & InterestWords::kShowNormals && pair.distance > 0) lines.push_back(&pair);
            if (show & InterestWords::kShowFaces) {
                faces.try_emplace({pair.nodeA, pair.faceA}, &pair);
                faces.try_emplace({pair.nodeB, pair.faceB}, &pair);
            }
        }
        addSome(MarkKind::kPoint, ends, [&](const std::pair<const PairDistance*, bool>& end) -> std::optional<Mark> {
            const double radius = thickness(*end.first, kEndRadius, kEndOfDistance);
            if (radius == 0) return {};
            return Mark{.translation = root_T_world_ * (end.second ? end.first->pointB : end.first->pointA),
                        .scale = Vec3d::Constant(radius)};
        });
        addSome(MarkKind::kLine, lines, [&](const PairDistance* pair) {
            return markOfLine(root_T_world_ * pair->pointA, root_T_world_ * pair->pointB,
                              thickness(*pair, kLineRadius, kLineOfDistance));
        });
        if (lines.size() <= kMostRulers)
            for (const PairDistance* pair : lines) addTicks(*pair, thickness(*pair, kLineRadius, kLineOfDistance));
        const std::vector<std::pair<Face, const PairDistance*>> listed(faces.begin(), faces.end());
        addSome(MarkKind::kFace, listed, [&](const std::pair<Face, const PairDistance*>& face) {
            const double size = sizeOf(face.second->objectA, face.second->objectB);
            return size == 0 ? std::nullopt : markOfFace(face.first, size);
        });
    }

    /// 0 where there is nothing to measure.
    [[nodiscard]] double thickness(const PairDistance& pair, double most, double ofDistance) {
        const double size = sizeOf(pair.objectA, pair.objectB);
        const double length = (root_T_world_.linear() * (pair.pointB - pair.pointA)).norm();
        return std::clamp(ofDistance * length, kThinnest * most * size, most * size);
    }

    /// Marks of as many of them as still may be drawn, evenly taken.
    template <typename Entry, typename MarkOf>
    void addSome(MarkKind kind, const std::vector<Entry>& wanted, MarkOf&& markOf) {
        const auto index = static_cast<std::size_t>(kind);
        const std::size_t drawn = std::min(wanted.size(), kMaxMarks[index] - marks_.of[index].size());
        marks_.leftOut[index] += wanted.size() - drawn;
        for (std::size_t i = 0; i < drawn; ++i)
            if (const std::optional<Mark> mark = markOf(wanted[evenly(i, drawn, wanted.size())]))
                marks_.of[index].push_back(*mark);
    }

    [[nodiscard]] static std::optional<Mark> markOfLine(const Vec3d& from, const Vec3d& to, double radius) {
        const Vec3d along = to - from;
        const double length = along.norm();
        if (!(length > 0 && radius > 0) || !std::isfinite(length)) return {};
        return Mark{.translation = from, .rotation = turnTo(along / length), .scale = Vec3d(radius, radius, length)};
    }

    void addTicks(const PairDistance& pair, double radius) {
        const Vec3d from = root_T_world_ * pair.pointA, along = root_T_world_ * pair.pointB - from;
        const double distance = (pair.pointB - pair.pointA).norm();
        const RulerTicks ticks = ticksOf(distance);
        const double tenth = 0.1 * ticks.step / distance;  // of the way
        const Vec3d half = std::min(0.1 * tenth, 0.5 * kTickThickness * radius / along.norm()) * along;
        for (int i = 1; i <= ticks.large + ticks.small; ++i) {
            const bool large = i <= ticks.large;
            const Vec3d middle = from + (large ? 10 * i : 9 * ticks.large + i) * tenth * along;
            if (const std::optional<Mark> mark =
                    markOfLine(middle - half, middle + half, (large ? kLargeTick : kSmallTick) * radius))
                marks_.of[static_cast<std::size_t>(MarkKind::kTick)].push_back(*mark);
        }
    }

    [[nodiscard]] bool ofDistances(ObjectId id) const {
        const Interest* interest = scene_.get<Interest>(id);
        return interest && interest->mode == InterestWords::kDistance;
    }

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

    /// Of marks between two objects; 0 where there is nothing to measure.
    [[nodiscard]] double sizeOf(ObjectId objectA, ObjectId objectB) {
        double least = 0, most = 0;
        for (const ObjectId object : {objectA, objectB}) {
            if (!scene_.get<Node>(object)) continue;
            const double own = sizeOf(object);
            if (!std::isfinite(own) || own <= 0) continue;
            least = least == 0 ? own : std::min(least, own);
            most = std::max(most, own);
        }
        return std::min(most, kMostOfSmaller * least);
    }

    [[nodiscard]] double sizeOf(const Contact& contact) {
        const Interest* interest = scene_.get<Interest>(contact.interest);
        const ObjectId object = interest ? interest->object : ObjectId();
        return sizeOf(objectOf(contact.interest, contact.objectA, object),
                      objectOf(contact.interest, contact.objectB, ObjectId()));
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

    [[nodiscard]] std::optional<Mark> markOfFace(const Face& named, double size) {
        const auto& [nodeId, face] = named;
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
        return markOfTriangle(corners[0], corners[1], corners[2], kLift * size);
    }

    const Aspect& scene_;
    const StepResult& step_;
    std::span<const InterestShow> asked_;
    ObjectId display_;
    Marks marks_;
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

RulerTicks ticksOf(double length) {
    // Beyond these the scene has no numbers for what would be drawn.
    if (!(length > 1e-30 && length < 1e30)) return {};
    const double rounded = length * (1 + 1e-9);  // 0.3 is three tenths, 1 is ten, whichever way it was rounded
    RulerTicks ticks{.step = 1};
    while (ticks.step > rounded) ticks.step /= 10;
    while (10 * ticks.step <= rounded) ticks.step *= 10;
    const int tenths = std::clamp(static_cast<int>(10 * rounded / ticks.step), 10, 99);
    ticks.large = tenths / 10;
    ticks.small = tenths % 10;
    return ticks;
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
