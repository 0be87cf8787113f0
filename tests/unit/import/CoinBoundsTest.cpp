// Files of VRML, X3D and Inventor of a few bytes that Coin alone would take minutes or gigabytes for.
#include <fmt/format.h>
#include <sys/resource.h>

#include <bit>
#include <cmath>
#include <numbers>

#include "common/cores/Geometry.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

const std::string kVrmlBegin = "#VRML V2.0 utf8\n";
const std::string kBinaryHead = "#Inventor V2.1 binary  \n";

std::string bigEndianWord(std::uint32_t number) {
    number = __builtin_bswap32(number);
    return {reinterpret_cast<const char*>(&number), sizeof(number)};
}
std::string lengthAndLetters(std::string_view letters) {
    std::string bytes = bigEndianWord(static_cast<std::uint32_t>(letters.size())) + std::string(letters);
    bytes.resize((bytes.size() + 3) / 4 * 4, '\0');
    return bytes;
}
std::string floatWords(std::initializer_list<float> all) {
    std::string bytes;
    for (const float number : all) bytes += bigEndianWord(std::bit_cast<std::uint32_t>(number));
    return bytes;
}
/// A node of one field.
std::string nodeOfOneField(std::string_view kind, std::string_view field, const std::string& value) {
    return lengthAndLetters(kind) + bigEndianWord(0) + bigEndianWord(1) + lengthAndLetters(field) + value +
           bigEndianWord(0);
}
std::string timesOver(const std::string& text, std::size_t times) {
    std::string all;
    for (std::size_t i = 0; i < times; ++i) all += text;
    return all;
}

/// Triangles around one place; each corner has a point.
std::string fanAround(std::size_t faces, std::string& points, const char* end) {
    std::string corners;
    points = "0 0 0,";
    for (std::size_t i = 0; i < faces; ++i) {
        const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(faces);
        points += fmt::format("{:.6f} {:.6f} 0,", std::cos(angle), std::sin(angle));
        corners += fmt::format("0,{},{}{}", 1 + i, 1 + (i + 1) % faces, end);
    }
    return corners;
}

class CoinBounds : public testing::Test {
protected:
    /// Within what a hostile file may take.
    Expected<ImportedScene> load(const std::string& file, const std::string& text, int seconds = 2) {
        ImportOptions options = importOptions();
        options.maxCpuTime = std::chrono::seconds(seconds);
        options.maxMemoryBytes = std::size_t{1} << 30;
        return importScene(scratch_.write(file, text), kRootNode, options);
    }
    void expectRefused(const std::string& file, const std::string& text, int seconds = 2) {
        const Expected<ImportedScene> scene = load(file, text, seconds);
        ASSERT_FALSE(scene) << file;
        EXPECT_WORDS(scene.error().message) << file;
    }
    void expectNote(const std::string& file, const std::string& text) {
        const Expected<ImportedScene> scene = load(file, text);
        EXPECT_WORDS(scene ? notesIn(*scene) : scene.error().message) << file;
    }
    const Scratch scratch_;
};

TEST_F(CoinBounds, InventorInBytesIsReadAsTheSameInText) {
    const std::string square =
        nodeOfOneField("Coordinate3", "point", bigEndianWord(4) + floatWords({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0})) +
        nodeOfOneField("IndexedFaceSet", "coordIndex",
                       bigEndianWord(8) + bigEndianWord(0) + bigEndianWord(1) + bigEndianWord(2) + bigEndianWord(-1u) +
                           bigEndianWord(1) + bigEndianWord(3) + bigEndianWord(2) + bigEndianWord(-1u));
    const Expected<ImportedScene> scene = load("a.iv", kBinaryHead + lengthAndLetters("Separator") + bigEndianWord(0) +
                                                           bigEndianWord(0) + bigEndianWord(2) + square);
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->triangles, 2u);
}

TEST_F(CoinBounds, CountsOfInventorInBytesThatLieAreRefused) {
    for (const std::uint32_t count : {20'000'000u, 1u << 30, 0x7fffffffu})
        expectRefused(
            "a.iv", kBinaryHead + nodeOfOneField("Coordinate3", "point", bigEndianWord(count) + floatWords({0, 0, 0})));
    expectRefused("b.iv",
                  kBinaryHead + nodeOfOneField("Coordinate3", "point", bigEndianWord(60'000) + floatWords({0, 0, 0})));
    expectRefused("c.iv", kBinaryHead + nodeOfOneField("Texture2", "image",
                                                       bigEndianWord(32'000) + bigEndianWord(32'000) +
                                                           bigEndianWord(4) + bigEndianWord(255)));
}

TEST_F(CoinBounds, InventorInBytesMayNotBeNestedWithoutEnd) {
    expectRefused("a.iv", kBinaryHead + timesOver(lengthAndLetters("Separator") + bigEndianWord(0) + bigEndianWord(0) +
                                                      bigEndianWord(1),
                                                  60'000));
}

TEST_F(CoinBounds, APictureThatIsNotThereTakesNoMemory) {
    expectRefused("a.wrl", kVrmlBegin +
                               "Shape { appearance Appearance { texture PixelTexture { image 32767 32767 4 0x1 } } "
                               "geometry Box {} }");
    expectRefused("b.iv", "#Inventor V2.1 ascii\nTexture2 { image 32767 32767 4 0xff }\nCube {}");
}

TEST_F(CoinBounds, LettersOfTwoBytesAreNamed) {
    for (const std::string& text : {kVrmlBegin + "Shape { geometry Box {} }", std::string("<X3D><Scene/></X3D>")}) {
        std::string wide = "\xff\xfe";
        for (const char letter : text) wide += {letter, '\0'};
        expectRefused("a.wrl", wide);
    }
}

TEST_F(CoinBounds, AnExtrusionIsWhatItSaysAndNoMore) {
    const auto extrusion = [](const std::string& fields) {
        return kVrmlBegin + "Shape { geometry Extrusion { " + fields + " } }";
    };
    std::string across, along;
    for (int i = 0; i < 600; ++i) {
        across += fmt::format("{} {},", i, i * i % 97);
        along += fmt::format("0 {} 0,", i);
    }
    const Expected<ImportedScene> large =
        load("a.wrl", extrusion(fmt::format("crossSection [{}] spine [{}]", across, along)));
    ASSERT_TRUE(large) << messageOf(large);
    EXPECT_EQ(large->triangles, 2u * 599 * 599 + 2 * 598);
    expectNote("b.wrl", extrusion("crossSection [" + timesOver("0 0,", 4000) + "1 1] spine [" +
                                  timesOver("0 0 0,", 4000) + "0 1 0]"));
    // All rings in one point.
    const Expected<ImportedScene> cone =
        load("c.wrl", extrusion("crossSection [" + across + "] spine [" + along + "] scale 0 0"));
    EXPECT_TRUE(!cone) << "a line has no triangle";
}

TEST_F(CoinBounds, AnExtrusionsSidesFaceOutwards) {
    const Expected<ImportedScene> scene = load("a.wrl", kVrmlBegin +
                                                            "Shape { geometry Extrusion { spine [ 0 0 0, 0 2 "
                                                            "0, 0 5 0 ] scale [ 1 1, 3 1, 1 1 ] } }");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->triangles, 20u);
    const ImportedAspect aspect(*scene);
    for (const ObjectId id : aspect->ids())
        if (const auto* const geometry = aspect->get<Geometry>(id)) {
            const auto places = geometry->positions.as<float>(), normals = geometry->normals.as<float>();
            float widest = 0;
            for (std::size_t i = 0; i + 2 < places.size(); i += 3) {
                const Vec3f place(places[i], places[i + 1] - 2.5f, places[i + 2]);
                EXPECT_GT(place.dot(Vec3f(normals[i], normals[i + 1], normals[i + 2])), 0) << i;
                widest = std::max(widest, place.x());
            }
            EXPECT_EQ(widest, 3);
        }
}

TEST_F(CoinBounds, OnePointMayBeOfVeryManyFaces) {
    constexpr std::size_t kFaces = 30'000;
    std::string points;
    const std::string corners = fanAround(kFaces, points, ",-1,");
    const auto expectFan = [&](const std::string& file, const std::string& text) {
        const Expected<ImportedScene> scene = load(file, text);
        ASSERT_TRUE(scene) << file << ": " << messageOf(scene);
        EXPECT_EQ(scene->triangles, kFaces) << file;
        const ImportedAspect aspect(*scene);
        for (const ObjectId id : aspect->ids()) {
            const auto* const geometry = aspect->get<Geometry>(id);
            const auto normals = geometry != nullptr ? geometry->normals.as<float>() : std::span<const float>();
            for (std::size_t i = 0; i + 2 < normals.size(); i += 3) ASSERT_EQ(normals[i + 2], 1) << file;
        }
    };
    expectFan("a.wrl", kVrmlBegin + "Shape { geometry IndexedFaceSet { creaseAngle 3 coord Coordinate { point [" +
                           points + "] } coordIndex [" + corners + "] } }");
    expectFan("b.iv", "#Inventor V2.1 ascii\nCoordinate3 { point [" + points + "] }\nIndexedFaceSet { coordIndex [" +
                          corners + "] }");
    std::string index;
    for (std::size_t i = 0; i < kFaces; ++i) index += fmt::format("0 {} {} ", 1 + i, 1 + (i + 1) % kFaces);
    expectFan("c.x3d", "<X3D><Scene><Shape><IndexedTriangleSet index='" + index + "'><Coordinate point='" + points +
                           "'/></IndexedTriangleSet></Shape></Scene></X3D>");
}

TEST_F(CoinBounds, AShapesPointsMayAllBeOne) {
    const std::string many = "#Inventor V2.1 ascii\nCoordinate3 { point [" + timesOver("0 0 0,1 0 0,0 1 0,", 10'000) +
                             "] }\nFaceSet { numVertices [" + timesOver("3,", 10'000) + "] }";
    const Expected<ImportedScene> scene = load("a.iv", many);
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->triangles, 10'000u);
    expectNote("b.wrl", kVrmlBegin +
                            "Shape { geometry ElevationGrid { xDimension 100 zDimension 100 xSpacing 0 height [" +
                            timesOver("0 ", 10'000) + "] } }");
}

TEST_F(CoinBounds, KindsOfNodesAndPrototypesMayBeVeryMany) {
    std::string kinds = kVrmlBegin + "Shape { geometry Box {} }\n", protos = kinds;
    for (int i = 0; i < 30'000; ++i) kinds += fmt::format("Foo{} {{}}\n", i);
    for (int i = 0; i < 20'000; ++i) protos += fmt::format("PROTO P{} [] {{ Group {{}} }}\n", i);
    const Expected<ImportedScene> scene = load("a.wrl", kinds);
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->triangles, 12u);
    expectRefused("b.wrl", protos);
}

TEST_F(CoinBounds, NodesWithNamesTakeHardlyMoreThanThoseWithout) {
    // Coin's own dictionary looked through a 2000th of all names for each word of the file.
    const int count = kSanitized ? 5'000 : 150'000;
    std::string named = kVrmlBegin + "DEF S Shape { geometry Box {} }\n", nameless = named;
    for (int i = 0; i < count; ++i) {
        const std::string node = fmt::format("Transform {{ translation {} 0 0 children USE S }}\n", i);
        named += fmt::format("DEF n{} ", i) + node;
        nameless += node;
    }
    const auto secondsOf = [&](const char* file, const std::string& text) {
        const auto used = [] {
            rusage all{};
            ::getrusage(RUSAGE_CHILDREN, &all);
            return static_cast<double>(all.ru_utime.tv_sec) + 1e-6 * static_cast<double>(all.ru_utime.tv_usec);
        };
        const double before = used();
        const Expected<ImportedScene> scene = load(file, text, 20);
        EXPECT_TRUE(scene) << messageOf(scene);
        return used() - before;
    };
    const double without = secondsOf("a.wrl", nameless), with = secondsOf("b.wrl", named);
    EXPECT_LT(with, kSanitized ? 1000 : 2.5 * without);
}

TEST_F(CoinBounds, ASideOfAPictureThatFitsNowhereIsNamedAsItIs) {
    expectRefused("a.wrl", kVrmlBegin +
                               "Shape { appearance Appearance { texture PixelTexture { image 100000 100000 3 0 0 } } "
                               "geometry Box {} }");
}

TEST_F(CoinBounds, OneGeometryIsMadeOnceWhoeverUsesIt) {
    std::string points;
    const std::string corners = fanAround(6'000, points, ",-1,");
    const Expected<ImportedScene> scene =
        load("a.wrl", kVrmlBegin + "Shape { geometry DEF G IndexedFaceSet { coord Coordinate { point [" + points +
                          "] } coordIndex [" + corners + "] } }\n" + timesOver("Shape { geometry USE G }\n", 2'000));
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->triangles, 6'000u * 2'001);
    // Of Inventor each use may look otherwise, and is made anew.
    expectRefused("b.iv",
                  "#Inventor V2.1 ascii\nCoordinate3 { point [" + points + "] }\nDEF A IndexedFaceSet { coordIndex [" +
                      corners + "] }" + timesOver(" USE A", 3'000),
                  10);
    expectRefused("c.wrl", kVrmlBegin + "PROTO P [] { Shape { geometry IndexedFaceSet { coord Coordinate { point [" +
                               points + "] } coordIndex [" + corners + "] } } }\n" + timesOver("P {} ", 3'000));
}

}  // namespace
}  // namespace tessera
