#include "server/import/reader/SceneShapes.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include "common/geometry/Points.h"

namespace tessera {
namespace {

using Content = proto::scene::Node::ContentCase;

bool isLength(double value) {
    return value > 0.0 && value < 1e9;
}

Expected<int> segmentCount(std::uint32_t asked, int otherwise) {
    if (asked == 0) return otherwise;
    if (asked < 3 || asked > 1024)
        return fail(ErrorCode::kBadInput, fmt::format("segments must be 3 to 1024, not {}", asked));
    return static_cast<int>(asked);
}

constexpr int kSegments = 24;

Expected<MeshData> listedPoints(const proto::scene::Points& message) {
    if (message.surface_case() != proto::scene::Points::SURFACE_NOT_SET)
        return fail(ErrorCode::kBadInput, "points are either listed or on a surface");
    MeshData points;
    points.primitive = Primitive::kPoints;
    for (const proto::scene::Vector& point : message.point()) {
        const Vec3d place(point.x(), point.y(), point.z());
        if (!(place.cwiseAbs().maxCoeff() < 1e9))
            return fail(ErrorCode::kBadInput, "points must be finite, and nearer than 1e9");
        for (const double coordinate : place) points.positions.push_back(static_cast<float>(coordinate));
    }
    return points;
}

Expected<MeshData> pointsOfSurface(const proto::scene::Points& message) {
    if (message.surface_case() == proto::scene::Points::SURFACE_NOT_SET)
        return fail(ErrorCode::kBadInput, "points need a list of them, or a surface");
    if (!isLength(message.spacing()))
        return fail(ErrorCode::kBadInput, "the spacing of points on a surface must be above zero and below 1e9");
    proto::scene::Node node;
    const int number = static_cast<int>(message.surface_case());
    node.GetReflection()
        ->MutableMessage(&node, node.GetDescriptor()->FindFieldByNumber(number))
        ->CopyFrom(message.GetReflection()->GetMessage(message, message.GetDescriptor()->FindFieldByNumber(number)));
    const Expected<MeshData> surface = makeShape(node);
    if (!surface) return surface;
    return pointsOnSurface(*surface, message.spacing());
}

Expected<MeshData> makePoints(const proto::scene::Points& message) {
    if (!(message.radius() >= 0 && message.radius() < 1e9))
        return fail(ErrorCode::kBadInput, "the radius of points must not be negative");
    Expected<MeshData> points = message.point().empty() ? pointsOfSurface(message) : listedPoints(message);
    if (points) points->pointRadius = message.radius();
    return points;
}

}  // namespace

Expected<MeshData> makeShape(const proto::scene::Node& node) {
    const auto lengths = [](std::initializer_list<double> values, const char* what) -> Expected<void> {
        for (const double value : values)
            if (!isLength(value))
                return fail(ErrorCode::kBadInput, fmt::format("{} must be above zero and below 1e9", what));
        return {};
    };
    Expected<void> good;
    switch (node.content_case()) {
        case Content::kBox: {
            const proto::scene::Vector& size = node.box().size();
            good = lengths({size.x(), size.y(), size.z()}, "a box's size x, y and z");
            if (!good) break;
            return makeBox(Vec3d(size.x(), size.y(), size.z()));
        }
        case Content::kCylinder: {
            good = lengths({node.cylinder().radius(), node.cylinder().height()}, "a cylinder's radius and height");
            const Expected<int> segments = segmentCount(node.cylinder().segments(), kSegments);
            if (!good || !segments) return tl::unexpected(good ? segments.error() : good.error());
            return makeCylinder(node.cylinder().radius(), node.cylinder().height(), *segments);
        }
        case Content::kTube: {
            const proto::scene::Tube& tube = node.tube();
            good = lengths(
                {tube.outer_radius(), tube.inner_radius(), tube.height(), tube.outer_radius() - tube.inner_radius()},
                "a tube's radii and height, and outer_radius less inner_radius,");
            const Expected<int> segments = segmentCount(tube.segments(), kSegments);
            if (!good || !segments) return tl::unexpected(good ? segments.error() : good.error());
            return makeTube(tube.outer_radius(), tube.inner_radius(), tube.height(), *segments);
        }
        case Content::kSphere: {
            good = lengths({node.sphere().radius()}, "a sphere's radius");
            const Expected<int> segments = segmentCount(node.sphere().segments(), kSegments);
            if (!good || !segments) return tl::unexpected(good ? segments.error() : good.error());
            return makeSphere(node.sphere().radius(), *segments);
        }
        case Content::kTorus: {
            const proto::scene::Torus& torus = node.torus();
            good = lengths({torus.ring_radius(), torus.pipe_radius()}, "a torus' radii");
            const Expected<int> ring = segmentCount(torus.ring_segments(), 2 * kSegments);
            const Expected<int> pipe = segmentCount(torus.pipe_segments(), kSegments / 2);
            if (!good) break;
            if (!ring || !pipe) return tl::unexpected(ring ? pipe.error() : ring.error());
            return makeTorus(torus.ring_radius(), torus.pipe_radius(), *ring, *pipe);
        }
        case Content::kPipe: {
            const proto::scene::Pipe& pipe = node.pipe();
            good = lengths({pipe.radius()}, "a pipe's radius");
            const Expected<int> segments = segmentCount(pipe.segments(), kSegments / 2);
            if (!good || !segments) return tl::unexpected(good ? segments.error() : good.error());
            if (pipe.point_size() < 2 || pipe.point_size() > 10'000)
                return fail(ErrorCode::kBadInput, "a pipe needs 2 to 10000 points");
            std::vector<Vec3d> path;
            for (const proto::scene::Vector& point : pipe.point()) path.emplace_back(point.x(), point.y(), point.z());
            for (std::size_t i = 0; i < path.size(); ++i)
                if (!path[i].allFinite() || (i > 0 && !isLength((path[i] - path[i - 1]).norm())))
                    return fail(ErrorCode::kBadInput, "a pipe's neighbouring points must differ and be finite");
            return makePipe(path, pipe.radius(), *segments);
        }
        case Content::kPoints:
            return makePoints(node.points());
        default:
            return fail(ErrorCode::kBadInput, "not a shape");
    }
    return tl::unexpected(good.error());
}

bool isShape(Content content) {
    switch (content) {
        case Content::kBox:
        case Content::kCylinder:
        case Content::kTube:
        case Content::kSphere:
        case Content::kTorus:
        case Content::kPipe:
        case Content::kPoints:
            return true;
        default:
            return false;
    }
}

std::string shapeKey(const proto::scene::Node& node) {
    std::string bytes;
    const google::protobuf::FieldDescriptor* field =
        node.GetDescriptor()->FindFieldByNumber(static_cast<int>(node.content_case()));
    node.GetReflection()->GetMessage(node, field).SerializeToString(&bytes);
    return fmt::format("{} {}", field->name(), bytes);
}

}  // namespace tessera
