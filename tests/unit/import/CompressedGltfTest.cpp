// Compressed glTF beside its uncompressed twin, and damaged.
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "common/cores/Image.h"
#include "common/drawable/Drawable.h"
#include "common/scene/Action.h"
#include "server/import/reader/GltfCompression.h"
#include "server/import/reader/ReadScene.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Damage.h"
#include "tests/unit/import/GltfText.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

const std::string kModels = TESSERA_SOURCE_DIR "/tests/data/models/";

/// A triangle as it is shown, in world coordinates.
struct ShownTriangle {
    Vec3d middle, normal;
    Vec2d texcoord = Vec2d::Zero();  ///< of its middle, on its image
};

std::vector<ShownTriangle> shownBy(const Aspect& aspect) {
    std::vector<ShownTriangle> shown;
    Action collect;
    collect.onNode([&](const Visit& visit) {
        const Drawable drawable = drawableOf(aspect, visit.node);
        if (!drawable) return Descend::kInto;
        const MeshArrays arrays = drawable.arrays();
        const std::span<const float> xyz = arrays.positions.as<float>(), uv = arrays.texcoords.as<float>();
        const std::span<const std::uint32_t> indices = arrays.indices.as<std::uint32_t>();
        for (std::size_t t = 0; t + 2 < indices.size(); t += 3) {
            std::array<Vec3d, 3> corners;
            ShownTriangle& triangle = shown.emplace_back();
            for (std::size_t c = 0; c < 3; ++c) {
                const std::size_t v = indices[t + c];
                corners[c] = visit.world_T_node * Vec3d(xyz[3 * v], xyz[3 * v + 1], xyz[3 * v + 2]);
                if (!uv.empty()) triangle.texcoord += Vec2d(uv[2 * v], uv[2 * v + 1]) / 3;
            }
            triangle.middle = (corners[0] + corners[1] + corners[2]) / 3;
            triangle.normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        }
        return Descend::kInto;
    });
    collect.run(aspect);
    return shown;
}

/// Each triangle of the one is one of the other, as near as `error`, and turned as it is.
void expectTwins(const Aspect& one, const Aspect& other, double error, double texcoordError) {
    const std::vector<ShownTriangle> ours = shownBy(one), theirs = shownBy(other);
    ASSERT_FALSE(theirs.empty());
    ASSERT_EQ(ours.size(), theirs.size());
    using Cell = std::array<std::int64_t, 3>;
    const auto cellOf = [&](const Vec3d& p) {
        Cell cell;
        for (int i = 0; i < 3; ++i)
            cell[static_cast<std::size_t>(i)] = static_cast<std::int64_t>(std::floor(p[i] / (2 * error)));
        return cell;
    };
    std::multimap<Cell, std::size_t> at;
    for (std::size_t i = 0; i < theirs.size(); ++i) at.emplace(cellOf(theirs[i].middle), i);
    std::size_t lost = 0;
    for (const ShownTriangle& triangle : ours) {
        const Cell middle = cellOf(triangle.middle);
        auto best = at.end();
        for (int n = 0; n < 27 && best == at.end(); ++n) {
            const auto [from, to] =
                at.equal_range({middle[0] + n % 3 - 1, middle[1] + n / 3 % 3 - 1, middle[2] + n / 9 - 1});
            for (auto found = from; found != to && best == at.end(); ++found) {
                const ShownTriangle& twin = theirs[found->second];
                // Of slivers the direction means nothing.
                const bool sliver =
                    twin.normal.norm() < 4 * error * error || triangle.normal.norm() < 4 * error * error;
                if ((twin.middle - triangle.middle).norm() <= error &&
                    (sliver || twin.normal.dot(triangle.normal) > 0) &&
                    (twin.texcoord - triangle.texcoord).norm() <= texcoordError)
                    best = found;
            }
        }
        if (best == at.end())
            ++lost;
        else
            at.erase(best);
    }
    EXPECT_EQ(lost, 0u) << "of " << ours.size();
}

Expected<ImportedScene> fromFile(const std::string& path) {
    return importScene(path, kRootNode, importOptions());
}

class CompressedTwin : public testing::TestWithParam<const char*> {};

TEST_P(CompressedTwin, IsTheSame) {
    const std::string way = GetParam();
    Expected<ImportedScene> packed = fromFile(kModels + "compressed/" + way + ".glb");
    ASSERT_TRUE(packed) << messageOf(packed);
    Expected<ImportedScene> plain =
        fromFile(kModels + (way.starts_with("arm") ? "arm.glb" : "compressed/stall.plain.glb"));
    ASSERT_TRUE(plain) << messageOf(plain);
    EXPECT_EQ(packed->notes, plain->notes);
    const ImportedAspect one(std::move(*packed)), other(std::move(*plain));
    // A picture that WebP changed a little is as large as before.
    std::vector<std::pair<std::int64_t, std::int64_t>> sizes[2];
    for (const Aspect* of : {&*one, &*other})
        for (const ObjectId id : of->ids())
            if (const auto* image = of->get<Image>(id))
                sizes[of == &*other].emplace_back(image->widthPx, image->heightPx);
    EXPECT_EQ(sizes[0], sizes[1]);
    // 14 bits of a few metres, and as much again of joints' weights in 8.
    expectTwins(*one, *other, 0.02, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(OfEachWay, CompressedTwin,
                         testing::Values("arm.draco", "arm.draco-seq", "arm.meshopt", "arm.meshopt-high", "arm.quant",
                                         "stall.draco", "stall.webp"),
                         [](const auto& way) {
                             std::string name = way.param;
                             std::erase_if(name, [](char c) { return c == '-' || c == '.'; });
                             return name;
                         });

TEST(CompressedGltf, AnEngineThatOthersPackedIsTheOneTheyDidNot) {
    const std::string folder = std::string(kDebianModels) + "/glTF2/";
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is missing (Debian package assimp-testmodels)";
    Expected<ImportedScene> packed = fromFile(folder + "draco/2CylinderEngine.gltf"), plain = fromFile(kEngine);
    ASSERT_TRUE(packed) << messageOf(packed);
    ASSERT_TRUE(plain) << messageOf(plain);
    const ImportedAspect one(std::move(*packed)), other(std::move(*plain));
    const std::vector<ShownTriangle> ours = shownBy(*one), theirs = shownBy(*other);
    // Draco left out 11,160 flat triangles of 121,496: draco3dgltf 1.5 (npm) counts as many.
    EXPECT_EQ(ours.size(), 110'336u);
    EXPECT_EQ(theirs.size(), 121'496u);
    Box a, b;
    double areas = 0, ofThem = 0;
    for (const ShownTriangle& triangle : ours) a.extend(triangle.middle), areas += triangle.normal.norm();
    for (const ShownTriangle& triangle : theirs) b.extend(triangle.middle), ofThem += triangle.normal.norm();
    const double size = b.size().norm();
    EXPECT_LT((a.lower - b.lower).norm() + (a.upper - b.upper).norm(), 1e-3 * size);
    EXPECT_NEAR(areas, ofThem, 2e-3 * ofThem);
}

/// A file whose only view says that it is compressed.
std::string meshoptFile(const std::string& view) {
    return R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":)"
           R"([{"attributes":{"POSITION":0}}]}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,)"
           R"("type":"VEC3"}],"buffers":[{"uri":"data:application/octet-stream;base64,oAAAAA==","byteLength":4},)"
           R"({"byteLength":36,"extensions":{"EXT_meshopt_compression":{"fallback":true}}}],"bufferViews":[)"
           R"({"buffer":1,"byteLength":36,"extensions":{"EXT_meshopt_compression":)" +
           view + "}}]}";
}

TEST(CompressedGltf, AViewThatIsNoneIsNamed) {
    const Scratch scratch;
    const auto refused = [&](const std::string& view) {
        return messageOf(fromFile(scratch.write("bad.gltf", meshoptFile(view))));
    };
    for (const char* const view : {
             R"({"buffer":0,"byteLength":4,"byteStride":12,"count":3,"mode":"ATTRIBUTES"})",
             R"({"buffer":0,"byteLength":4,"byteStride":11,"count":3,"mode":"ATTRIBUTES"})",
             R"({"buffer":0,"byteLength":4,"byteStride":12,"count":3,"mode":"ATTRIBUTES","filter":"COLOR"})",
             R"({"buffer":0,"byteLength":4,"byteStride":12,"count":3,"mode":"ATTRIBUTES","filter":"QUATERNION"})",
             R"({"buffer":0,"byteLength":4,"byteStride":2,"count":4,"mode":"TRIANGLES"})",
             R"({"buffer":0,"byteLength":4,"byteStride":4,"count":4,"mode":"MAGIC"})",
             R"({"buffer":7,"byteLength":4,"byteStride":4,"count":4,"mode":"INDICES"})",
             R"({"buffer":0,"byteLength":5,"byteStride":4,"count":4,"mode":"INDICES"})",
             R"({"buffer":0,"byteLength":4,"byteStride":12,"count":1000000,"mode":"ATTRIBUTES"})",
         })
        EXPECT_WORDS(refused(view));
}

std::string bytesOf(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

TEST(CompressedGltf, WhatIsDamagedIsRefusedOrAScene) {
    const Scratch scratch;
    std::mt19937 random(11);
    for (const char* way : {"arm.draco", "arm.draco-seq", "arm.meshopt", "arm.meshopt-high", "stall.webp"}) {
        const std::string whole = bytesOf(kModels + "compressed/" + way + ".glb");
        ASSERT_GT(whole.size(), 1000u);
        for (int i = 0; i < 40; ++i) {
            std::string bad = whole;
            for (int k = 0; k < 1 + i % 4; ++k)
                bad[20 + random() % (bad.size() - 20)] = static_cast<char>(random() % 256);
            if (i % 8 == 7) bad.resize(random() % bad.size());
            const Expected<ImportedScene> scene = fromFile(scratch.write("bad.glb", bad));
            if (scene) continue;
            EXPECT_EQ(scene.error().message.find("signal"), std::string::npos)
                << way << ", " << i << ": " << scene.error().message;
        }
    }
}

class GltfDamage : public testing::TestWithParam<const char*> {};

/// In this process, where a sanitizer sees it.
TEST_P(GltfDamage, LeadsToASceneOrWords) {
    const Scratch scratch;
    const std::string whole = bytesOf(kModels + "compressed/arm." + GetParam() + ".glb");
    const Seeds seeds(1'000);
    std::size_t read = 0;
    for (unsigned seed = seeds.first; seed < seeds.end; ++seed) {
        SCOPED_TRACE(fmt::format("TESSERA_SEED={} build/bin/unit_import --gtest_filter=*GltfDamage*", seed));
        std::mt19937 random(seed);
        std::string bad = whole;
        for (unsigned change = 0; change < 1 + seed % 4; ++change)
            bad[20 + random() % (bad.size() - 20)] = static_cast<char>(random() % 256);
        const Expected<PlainScene> scene = readScene(scratch.write("bad.glb", bad), {});
        read += scene ? 1 : 0;
        if (scene)
            expectSoundMeshes(*scene);
        else
            EXPECT_FALSE(scene.error().message.empty());
        if (testing::Test::HasFailure()) return;
    }
    expectSomeRead(read, seeds);
}

INSTANTIATE_TEST_SUITE_P(Of, GltfDamage, testing::Values("meshopt", "meshopt-high"), [](const auto& test) {
    std::string name = test.param;
    std::ranges::replace(name, '-', '_');
    return name;
});

TEST(CompressedGltf, WhatDracoCannotDecodeIsItsTwinInTheFile) {
    const Scratch scratch;
    GltfText text;
    const int places = text.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
    const auto file = [&](const char* attributes) {
        return text.text(fmt::format(R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{)"
                                     R"("attributes":{{{}}},"extensions":{{"KHR_draco_mesh_compression":{{)"
                                     R"("bufferView":0,"attributes":{{"POSITION":0}}}}}}}}]}}])",
                                     attributes));
    };
    const Expected<ImportedScene> twin =
        fromFile(scratch.write("twin.gltf", file(fmt::format(R"("POSITION":{})", places).c_str())));
    ASSERT_TRUE(twin) << messageOf(twin);
    ASSERT_EQ(twin->notes.size(), 1u);
    EXPECT_WORDS(twin->notes[0]);
}

/// A triangle ten times as large as its twin, and places alone.
std::vector<std::uint8_t> packedTriangle() {
    draco::TriangleSoupMeshBuilder builder;
    builder.Start(1);
    const int places = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
    const std::array<std::array<float, 3>, 3> corners = {{{0, 0, 0}, {10, 0, 0}, {0, 10, 0}}};
    builder.SetAttributeValuesForFace(places, draco::FaceIndex(0), corners[0].data(), corners[1].data(),
                                      corners[2].data());
    const std::unique_ptr<draco::Mesh> mesh = builder.Finalize();
    draco::EncoderBuffer bytes;
    draco::Encoder encoder;
    EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &bytes).ok());
    return {bytes.data(), bytes.data() + bytes.size()};
}

TEST(CompressedGltf, WhatDracoDecodesInPartIsItsTwinInWhole) {
    const Scratch scratch;
    const auto sizeOf = [&](const char* attributes) {
        GltfText text;
        const int packed = text.add(packedTriangle(), 5121, "SCALAR", 1);
        const int places = text.floats({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
        const int normals = text.floats({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3", 3);
        Expected<ImportedScene> scene = fromFile(scratch.write(
            "part.gltf",
            text.text(fmt::format(R"("scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{)"
                                  R"("attributes":{{"POSITION":{},"NORMAL":{}}},"extensions":{{)"
                                  R"("KHR_draco_mesh_compression":{{"bufferView":{},"attributes":{}}}}}}}]}}])",
                                  places, normals, packed, attributes))));
        EXPECT_TRUE(scene) << messageOf(scene);
        const ImportedAspect aspect(std::move(*scene));
        const std::vector<ShownTriangle> shown = shownBy(*aspect);
        EXPECT_EQ(shown.size(), 1u);
        return shown.empty() ? 0 : shown[0].normal.norm();
    };
    EXPECT_NEAR(sizeOf(R"({"POSITION":0})"), 100, 1e-6);
    // Places come before what is not there in no order of names, so both are tried.
    EXPECT_NEAR(sizeOf(R"({"NORMAL":9,"POSITION":0})"), 1, 1e-6);
    EXPECT_NEAR(sizeOf(R"({"POSITION":9,"NORMAL":0})"), 1, 1e-6);
}

}  // namespace
}  // namespace tessera
