// AMF: volumes, materials, colours, constellations; as XML and in an archive.
#include "common/cores/Material.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/PrintingFixture.h"

namespace tessera {
namespace {

std::string amfColor(const std::string& red) {
    return "<color><r>" + red + "</r><g>0</g><b>0</b></color>";
}
std::string amfTriangle(int a, int b, int c, const std::string& inside = "") {
    return fmt::format("<triangle>{}<v1>{}</v1><v2>{}</v2><v3>{}</v3></triangle>", inside, a, b, c);
}
/// Four vertices of a square; `ofVertex` stands in each.
std::string amfMesh(const std::string& volumes, const std::string& ofVertex = "") {
    std::string text = "<mesh><vertices>";
    for (const auto& [x, y] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}})
        text +=
            fmt::format("<vertex><coordinates><x>{}</x><y> {} </y><z>0</z></coordinates>{}</vertex>\n", x, y, ofVertex);
    return text + "</vertices>" + volumes + "</mesh>";
}
std::string amfOf(const std::string& content, const std::string& attributes = "unit=\"meter\"") {
    return fmt::format("<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<amf {}>\n{}\n</amf>\n", attributes, content);
}
PrintedScene amfScene(const std::string& content) {
    return {"model.amf", amfOf(content)};
}

TEST(Amf, AllVolumesOfAnObjectArriveWithTheirNames) {
    const PrintedScene scene =
        amfScene("<object id=\"1\"><metadata type=\"name\">Cup</metadata>" +
                 amfMesh("<volume><metadata type=\"name\">Inside</metadata>" + amfTriangle(0, 1, 2) +
                         "</volume><volume>" + amfTriangle(0, 2, 3) + "</volume>") +
                 "</object>");
    EXPECT_EQ(scene.scene().triangles, 2u);
    EXPECT_TRUE(scene.has("/model/Cup/Inside") && scene.has("/model/Cup/volume"));
    ASSERT_EQ(scene.all<Geometry>().size(), 2u);
    for (const Geometry* geometry : scene.all<Geometry>()) {
        EXPECT_EQ(geometry->positions.sizeBytes(), 36u) << "a volume has its own vertices alone";
        EXPECT_EQ(geometry->colors.sizeBytes(), 0u) << "nothing is said";
    }
}

TEST(Amf, UnitsBecomeMetres) {
    for (const auto& [unit, metres] : {std::pair("millimeter", 1e-3),
                                       {"inch", 0.0254},
                                       {"feet", 0.3048},
                                       {"meter", 1.0},
                                       {"micrometer", 1e-6},
                                       {"", 1e-3}}) {
        const std::string object =
            "<object id=\"1\">" + amfMesh("<volume>" + amfTriangle(0, 1, 2) + "</volume>") + "</object>";
        const PrintedScene scene("model.amf", amfOf(object, *unit ? fmt::format("unit=\"{}\"", unit) : ""));
        expectNear(scene.bounds().upper, Vec3d(metres, metres, 0), 1e-9);
    }
}

/// The red of each of a square's first triangle's corners: of vertices times the material.
double amfRedOf(const std::string& ofObject, const std::string& ofVertex, const std::string& ofVolume,
                const std::string& ofTriangle) {
    const PrintedScene scene =
        amfScene("<material id=\"2\"><metadata type=\"name\">PLA</metadata>" + amfColor("0.2") +
                 "</material><object id=\"1\">" + ofObject +
                 amfMesh("<volume materialid=\"2\">" + ofVolume + amfTriangle(0, 1, 2, ofTriangle) +
                             amfTriangle(0, 2, 3) + "</volume>",
                         ofVertex) +
                 "</object>");
    if (scene.all<Geometry>().size() != 1 || scene.all<Material>().size() != 1) return -1;
    const Geometry& geometry = *scene.all<Geometry>()[0];
    if (geometry.colors.sizeBytes() == 0) return scene.all<Material>()[0]->baseColor[0];
    const std::uint32_t corner = geometry.indices.as<std::uint32_t>()[0];
    return geometry.colors.as<std::uint8_t>()[std::size_t{4} * corner] / 255.0;
}

TEST(Amf, OfColoursThoseOfTheSmallestPartCount) {
    const auto linear = [](double srgb) { return std::pow((srgb + 0.055) / 1.055, 2.4); };
    EXPECT_NEAR(amfRedOf("", "", "", ""), linear(0.2), 1e-4);
    EXPECT_NEAR(amfRedOf(amfColor("0.4"), "", "", ""), linear(0.4), 1e-4);
    EXPECT_NEAR(amfRedOf(amfColor("0.4"), "", amfColor("0.6"), ""), linear(0.6), 1e-4);
    EXPECT_NEAR(amfRedOf(amfColor("0.4"), amfColor("0.8"), amfColor("0.6"), ""), linear(0.8), 1e-4);
    EXPECT_NEAR(amfRedOf(amfColor("0.4"), amfColor("0.8"), amfColor("0.6"), amfColor("1")), 1, 1e-4);
}

TEST(Amf, AMaterialKeepsItsNameWhereItsColourIsShown) {
    const PrintedScene scene = amfScene("<material id=\"2\"><metadata type=\"name\">PLA</metadata>" + amfColor("0.2") +
                                        "</material><object id=\"1\">" +
                                        amfMesh("<volume materialid=\"2\">" + amfTriangle(0, 1, 2) +
                                                "</volume><volume "
                                                "materialid=\"9\">" +
                                                amfTriangle(0, 2, 3) + "</volume>") +
                                        "</object>");
    EXPECT_EQ(scene.all<Material>().size(), 1u);
    EXPECT_TRUE(scene.has("/model/object 1/PLA")) << "a volume without a name has its material's";
    EXPECT_WORDS(scene.notes());
}

TEST(Amf, ConstellationsPlaceAndTurnWhatTheyHold) {
    const PrintedScene scene = amfScene(
        "<object id=\"1\">" + amfMesh("<volume>" + amfTriangle(0, 1, 2) + "</volume>") +
        "</object><constellation id=\"2\"><metadata type=\"name\">Pair</metadata><instance objectid=\"1\"/><instance "
        "objectid=\"1\"><deltax>5</deltax><deltay>6</deltay><deltaz>7</deltaz><rx>90</rx><rz>90</rz></instance>"
        "</constellation><constellation id=\"3\"><instance objectid=\"2\"><deltax>10</deltax></instance><instance "
        "objectid=\"8\"/></constellation>");
    EXPECT_EQ(scene.all<Geometry>().size(), 1u);
    const std::vector<Vec3d> corners = scene.corners();
    ASSERT_EQ(corners.size(), 6u) << "what is in a constellation stands nowhere else";
    expectNear(corners[1], Vec3d(11, 0, 0));
    // (1, 0, 0) stays as it is about x, and comes to y about z; (1, 1, 0) is (1, 0, 1) before it is turned about z.
    expectNear(corners[4], Vec3d(15, 7, 7));
    expectNear(corners[5], Vec3d(15, 7, 8));
    EXPECT_WORDS(scene.notes());
}

TEST(Amf, WhatIsLeftOutIsNamed) {
    const PrintedScene scene =
        amfScene("<texture id=\"4\" width=\"1\">AA==</texture><object id=\"1\"><color><r>x*0.5</r></color>" +
                 amfMesh("<volume>" + amfTriangle(0, 1, 2, "<texmap rtexid=\"4\"/>") + "</volume>",
                         "<normal><nx>1</nx></normal>") +
                 "</object>");
    for (const std::string& note : scene.scene().notes) EXPECT_WORDS(note);
}

TEST(Amf, ArchivesAndTextsThatAreCutOffShowWhatIsThere) {
    const std::string whole =
        amfOf("<object id=\"1\">" +
              amfMesh("<volume>" + amfTriangle(0, 1, 2) + "\n" + amfTriangle(0, 2, 3) + "</volume>") + "</object>");
    EXPECT_EQ(PrintedScene("model.amf", archiveOf({{"a/model.amf", whole}})).scene().triangles, 2u);
    const PrintedScene cut("model.amf", whole.substr(0, whole.find("<v3>3")));
    EXPECT_EQ(cut.scene().triangles, 1u);
    EXPECT_WORDS(cut.notes());
    const Scratch scratch;
    ImportOptions options = importOptions();
    options.whole = true;
    EXPECT_WORDS(
        messageOf(importScene(scratch.write("cut.amf", whole.substr(0, whole.find("<v3>3"))), kRootNode, options)));
}

/// Triangles as Python's xml.etree counts them; through constellations by hand: test8 has two instances of 8, test9 two
/// of six instances of 8.
TEST(Amf, FilesOfOthersHaveAsManyTrianglesAsAreInThem) {
    for (const auto& [file, triangles] : {std::pair("test1", 4u),
                                          {"test6", 4u},
                                          {"test7", 8u},
                                          {"test8", 16u},
                                          {"test9", 96u},
                                          {"test_with_mat", 8u}}) {
        const Expected<ImportedScene> scene =
            importScene(fmt::format("{}/AMF/{}.amf", kDebianModels, file), kRootNode, importOptions());
        ASSERT_TRUE(scene) << messageOf(scene);
        EXPECT_EQ(scene->triangles, triangles) << file;
    }
}

}  // namespace
}  // namespace tessera
