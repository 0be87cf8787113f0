#include "server/import/reader/DxfContent.h"

#include <utility>

namespace tessera {
namespace {

/// From here on a float is too coarse for a drawing of the usual size.
constexpr double kFar = 1e4;
constexpr std::size_t kMostLines = 4'000'000;

}  // namespace

std::uint32_t DxfBucket::addVertex(MeshData& mesh, const Vec3d& at) {
    if (!std::exchange(placed_, true) && at.norm() > kFar) origin = at.array().round();
    const Vec3d from = at - origin;
    for (int i = 0; i < 3; ++i) mesh.positions.push_back(static_cast<float>(from[i]));
    bounds.extend(at);
    return static_cast<std::uint32_t>(mesh.positions.size() / 3 - 1);
}

MeshData& DxfBucket::roomForLines() {
    if (lines.empty() || lines.back().lines.size() >= 2 * kMostLines) {
        lines.emplace_back();
        lines.back().primitive = Primitive::kLines;
    }
    return lines.back();
}

void DxfBucket::addPath(std::span<const Vec3d> path, bool closed, const Vec3d& thickness) {
    if (path.size() < 2) return;
    if (!thickness.isZero()) {
        std::uint32_t before = 0;
        const auto first = static_cast<std::uint32_t>(faces.positions.size() / 3);
        for (std::size_t i = 0; i < path.size(); ++i) {
            const std::uint32_t foot = addVertex(faces, path[i]);
            addVertex(faces, path[i] + thickness);
            if (i > 0)
                faces.indices.insert(faces.indices.end(), {before, foot, foot + 1, before, foot + 1, before + 1});
            before = foot;
        }
        if (closed && path.size() > 2)
            faces.indices.insert(faces.indices.end(), {before, first, first + 1, before, first + 1, before + 1});
        return;
    }
    MeshData& mesh = roomForLines();
    const auto first = static_cast<std::uint32_t>(mesh.positions.size() / 3);
    for (const Vec3d& point : path)
        if (const std::uint32_t vertex = addVertex(mesh, point); vertex > first)
            mesh.lines.insert(mesh.lines.end(), {vertex - 1, vertex});
    if (closed && path.size() > 2)
        mesh.lines.insert(mesh.lines.end(), {first + static_cast<std::uint32_t>(path.size()) - 1, first});
}

void DxfBucket::addPoint(const Vec3d& point) {
    points.primitive = Primitive::kPoints;
    addVertex(points, point);
}

void DxfBucket::addFace(std::span<const Vec3d> corners) {
    static constexpr std::uint32_t kFan[] = {0, 1, 2, 0, 2, 3};
    addTriangles(corners, std::span(kFan, corners.size() < 4 ? 3 : 6));
}

void DxfBucket::addTriangles(std::span<const Vec3d> corners, std::span<const std::uint32_t> triangles) {
    const auto first = static_cast<std::uint32_t>(faces.positions.size() / 3);
    for (const Vec3d& corner : corners) addVertex(faces, corner);
    for (const std::uint32_t corner : triangles) faces.indices.push_back(first + corner);
}

void DxfBucket::addLetters(DxfLetters made) {
    bounds.extend(made.place.translation());
    letters.push_back(std::move(made));
}

DxfLayerContent& DxfContent::of(const DxfLayer& layer) {
    DxfLayerContent& content = layers[dxfKey(layer.name)];
    content.layer = &layer;
    return content;
}

Box DxfContent::bounds() const {
    Box all;
    for (const auto& [key, content] : layers) {
        for (const auto& [color, bucket] : content.buckets) all.extend(bucket.bounds);
        for (const DxfPlaced& placed : content.placed)
            if (!placed.guise->bounds.empty()) all.extend(placed.guise->bounds.transformed(placed.place));
    }
    return all;
}

}  // namespace tessera
