#include "server/import/reader/NurbsMessage.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/freeform/nurbs/NurbsShapes.h"

namespace tessera {
namespace {

using Message = proto::scene::NurbsSurface;

void addCurve(proto::scene::NurbsCurve& message, const TrimCurve& curve) {
    message.set_degree(static_cast<std::uint32_t>(curve.knots.degree));
    message.mutable_knot()->Add(curve.knots.knots.begin(), curve.knots.knots.end());
    for (const Vec3d& p : curve.points) {
        proto::scene::Vector* point = message.add_point();
        point->set_x(p.x() / p.z());
        point->set_y(p.y() / p.z());
        message.add_weight(p.z());
    }
    message.set_begin(curve.begin);
    message.set_end(curve.end);
}

Expected<void> checkLengths(std::initializer_list<double> lengths, const char* what) {
    for (const double length : lengths)
        if (!(length > 0 && length < 1e9))
            return fail(ErrorCode::kBadInput, fmt::format("{} must be above zero and below 1e9", what));
    return {};
}

Expected<NurbsSurface> primitiveOf(const Message& message) {
    Expected<void> good;
    switch (message.primitive_case()) {
        case Message::kSphere:
            good = checkLengths({message.sphere().radius()}, "a NURBS sphere's radius");
            return good ? sphereSurface(message.sphere().radius()) : tl::unexpected(good.error());
        case Message::kTorus:
            good = checkLengths({message.torus().ring_radius(), message.torus().pipe_radius()}, "a NURBS torus' radii");
            return good ? torusSurface(message.torus().ring_radius(), message.torus().pipe_radius())
                        : tl::unexpected(good.error());
        case Message::kCylinder:
            good = checkLengths({message.cylinder().radius(), message.cylinder().height()},
                                "a NURBS cylinder's radius and height");
            return good ? cylinderSurface(message.cylinder().radius(), message.cylinder().height())
                        : tl::unexpected(good.error());
        default: {
            const proto::scene::NurbsCone& cone = message.cone();
            good = checkLengths({std::max(cone.lower_radius(), cone.upper_radius()), cone.height()},
                                "a NURBS cone's height and larger radius");
            if (good && !(std::min(cone.lower_radius(), cone.upper_radius()) >= 0))
                good = fail(ErrorCode::kBadInput, "a NURBS cone's radii must not be negative");
            return good ? coneSurface(cone.lower_radius(), cone.upper_radius(), cone.height())
                        : tl::unexpected(good.error());
        }
    }
}

}  // namespace

void setSurface(proto::scene::NurbsSurface& message, const NurbsSurface& surface) {
    const NurbsDefinition& d = surface.definition();
    message.set_degree_u(static_cast<std::uint32_t>(d.u.degree));
    message.set_degree_v(static_cast<std::uint32_t>(d.v.degree));
    message.mutable_knot_u()->Add(d.u.knots.begin(), d.u.knots.end());
    message.mutable_knot_v()->Add(d.v.knots.begin(), d.v.knots.end());
    const bool rational = std::any_of(d.points.begin(), d.points.end(), [](const Vec4d& p) { return p.w() != 1; });
    for (const Vec4d& p : d.points) {
        proto::scene::Vector* point = message.add_point();
        point->set_x(p.x() / p.w());
        point->set_y(p.y() / p.w());
        point->set_z(p.z() / p.w());
        if (rational) message.add_weight(p.w());
    }
    message.set_begin_u(surface.domain().u.lower);
    message.set_end_u(surface.domain().u.upper);
    message.set_begin_v(surface.domain().v.lower);
    message.set_end_v(surface.domain().v.upper);
    for (const TrimLoop& loop : d.loops) {
        proto::scene::NurbsLoop* made = message.add_loop();
        made->set_hole(loop.role == LoopRole::kHole);
        for (const TrimCurve& curve : loop.curves) addCurve(*made->add_curve(), curve);
    }
}

Expected<Message> byControlPoints(const Message& message) {
    if (message.primitive_case() == Message::PRIMITIVE_NOT_SET) return message;
    if (message.has_degree_u() || message.has_degree_v() ||
        message.knot_u_size() + message.knot_v_size() + message.point_size() + message.weight_size() > 0 ||
        message.count_u() != 0)
        return fail(ErrorCode::kBadInput,
                    "a NURBS surface is either a primitive or has degrees, knots, points and weights of its own");
    const Expected<NurbsSurface> surface = primitiveOf(message);
    if (!surface) return tl::unexpected(surface.error());
    Message out = message;
    out.clear_primitive();
    setSurface(out, *surface);
    // What is said of a part counts.
    if (message.has_begin_u()) out.set_begin_u(message.begin_u());
    if (message.has_end_u()) out.set_end_u(message.end_u());
    if (message.has_begin_v()) out.set_begin_v(message.begin_v());
    if (message.has_end_v()) out.set_end_v(message.end_v());
    return out;
}

}  // namespace tessera
