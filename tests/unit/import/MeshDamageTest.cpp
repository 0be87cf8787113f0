/// OBJ, STL and PLY with bytes that are others: a scene that is sound, or words. In this process, where a sanitizer
/// sees it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/import/reader/ReadScene.h"
#include "tests/unit/import/Damage.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

template <typename Number>
void appendNumber(std::string& bytes, Number number) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
}

std::string magicsStl() {
    std::string bytes = "COLOR=\x10\x20\x30\xff";
    bytes.resize(80, ' ');
    appendNumber(bytes, std::uint32_t{4});
    for (int facet = 0; facet < 4; ++facet) {
        for (int i = 0; i < 12; ++i) appendNumber(bytes, static_cast<float>((facet * 7 + i * 3) % 5));
        appendNumber(bytes, static_cast<std::uint16_t>(facet * 9000));
    }
    return bytes;
}

std::string mixedPly() {
    std::string bytes =
        "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty double y\nproperty short "
        "z\nproperty uchar red\nproperty ushort green\nproperty float nx\nelement face 3\nproperty list uchar uint "
        "vertex_indices\nproperty list uchar float texcoord\nelement edge 1\nproperty int one\nend_header\n";
    for (int v = 0; v < 4; ++v) {
        appendNumber(bytes, static_cast<float>(v % 2));
        appendNumber(bytes, static_cast<double>(v / 2));
        appendNumber(bytes, static_cast<std::int16_t>(v));
        appendNumber(bytes, std::uint8_t{200});
        appendNumber(bytes, std::uint16_t{40000});
        appendNumber(bytes, 1.0f);
    }
    for (const std::vector<std::uint32_t>& face : {std::vector<std::uint32_t>{0, 1, 2}, {1, 3, 2, 0}, {2, 3}}) {
        appendNumber(bytes, static_cast<std::uint8_t>(face.size()));
        for (const std::uint32_t corner : face) appendNumber(bytes, corner);
        appendNumber(bytes, static_cast<std::uint8_t>(2 * face.size()));
        for (std::size_t i = 0; i < 2 * face.size(); ++i) appendNumber(bytes, 0.25f);
    }
    appendNumber(bytes, 7);
    return bytes;
}

const std::vector<std::pair<std::string, std::string>> kWhole = {
    {"a.obj",
     "# all kinds\no one\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0 0.5 0 1\nv 0 1 0 2\nv 2 2 2\nvt 0 0\nvt 1 0.5 0\nvn 0 0 1\n"
     "f 1/1/1 2/2/1 3//1\nf -5 -4 -3 -2\ng two words\nf 1 2 3 4 \\\n 5\nl 1 2 3\np 1 2\ns off\nusemtl gold\nf 1/1 2/2 "
     "3/1\nf 1 2\n"},
    {"a.stl",
     "solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1e0 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
     "endsolid one\nsolid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 5\nvertex 1 0 5\nvertex 0 1 5\nendloop\n"
     "endfacet\nendsolid\n"},
    {"b.stl", magicsStl()},
    {"a.ply",
     "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar "
     "red\nproperty float u\nelement face 3\nproperty list uchar int vertex_indices\nend_header\n0 0 0 1 0.5\n1 0 0 2 "
     "1\n0 1 0 255 0\n1 1 1 0 0\n3 0 1 2\n4 0 1 3 2\n2 0 1\n"},
    {"b.ply", mixedPly()},
};

Expected<PlainScene> readByOurs(const std::string& path) {
    return path.ends_with(".obj") ? readObj(path, {}) : path.ends_with(".stl") ? readStl(path, {}) : readPly(path, {});
}

TEST(MeshDamageOfNone, IsWhatWasWritten) {
    const Scratch scratch;
    for (const auto& [name, bytes] : kWhole) {
        const Expected<PlainScene> scene = readByOurs(scratch.write(name, bytes));
        ASSERT_TRUE(scene) << name << ": " << scene.error().message;
        EXPECT_FALSE(scene->file.mesh().empty()) << name;
        expectSoundMeshes(*scene);
    }
}

class MeshDamage : public testing::TestWithParam<std::pair<std::string, std::string>> {};

TEST_P(MeshDamage, LeadsToASceneOrWords) {
    const auto& [name, bytes] = GetParam();
    const Scratch scratch;
    const Seeds seeds;
    for (unsigned seed = seeds.first; seed < seeds.end; ++seed) {
        SCOPED_TRACE(fmt::format("TESSERA_SEED={} build/bin/unit_import --gtest_filter=*MeshDamage.Leads*", seed));
        constexpr std::string_view kLetters = "0123456789-+.eE/ \n\r\t#\\vnflpgosx";
        const Expected<PlainScene> scene = readByOurs(scratch.write(name, damaged(bytes, kLetters, seed)));
        if (scene)
            expectSoundMeshes(*scene);
        else
            EXPECT_FALSE(scene.error().message.empty());
        if (testing::Test::HasFailure()) return;
    }
}

INSTANTIATE_TEST_SUITE_P(Of, MeshDamage, testing::ValuesIn(kWhole), [](const auto& test) {
    std::string name = test.param.first;
    name[1] = '_';
    return name;
});

}  // namespace
}  // namespace tessera
