// Binary STL: 80 bytes of head, the number of triangles, 50 bytes for each.

#include <cstring>
#include <limits>

#include "common/export/Formats.h"
#include "common/export/LeavingBytes.h"
#include "common/export/WorldMeshes.h"

namespace tessera {

Expected<LeavingFiles> writeStl(const LeavingScene& leaving) {
    Expected<std::vector<WorldMesh>> meshes = worldMeshes(leaving);
    if (!meshes) return tl::unexpected(meshes.error());
    constexpr std::uint64_t kHead = 84, kEach = 50;
    std::uint64_t triangles = 0;
    for (const WorldMesh& mesh : *meshes) triangles += mesh.triangles();
    if (Expected<void> fits = checkFileBytes(kHead + kEach * triangles, leaving.options); !fits)
        return tl::unexpected(fits.error());
    LeavingFiles files{.files = {{.path = leaving.path, .parts = {}}}, .triangles = triangles};
    std::vector<ByteSlice>& parts = files.files.front().parts;
    std::vector<std::byte> head(kHead);
    constexpr std::string_view kTitle = "triangles in metres, Y up";  // nothing that begins with "solid"
    std::memcpy(head.data(), kTitle.data(), kTitle.size());
    const auto count = static_cast<std::uint32_t>(triangles);
    std::memcpy(head.data() + 80, &count, sizeof(count));
    parts.push_back(sliceOf(std::move(head)));
    for (const WorldMesh& mesh : *meshes) {
        if (mesh.arrays.kind != MeshKind::kTriangles) {
            leaving.notes.add("points and lines are left out", mesh.node->id);
            continue;
        }
        ++files.nodes;
        if (mesh.material) leaving.notes.add("materials and their images are left out", mesh.node->id);
        std::vector<std::byte> bytes(kEach * mesh.triangles());
        for (std::size_t t = 0; t < mesh.triangles(); ++t) {
            const std::array<std::uint32_t, 3> corners = mesh.corners(t);
            const Vec3f at[3] = {mesh.position(corners[0]), mesh.position(corners[1]), mesh.position(corners[2])};
            const Vec3f normal = faceNormal(at[0], at[1], at[2]);
            std::byte* to = bytes.data() + kEach * t;
            for (const Vec3f* vector : {&normal, &at[0], &at[1], &at[2]}) {
                std::memcpy(to, vector->data(), 3 * sizeof(float));
                to += 3 * sizeof(float);
            }
        }
        parts.push_back(sliceOf(std::move(bytes)));
    }
    return files;
}

}  // namespace tessera
