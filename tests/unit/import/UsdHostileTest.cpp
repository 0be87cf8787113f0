// USD files that lie, are cut off, or go on for ever: a clear message, or the sound part of it.
#include <fmt/format.h>
#include <sys/resource.h>

#include <random>

#include "server/import/reader/UsdReader.h"
#include "server/import/reader/usd/UsdCrate.h"
#include "tests/unit/import/UsdFixture.h"

namespace tessera {
namespace {

/// The reader itself, without the child: as often as wanted. What it says where it refuses.
std::string readAlone(const std::string& bytes) {
    UsdRemarks remarks;
    UsdFiles files(
        [&](const std::string& name) -> Expected<Bytes> {
            if (name != "model.usd") return fail(ErrorCode::kNotFound, name + ": there is no such file");
            const ByteSpan all = asBytes(bytes);
            return Bytes(all.begin(), all.end());
        },
        {.maxDepth = 100, .maxSpecs = 100'000});
    UsdStage stage(files, remarks);
    if (const Expected<void> opened = stage.open("model.usd"); !opened) return opened.error().message;
    ReadLimits limits;
    limits.maxNodes = 100'000;
    limits.maxDepth = 100;
    const Expected<PlainScene> scene = UsdReader(stage, files, remarks, limits).read();
    return scene ? "" : scene.error().message;
}

TEST(UsdHostile, CratesAndPackagesCutAtEachByteAreRefusedInWords) {
    for (const char* name : {"cart.usdc", "cart.usdz"}) {
        const std::string whole = contentOf(kUsdFiles + name);
        ASSERT_EQ(readAlone(whole), "");
        for (std::size_t size = 0; size < whole.size(); size += size < 100 || size + 100 > whole.size() ? 1 : 7)
            EXPECT_NE(readAlone(whole.substr(0, size)), "") << name << " of " << size << " bytes";
    }
}

TEST(UsdHostile, TextsCutAnywhereAreRefusedOrShownAsFarAsTheyGo) {
    const std::string whole = contentOf(kUsdFiles + "cart.usda");
    std::size_t refused = 0;
    for (std::size_t size = 0; size < whole.size(); size += 5)
        refused += readAlone(whole.substr(0, size)).empty() ? 0 : 1;
    EXPECT_GT(refused, whole.size() / 5 * 9 / 10);
}

TEST(UsdHostile, BytesChangedAnywhereHarmNobody) {
    std::mt19937 random(7);
    for (const char* name : {"cart.usda", "cart.usdc", "cart.usdz"}) {
        const std::string whole = contentOf(kUsdFiles + name);
        for (int run = 0; run < 3400; ++run) {
            std::string bytes = whole;
            for (std::uint32_t changes = 1 + random() % 4; changes > 0; --changes)
                bytes[random() % bytes.size()] = static_cast<char>(random() % 3 == 0 ? 0xff : random() % 256);
            (void)readAlone(bytes);
        }
    }
}

TEST(UsdHostile, CratesOfOtherVersionsAreNamed) {
    std::string bytes = contentOf(kUsdFiles + "cart.usdc");
    bytes[9] = 3;
    EXPECT_NE(readAlone(bytes).find("a crate of version 0.3.0; 0.4 to"), std::string::npos) << readAlone(bytes);
}

TEST(UsdHostile, PackagesThatWouldUnpackAreRefusedByName) {
    std::string bytes = contentOf(kUsdFiles + "cart.usdz");
    // Both heads of the first file say "deflated", and the second that it becomes 4 GiB.
    bytes[8] = 8;
    const std::size_t entry = bytes.find("PK\x01\x02");
    bytes[entry + 10] = 8;
    bytes.replace(entry + 24, 4, "\xff\xff\xff\x7f");
    const std::string said = readAlone(bytes);
    EXPECT_NE(said.find("'cart.usdc' in it is compressed, to 2147483647 bytes as it says"), std::string::npos) << said;
}

/// A file within the child: within 2 s of its own time.
Expected<ImportedScene> importWithin2s(const std::string& path) {
    ImportOptions options = importOptions();
    if (!kSanitized) options.maxCpuTime = std::chrono::seconds(2);
    return importScene(path, kRootNode, options);
}

TEST(UsdHostile, ManyLayersAndManyPlacesAreBounded) {
    const Scratch scratch;
    std::string layers = "#usda 1.0\n(\n subLayers = [";
    for (int i = 0; i < 100'000; ++i) layers += fmt::format("@layer{}.usda@,\n", i);
    const Expected<ImportedScene> many =
        importWithin2s(scratch.write("layers.usda", layers + "]\n)\ndef Sphere \"S\" {}\n"));
    ASSERT_TRUE(many) << messageOf(many);
    EXPECT_TRUE(hasNote(*many, "99990 others")) << many->notes.front();
    // Each of 40 prims holds the one before twice: 2^40 of them.
    std::string doubled = "#usda 1.0\ndef Sphere \"P0\" {}\n";
    for (int i = 1; i < 40; ++i)
        doubled += fmt::format(
            "def \"P{0}\" {{ def \"A\" (references = </P{1}>) {{}}\n def \"B\" (references = </P{1}>) "
            "{{}} }}\n",
            i, i - 1);
    const Expected<ImportedScene> refused = importWithin2s(scratch.write("doubled.usda", doubled));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kLimit) << refused.error().message;
    std::string deep = "#usda 1.0\n";
    for (int i = 0; i < 5000; ++i) deep += "def \"D\" {\n";
    EXPECT_NE(messageOf(importWithin2s(scratch.write("deep.usda", deep))).find("nested deeper"), std::string::npos);
    EXPECT_NE(messageOf(importWithin2s(
                            scratch.write("lists.usda", "#usda 1.0\n(\n a = " + std::string(100'000, '[') + "\n)\n")))
                  .find("lists.usda:3:"),
              std::string::npos);
}

TEST(UsdHostile, ShadersThatAreConnectedToThemselvesEndSomewhere) {
    const UsdScene scene("def Mesh \"M\" {" + kUsdTriangle + R"( rel material:binding = </L> }
def Material "L" {
    token outputs:surface.connect = </L/S.outputs:surface>
    def Shader "S" { uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </L/R.outputs:result>
        float inputs:roughness.connect = </L.inputs:round> }
    float inputs:round.connect = </L.inputs:round>
    def Shader "R" { uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname.connect = </L/R.outputs:result> } })");
    EXPECT_EQ(scene.corners().size(), 3u);
}

TEST(UsdHostile, NumbersThatAreNoneAndCountsThatLieLeaveTheRest) {
    const UsdScene scene(R"(
def Sphere "Good" {}
def Mesh "Bad" {
    int[] faceVertexCounts = [3, 3, -5, 3]
    int[] faceVertexIndices = [0, 1, 2, 0, 1, 99, 0, 1, 2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    uniform token subdivisionScheme = "none"
}
def Mesh "Nan" {
    int[] faceVertexCounts = [3, 3]
    int[] faceVertexIndices = [0, 1, 2, 1, 2, 3]
    point3f[] points = [(nan, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, inf)]
}
def Xform "Flat" {
    float3 xformOp:scale = (0, 0, 0)
    matrix4d xformOp:transform = ((nan, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
    uniform token[] xformOpOrder = ["!invert!xformOp:scale", "xformOp:transform", "xformOp:missing"]
    def Sphere "S" { double radius = nan }
}
def PointInstancer "I" {
    int[] protoIndices = [7, -1, 0, 0]
    point3f[] positions = [(0, 0, 0), (1, 0, 0), (nan, 0, 0), (3, 0, 0)]
    rel prototypes = [</I>, </Good>]
}
)");
    EXPECT_TRUE(scene.has("/Good"));
    EXPECT_TRUE(scene.has("/Flat/S"));
    for (const char* part : {"/Bad: ", "/Nan: 2 of 2 faces are left out", "not finite, or have no inverse",
                             "operations of transforms that have no value", "/I: 3 of 4 instances are left out",
                             "prototypes that hold themselves"})
        EXPECT_TRUE(scene.notes(part)) << part;
}

}  // namespace
}  // namespace tessera
