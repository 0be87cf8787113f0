// USD files that lie, are cut off, or go on for ever: a clear message, or the sound part of it.
#include <fmt/format.h>
#include <sys/resource.h>

#include <array>
#include <cstring>
#include <random>

#include "common/cores/Animation.h"
#include "server/import/reader/UsdReader.h"
#include "server/import/reader/usd/UsdCrate.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Damage.h"
#include "tests/unit/import/UsdFixture.h"

namespace tessera {
namespace {

/// The reader itself, without the child: as often as wanted.
Expected<PlainScene> readUsd(const std::string& bytes) {
    UsdRemarks remarks;
    UsdFiles files(
        [&](const std::string& name) -> Expected<Bytes> {
            if (name != "model.usd") return fail(ErrorCode::kNotFound, name + ": there is no such file");
            const ByteSpan all = asBytes(bytes);
            return Bytes(all.begin(), all.end());
        },
        {.maxDepth = 100, .maxSpecs = 100'000});
    UsdStage stage(files, remarks);
    if (const Expected<void> opened = stage.open("model.usd"); !opened) return tl::unexpected(opened.error());
    ReadLimits limits;
    limits.maxNodes = 100'000;
    limits.maxDepth = 100;
    return UsdReader(stage, files, remarks, limits).read();
}

/// What it says where it refuses.
std::string readAlone(const std::string& bytes) {
    const Expected<PlainScene> scene = readUsd(bytes);
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

/// One change: of a byte, of eight bytes as a count or a place, of a number or a word in text; or a piece goes, or
/// stands twice.
void change(std::string& bytes, std::mt19937& random) {
    static constexpr std::array<std::uint64_t, 6> kNumbers = {0, 1, 0xff, 0x7fffffff, 0xffffffffff, ~std::uint64_t{0}};
    static constexpr std::array<std::string_view, 10> kWords = {"nan", "-1", "1e30", "2147483647", "None",
                                                                "[]",  "{",  "(",    "def",        "</Cart>"};
    const std::size_t at = random() % bytes.size(), size = std::min<std::size_t>(random() % 64, bytes.size() - at);
    switch (random() % 6) {
        case 0:
            bytes.erase(at, std::min(size, bytes.size() - 1));
            break;
        case 1:
            bytes.insert(random() % bytes.size(), bytes.substr(at, size));
            break;
        case 2:
            if (at + 8 <= bytes.size()) std::memcpy(&bytes[at], &kNumbers[random() % kNumbers.size()], 8);
            break;
        case 3: {
            const std::size_t word = std::min(bytes.find_first_of("0123456789\"<", at), bytes.size() - 1);
            bytes.replace(word, 1, kWords[random() % kWords.size()]);
            break;
        }
        default:
            bytes[at] = static_cast<char>(random() % 3 == 0 ? 0xff : random() % 256);
    }
}

class UsdDamage : public testing::TestWithParam<const char*> {};

TEST_P(UsdDamage, LeadsToASceneOrWords) {
    const std::string whole = contentOf(kUsdFiles + GetParam());
    const Seeds seeds(kSanitized ? 1'000 : 10'000);
    std::size_t read = 0;
    for (unsigned seed = seeds.first; seed < seeds.end; ++seed) {
        SCOPED_TRACE(fmt::format("TESSERA_SEED={} build/bin/unit_import --gtest_filter=*UsdDamage*", seed));
        std::mt19937 random(seed);
        std::string bytes = whole;
        for (std::uint32_t changes = 1 + seed % 4; changes > 0; --changes) change(bytes, random);
        const Expected<PlainScene> scene = readUsd(bytes);
        read += scene ? 1 : 0;
        if (scene)
            expectSoundMeshes(*scene);
        else
            EXPECT_FALSE(scene.error().message.empty());
        if (testing::Test::HasFailure()) return;
    }
    expectSomeRead(read, seeds);
}

INSTANTIATE_TEST_SUITE_P(Of, UsdDamage, testing::Values("cart.usda", "cart.usdc", "cart.usdz"),
                         [](const auto& test) { return std::string(test.param).replace(4, 1, "_"); });

/// What a crate can say of very much in few bytes: LZ4's blocks of one byte, so many times.
class ConstantCrate {
public:
    /// So many fields, all in each set of fields; so many paths, each with a spec.
    static std::string of(std::size_t fields, std::size_t specs) {
        ConstantCrate crate;
        crate.section("TOKENS", number(2) + number(4) + packed(block("", 0, 4)));
        crate.section("STRINGS", number(0));
        crate.section("FIELDS", number(fields) + integers(0, fields) + packed(block("", 0, 8 * fields)));
        crate.section("FIELDSETS", number(fields) + integers(0, fields));
        crate.section("PATHS",
                      number(specs + 1) + number(specs) + integers(1, specs) + integers(0, specs) + integers(0, specs));
        crate.section("SPECS", number(specs) + integers(1, specs) + integers(0, specs) + integers(0, specs, 6));
        const std::string place = number(crate.bytes_.size());
        crate.bytes_ += number(6) + crate.contents_;
        return crate.bytes_.replace(16, 8, place);
    }

private:
    static std::string number(std::uint64_t value) {
        return {reinterpret_cast<const char*>(&value), sizeof(value)};  // little-endian, as this machine
    }
    static std::string packed(const std::string& bytes) { return number(bytes.size()) + bytes; }
    static std::string block(const std::string& first, char byte, std::size_t count, char last = 0) {
        std::string out{'\0', static_cast<char>((first.size() + 1) << 4 | 15)};
        out += first + byte + std::string("\1\0", 2);
        if (count < 30) return std::string{'\0', static_cast<char>(count << 4)} + std::string(count, byte);
        std::size_t more = count - 10 - 15;  // of a match that is 4 long at least, before five letters
        for (; more >= 255; more -= 255) out += '\xff';
        out += static_cast<char>(more);
        return out + std::string("\x50\0\0\0\0", 5) + last;
    }
    /// All with the same difference; `first`: of the first one.
    static std::string integers(char step, std::size_t count, char first = 0) {
        const std::string head = std::string{step, '\0', '\0', '\0'} + (first != 0 ? "\1" : "");
        return packed(block(head, 0, (2 * count + 7) / 8, first));
    }
    void section(std::string name, const std::string& content) {
        name.resize(16);
        contents_ += name + number(bytes_.size()) + number(content.size());
        bytes_ += content;
    }

    std::string bytes_ = "PXR-USDC" + std::string("\0\x08", 2) + std::string(78, '\0'), contents_;
};

TEST(UsdHostile, CratesOfManyThingsInFewBytesAreRefused) {
    for (const auto& [fields, specs] : {std::pair{1'900'000, 99'000}, {50'000'000, 100}, {1000, 50'000'000}}) {
        const std::string bytes = ConstantCrate::of(static_cast<std::size_t>(fields), static_cast<std::size_t>(specs));
        EXPECT_LT(bytes.size(), 2'000'000u);
        const std::string said = readAlone(bytes);
        EXPECT_WORDS(said);
    }
    EXPECT_EQ(readAlone(ConstantCrate::of(1000, 1000)), "");
}

TEST(UsdHostile, CratesOfOtherVersionsAreNamed) {
    std::string bytes = contentOf(kUsdFiles + "cart.usdc");
    bytes[9] = 3;
    EXPECT_WORDS(readAlone(bytes));
}

TEST(UsdHostile, PackagesThatWouldUnpackAreRefusedByName) {
    std::string bytes = contentOf(kUsdFiles + "cart.usdz");
    // Both heads of the first file say "deflated", and the second that it becomes 4 GiB.
    bytes[8] = 8;
    const std::size_t entry = bytes.find("PK\x01\x02");
    bytes[entry + 10] = 8;
    bytes.replace(entry + 24, 4, "\xff\xff\xff\x7f");
    const std::string said = readAlone(bytes);
    EXPECT_WORDS(said);
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
    EXPECT_WORDS(notesIn(*many));
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
    EXPECT_WORDS(messageOf(importWithin2s(scratch.write("deep.usda", deep))));
    EXPECT_WORDS(messageOf(
        importWithin2s(scratch.write("lists.usda", "#usda 1.0\n(\n a = " + std::string(100'000, '[') + "\n)\n"))));
}

TEST(UsdHostile, CirclesOfAllWithAllEndAndAreNamed) {
    const Scratch scratch;
    std::string all = "#usda 1.0\ndef Sphere \"Good\" {}\n";
    for (int i = 0; i < 25; ++i) {
        std::string others;
        for (int j = 0; j < 25; ++j)
            if (j != i) others += fmt::format("</A{}>, ", j);
        all += fmt::format("def \"A{}\" (references = [{}]) {{}}\n", i, others);
    }
    const Expected<ImportedScene> refused = importWithin2s(scratch.write("all.usda", all));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kLimit) << refused.error().message;
    EXPECT_WORDS(refused.error().message);
}

TEST(UsdHostile, TurnsWithoutEndGetNoKeysWithoutEnd) {
    std::string text;
    for (int i = 0; i < 8; ++i)
        text += fmt::format(
            "def Xform \"X{}\" {{ float xformOp:rotateZ.timeSamples = {{ 0: 0, 1: {} }}\n"
            " uniform token[] xformOpOrder = [\"xformOp:rotateZ\"]\n def Sphere \"S\" {{}} }}\n",
            i, i < 4 ? "1e30" : "1e6");
    const UsdScene scene(text);
    std::size_t keys = 0;
    for (const KeyFrames* frames : scene.all<KeyFrames>()) keys += frames->times.sizeBytes() / 8;
    EXPECT_GT(keys, 60'000u) << "some turn as far as they say";
    EXPECT_LE(keys, 110'000u);
    EXPECT_WORDS(scene.notes());
}

TEST(UsdHostile, TextsOfOtherMachinesAreReadOrNamed) {
    const std::string body = "#usda 1.0\ndef Sphere \"S\" {\n # a remark\n double radius = 2\n}\n";
    std::string mac = body, wrong = body;
    std::ranges::replace(mac, '\n', '\r');
    EXPECT_EQ(readAlone(mac), "");
    wrong.insert(wrong.find('2'), "big");
    std::ranges::replace(wrong, '\n', '\r');
    EXPECT_TRUE(readAlone(wrong).starts_with("4:18: a number is missing")) << readAlone(wrong);
    for (const bool big : {false, true})
        for (const bool mark : {false, true}) {
            std::string wide;
            for (const char c : (mark ? "\xff" : "") + body)
                wide += c == '\xff' ? (big ? std::string("\xfe\xff") : std::string("\xff\xfe"))
                        : big       ? std::string{'\0', c}
                                    : std::string{c, '\0'};
            EXPECT_WORDS(readAlone(wide));
        }
    const UsdScene odd("#usda 99.0\n(\n metersPerUnit = 1\n)\ndef Sphere \"S\" {}\ndef Sphere \"S\" {}\n");
    EXPECT_WORDS(odd.notes());
    EXPECT_FALSE(UsdScene("#usda 1.1\n(\n metersPerUnit = 1\n)\ndef Sphere \"S\" {}\n").notes("versions"));
}

/// A zip of files that are stored as they are.
std::string zipOf(const std::vector<std::pair<std::string, std::string>>& files) {
    std::string zip, list;
    const auto number = [](std::string& to, std::size_t value, int bytes) {
        for (int i = 0; i < bytes; ++i) to.push_back(static_cast<char>(value >> (8 * i) & 0xff));
    };
    for (const auto& [name, content] : files) {
        const std::size_t at = zip.size();
        for (std::string* to : {&zip, &list}) {
            *to += to == &zip ? std::string("PK\3\4") : std::string("PK\1\2\24\0", 6);
            number(*to, 20, 2);
            number(*to, 0, 12);
            number(*to, content.size(), 4);
            number(*to, content.size(), 4);
            number(*to, name.size(), 2);
            number(*to, 0, to == &zip ? 2 : 12);
        }
        number(list, at, 4);
        zip += name + content;
        list += name;
    }
    const std::size_t begin = zip.size();
    zip += list + std::string("PK\5\6\0\0\0\0", 8);
    number(zip, files.size(), 2);
    number(zip, files.size(), 2);
    number(zip, list.size(), 4);
    number(zip, begin, 4);
    number(zip, 0, 2);
    return zip;
}

TEST(UsdHostile, PackagesThatAreNoneOfUsdSayWhatWouldHelp) {
    const std::string layer = "#usda 1.0\ndef Sphere \"S\" {}\n";
    const std::string good = zipOf({{"a.usda", layer}});
    EXPECT_EQ(readAlone(good), "");
    const std::string second = readAlone(zipOf({{"read.txt", "me"}, {"a.usda", layer}}));
    EXPECT_WORDS(second);
    EXPECT_WORDS(readAlone(zipOf({{"a.usdz", good}})));
    EXPECT_WORDS(readAlone(zipOf({{"a.usda", ""}})));
    std::string longer = good;
    const std::size_t entry = longer.find("PK\1\2");
    longer.replace(entry + 20, 8, std::string(8, '\xff'));
    EXPECT_WORDS(readAlone(longer));
}

TEST(UsdHostile, NumbersThatAreNoneAreNamed) {
    const UsdScene scene(R"(
def Sphere "Nan" { double radius = nan }
def Sphere "Huge" { double radius = 1e400 }
def Capsule "None" { double radius = 0 }
def Xform "Zero" { matrix4d xformOp:transform = ((0, 0, 0, 0), (0, 0, 0, 0), (0, 0, 0, 0), (0, 0, 0, 1))
 uniform token[] xformOpOrder = ["xformOp:transform"]
 def Sphere "S" {} }
def Xform "Far" { matrix4d xformOp:transform = ((1, 0, 0, 1), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
 uniform token[] xformOpOrder = ["xformOp:transform"]
 def Sphere "S" {} }
def Mesh "Points" {
 int[] faceVertexCounts = [3, 3]
 int[] faceVertexIndices = [0, 1, 2, 1, 2, 3]
 point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (nan, 0, 0)] }
)");
    for (const std::string& note : scene.scene().notes) EXPECT_WORDS(note);
}

TEST(UsdHostile, WhatASmallFileMultipliesIsBounded) {
    const Scratch scratch;
    ImportOptions options = importOptions();
    if (!kSanitized) options.maxCpuTime = std::chrono::seconds(2), options.maxMemoryBytes = std::size_t{768} << 20;
    // A sample is four letters, and hundreds of bytes in memory; so is a property.
    std::string samples = "#usda 1.0\ndef Sphere \"S\" {\n double radius.timeSamples = {";
    for (int i = 0; i < 2'000'000; ++i) samples += "0:1,";
    const auto refused = [&](const std::string& text) {
        const Expected<ImportedScene> scene = importScene(scratch.write("large.usda", text), kRootNode, options);
        return scene ? "" : scene.error().message;
    };
    EXPECT_WORDS(refused(samples + "}\n}\n"));
    std::string properties = "#usda 1.0\ndef Sphere \"S\" {\n";
    for (int i = 0; i < 2'000'000; ++i) properties += fmt::format("int a{:x}\n", i);
    EXPECT_WORDS(refused(properties + "}\n"));
    std::string inherited = "#usda 1.0\nclass Sphere \"C\" {\n";
    for (int i = 0; i < 100'000; ++i) inherited += fmt::format("int a{:x}\n", i);
    inherited += "}\n";
    for (int i = 0; i < 1000; ++i) inherited += fmt::format("def \"P{}\" (inherits = </C>) {{}}\n", i);
    EXPECT_WORDS(refused(inherited));
    // A smooth surface of some size at thousands of places.
    std::string surface = "#usda 1.0\nclass Mesh \"Smooth\" {\n int[] faceVertexCounts = [";
    std::string corners, points;
    for (int i = 0; i < 4'000; ++i) {
        surface += "3,";
        corners += fmt::format("{},{},{},", 3 * i, 3 * i + 1, 3 * i + 2);
        points += fmt::format("({},0,0),({},1,0),({},0,1),", i, i, i);
    }
    surface += "]\n int[] faceVertexIndices = [" + corners + "]\n point3f[] points = [" + points + "] }\n";
    for (int i = 0; i < 10'000; ++i) surface += fmt::format("def \"P{}\" (inherits = </Smooth>) {{}}\n", i);
    EXPECT_EQ(refused(surface), "");
}

TEST(UsdHostile, GlyphsOfInheritedPlacesAreBounded) {
    std::string text = R"(class "C" { int[] protoIndices = [)", positions, colors;
    for (int i = 0; i < 5'000; ++i) {
        text += i ? ",0" : "0";
        positions += i ? ",(0,0,0)" : "(0,0,0)";
        colors += i ? ",(1,0,0)" : "(1,0,0)";
    }
    text += "] point3f[] positions = [" + positions + "] color3f[] primvars:displayColor = [" + colors +
            "] (interpolation = \"vertex\") }\ndef Xform \"P\" {\n";
    for (int i = 0; i < 16; ++i) text += fmt::format("def Mesh \"T{}\" {{{}}}\n", i, kUsdTriangle);
    text += "}\n";
    for (int i = 0; i < 200; ++i)
        text += fmt::format("def PointInstancer \"I{}\" (inherits = </C>) {{ rel prototypes = </P> }}\n", i);
    const Scratch scratch;
    const Expected<ImportedScene> read = importUsd(scratch.write("many.usda", usda(text)));
    ASSERT_FALSE(read);
    EXPECT_WORDS(read.error().message);
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
def PointInstancer "J" {
    int[] protoIndices = [0, 0]
    point3f[] positions = [(0, 0, 0), (1, 0, 0)]
    float3[] scales = [(1, 1, 1), (nan, 1, 1)]
    quatf[] orientations = [(1, 0, 0, 0), (0, 0, 0, 0)]
    rel prototypes = </Good>
}
)");
    EXPECT_TRUE(scene.has("/Good"));
    EXPECT_TRUE(scene.has("/Flat/S"));
    for (const std::string& note : scene.scene().notes) EXPECT_WORDS(note);
}

}  // namespace
}  // namespace tessera
