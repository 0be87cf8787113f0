// Files that lie, lead elsewhere, or never end. Each gives one clear error or a scene, and the importer lives on.

#include <fmt/format.h>
#include <sys/stat.h>

#include <chrono>

#include "common/cores/Material.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

Expected<ImportedScene> import(const std::string& path) {
    return importScene(path, kRootNode, importOptions());
}

std::string gltf(const std::string& bufferUri, std::size_t bytes = 36) {
    return fmt::format(R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
      "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
      "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}}],
      "bufferViews":[{{"buffer":0,"byteLength":{0}}}],"buffers":[{{"uri":"{1}","byteLength":{0}}}]}})",
                       bytes, bufferUri);
}

void expectError(const std::string& path, ErrorCode code) {
    const Expected<ImportedScene> scene = import(path);
    ASSERT_FALSE(scene) << path << " was imported";
    EXPECT_EQ(static_cast<int>(scene.error().code), static_cast<int>(code)) << scene.error().message;
    EXPECT_WORDS(scene.error().message);
    EXPECT_EQ(scene.error().message.compare(0, path.size(), path), 0)
        << "names the file first: " << scene.error().message;
}

TEST(HostileFile, ThatIsNoOrdinaryFileIsNotOpened) {
    const Scratch scratch;
    expectError(scratch.path("none.glb"), ErrorCode::kNotFound);
    expectError(scratch.write("empty.glb", ""), ErrorCode::kBadInput);
    std::filesystem::create_directory(scratch.path("folder.glb"));
    expectError(scratch.path("folder.glb"), ErrorCode::kBadInput);
    ASSERT_EQ(::mkfifo(scratch.path("pipe.glb").c_str(), 0600), 0);
    expectError(scratch.path("pipe.glb"), ErrorCode::kBadInput);
    expectError("/dev/zero", ErrorCode::kBadInput);
    std::filesystem::create_symlink(scratch.path("loop.obj"), scratch.path("loop.obj"));
    expectError(scratch.path("loop.obj"), ErrorCode::kBadInput);
}

TEST(HostileFile, BesideAModelIsNeverWaitedFor) {
    const Scratch scratch;
    ASSERT_EQ(::mkfifo(scratch.path("pipe.mtl").c_str(), 0600), 0);
    ASSERT_EQ(::mkfifo(scratch.path("pipe.png").c_str(), 0600), 0);
    ASSERT_EQ(::mkfifo(scratch.path("pipe.bin").c_str(), 0600), 0);
    ASSERT_EQ(::mkfifo(scratch.path("pipe.raw").c_str(), 0600), 0);
    ImportOptions options = importOptions();
    // Nobody ever opens the other ends: who waited would wait for ever.
    options.deadline = std::chrono::seconds(20);
    const auto said = [&](const std::string& path) {
        const Expected<ImportedScene> scene = importScene(path, kRootNode, options);
        std::string all = scene ? "" : scene.error().message;
        if (scene)
            for (const std::string& note : scene->notes) all += note + "; ";
        return all;
    };
    const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    scratch.write("good.mtl", "newmtl a\nmap_Kd pipe.png\n");
    for (const std::string& path :
         {scratch.write("library.obj", "mtllib pipe.mtl\nusemtl a\n" + triangle),
          scratch.write("picture.obj", "mtllib good.mtl\nusemtl a\n" + triangle),
          scratch.write("buffer.gltf", gltf("pipe.bin")),
          scratch.write("field.mhd",
                        "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = pipe.raw\n"),
          scratch.write("image.tsct", R"(image { name: "i" uri: "pipe.png" } node { sphere { radius: 1 } })")})
        EXPECT_WORDS(said(path)) << path;
}

TEST(HostileFile, ThatIsTooLargeOrUnreadableSaysSo) {
    const Scratch scratch;
    const std::string large = scratch.path("large.obj");
    std::ofstream(large).put('#');
    std::filesystem::resize_file(large, std::uintmax_t{3} << 30);  // sparse: takes no room
    expectError(large, ErrorCode::kLimit);
    // Its sentence is a list of all formats.
    const Expected<ImportedScene> what = import(scratch.write("what.xyz123", "?"));
    ASSERT_FALSE(what);
    EXPECT_EQ(what.error().code, ErrorCode::kUnsupported);
    for (const char* part : {"'.xyz123'", ".3ds", ".blend", ".dae", ".fbx", ".glb", ".mhd", ".nrrd", ".ply", ".stl",
                             ".tsct", "tessera-check --formats"})
        EXPECT_NE(what.error().message.find(part), std::string::npos) << what.error().message;
    expectError(scratch.write("word.obj", "v 0 0 0\nv 1 0 zero\nv 0 1 0\nf 1 2 3\n"), ErrorCode::kBadInput);
    expectError(scratch.write("two.obj", "v 0 0 0\n# two\nv 1 0\nv 0 1 0\nf 1 2 3\n"), ErrorCode::kBadInput);
    if (::geteuid() == 0) return;  // root reads everything
    const std::string secret = scratch.write("secret.glb", "glTF");
    std::filesystem::permissions(secret, std::filesystem::perms::none);
    const Expected<ImportedScene> shut = import(secret);
    ASSERT_FALSE(shut);
    EXPECT_EQ(shut.error().code, ErrorCode::kBadInput) << shut.error().message;
    EXPECT_NE(shut.error().message.find("Permission denied"), std::string::npos) << shut.error().message;
}

TEST(HostileGltf, CannotReadOutsideOfItsFolder) {
    const Scratch scratch;
    scratch.write("secret.bin", std::string(36, 'x'));
    expectError(scratch.write("in/up.gltf", gltf("../secret.bin")), ErrorCode::kBadInput);
    expectError(scratch.write("in/passwd.gltf", gltf("../../../../../../../etc/passwd")), ErrorCode::kBadInput);
    expectError(scratch.write("in/absolute.gltf", gltf("/etc/passwd")), ErrorCode::kBadInput);
    std::filesystem::create_symlink(scratch.path("secret.bin"), scratch.path("in/link.bin"));
    expectError(scratch.write("in/link.gltf", gltf("link.bin")), ErrorCode::kBadInput);
    ASSERT_EQ(::mkfifo(scratch.path("in/pipe.bin").c_str(), 0600), 0);
    expectError(scratch.write("in/pipe.gltf", gltf("pipe.bin")), ErrorCode::kBadInput);
    // The same file inside of the folder is read.
    scratch.write("in/good.bin", std::string(36, '\0'));
    EXPECT_TRUE(import(scratch.write("in/good.gltf", gltf("good.bin"))));
}

TEST(HostileFiles, APathThatWasLookedAtIsNotLookedAtAgain) {
    const Scratch scratch;
    const std::string file = scratch.write("scene.tsct", "node { box { size { x: 1 y: 1 z: 1 } } }\n");
    const std::string link = scratch.path("link.tsct");
    std::filesystem::create_symlink(file, link);
    ImportOptions options = importOptions();
    EXPECT_TRUE(importScene(link, kRootNode, options)) << "whoever owns the server may name a link";
    // Of an application's path the server has found where it leads; a link there came later.
    options.resolved = true;
    EXPECT_TRUE(importScene(file, kRootNode, options));
    const Expected<ImportedScene> swapped = importScene(link, kRootNode, options);
    ASSERT_FALSE(swapped);
    EXPECT_EQ(swapped.error().code, ErrorCode::kRefused);
    EXPECT_WORDS(swapped.error().message);
}

TEST(HostileGltf, NestedDeeplyIsRefused) {
    const Scratch scratch;
    const int levels = 100'000;
    // Deep JSON ends the reader's stack.
    std::string json = R"({"asset":{"version":"2.0","extras":)";
    for (int i = 0; i < levels; ++i) json += R"({"a":)";
    json += "1" + std::string(levels, '}') + "}}";
    const Expected<ImportedScene> deepJson = import(scratch.write("json.gltf", json));
    ASSERT_FALSE(deepJson);
    EXPECT_EQ(deepJson.error().code, ErrorCode::kBadInput) << deepJson.error().message;
    // Deep nodes in flat JSON.
    std::string chain = R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[)";
    for (int i = 1; i < levels; ++i) chain += fmt::format(R"({{"children":[{}]}},)", i);
    expectError(scratch.write("chain.gltf", chain + "{}]}"), ErrorCode::kLimit);
    expectError(
        scratch.write(
            "cycle.gltf",
            R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"children":[1]},{"children":[0]}]})"),
        ErrorCode::kBadInput);
}

TEST(HostileGltf, CountsThatAskForMemoryAreRefused) {
    const Scratch scratch;
    const std::string before = R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
                               R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"accessors":[{)";
    expectError(scratch.write("zeros.gltf", before + R"("componentType":5126,"count":4000000000,"type":"VEC3"}]})"),
                ErrorCode::kLimit);
    expectError(scratch.write("past.gltf", before +
                                               R"("bufferView":0,"componentType":5126,"count":1000000,"type":"VEC3"}],
                "bufferViews":[{"buffer":0,"byteLength":12}],
        "buffers":[{"byteLength":12,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAA"}]})"),
                ErrorCode::kBadInput);
    if (kSanitized) return;  // the sanitizers' own memory is beyond any limit
    // 60 million vertices of nothing fit the element limit, but not the file's bytes.
    expectError(scratch.write("none.gltf", before + R"("componentType":5126,"count":60000000,"type":"VEC3"}]})"),
                ErrorCode::kLimit);
    // Ten million do, and not the memory.
    ImportOptions small = importOptions();
    small.maxMemoryBytes = std::size_t{200} << 20;
    const std::string bomb =
        scratch.write("bomb.gltf", before + R"("componentType":5126,"count":10000000,"type":"VEC3"}]})");
    const Expected<ImportedScene> scene = importScene(bomb, kRootNode, small);
    ASSERT_FALSE(scene);
    EXPECT_EQ(scene.error().message,
              bomb + ": it needs more than 200 MiB of memory to read: --import-memory gives it more");
    EXPECT_EQ(scene.error().code, ErrorCode::kLimit);
}

TEST(HostileGltf, TruncatedAnywhereIsAnErrorAndNeverACrashOfOurs) {
    if (!std::filesystem::exists(kEngine)) GTEST_SKIP() << kEngine << " is missing (Debian package assimp-testmodels)";
    std::ifstream in(kEngine, std::ios::binary);
    const std::string whole((std::istreambuf_iterator<char>(in)), {});
    const Scratch scratch;
    for (const std::size_t length : {1u, 3u, 4u, 11u, 12u, 19u, 20u, 21u, 1000u, 20'000u, 100'000u, 900'000u}) {
        const Expected<ImportedScene> scene =
            import(scratch.write("cut.glb", std::string_view(whole).substr(0, length)));
        ASSERT_FALSE(scene) << length;
        EXPECT_WORDS(scene.error().message);
    }
}

TEST(HostileScene, DefinitionsThatMultiplyAreCounted) {
    const Scratch scratch;
    std::string laughs = R"(definition { name: "d0" node { sphere { radius: 1 } } })";
    for (int i = 1; i < 30; ++i)
        laughs +=
            fmt::format("definition {{ name: \"d{}\" node {{ instance: \"d{}\" }} node {{ instance: \"d{}\" }} }}\n", i,
                        i - 1, i - 1);
    expectError(scratch.write("laughs.tsct", laughs + "node { instance: \"d29\" }"), ErrorCode::kLimit);
    expectError(scratch.write("self.tsct", R"(definition { name: "d" node { instance: "d" } } node { instance: "d" })"),
                ErrorCode::kLimit);
    expectError(
        scratch.write("rows.tsct", R"(node { repeat { count: 4000000000 } node { repeat { count: 4000000000 } } })"),
        ErrorCode::kLimit);
}

TEST(HostileScene, ThatImportsItselfIsRefused) {
    const Scratch scratch;
    const std::string path = scratch.write("a.tsct", R"(node { import { uri: "b.tsct" } })");
    scratch.write("b.tsct", R"(node { import { uri: "a.tsct" } })");
    const Expected<ImportedScene> scene = import(path);
    ASSERT_FALSE(scene);
    EXPECT_WORDS(scene.error().message);
}

TEST(HostileScene, DeepTextIsRefused) {
    const Scratch scratch;
    std::string deep;
    for (int i = 0; i < 100'000; ++i) deep += "node {";
    const Expected<ImportedScene> scene = import(scratch.write("deep.tsct", deep + std::string(100'000, '}')));
    ASSERT_FALSE(scene);
    EXPECT_WORDS(scene.error().message);
}

TEST(HostileScene, BinaryGarbageAndEmptyMessageBombsAreRefused) {
    const Scratch scratch;
    expectError(scratch.write("noise.tsc", "\x7f\x45\x4c\x46 this is no scene"), ErrorCode::kBadInput);
    // 10 MiB of empty nodes would be a gigabyte of objects.
    std::string bomb;
    for (int i = 0; i < 9'000'000; ++i) bomb.append("\x32\x00", 2);
    expectError(scratch.write("bomb.tsc", bomb), ErrorCode::kLimit);
    // Nodes in nodes in nodes.
    std::string deep;
    for (int i = 0; i < 2000; ++i) {
        std::string outer = "\xc2\x02";  // field 40, length-delimited
        for (std::size_t length = deep.size();; length >>= 7) {
            outer.push_back(static_cast<char>((length & 0x7f) | (length > 0x7f ? 0x80 : 0)));
            if (length <= 0x7f) break;
        }
        deep = outer + deep;
    }
    std::string file = "\x32";
    for (std::size_t length = deep.size();; length >>= 7) {
        file.push_back(static_cast<char>((length & 0x7f) | (length > 0x7f ? 0x80 : 0)));
        if (length <= 0x7f) break;
    }
    expectError(scratch.write("deep.tsc", file + deep), ErrorCode::kLimit);
}

TEST(HostileObj, HasAMaterialFileElsewhere) {
    const Scratch scratch;
    scratch.write("out.mtl", "newmtl m\nKd 1 0 0\n");
    // A material library outside of the folder is not there, the model itself is.
    const Expected<ImportedScene> scene =
        import(scratch.write("in/model.obj", "mtllib ../out.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect{ImportedScene(*scene)};
    for (const ObjectId id : aspect->ids()) {
        const auto* material = aspect->get<Material>(id);
        EXPECT_TRUE(material == nullptr || material->baseColor.x() != 1.0f);
    }
}

TEST(HostilePly, ThatPromisesBillionsOrEndsTheReaderIsAnError) {
    const Scratch scratch;
    const std::string begin = "ply\nformat ascii 1.0\n";
    const std::string vertex = "property float x\nproperty float y\nproperty float z\n";
    const std::string texts[] = {
        begin + "element vertex 4294967295\n" + vertex + "end_header\n0 0",
        begin + "element vertex -1\n" + vertex +
            "element face 1\nproperty list uchar int vertex_indices\nend_header\n3 0 1 2\n",
        begin + "element vertex 3\n" + vertex +
            "element face 1\nproperty list uint int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n4294967295 0 1 "
            "2\n",
        begin + "element vertex 1\n" + vertex +
            "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n3 0 7 9\n",
        "ply\nformat binary_little_endian 1.0\nelement vertex 100000000\n" + vertex + "end_header\nxx",
        "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n3 0 1 2\n",
        "ply\n" + std::string(100'000, 'x'),
        "ply\nformat ascii 1.0\nelement vertex 3\nend_header\n"};
    int number = 0;
    for (const std::string& text : texts) {
        const std::string path = scratch.write(fmt::format("{}.ply", number++), text);
        const Expected<ImportedScene> scene = import(path);
        ASSERT_FALSE(scene) << path;
        EXPECT_EQ(scene.error().message.compare(0, path.size() + 2, path + ": "), 0) << scene.error().message;
    }
}

TEST(HostileImage, BombsAndDamagedOnesAreLeftOutWithANote) {
    const Scratch scratch;
    // A PNG that promises 60,000 × 60,000 pixels.
    const std::string png("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\xea\x60\0\0\xea\x60\x08\x06\0\0\0\0\0\0\0", 33);
    scratch.write("bomb.png", png);
    const std::string scene = R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],
      "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"textures":[{"source":0}],
      "images":[{"uri":"bomb.png"}],
      "accessors":[{"componentType":5126,"count":3,"type":"VEC3"}]})";
    const Expected<ImportedScene> imported = import(scratch.write("bomb.gltf", scene));
    ASSERT_TRUE(imported) << messageOf(imported);
    ASSERT_FALSE(imported->notes.empty());
    EXPECT_WORDS(imported->notes.front());
}

/// A glTF of one triangle with a WebP picture.
std::string pictured(const std::string& uri) {
    return fmt::format(
        R"({{"asset":{{"version":"2.0"}},"extensionsUsed":["EXT_texture_webp"],"scene":0,"scenes":[{{"nodes":[0]}}],)"
        R"("nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},)"
        R"("material":0}}]}}],"materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],)"
        R"("textures":[{{"extensions":{{"EXT_texture_webp":{{"source":0}}}}}}],"images":[{{"uri":"{}",)"
        R"("mimeType":"image/webp"}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",)"
        R"("min":[0,0,0],"max":[0,0,0]}},{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC2"}}],)"
        R"("bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36,"uri":)"
        R"("data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"}}]}})",
        uri);
}

/// A lossless WebP of one colour, whose pixels take no bits ("Specification for WebP Lossless Bitstream", 2023).
std::string plainWebp(std::uint32_t width, std::uint32_t height) {
    std::string bits;
    const auto put = [&](std::uint32_t value, int count) {
        for (int i = 0; i < count; ++i) bits.push_back(static_cast<char>(value >> i & 1));
    };
    put(width - 1, 14);
    put(height - 1, 14);
    put(0, 1 + 3 + 1 + 1 + 1);                       // no alpha, version, no transform, no cache, one group
    for (int code = 0; code < 5; ++code) put(1, 4);  // simple, of one symbol of one bit, which is 0
    std::string data = "\x2f";
    for (std::size_t at = 0; at < bits.size(); at += 8) {
        int byte = 0;
        for (std::size_t i = at; i < std::min(at + 8, bits.size()); ++i) byte |= bits[i] << (i - at);
        data.push_back(static_cast<char>(byte));
    }
    data += std::string(8 + data.size() % 2, '\0');
    const auto sized = [](const char* name, const std::string& content) {
        const auto size = static_cast<std::uint32_t>(content.size());
        return name + std::string(reinterpret_cast<const char*>(&size), sizeof(size)) + content;
    };
    return sized("RIFF", "WEBP" + sized("VP8L", data));
}

TEST(HostileImage, OfFewBytesTakesNoMemoryForWhatItClaims) {
    const Scratch scratch;
    ImportOptions options = importOptions();
    options.maxMemoryBytes = std::size_t{640} << 20;
    const auto notesOf = [&](std::uint32_t width, std::uint32_t height) {
        (void)scratch.write("a.webp", plainWebp(width, height));
        const Expected<ImportedScene> scene =
            importScene(scratch.write("a.gltf", pictured("a.webp")), kRootNode, options);
        return scene ? fmt::format("{}", fmt::join(scene->notes, "\n")) : "error: " + scene.error().message;
    };
    EXPECT_EQ(notesOf(64, 64), "");
    EXPECT_TRUE(notesOf(8192, 8192).ends_with(": image 0 was reduced to 4096 × 4096 pixels")) << notesOf(8192, 8192);
    EXPECT_WORDS(notesOf(16383, 8000));
}

TEST(HostileImage, ThatIsNotThereIsNamedOnce) {
    const Scratch scratch;
    const auto expectOne = [&](const std::string& uri, const std::string& note) {
        const Expected<ImportedScene> scene =
            importScene(scratch.write("a.gltf", pictured(uri)), kRootNode, importOptions());
        ASSERT_TRUE(scene) << messageOf(scene);
        ASSERT_EQ(scene->notes.size(), 1u);
        EXPECT_TRUE(scene->notes[0].ends_with(": image 0 is left out: " + note)) << scene->notes[0];
    };
    expectOne("gone.webp", "'gone.webp': No such file or directory");
    expectOne("../../gone.webp", "'../../gone.webp' leads out of the file's own folder");
}

}  // namespace
}  // namespace tessera
