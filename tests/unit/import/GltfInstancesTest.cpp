/// EXT_mesh_gpu_instancing: few places are nodes, very many are glyphs, and both stand where the file says.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "common/cores/Glyphs.h"
#include "common/drawable/Drawable.h"
#include "common/drawable/GlyphArrays.h"
#include "common/geometry/MeshCopies.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/GltfText.h"
#include "tests/unit/import/UsdFixture.h"

namespace tessera {
namespace {

struct Places {
    std::vector<float> translations, rotations, scales;
    explicit Places(std::size_t count, bool odd = false) {
        std::mt19937 random(3);
        std::uniform_real_distribution<float> part(-1, 1), size(0.5f, 2);
        for (std::size_t i = 0; i < count; ++i) {
            translations.insert(translations.end(), {static_cast<float>(i), part(random), part(random)});
            const Eigen::Vector4f q =
                Eigen::Vector4f(part(random), part(random), part(random), part(random)).normalized();
            rotations.insert(rotations.end(), {q[0], q[1], q[2], q[3]});
            scales.insert(scales.end(), 3, size(random));
            if (!odd) continue;
            scales[3 * i + i % 3] = size(random);
            // As a matrix in single precision has it, of a turn.
            scales[3 * i + (i + 1) % 3] = std::nextafter(scales[3 * i + (i + 1) % 3], i % 2 == 0 ? 3.0f : 0.0f);
            for (std::size_t axis = 0; axis < 3; ++axis)
                if (i >> axis & 1) scales[3 * i + axis] *= -1;
        }
    }
    [[nodiscard]] Vec3d scale(std::size_t i) const { return {scales[3 * i], scales[3 * i + 1], scales[3 * i + 2]}; }
    [[nodiscard]] Vec3d at(std::size_t i, const Vec3d& corner) const {
        const float* const q = &rotations[4 * i];
        const float* const t = &translations[3 * i];
        return Vec3d(t[0], t[1], t[2]) + Quatd(q[3], q[0], q[1], q[2]).normalized() * scale(i).cwiseProduct(corner);
    }
};

const std::array<Vec3d, 3> kCorners = {Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(0, 2, 0)};

/// `color` of all vertices; `colors` of all places.
std::string fileOf(const Places& places, const std::vector<float>& color = {}, const std::vector<float>& colors = {}) {
    GltfText file;
    std::string attributes, ofPlaces;
    if (!color.empty()) attributes = fmt::format(R"(,"COLOR_0":{})", file.floats(color, "VEC4", 4));
    if (!colors.empty()) ofPlaces = fmt::format(R"(,"_COLOR_0":{})", file.floats(colors, "VEC3", 3));
    const int positions = file.floats({0, 0, 0, 1, 0, 0, 0, 2, 0}, "VEC3", 3),
              translations = file.floats(places.translations, "VEC3", 3),
              rotations = file.floats(places.rotations, "VEC4", 4), scales = file.floats(places.scales, "VEC3", 3);
    return file.text(fmt::format(
        R"("extensionsUsed":["EXT_mesh_gpu_instancing"],"scenes":[{{"nodes":[0]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{}{}}}}}]}}],
        "nodes":[{{"name":"wood","mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":
        {{"TRANSLATION":{},"ROTATION":{},"SCALE":{}{}}}}}}}}}])",
        positions, attributes, translations, rotations, scales, ofPlaces));
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
    EXPECT_WORDS(notesIn(*scene));
    EXPECT_EQ(scene->triangles, 1u);
}

/// Each corner where the file's formula puts it, and faces outwards as its mirror has them.
void expectStanding(const std::vector<const Glyphs*>& all, const Places& places, std::size_t count) {
    std::size_t seen = 0;
    for (const Glyphs* glyphs : all) {
        const MeshArrays arrays = drawableOf(Object::of(*glyphs)).at(kGlyphsOnScreens).arrays();
        const std::span<const float> corners = arrays.positions.as<float>();
        ASSERT_EQ(corners.size(), 9u);
        const std::span<const std::uint32_t> order = arrays.indices.as<std::uint32_t>();
        for (const MeshCopy& copy : arrays.copies.as<MeshCopy>()) {
            ++seen;
            const Quatd turn(copy.turn[3], copy.turn[0], copy.turn[1], copy.turn[2]);
            const auto i = static_cast<std::size_t>(std::lround(copy.place[0]));
            std::array<Vec3d, 3> shown, named;
            for (std::size_t c = 0; c < 3; ++c) {
                const float* const p = &corners[3 * c];
                shown[c] = Vec3d(copy.place[0], copy.place[1], copy.place[2]) +
                           turn * Vec3d(copy.width * p[0], copy.length * p[1], copy.width * p[2]);
                named[c] = places.at(i, kCorners[c]);
                ASSERT_LT((shown[c] - named[c]).norm(), 1e-5) << i;
            }
            const auto normal = [](const Vec3d& a, const Vec3d& b, const Vec3d& c) {
                return Vec3d((b - a).cross(c - a).normalized());
            };
            const double mirror = places.scale(i).prod() < 0 ? -1 : 1;
            ASSERT_GT(normal(shown[order[0]], shown[order[1]], shown[order[2]])
                          .dot(mirror * normal(named[0], named[1], named[2])),
                      0.999)
                << i;
        }
    }
    EXPECT_EQ(seen, count);
}

TEST(GltfInstances, AreGlyphsWhereTheyAreVeryMany) {
    const Places places(12'000);
    const ImportedAspect scene = read(places);
    EXPECT_EQ(allOf<Glyphs>(scene).size(), 1u);
    expectStanding(allOf<Glyphs>(scene), places, 12'000);
}

TEST(GltfInstances, OfAnyTwoScalesAndAnySignsAreGlyphs) {
    const Places places(12'000, true);
    const ImportedAspect scene = read(places);
    EXPECT_EQ(allOf<Glyphs>(scene).size(), 6u);
    EXPECT_TRUE(allOf<Geometry>(scene).empty());
    expectStanding(allOf<Glyphs>(scene), places, 12'000);
}

TEST(GltfInstances, InColoursAreGlyphsHoweverFew) {
    const Places places(3);
    const Scratch scratch;
    // As light, of bytes: half is 188, and half of that 138.
    Expected<ImportedScene> read =
        importScene(scratch.write("wood.gltf", fileOf(places, {0.5f, 1, 0, 1, 0.5f, 1, 0, 1, 0.5f, 1, 0, 1},
                                                      {0.5f, 1, 1, 1, 0.25f, 1, 0, 0, 0})),
                    kRootNode, importOptions());
    ASSERT_TRUE(read) << messageOf(read);
    const ImportedAspect scene(std::move(*read));
    const std::vector<const Glyphs*> all = allOf<Glyphs>(scene);
    ASSERT_EQ(all.size(), 1u);
    const std::span<const std::uint8_t> colors = all.front()->colors.as<std::uint8_t>();
    EXPECT_EQ(std::vector<std::uint8_t>(colors.begin(), colors.end()),
              (std::vector<std::uint8_t>{138, 255, 0, 255, 188, 137, 0, 255, 0, 0, 0, 255}));
    expectStanding(all, places, 3);
}

/// What cannot be glyphs is as many nodes as the file's bytes bear, and says why.
TEST(GltfInstances, ThatAreNodesSayWhy) {
    const Places places(12'000);
    const Scratch scratch;
    const Expected<ImportedScene> read = importScene(
        scratch.write("wood.gltf", fileOf(places, {1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1})), kRootNode, importOptions());
    ASSERT_TRUE(read) << messageOf(read);
    EXPECT_WORDS(notesIn(*read));
    EXPECT_EQ(read->triangles, 12'000u);
}

/// One accessor of few bytes, which many nodes name; and many meshes.
TEST(GltfInstances, OfFewSparseBytesAreBounded) {
    const auto sparse = [](GltfText& file, std::size_t count, const std::string& nodes) {
        const int positions = file.floats({0, 0, 0, 1, 0, 0, 0, 2, 0}, "VEC3", 3);
        std::string text = file.text(nodes);
        const std::string last = R"("type":"VEC3"}],)", first = R"("bufferView":0,)";
        EXPECT_EQ(positions, 0);
        const std::size_t at = text.find(last);
        EXPECT_NE(at, std::string::npos);
        return text.replace(
            at, last.size(),
            fmt::format(R"("type":"VEC3"}},{{"componentType":5126,"count":{},"type":"VEC3","sparse":{{"count":1,
            "indices":{{"bufferView":0,"componentType":5125}},"values":{{"bufferView":0}}}}}}],)",
                        count));
    };
    const auto refused = [](const std::string& text) {
        const Scratch scratch;
        const Expected<ImportedScene> read = importScene(scratch.write("many.gltf", text), kRootNode, importOptions());
        EXPECT_FALSE(read);
        return read ? std::string() : read.error().message;
    };
    std::string nodes, numbers, primitives;
    for (int i = 0; i < 50; ++i) {
        nodes += fmt::format(
            R"({}{{"mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":1}}}}}}}})",
            i ? "," : "", i);
        numbers += fmt::format("{}{}", i ? "," : "", i);
        primitives += fmt::format(R"({}{{"attributes":{{"POSITION":1}}}})", i ? "," : "");
    }
    GltfText places, meshes;
    EXPECT_WORDS(refused(sparse(places, 100'000,
                                fmt::format(R"("extensionsUsed":["EXT_mesh_gpu_instancing"],"scenes":[{{"nodes":[{}]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],"nodes":[{}])",
                                            numbers, nodes))));
    EXPECT_WORDS(refused(sparse(meshes, 300'000,
                                fmt::format(R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{}]}}])",
                                            primitives))));
}

TEST(GltfInstances, OfManyPartsAreBoundedByTheFile) {
    GltfText file;
    const int positions = file.floats({0, 0, 0, 1, 0, 0, 0, 2, 0}, "VEC3", 3),
              colors = file.floats({1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1}, "VEC4", 4),
              places = file.add(std::vector<std::int8_t>(40'000), 5120, "VEC3", 10'000, R"(,"byteStride":4)");
    std::string parts;
    for (int i = 0; i < 40; ++i)
        parts += fmt::format(R"({}{{"attributes":{{"POSITION":{},"COLOR_0":{}}}}})", i ? "," : "", positions, colors);
    const Scratch scratch;
    const Expected<ImportedScene> read = importScene(
        scratch.write("many.gltf", file.text(fmt::format(
                                       R"("extensionsUsed":["EXT_mesh_gpu_instancing"],"scenes":[{{"nodes":[0]}}],
        "meshes":[{{"primitives":[{}]}}],
        "nodes":[{{"mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":{}}}}}}}}}])",
                                       parts, places))),
        kRootNode, importOptions());
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::kLimit);
    EXPECT_WORDS(read.error().message);
}

}  // namespace
}  // namespace tessera
