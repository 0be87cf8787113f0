// 3MF: units, components, properties, parts of a package, and counts by others.
#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/cores/Switch.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/PrintingFixture.h"

namespace tessera {
namespace {

PrintedScene threeMfScene(const std::string& resources, const std::string& build = "<item objectid=\"1\"/>",
                          const ZipParts& beside = {}) {
    return {"model.3mf", threeMf(threeMfModel(resources, build), beside)};
}

std::string threeMfObject(int id, const std::string& content, const std::string& attributes = "") {
    return fmt::format("<object id=\"{}\" {}>{}</object>\n", id, attributes, content);
}

/// Of a scene's only geometry the different colours of vertices, in order.
std::vector<std::uint32_t> vertexColorsOf(const Geometry& geometry) {
    std::vector<std::uint32_t> colors;
    const auto bytes = geometry.colors.as<std::uint8_t>();
    for (std::size_t at = 0; at + 3 < bytes.size(); at += 4)
        colors.push_back(std::uint32_t{bytes[at]} << 24 | std::uint32_t{bytes[at + 1]} << 16 |
                         std::uint32_t{bytes[at + 2]} << 8 | bytes[at + 3]);
    std::ranges::sort(colors);
    colors.erase(std::unique(colors.begin(), colors.end()), colors.end());
    return colors;
}

TEST(ThreeMf, StandsInMetresWithItsTitleAndNames) {
    for (const auto& [unit, metres] : {std::pair("micron", 1e-6),
                                       {"millimeter", 1e-3},
                                       {"centimeter", 1e-2},
                                       {"inch", 0.0254},
                                       {"foot", 0.3048},
                                       {"meter", 1.0}}) {
        std::string model = threeMfModel(threeMfObject(1, squareMesh(), "name=\"Plate\""), "<item objectid=\"1\"/>",
                                         fmt::format("unit=\"{}\"", unit));
        model.insert(model.find("<resources>"), "<metadata name=\"Title\">Test plate</metadata>");
        const PrintedScene scene("model.3mf", threeMf(model));
        expectNear(scene.bounds().upper, Vec3d(metres, metres, 0), 1e-9);
        EXPECT_TRUE(scene.has("/Test plate/Plate")) << unit;
    }
    const PrintedScene none("model.3mf",
                            threeMf(threeMfModel(threeMfObject(1, squareMesh()), "<item objectid=\"1\"/>", "")));
    expectNear(none.bounds().upper, Vec3d(0.001, 0.001, 0), 1e-9);
    const PrintedScene odd(
        "model.3mf", threeMf(threeMfModel(threeMfObject(1, squareMesh()), "<item objectid=\"1\"/>", "unit=\"mile\"")));
    EXPECT_WORDS(odd.notes());
}

TEST(ThreeMf, ComponentsShareOneGeometryAndStandWhereTransformsSay) {
    const PrintedScene scene = threeMfScene(
        threeMfObject(1, squareMesh(), "name=\"leaf\"") +
            threeMfObject(
                2,
                "<components><component objectid=\"1\"/><component objectid=\"1\" transform=\"0 1 0 -1 0 0 0 0 1 5 "
                "6 7\"/></components>",
                "name=\"pair\""),
        "<item objectid=\"2\"/><item objectid=\"2\" transform=\"2 0 0 0 2 0 0 0 2 100 0 0\" partnumber=\"P7\"/>");
    EXPECT_EQ(scene.scene().triangles, 8u);
    EXPECT_EQ(scene.all<Geometry>().size(), 1u);
    const std::vector<Vec3d> corners = scene.corners();
    ASSERT_EQ(corners.size(), 24u);
    expectNear(corners[1], Vec3d(1, 0, 0));
    expectNear(corners[7], Vec3d(5, 7, 7));       // (1, 0, 0) turned to y, and moved
    expectNear(corners[19], Vec3d(110, 14, 14));  // that, twice as large, and moved
}

TEST(ThreeMf, APartNumberNamesWhatHasNoName) {
    const PrintedScene scene =
        threeMfScene(threeMfObject(1, squareMesh()) + threeMfObject(2, squareMesh(), "partnumber=\"A-2\""),
                     "<item objectid=\"1\" partnumber=\"A-1\"/><item objectid=\"2\"/><item objectid=\"1\"/>");
    for (const char* name : {"A-1", "A-2", "object 1"}) EXPECT_TRUE(scene.has(std::string("/model/") + name)) << name;
}

const std::string kThreeMfBases =
    "<basematerials id=\"5\"><base name=\"Red\" displaycolor=\"#FF0000\"/><base name=\"Glass\" "
    "displaycolor=\"#00FF0080\"/></basematerials>";

TEST(ThreeMf, BaseMaterialsAreMaterialsByTheirNames) {
    const PrintedScene scene =
        threeMfScene(kThreeMfBases + threeMfObject(1, squareMesh("", "pid=\"5\" p1=\"1\""), "pid=\"5\" pindex=\"0\""));
    EXPECT_EQ(scene.all<Geometry>().size(), 2u);
    EXPECT_TRUE(scene.has("/model/object 1/Red") && scene.has("/model/object 1/Glass"));
    const std::vector<const Material*> materials = scene.all<Material>();
    ASSERT_EQ(materials.size(), 2u);
    EXPECT_EQ(materials[0]->baseColor, Vec4f(1, 0, 0, 1));
    EXPECT_NEAR(materials[1]->baseColor[3], 128 / 255.0, 1e-6);
    EXPECT_EQ(materials[1]->alphaMode, Material::kBlend);
    EXPECT_FALSE(materials[0]->doubleSided) << "a solid";
    // All of one: one mesh, one material.
    const PrintedScene one =
        threeMfScene(kThreeMfBases + threeMfObject(1, squareMesh(), "pid=\"5\" pindex=\"1\" type=\"surface\""));
    EXPECT_EQ(one.all<Geometry>().size(), 1u);
    ASSERT_EQ(one.all<Material>().size(), 1u);
    EXPECT_TRUE(one.all<Material>()[0]->doubleSided) << "no solid";
}

TEST(ThreeMf, VeryManyBaseMaterialsOfAnObjectAreColoursOfVertices) {
    std::string bases = "<basematerials id=\"5\">", triangles;
    for (int i = 0; i < 100; ++i) {
        bases += fmt::format("<base name=\"M{0}\" displaycolor=\"#0000{0:02X}\"/>", i);
        triangles += fmt::format("<triangle v1=\"0\" v2=\"1\" v3=\"2\" pid=\"5\" p1=\"{}\"/>", i);
    }
    std::string mesh = squareMesh();
    mesh.insert(mesh.find("</triangles>"), triangles);
    const PrintedScene scene =
        threeMfScene(bases + "</basematerials>" + threeMfObject(1, mesh, "pid=\"5\" pindex=\"0\""));
    ASSERT_EQ(scene.all<Geometry>().size(), 1u);
    EXPECT_EQ(vertexColorsOf(*scene.all<Geometry>()[0]).size(), 100u);
    EXPECT_WORDS(scene.notes());
}

TEST(ThreeMf, ColoursOfCornersAreThoseOfVertices) {
    const std::string group =
        "<m:colorgroup id=\"3\"><m:color color=\"#102030\"/><m:color color=\"#405060FF\"/><m:color "
        "color=\"#708090\"/></m:colorgroup>";
    const PrintedScene scene = threeMfScene(
        group + threeMfObject(1, squareMesh("pid=\"3\" p1=\"0\" p2=\"1\" p3=\"2\"", "pid=\"3\" p1=\"2\"")));
    ASSERT_EQ(scene.all<Geometry>().size(), 1u);
    EXPECT_EQ(vertexColorsOf(*scene.all<Geometry>()[0]),
              (std::vector<std::uint32_t>{0x102030ff, 0x405060ff, 0x708090ff}));
    ASSERT_EQ(scene.all<Material>().size(), 1u);
    EXPECT_EQ(scene.all<Material>()[0]->baseColor, Vec4f(1, 1, 1, 1));
    // A border between colours is no edge: both triangles' normals are the same.
    EXPECT_EQ(scene.all<Geometry>()[0]->normals.as<float>()[2], 1.0f);
    const PrintedScene one = threeMfScene(group + threeMfObject(1, squareMesh(), "pid=\"3\" pindex=\"1\""));
    EXPECT_EQ(one.all<Geometry>()[0]->colors.sizeBytes(), 0u);
    EXPECT_TRUE(one.all<Material>()[0]->baseColor.isApprox(Vec4f(0.0512695f, 0.0802198f, 0.1169707f, 1), 1e-4f))
        << one.all<Material>()[0]->baseColor.transpose();
}

TEST(ThreeMf, PicturesOfThePackageLieOnTriangles) {
    const std::string texture =
        "<m:texture2d id=\"7\" path=\"/3D/Texture/a.png\" contenttype=\"image/png\" tilestyleu=\"mirror\" "
        "tilestylev=\"clamp\" filter=\"nearest\"/><m:texture2dgroup id=\"8\" texid=\"7\"><m:tex2coord u=\"0\" "
        "v=\"0\"/><m:tex2coord u=\"1\" v=\"0\"/><m:tex2coord u=\"1\" v=\"1\"/></m:texture2dgroup>";
    const std::string mesh = squareMesh("pid=\"8\" p1=\"0\" p2=\"1\" p3=\"2\"");
    const PrintedScene scene = threeMfScene(texture + threeMfObject(1, mesh), "<item objectid=\"1\"/>",
                                            {{"3D/Texture/A.png", pictureOf({{255, 0, 0, 255}, {0, 0, 255, 255}})}});
    EXPECT_EQ(scene.all<Geometry>().size(), 2u) << "one triangle says nothing";
    ASSERT_EQ(scene.all<Image>().size(), 1u);
    const Image& image = *scene.all<Image>()[0];
    EXPECT_EQ(image.wrapU, Image::kMirror);
    EXPECT_EQ(image.wrapV, Image::kClamp);
    bool found = false;
    for (const Geometry* geometry : scene.all<Geometry>()) {
        const auto uv = geometry->texcoords.as<float>();
        if (uv.empty()) continue;
        found = true;
        ASSERT_EQ(uv.size(), 6u);
        EXPECT_EQ(uv[1], 1.0f) << "from the picture's upper edge";
        EXPECT_EQ(uv[5], 0.0f);
    }
    EXPECT_TRUE(found);
    const PrintedScene lost = threeMfScene(texture + threeMfObject(1, mesh));
    EXPECT_WORDS(lost.notes());
}

TEST(ThreeMf, MixturesAndLayersAreWorkedOut) {
    const std::string resources =
        kThreeMfBases +
        "<m:compositematerials id=\"6\" matid=\"5\" matindices=\"0 1\"><m:composite values=\"1 "
        "0\"/></m:compositematerials><m:colorgroup id=\"3\"><m:color color=\"#808080\"/><m:color "
        "color=\"#0000FF00\"/></m:colorgroup><m:multiproperties id=\"9\" pids=\"5 3 3\" blendmethods=\"multiply "
        "mix\"><m:multi pindices=\"0 0 1\"/></m:multiproperties>";
    const auto colorOf = [&](const std::string& attributes) {
        const PrintedScene scene = threeMfScene(resources + threeMfObject(1, squareMesh(), attributes));
        return scene.all<Material>().size() == 1 ? scene.all<Material>()[0]->baseColor : Vec4f(0, 0, 0, 0);
    };
    EXPECT_EQ(colorOf("pid=\"6\" pindex=\"0\""), Vec4f(1, 0, 0, 1));
    // Red times grey; a clear blue over it changes nothing.
    const Vec4f layers = colorOf("pid=\"9\" pindex=\"0\"");
    EXPECT_NEAR(layers[0], 0.2158605, 1e-4) << layers.transpose();
    EXPECT_EQ(layers[2], 0.0f);
}

TEST(ThreeMf, ModelsOfOtherPartsAreReadByTheirPaths) {
    const std::string part = threeMfModel(threeMfObject(1, squareMesh(), "name=\"inner\""), "");
    const std::string start = threeMfModel(
        threeMfObject(1, "<components><component objectid=\"1\" p:path=\"/3D/Objects/part%201.model\"/></components>"),
        "<item objectid=\"1\"/><item objectid=\"1\" p:path=\"/3D/Objects/part%201.model\"/><item objectid=\"1\" "
        "p:path=\"/3D/none.model\"/>",
        "unit=\"meter\" requiredextensions=\"p\"");
    const PrintedScene scene("model.3mf", threeMf(start, {{"3D/Objects/part 1.model", part}}));
    EXPECT_EQ(scene.scene().triangles, 4u);
    EXPECT_EQ(scene.all<Geometry>().size(), 1u);
    EXPECT_WORDS(scene.notes());
}

TEST(ThreeMf, WhatIsNotPrintedIsHidden) {
    const PrintedScene scene = threeMfScene(threeMfObject(1, squareMesh(), "type=\"other\" name=\"modifier\"") +
                                                threeMfObject(2, squareMesh(), "type=\"support\""),
                                            "<item objectid=\"1\"/><item objectid=\"2\"/>");
    ASSERT_EQ(scene.all<Switch>().size(), 1u);
    EXPECT_EQ(scene.all<Switch>()[0]->choice, Switch::kNone);
    EXPECT_WORDS(scene.notes());
    EXPECT_EQ(scene.scene().triangles, 4u);
}

TEST(ThreeMf, ExtensionsThatAreLeftOutAreNamed) {
    std::string mesh = squareMesh("paint_color=\"4\"");
    mesh.insert(mesh.find("</mesh>"), "<b:beamlattice xmlns:b=\"x\"><b:beams/></b:beamlattice>");
    const PrintedScene scene =
        threeMfScene("<s:slicestack id=\"4\" xmlns:s=\"y\"/>" + threeMfObject(1, mesh, "name=\"lattice\""));
    for (const std::string& note : scene.scene().notes) EXPECT_WORDS(note);
}

TEST(ThreeMf, ArchivesAreReadStoredAndWithSizesOf64Bits) {
    const ZipParts parts = {{"_rels/.rels", kThreeMfRelations},
                            {"3D/start.model", threeMfModel(threeMfObject(1, squareMesh()), "<item objectid=\"1\"/>")}};
    for (const bool isDeflated : {false, true})
        for (const bool isLong : {false, true})
            EXPECT_EQ(PrintedScene("model.3mf", archiveOf(parts, isDeflated, isLong)).scene().triangles, 2u);
}

/// Triangles as Python's zipfile and xml.etree count them, through components and items:
/// sum(count(item) for item in build), where count(object) is its triangles and those of its components.
TEST(ThreeMf, FilesOfOthersHaveAsManyTrianglesAsPythonCounts) {
    const std::string box = std::string(kDebianModels) + "/3MF/box.3mf";
    const Expected<ImportedScene> small = importScene(box, kRootNode, importOptions());
    ASSERT_TRUE(small) << messageOf(small);
    EXPECT_EQ(small->triangles, 12u);
    const std::string counter = testData() + "/cad/counterXP.3MF";
    if (!std::filesystem::exists(counter)) GTEST_SKIP() << "no data of others here";
    const Expected<ImportedScene> large = importScene(counter, kRootNode, importOptions());
    ASSERT_TRUE(large) << messageOf(large);
    EXPECT_EQ(large->triangles, 83'750u);
    EXPECT_EQ(large->geometries, 3u) << "a body of two looks, and a screw in five places";
}

/// Packages have percent signs in the names of parts, as OPC wants it; other archives what they stand for.
TEST(ThreeMfParts, AreFoundByTheirPercentSigns) {
    std::string relations = kThreeMfRelations;
    const std::string start = "start.model";
    relations.replace(relations.find(start), start.size(), "my%20model.model");
    const std::string right = threeMfModel(threeMfObject(1, squareMesh(), "name=\"right\""), "<item objectid=\"1\"/>"),
                      wrong = threeMfModel(threeMfObject(1, squareMesh(), "name=\"wrong\""), "<item objectid=\"1\"/>");
    for (const char* const name : {"3D/my%20model.model", "3D/my model.model"}) {
        const PrintedScene scene("model.3mf",
                                 archiveOf({{"_rels/.rels", relations}, {"3D/3dmodel.model", wrong}, {name, right}}));
        EXPECT_TRUE(scene.has("/model/right")) << name;
        EXPECT_FALSE(scene.notes("does not say where its model is")) << name;
    }
}

}  // namespace
}  // namespace tessera
