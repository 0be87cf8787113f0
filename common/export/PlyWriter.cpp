// PLY, binary, little endian: all vertices, then all triangles; or points alone.

#include <fmt/format.h>

#include <cstring>
#include <limits>

#include "common/export/Formats.h"
#include "common/export/LeavingBytes.h"
#include "common/export/WorldMeshes.h"

namespace tessera {
namespace {

constexpr std::size_t kVertexBytes = 6 * sizeof(float) + 4, kFaceBytes = 1 + 3 * sizeof(std::uint32_t);

struct PlyVertex {
    Vec3f position, normal;
    std::array<std::uint8_t, 4> color{255, 255, 255, 255};
};

void append(std::vector<std::byte>& bytes, const PlyVertex& vertex) {
    const std::size_t at = bytes.size();
    bytes.resize(at + kVertexBytes);
    std::memcpy(&bytes[at], vertex.position.data(), 3 * sizeof(float));
    std::memcpy(&bytes[at + 12], vertex.normal.data(), 3 * sizeof(float));
    std::memcpy(&bytes[at + 24], vertex.color.data(), 4);
}

/// The material's base colour times the vertex's, as bytes.
std::array<std::uint8_t, 4> colorOf(const WorldMesh& mesh, const std::array<std::uint8_t, 4>& base,
                                    std::size_t vertex) {
    std::array<std::uint8_t, 4> color = base;
    const std::span<const std::uint8_t> own = mesh.arrays.colors.as<std::uint8_t>();
    for (std::size_t k = 0; k < 4 && !own.empty(); ++k)
        color[k] = static_cast<std::uint8_t>((color[k] * own[4 * vertex + k] + 127) / 255);
    return color;
}

}  // namespace

Expected<LeavingFiles> writePly(const LeavingScene& leaving) {
    Expected<std::vector<WorldMesh>> meshes = worldMeshes(leaving);
    if (!meshes) return tl::unexpected(meshes.error());
    bool surfaces = false;
    for (const WorldMesh& mesh : *meshes) surfaces = surfaces || mesh.triangles() > 0;
    // Readers take vertices of no face for nothing, or for mistakes.
    std::erase_if(*meshes, [&](const WorldMesh& mesh) {
        const bool points = mesh.arrays.kind == MeshKind::kPoints;
        const bool kept = surfaces ? mesh.arrays.kind == MeshKind::kTriangles : points;
        if (!kept)
            leaving.notes.add(points ? "points beside triangles are left out" : "lines are left out", mesh.node->id);
        return !kept;
    });
    std::uint64_t vertices = 0, triangles = 0;
    for (const WorldMesh& mesh : *meshes) {
        triangles += mesh.triangles();
        // Without normals a mesh is faceted: each corner has one of its face.
        vertices += mesh.triangles() > 0 && mesh.arrays.normals.empty() ? 3 * mesh.triangles() : mesh.vertices();
    }
    const std::uint64_t bytes = kVertexBytes * vertices + kFaceBytes * triangles;
    if (Expected<void> fits = checkFileBytes(bytes, leaving.options); !fits) return tl::unexpected(fits.error());
    LeavingFiles files{.files = {{.path = leaving.path, .parts = {}}}, .nodes = meshes->size(), .triangles = triangles};
    std::vector<ByteSlice>& parts = files.files.front().parts;
    std::string head = fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
        "property float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty uchar red\n"
        "property uchar green\nproperty uchar blue\nproperty uchar alpha\n",
        vertices);
    if (surfaces) head += fmt::format("element face {}\nproperty list uchar uint vertex_indices\n", triangles);
    parts.push_back(sliceOfText(head + "end_header\n"));
    std::vector<std::byte> faces;
    faces.reserve(kFaceBytes * triangles);
    std::uint32_t first = 0;
    const auto addFace = [&](const std::array<std::uint32_t, 3>& corners) {
        const std::size_t at = faces.size();
        faces.resize(at + kFaceBytes);
        faces[at] = std::byte{3};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t corner = first + corners[k];
            std::memcpy(&faces[at + 1 + sizeof(corner) * k], &corner, sizeof(corner));
        }
    };
    for (const WorldMesh& mesh : *meshes) {
        const Material material = materialOf(leaving.scene, mesh.material);
        if (material.baseColorImage) leaving.notes.add("images of materials are left out", mesh.node->id);
        const std::array<std::uint8_t, 4> base = mesh.material || surfaces
                                                     ? colorBytes(material.baseColor)
                                                     : std::array<std::uint8_t, 4>{255, 255, 255, 255};
        std::vector<std::byte> list;
        if (mesh.triangles() > 0 && mesh.arrays.normals.empty()) {
            for (std::size_t t = 0; t < mesh.triangles(); ++t) {
                const std::array<std::uint32_t, 3> c = mesh.corners(t);
                const Vec3f normal = faceNormal(mesh.position(c[0]), mesh.position(c[1]), mesh.position(c[2]));
                for (const std::uint32_t corner : c)
                    append(list, {mesh.position(corner), normal, colorOf(mesh, base, corner)});
                addFace({0, 1, 2});
                first += 3;
            }
        } else {
            const bool shaded = !mesh.arrays.normals.empty();
            for (std::size_t v = 0; v < mesh.vertices(); ++v)
                append(list,
                       {mesh.position(v), shaded ? mesh.normal(v) : Vec3f(Vec3f::Zero()), colorOf(mesh, base, v)});
            for (std::size_t t = 0; t < mesh.triangles(); ++t) addFace(mesh.corners(t));
            first += static_cast<std::uint32_t>(mesh.vertices());
        }
        parts.push_back(sliceOf(std::move(list)));
    }
    parts.push_back(sliceOf(std::move(faces)));
    return files;
}

}  // namespace tessera
