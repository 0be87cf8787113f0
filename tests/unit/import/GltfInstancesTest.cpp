/// EXT_mesh_gpu_instancing: few places are nodes, very many are glyphs, and both stand where the file says.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "common/cores/Glyphs.h"
#include "common/drawable/Drawable.h"
#include "common/drawable/GlyphArrays.h"
#include "common/geometry/MeshCopies.h"
#include "tests/unit/import/GltfText.h"
#include "tests/unit/import/UsdFixture.h"

namespace tessera {
namespace {

struct Places {
    std::vector<float> translations, rotations, scales;
    explicit Places(std::size_t count) {
        std::mt19937 random(3);
        std::uniform_real_distribution<float> part(-1, 1), size(0.5f, 2);
        for (std::size_t i = 0; i < count; ++i) {
            translations.insert(translations.end(), {static_cast<float>(i), part(random), part(random)});
            const Eigen::Vector4f q =
                Eigen::Vector4f(part(random), part(random), part(random), part(random)).normalized();
            rotations.insert(rotations.end(), {q[0], q[1], q[2], q[3]});
            scales.insert(scales.end(), 3, size(random));
        }
    }
    [[nodiscard]] Vec3d at(std::size_t i, const Vec3d& corner) const {
        const float* const q = &rotations[4 * i];
        const float* const t = &translations[3 * i];
        return Vec3d(t[0], t[1], t[2]) +
               Quatd(q[3], q[0], q[1], q[2]).normalized() * (static_cast<double>(scales[3 * i]) * corner);
    }
};

const std::array<Vec3d, 3> kCorners = {Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(0, 2, 0)};

std::string fileOf(const Places& places) {
    GltfText file;
    const int positions = file.floats({0, 0, 0, 1, 0, 0, 0, 2, 0}, "VEC3", 3),
              translations = file.floats(places.translations, "VEC3", 3),
              rotations = file.floats(places.rotations, "VEC4", 4), scales = file.floats(places.scales, "VEC3", 3);
    return file.text(fmt::format(
        R"("extensionsUsed":["EXT_mesh_gpu_instancing"],"scenes":[{{"nodes":[0]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}}}}]}}],
        "nodes":[{{"name":"wood","mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":
        {{"TRANSLATION":{},"ROTATION":{},"SCALE":{}}}}}}}}}])",
        positions, translations, rotations, scales));
}

ImportedAspect read(const Places& places) {
    const Scratch scratch;
    Expected<ImportedScene> scene = importScene(scratch.write("wood.gltf", fileOf(places)), kRootNode, importOptions());
    EXPECT_TRUE(scene) << messageOf(scene);
    return ImportedAspect(std::move(*scene));
}

TEST(GltfInstances, AreNodesWhereTheyAreFew) {
    const Places places(50);
    const ImportedAspect scene = read(places);
    const std::vector<Vec3d> corners = shownCorners(*scene);
    ASSERT_EQ(corners.size(), 150u);
    for (std::size_t i = 0; i < corners.size(); ++i)
        EXPECT_LT((corners[i] - places.at(i / 3, kCorners[i % 3])).norm(), 1e-5) << i;
    EXPECT_TRUE(allOf<Glyphs>(scene).empty());
}

/// A few letters of a file, and a million nodes of nothing.
TEST(GltfInstances, OfNoValuesAreOne) {
    const Scratch scratch;
    GltfText file;
    const int positions = file.floats({0, 0, 0, 1, 0, 0, 0, 2, 0}, "VEC3", 3);
    std::string text = file.text(fmt::format(
        R"("extensionsUsed":["EXT_mesh_gpu_instancing"],"scenes":[{{"nodes":[0]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}}}}}]}}],
        "nodes":[{{"mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":1}}}}}}}}])",
        positions));
    const std::string last = R"("type":"VEC3"}],)";
    const std::size_t at = text.find(last);
    ASSERT_NE(at, std::string::npos);
    text.replace(at, last.size(), R"("type":"VEC3"},{"componentType":5126,"count":1000000,"type":"VEC3"}],)");
    Expected<ImportedScene> scene = importScene(scratch.write("many.gltf", text), kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(hasNote(*scene, "its 1000000 instances of no values stand at one place: one of them is shown"));
    EXPECT_EQ(scene->triangles, 1u);
}

TEST(GltfInstances, AreGlyphsWhereTheyAreVeryMany) {
    constexpr std::size_t kMany = 12'000;
    const Places places(kMany);
    const ImportedAspect scene = read(places);
    const std::vector<const Glyphs*> all = allOf<Glyphs>(scene);
    ASSERT_EQ(all.size(), 1u);
    const MeshArrays arrays = drawableOf(Object::of(*all.front())).at(kGlyphsOnScreens).arrays();
    const std::span<const float> corners = arrays.positions.as<float>();
    ASSERT_EQ(corners.size(), 9u);
    const auto copies = arrays.copies.as<MeshCopy>();
    ASSERT_EQ(copies.size(), kMany);
    for (const MeshCopy& copy : copies) {
        const Quatd turn(copy.turn[3], copy.turn[0], copy.turn[1], copy.turn[2]);
        for (std::size_t c = 0; c < 3; ++c) {
            const float* const p = &corners[3 * c];
            const Vec3d at = Vec3d(copy.place[0], copy.place[1], copy.place[2]) +
                             turn * Vec3d(copy.width * p[0], copy.length * p[1], copy.width * p[2]);
            ASSERT_LT((at - places.at(static_cast<std::size_t>(std::lround(copy.place[0])), kCorners[c])).norm(), 1e-5);
        }
    }
}

}  // namespace
}  // namespace tessera
