#include "tests/support/Models.h"

#include <cstdlib>
#include <map>

#include "server/collision/mesh/Predicates.h"
#include "server/tools/SceneTriangles.h"

namespace tessera {

std::filesystem::path testDataFolder() {
    const char* named = std::getenv("TESSERA_TEST_DATA");
    return named ? std::filesystem::path(named) : std::filesystem::path(TESSERA_SOURCE_DIR) / ".." / "shared" / "data";
}

MeshArrays3 arraysOf(const TriangleMesh& mesh) {
    MeshArrays3 out;
    std::map<std::array<double, 3>, std::uint32_t> known;
    for (std::uint32_t f = 0; f < mesh.faceCount(); ++f)
        for (unsigned i = 0; i < 3; ++i) {
            const Vec3d& p = mesh.corner(f, i);
            const auto [at, isNew] = known.try_emplace({p.x(), p.y(), p.z()}, static_cast<std::uint32_t>(known.size()));
            if (isNew) out.positions.insert(out.positions.end(), {p.x(), p.y(), p.z()});
            out.indices.push_back(at->second);
        }
    return out;
}

TriangleMesh meshOf(const MeshArrays3& arrays) {
    Expected<TriangleMesh> mesh = TriangleMesh::make(arrays.positions, arrays.indices);
    TESSERA_CHECK(mesh.has_value(), "arrays that are no mesh");
    return std::move(*mesh);
}

Expected<TriangleMesh> loadModel(const std::filesystem::path& file) {
    ImportOptions options;
    options.importerProgram = TESSERA_BIN_DIR "/tessera-import";
    // Our own test data; what the import is confined by has tests of its own.
    options.allowUnconfined = true;
    return readTriangles(file.string(), options);
}

bool withoutArea(const Triangle& t) {
    const auto flat = [&](int x, int y) {
        return orient2d({t[0][x], t[0][y]}, {t[1][x], t[1][y]}, {t[2][x], t[2][y]}) == 0;
    };
    return flat(0, 1) && flat(1, 2) && flat(2, 0);
}

TriangleMesh normalised(const TriangleMesh& mesh) {
    const Vec3d center = mesh.bounds().center();
    const double scale = 1 / mesh.bounds().size().norm();
    MeshArrays3 all = arraysOf(mesh);
    for (std::size_t v = 0; v < all.positions.size(); ++v)
        all.positions[v] = static_cast<float>((all.positions[v] - center[static_cast<int>(v % 3)]) * scale);
    const TriangleMesh rounded = meshOf(all);
    MeshArrays3 kept = {all.positions, {}};
    for (std::uint32_t f = 0; f < rounded.faceCount(); ++f)
        if (!withoutArea(rounded.triangle(f)))
            kept.indices.insert(kept.indices.end(), &all.indices[3 * f], &all.indices[3 * f] + 3);
    // Once more through arraysOf: vertices that became one, or that no face uses any more, go.
    return meshOf(arraysOf(meshOf(kept)));
}

}  // namespace tessera
