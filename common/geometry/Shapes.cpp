/// Boxes, cylinders, tubes, spheres, tori and pipes.
#include <cmath>
#include <numbers>

#include "common/geometry/Mesh.h"
#include "common/math/Decompositions.h"

namespace tessera {

namespace {

/// `uv`: v points down, so that a picture stands upright on a shape that is seen from outside with +Y up.
std::uint32_t addVertex(MeshData& mesh, const Vec3d& position, const Vec3d& normal, const Vec2d& uv) {
    for (int axis = 0; axis < 3; ++axis) mesh.positions.push_back(static_cast<float>(position[axis]));
    for (int axis = 0; axis < 3; ++axis) mesh.normals.push_back(static_cast<float>(normal[axis]));
    for (int axis = 0; axis < 2; ++axis) mesh.texcoords.push_back(static_cast<float>(uv[axis]));
    return static_cast<std::uint32_t>(mesh.positions.size() / 3 - 1);
}

void addTriangle(MeshData& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.indices.insert(mesh.indices.end(), {a, b, c});
}

/// Corners counter-clockwise seen from outside.
void addQuad(MeshData& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    addTriangle(mesh, a, b, c);
    addTriangle(mesh, a, c, d);
}

/// Unit vector in the plane of +X and -Z, so that the angle grows counter-clockwise seen from +Y.
Vec3d aroundY(int step, int steps) {
    const double angle = 2 * std::numbers::pi * (step % steps) / steps;
    return {std::cos(angle), 0, -std::sin(angle)};
}

/// A vertical wall around +Y between two heights. `facing` 1: outwards, -1: inwards.
void addWallAroundY(MeshData& mesh, double radius, double height, int segments, double facing) {
    const Vec3d half(0, 0.5 * height, 0);
    std::uint32_t previous = 0;
    for (int i = 0; i <= segments; ++i) {
        const Vec3d out = aroundY(i, segments);
        const double u = facing * i / segments;
        const std::uint32_t below = addVertex(mesh, radius * out - half, facing * out, {u, 1});
        addVertex(mesh, radius * out + half, facing * out, {u, 0});
        if (i > 0 && facing > 0) addQuad(mesh, previous, below, below + 1, previous + 1);
        if (i > 0 && facing < 0) addQuad(mesh, below, previous, previous + 1, below + 1);
        previous = below;
    }
}

/// A flat ring (or disc, where the inner radius is 0) across +Y. `facing` 1: upwards, -1: downwards.
void addRingAcrossY(MeshData& mesh, double outer, double inner, double y, int segments, double facing) {
    const Vec3d normal(0, facing, 0);
    const Vec3d height(0, y, 0);
    const auto uvOf = [&](const Vec3d& at) {
        return Vec2d(0.5 + 0.5 * at.x() / outer, 0.5 + 0.5 * facing * at.z() / outer);
    };
    const std::uint32_t center = inner > 0 ? 0 : addVertex(mesh, height, normal, {0.5, 0.5});
    std::uint32_t previousOuter = 0, previousInner = 0;
    for (int i = 0; i <= segments; ++i) {
        const Vec3d out = aroundY(i, segments);
        const std::uint32_t onOuter = addVertex(mesh, outer * out + height, normal, uvOf(outer * out));
        const std::uint32_t onInner =
            inner > 0 ? addVertex(mesh, inner * out + height, normal, uvOf(inner * out)) : center;
        if (i > 0 && inner > 0) {
            if (facing > 0) addQuad(mesh, previousOuter, onOuter, onInner, previousInner);
            if (facing < 0) addQuad(mesh, onOuter, previousOuter, previousInner, onInner);
        } else if (i > 0) {
            if (facing > 0) addTriangle(mesh, previousOuter, onOuter, center);
            if (facing < 0) addTriangle(mesh, onOuter, previousOuter, center);
        }
        previousOuter = onOuter;
        previousInner = onInner;
    }
}

/// Joins two rings of `segments` + 1 vertices each; `second` lies further along the direction around which the rings
/// run counter-clockwise.
void addBand(MeshData& mesh, std::uint32_t first, std::uint32_t second, int segments) {
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(segments); ++i) {
        addQuad(mesh, first + i, first + i + 1, second + i + 1, second + i);
    }
}

int atLeast(int segments, int least) {
    return segments < least ? least : segments;
}

}  // namespace

MeshData makeBox(const Vec3d& size) {
    MeshData mesh;
    const Vec3d half = 0.5 * size;
    for (int axis = 0; axis < 3; ++axis) {
        for (const double side : {1.0, -1.0}) {
            const Vec3d normal = side * Vec3d::Unit(axis);
            const Vec3d u = Vec3d::Unit((axis + 1) % 3);
            const Vec3d v = side * Vec3d::Unit((axis + 2) % 3);
            const Vec3d up = axis == 1 ? Vec3d(-side * Vec3d::UnitZ()) : Vec3d::UnitY(), right = up.cross(normal);
            const auto corner = [&](double su, double sv) {
                const Vec3d on = su * u + sv * v;
                return addVertex(mesh, half.cwiseProduct(normal + on), normal,
                                 {0.5 + 0.5 * right.dot(on), 0.5 - 0.5 * up.dot(on)});
            };
            const std::uint32_t a = corner(-1, -1), b = corner(1, -1), c = corner(1, 1), d = corner(-1, 1);
            addQuad(mesh, a, b, c, d);
        }
    }
    return mesh;
}

MeshData makeCylinder(double radius, double height, int segments) {
    MeshData mesh;
    segments = atLeast(segments, 3);
    addWallAroundY(mesh, radius, height, segments, 1);
    addRingAcrossY(mesh, radius, 0, 0.5 * height, segments, 1);
    addRingAcrossY(mesh, radius, 0, -0.5 * height, segments, -1);
    return mesh;
}

MeshData makeTube(double outerRadius, double innerRadius, double height, int segments) {
    MeshData mesh;
    segments = atLeast(segments, 3);
    addWallAroundY(mesh, outerRadius, height, segments, 1);
    addWallAroundY(mesh, innerRadius, height, segments, -1);
    addRingAcrossY(mesh, outerRadius, innerRadius, 0.5 * height, segments, 1);
    addRingAcrossY(mesh, outerRadius, innerRadius, -0.5 * height, segments, -1);
    return mesh;
}

MeshData makeSphere(double radius, int segments) {
    MeshData mesh;
    segments = atLeast(segments, 3);
    const int rings = atLeast(segments / 2, 2);
    for (int ring = 0; ring <= rings; ++ring) {
        const double latitude = std::numbers::pi * (static_cast<double>(ring) / rings - 0.5);
        for (int i = 0; i <= segments; ++i) {
            Vec3d out = std::cos(latitude) * aroundY(i, segments) + std::sin(latitude) * Vec3d::UnitY();
            // The poles exactly on the axis: cos(pi / 2) is not quite 0.
            if (ring == 0 || ring == rings) out = Vec3d(0, ring == 0 ? -1 : 1, 0);
            addVertex(mesh, radius * out, out,
                      {static_cast<double>(i) / segments, 1 - static_cast<double>(ring) / rings});
        }
    }
    const auto at = [&](int ring, int i) { return static_cast<std::uint32_t>(ring * (segments + 1) + i); };
    for (int ring = 0; ring < rings; ++ring) {
        for (int i = 0; i < segments; ++i) {
            // At a pole a quad's two corners coincide: one of its triangles would have no area.
            if (ring + 1 < rings) addTriangle(mesh, at(ring, i), at(ring + 1, i + 1), at(ring + 1, i));
            if (ring > 0) addTriangle(mesh, at(ring, i), at(ring, i + 1), at(ring + 1, i + 1));
        }
    }
    return mesh;
}

MeshData makeTorus(double ringRadius, double pipeRadius, int ringSegments, int pipeSegments) {
    MeshData mesh;
    ringSegments = atLeast(ringSegments, 3);
    pipeSegments = atLeast(pipeSegments, 3);
    for (int i = 0; i <= ringSegments; ++i) {
        const Vec3d out = aroundY(i, ringSegments);
        for (int j = 0; j <= pipeSegments; ++j) {
            const double angle = 2 * std::numbers::pi * (j % pipeSegments) / pipeSegments;
            const Vec3d normal = std::cos(angle) * out + std::sin(angle) * Vec3d::UnitY();
            addVertex(mesh, ringRadius * out + pipeRadius * normal, normal,
                      {static_cast<double>(i) / ringSegments, 1 - static_cast<double>(j) / pipeSegments});
        }
    }
    const std::uint32_t stride = static_cast<std::uint32_t>(pipeSegments) + 1;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(ringSegments); ++i) {
        for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(pipeSegments); ++j) {
            const std::uint32_t a = i * stride + j;
            addQuad(mesh, a, a + stride, a + stride + 1, a + 1);
        }
    }
    return mesh;
}

MeshData makePipe(std::span<const Vec3d> path, double radius, int segments) {
    MeshData mesh;
    segments = atLeast(segments, 3);
    std::vector<Vec3d> points;
    for (const Vec3d& p : path) {
        if (points.empty() || (p - points.back()).norm() > 1e-9 * (1 + p.norm())) points.push_back(p);
    }
    if (points.size() < 2) return mesh;

    std::vector<Vec3d> directions;
    for (std::size_t i = 0; i + 1 < points.size(); ++i) directions.push_back((points[i + 1] - points[i]).normalized());

    // Two axes across the pipe, carried along from bend to bend by the smallest rotation, so that it does not twist.
    Vec3d u = directions[0].unitOrthogonal();
    const auto offset = [&](int i, const Vec3d& direction) {
        const double angle = 2 * std::numbers::pi * (i % segments) / segments;
        return Vec3d(std::cos(angle) * u + std::sin(angle) * direction.cross(u));
    };
    // Where the surface line through `out` meets the plane that halves the bend at `joint`.
    const auto mitred = [&](std::size_t joint, const Vec3d& direction, const Vec3d& out) -> Vec3d {
        if (joint == 0 || joint + 1 == points.size()) return points[joint] + radius * out;
        const Vec3d plane = directions[joint - 1] + directions[joint];
        // A pipe that turns back on itself would reach to infinity there: it is cut straight instead.
        if (plane.norm() < 0.2) return points[joint] + radius * out;
        return points[joint] + radius * (out - direction * (out.dot(plane) / direction.dot(plane)));
    };

    // As dense along the pipe as around it.
    const double girth = 2 * std::numbers::pi * radius;
    double along = 0;
    for (std::size_t s = 0; s < directions.size(); ++s) {
        const Vec3d& direction = directions[s];
        if (s > 0) {
            u = turnBetween(directions[s - 1], direction) * u;
            u = (u - direction * direction.dot(u)).normalized();
        }
        const std::uint32_t rings[2] = {
            static_cast<std::uint32_t>(mesh.positions.size() / 3),
            static_cast<std::uint32_t>(mesh.positions.size() / 3 + static_cast<std::size_t>(segments) + 1)};
        for (const std::size_t joint : {s, s + 1}) {
            for (int i = 0; i <= segments; ++i) {
                const Vec3d out = offset(i, direction);
                const Vec3d at = mitred(joint, direction, out);
                addVertex(mesh, at, out,
                          {static_cast<double>(i) / segments, -(along + (at - points[s]).dot(direction)) / girth});
            }
        }
        addBand(mesh, rings[0], rings[1], segments);
        const bool ends[2] = {s == 0, s + 1 == directions.size()};
        for (int end = 0; end < 2; ++end) {
            if (!ends[end]) continue;
            const Vec3d& at = points[end == 0 ? s : s + 1];
            const Vec3d normal = end == 0 ? Vec3d(-direction) : direction;
            const std::uint32_t center = addVertex(mesh, at, normal, {0.5, 0.5});
            for (int i = 0; i <= segments; ++i) {
                const double angle = 2 * std::numbers::pi * i / segments;
                const std::uint32_t here = addVertex(mesh, at + radius * offset(i, direction), normal,
                                                     {0.5 + 0.5 * std::cos(angle), 0.5 - 0.5 * std::sin(angle)});
                if (i > 0 && end == 1) addTriangle(mesh, here - 1, here, center);
                if (i > 0 && end == 0) addTriangle(mesh, here, here - 1, center);
            }
        }
        along += (points[s + 1] - points[s]).norm();
    }
    return mesh;
}

}  // namespace tessera
