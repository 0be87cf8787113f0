#include "server/manipulators/Drag.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/cores/SpotLight.h"
#include "common/math/Decompositions.h"

namespace tessera {
namespace {

/// A ray in the frame, its direction of length 1.
struct FrameRay {
    Vec3d origin, direction;
};

constexpr double kLeastSine = 0.02;  ///< between a ray and an axis or a plane: below, both say too little
constexpr double kEdgeOn = 0.1;      ///< of a ring or a plane, when it is grabbed
constexpr double kFarthest = 1e6;    ///< moves, in sizes of the handles and distances to the eye
constexpr double kLeastFactor = 1e-3, kMostFactor = 1e6;

std::optional<FrameRay> toFrame(const HandleFrame& frame, const Ray& ray) {
    const Affine3d frame_T_world = frame.world_T_frame.inverse();
    const Vec3d origin = frame_T_world * ray.origin;
    // First of length about 1: products of what is huge would be no numbers.
    const double size = ray.direction.cwiseAbs().maxCoeff();
    if (!(size > 0) || !std::isfinite(size)) return std::nullopt;
    const Vec3d direction = frame_T_world.linear() * (ray.direction / size);
    const double length = direction.stableNorm();
    if (!origin.allFinite() || !std::isfinite(length) || !(length > 0)) return std::nullopt;
    return FrameRay{origin, direction / length};
}

/// How far along a line through `at` it comes nearest to the ray.
std::optional<double> alongLine(const Vec3d& at, const Vec3d& axis, const FrameRay& ray) {
    const Vec3d away = ray.origin - at;
    const double cosine = axis.dot(ray.direction), sine2 = 1 - cosine * cosine;
    if (sine2 < kLeastSine * kLeastSine) return std::nullopt;
    const double ofAxis = axis.dot(away), ofRay = ray.direction.dot(away);
    if ((cosine * ofAxis - ofRay) / sine2 <= 0) return std::nullopt;  // behind the eye
    return (ofAxis - cosine * ofRay) / sine2;
}

std::optional<Vec3d> onPlane(const Vec3d& at, const Vec3d& normal, const FrameRay& ray) {
    const double cosine = normal.dot(ray.direction);
    if (std::abs(cosine) < kLeastSine) return std::nullopt;
    const double t = normal.dot(at - ray.origin) / cosine;
    if (!(t > 0)) return std::nullopt;
    return Vec3d(ray.origin + t * ray.direction);
}

/// On Bell's trackball around the frame's origin.
std::optional<Vec3d> onBall(double radius, bool farSide, const FrameRay& ray) {
    const double nearest = -ray.origin.dot(ray.direction);
    if (!(nearest > 0)) return std::nullopt;
    const Vec3d closest = ray.origin + nearest * ray.direction;
    const double away = closest.norm();
    const double height =
        away < radius / std::numbers::sqrt2 ? std::sqrt(radius * radius - away * away) : radius * radius / (2 * away);
    return Vec3d(closest + (farSide ? height : -height) * ray.direction);
}

double snapped(double value, double step) {
    return step > 0 ? std::round(value / step) * step : value;
}

/// In steps of the world's units, along each axis of the frame by itself.
Vec3d snappedMove(const Grab& grab, Vec3d move) {
    if (!(grab.snap > 0)) return move;
    for (int i = 0; i < 3; ++i) {
        const double step = grab.snap / grab.frame.world_T_frame.linear().col(i).norm();
        move[i] = snapped(move[i], step);
    }
    return move;
}

double radiusOf(const Grab& grab) {
    return std::max(grab.at.norm(), 0.25 * grab.frame.extent.maxCoeff());
}

Vec3d inParent(const Grab& grab, const Vec3d& ofFrame) {
    if (grab.frame.ofWorld) return grab.moved.world_T_parent.linear().inverse() * ofFrame;
    return grab.frame.parent_R_frame * ofFrame;
}

bool withinReach(const Grab& grab, const FrameRay& ray, const Vec3d& move) {
    const double reach = grab.frame.extent.maxCoeff() + (ray.origin - grab.at).norm();
    return move.allFinite() && move.norm() <= kFarthest * reach;
}

Dragged movedBy(const Grab& grab, const Vec3d& move) {
    Dragged result{.pose = grab.moved.pose, .center = std::nullopt, .outerAngle = std::nullopt};
    result.pose.translation += inParent(grab, snappedMove(grab, move));
    return result;
}

Dragged turnedBy(const Grab& grab, const Vec3d& axis, double angle) {
    Dragged result{.pose = grab.moved.pose, .center = std::nullopt, .outerAngle = std::nullopt};
    const Quatd turn(Eigen::AngleAxisd(snapped(angle, grab.snap), grab.frame.parent_R_frame * axis));
    result.pose.rotation = (turn * grab.moved.pose.rotation).normalized();
    result.pose.translation = grab.frame.pivot + turn * (grab.moved.pose.translation - grab.frame.pivot);
    return result;
}

Dragged scaledBy(const Grab& grab, const Vec3d& factors) {
    Dragged result{.pose = grab.moved.pose, .center = std::nullopt, .outerAngle = std::nullopt};
    result.pose.scale = grab.moved.pose.scale.cwiseProduct(factors);
    const Quatd& axes = grab.frame.parent_R_frame;
    const Vec3d fixed = grab.frame.pivot + axes * grab.handle.fixed;
    result.pose.translation =
        fixed + axes * factors.cwiseProduct(axes.conjugate() * (grab.moved.pose.translation - fixed));
    return result;
}

double factorOf(const Grab& grab, double factor) {
    factor = snapped(factor, grab.snap);
    return std::clamp(factor, std::max(kLeastFactor, grab.snap), std::max(kMostFactor, grab.snap));
}

std::optional<Dragged> turnRing(const Grab& grab, const FrameRay& ray) {
    const Vec3d axis = Vec3d::Unit(grab.handle.axis);
    const Vec3d center = axis * axis.dot(grab.at), arm = grab.at - center;
    const double radius = arm.norm();
    if (!(radius > 0)) return std::nullopt;
    if (grab.edgeOn) {
        const std::optional<double> way = alongLine(grab.at, axis.cross(arm) / radius, ray);
        if (!way || !(std::abs(*way) < kFarthest * radius)) return std::nullopt;
        return turnedBy(grab, axis, *way / radius);
    }
    const std::optional<Vec3d> at = onPlane(grab.at, axis, ray);
    if (!at) return std::nullopt;
    const Vec3d now = *at - center;
    if (!(now.norm() > 1e-9 * radius)) return std::nullopt;
    return turnedBy(grab, axis, std::atan2(axis.dot(arm.cross(now)), arm.dot(now)));
}

std::optional<Dragged> turnBall(const Grab& grab, const FrameRay& ray) {
    const double radius = radiusOf(grab);
    const std::optional<Vec3d> now = onBall(radius, grab.farSide, ray);
    const FrameRay first{grab.at - 1e3 * radius * grab.towards, grab.towards};  // any point of it before the ball
    const std::optional<Vec3d> then = onBall(radius, grab.farSide, first);
    if (!now || !then) return std::nullopt;
    const Eigen::AngleAxisd turn(turnBetween(*then, *now));
    return turnedBy(grab, turn.axis(), turn.angle());
}

std::optional<Dragged> scaleAlong(const Grab& grab, const FrameRay& ray) {
    const bool all = grab.handle.deed == HandleDeed::kScaleAll;
    const Vec3d arm = grab.at - grab.handle.fixed;
    const Vec3d axis = all ? Vec3d(arm.stableNormalized()) : Vec3d(Vec3d::Unit(grab.handle.axis));
    const double from = axis.dot(arm);
    if (!(std::abs(from) > 1e-9 * grab.frame.extent.maxCoeff())) return std::nullopt;
    const std::optional<double> way = alongLine(grab.at, axis, ray);
    if (!way || !std::isfinite(*way)) return std::nullopt;
    const double factor = factorOf(grab, (from + *way) / from);
    if (all) return scaledBy(grab, Vec3d::Constant(factor));
    Vec3d factors = Vec3d::Ones();
    factors[grab.handle.axis] = factor;
    return scaledBy(grab, factors);
}

/// With m the matrix about the centre, a point x of the target stands at translation + centre + m (x - centre). The
/// centre goes where the hand leads its image, and the translation follows, so that every x stays where it is.
std::optional<Dragged> moveCenter(const Grab& grab, const FrameRay& ray) {
    const Vec3d axis = Vec3d::Unit(grab.handle.axis);
    const std::optional<double> way = alongLine(grab.at, axis, ray);
    if (!way || !withinReach(grab, ray, *way * axis)) return std::nullopt;
    const MovedCore& moved = grab.moved;
    const Mat3d matrix = moved.pose.matrix().linear() * moved.axes.conjugate().toRotationMatrix();
    const double least = moved.pose.scale.cwiseAbs().minCoeff();
    if (!(least > 1e-12 * moved.pose.scale.cwiseAbs().maxCoeff()))
        return std::nullopt;  // flat: many centres have this image
    const Vec3d move = inParent(grab, snappedMove(grab, *way * axis));
    Dragged result{.pose = moved.pose, .center = moved.center + matrix.inverse() * move, .outerAngle = std::nullopt};
    result.pose.translation += move;  // of the centre's image, which is translation + centre
    return result;
}

std::optional<Dragged> openCone(const Grab& grab, const FrameRay& ray) {
    const std::optional<Vec3d> now = onPlane(grab.at, grab.towards, ray);
    if (!now) return std::nullopt;
    const auto angle = [](const Vec3d& p) { return std::atan2(std::hypot(p.x(), p.y()), -p.z()); };
    const double wanted = snapped(grab.outerAngle + angle(*now) - angle(grab.at), grab.snap);
    return Dragged{.pose = grab.moved.pose,
                   .center = std::nullopt,
                   .outerAngle = std::clamp(wanted, 0.0, static_cast<double>(SpotLight::kWidest))};
}

std::optional<Dragged> moveAlong(const Grab& grab, const FrameRay& ray) {
    Vec3d move = Vec3d::Zero();
    if (grab.handle.deed == HandleDeed::kMoveAxis) {
        const Vec3d axis = Vec3d::Unit(grab.handle.axis);
        const std::optional<double> way = alongLine(grab.at, axis, ray);
        if (!way) return std::nullopt;
        move = *way * axis;
    } else {
        const Vec3d normal =
            grab.handle.deed == HandleDeed::kMovePlane ? Vec3d(Vec3d::Unit(grab.handle.axis)) : grab.towards;
        const std::optional<Vec3d> at = onPlane(grab.at, normal, ray);
        if (!at) return std::nullopt;
        move = *at - grab.at;
    }
    if (!withinReach(grab, ray, move)) return std::nullopt;
    return movedBy(grab, move);
}

}  // namespace

std::optional<HandleHit> hitOf(const Handles& handles, const Affine3d& world_T_frame, const Ray& ray) {
    std::optional<HandleHit> nearest;
    const Vec3d inFrame = (world_T_frame.linear().inverse() * ray.direction).stableNormalized();
    for (const HandlePiece& piece : handles.pieces) {
        // A plane that is seen from its side would lead far away for a little of the hand; what lies behind it is
        // meant.
        const Handle& handle = handles.of[static_cast<std::size_t>(piece.handle - 1)];
        if (handle.deed == HandleDeed::kMovePlane && std::abs(inFrame[handle.axis]) < kEdgeOn) continue;
        const Affine3d world_T_piece = world_T_frame * piece.pose.matrix();
        const Affine3d piece_T_world = world_T_piece.inverse();
        const Vec3d o = piece_T_world * ray.origin, d = piece_T_world.linear() * ray.direction;
        if (!o.allFinite() || !d.allFinite()) continue;
        const MeshArrays& shape = handleShape(piece.shape);
        const std::span<const float> positions = shape.positions.as<float>();
        const std::span<const std::uint32_t> indices = shape.indices.as<std::uint32_t>();
        const auto corner = [&](std::uint32_t index) {
            return Vec3d(positions[3 * index], positions[3 * index + 1], positions[3 * index + 2]);
        };
        for (std::size_t i = 0; i + 2 < indices.size();
             i += 3) {  // Möller and Trumbore, Journal of Graphics Tools 2 (1), 1997
            const Vec3d a = corner(indices[i]), ab = corner(indices[i + 1]) - a, ac = corner(indices[i + 2]) - a;
            const Vec3d p = d.cross(ac);
            const double volume = ab.dot(p);
            if (volume == 0) continue;
            const Vec3d s = o - a;
            const double u = s.dot(p) / volume;
            if (!(u >= 0 && u <= 1)) continue;
            const Vec3d q = s.cross(ab);
            const double v = d.dot(q) / volume, t = ac.dot(q) / volume;
            if (!(v >= 0 && u + v <= 1 && t > 0)) continue;
            if (!nearest || t < nearest->t) nearest = HandleHit{.handle = piece.handle, .t = t};
        }
    }
    return nearest;
}

std::optional<Grab> grabAt(const Handle& handle, const HandleFrame& frame, const MovedCore& moved, const Ray& ray,
                           double t, double snap, double outerAngle) {
    const std::optional<FrameRay> inFrame = toFrame(frame, ray);
    const Vec3d at = frame.world_T_frame.inverse() * Vec3d(ray.origin + t * ray.direction);
    if (!inFrame || !at.allFinite()) return std::nullopt;
    Grab grab{.handle = handle,
              .frame = frame,
              .moved = moved,
              .at = at,
              .towards = inFrame->direction,
              .snap = snap,
              .outerAngle = outerAngle};
    grab.ray = ray;
    grab.edgeOn = std::abs(inFrame->direction[handle.axis]) < kEdgeOn;
    grab.farSide = at.dot(inFrame->direction) > 0;
    return grab;
}

std::optional<Dragged> dragged(const Grab& grab, const Ray& ray) {
    const std::optional<FrameRay> inFrame = toFrame(grab.frame, ray);
    if (!inFrame) return std::nullopt;
    // Nowhere: not even rounding, nor a whole step.
    if (ray.origin == grab.ray.origin && ray.direction == grab.ray.direction)
        return Dragged{
            .pose = grab.moved.pose,
            .center = std::nullopt,
            .outerAngle = grab.handle.deed == HandleDeed::kOpenCone ? std::optional(grab.outerAngle) : std::nullopt};
    const std::optional<Dragged> result = [&]() -> std::optional<Dragged> {
        switch (grab.handle.deed) {
            case HandleDeed::kMoveAxis:
            case HandleDeed::kMovePlane:
            case HandleDeed::kMoveFacing:
                return moveAlong(grab, *inFrame);
            case HandleDeed::kTurnRing:
                return turnRing(grab, *inFrame);
            case HandleDeed::kTurnBall:
                return turnBall(grab, *inFrame);
            case HandleDeed::kScaleAxis:
            case HandleDeed::kScaleAll:
                return scaleAlong(grab, *inFrame);
            case HandleDeed::kMoveCenter:
                return moveCenter(grab, *inFrame);
            case HandleDeed::kOpenCone:
                return openCone(grab, *inFrame);
        }
        return std::nullopt;
    }();
    if (!result || !result->pose.sound() || (result->center && !result->center->allFinite())) return std::nullopt;
    return result;
}

}  // namespace tessera
