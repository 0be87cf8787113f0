// 3MF and AMF that lie, are cut off, multiply or go in circles: a clear message, or the sound part of it.
#include <cstring>

#include "server/import/reader/ReadScene.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Damage.h"
#include "tests/unit/import/PngBytes.h"
#include "tests/unit/import/PrintingFixture.h"

namespace tessera {
namespace {

/// A file within the child: within 2 s of its own time, and half a gigabyte. What it says where it refuses, else its
/// notes.
std::string printedSays(const std::string& name, const std::string& bytes) {
    const Scratch scratch;
    ImportOptions options = importOptions();
    if (!kSanitized) options.maxCpuTime = std::chrono::seconds(2);
    options.maxMemoryBytes = std::size_t{640} << 20;  // with what the program is
    const Expected<ImportedScene> scene = importScene(scratch.write(name, bytes), kRootNode, options);
    if (!scene) return scene.error().message;
    std::string notes = "(imported) ";
    for (const std::string& note : scene->notes) notes += note + "\n";
    return notes;
}
std::string printedSays(const std::string& model) {
    return printedSays("model.3mf", threeMf(model));
}
void expectPart(const std::string& text, std::string_view part) {
    EXPECT_NE(text.find(part), std::string::npos) << text << " lacks: " << part;
}

std::string threeMfComponents(int id, int of, int count = 1) {
    std::string text = "<components>";
    for (int i = 0; i < count; ++i) text += fmt::format("<component objectid=\"{}\"/>", of);
    return threeMfObject(id, text + "</components>");
}
const std::string kOneItem = "<item objectid=\"1\"/>";

TEST(PrintingHostile, ArchivesThatAreNoneOrCutOffAreRefusedInWords) {
    const std::string whole = threeMf(threeMfModel(threeMfObject(1, squareMesh()), kOneItem));
    EXPECT_WORDS(printedSays("a.3mf", "hello"));
    EXPECT_WORDS(printedSays("a.3mf", whole.substr(0, 300)));
    EXPECT_WORDS(printedSays("a.3mf", archiveOf({{"read.me", "x"}})));
    EXPECT_WORDS(printedSays("a.amf", archiveOf({{"read.me", "x"}})));
    std::string damaged = whole;
    damaged[damaged.find("3D/start.model") + 60] ^= 0x55;
    EXPECT_WORDS(printedSays("a.3mf", damaged));
    std::string encrypted = whole;
    encrypted[encrypted.rfind("PK\1\2") + 8] = 1;
    EXPECT_WORDS(printedSays("a.3mf", encrypted));
}

TEST(PrintingHostile, WhatIsWrongIsSaidWithWhatWouldCureIt) {
    const std::string whole = threeMf(threeMfModel(threeMfObject(1, squareMesh()), kOneItem));
    EXPECT_WORDS(printedSays("a.3mf", "hello"));
    std::string lost = whole;  // an entry of the list, another's place, and its length
    lost[lost.rfind("PK\1\2")] = 'Q';
    EXPECT_WORDS(printedSays("a.3mf", lost));
    lost = whole;
    lost.replace(lost.rfind("PK\1\2") + 42, 4, std::string("\7\0\0\0", 4));
    EXPECT_WORDS(printedSays("a.3mf", lost));
    lost = whole;
    lost.replace(lost.rfind("PK\1\2") + 20, 4, std::string("\0\0\1\0", 4));
    EXPECT_WORDS(printedSays("a.3mf", lost));
    std::string model = threeMfModel(threeMfObject(1, squareMesh()), kOneItem);
    EXPECT_WORDS(printedSays(model.substr(0, model.find("</mesh>")) + "</msh>"));
    EXPECT_WORDS(printedSays(model.substr(0, model.find("</mesh>"))));
    EXPECT_WORDS(printedSays("a.amf", "\x1f\x8b\b"));
}

TEST(PrintingHostile, NumbersThatAreNoneAreNotToldAsOthers) {
    for (const std::string number : {"-1", "abc", "4294967295", "1.5"}) {
        std::string model = threeMfModel(threeMfObject(1, squareMesh()), kOneItem);
        model.replace(model.find("v1=\"") + 4, 1, number);
        const std::string said = printedSays(model);
        EXPECT_WORDS(said);
        EXPECT_EQ(said.find("4294967295"), std::string::npos) << said;
    }
    const std::string mesh =
        "<mesh><vertices><vertex><coordinates><x>0</x><y>0</y><z>0</z></coordinates></vertex><vertex><coordinates><x>1"
        "</x><y>0</y><z>0</z></coordinates></vertex><vertex><coordinates><x>0</x><y>1</y><z>0</z></coordinates></"
        "vertex>"
        "</vertices><volume materialid=\"red\"><triangle><v1>0</v1><v2>1</v2><v3>2</v3></triangle></volume></mesh>";
    const std::string said = printedSays("a.amf", "<amf><object id=\"abc\">" + mesh +
                                                      "</object><constellation id=\"1\"><instance objectid=\"abc\"/>"
                                                      "</constellation></amf>");
    EXPECT_WORDS(said);
    EXPECT_EQ(said.find("4294967295"), std::string::npos) << said;
}

TEST(PrintingHostile, BombsAreRefusedBeforeTheyAreUnpacked) {
    const std::string blanks(64 << 20, ' ');
    const std::string text = threeMfModel(threeMfObject(1, squareMesh()) + blanks, kOneItem);
    EXPECT_WORDS(printedSays(text));
    EXPECT_WORDS(printedSays("a.amf", archiveOf({{"a.amf", "<amf>" + blanks + "</amf>"}})));
    // One that says it is small.
    std::string liar = threeMf(text);
    const std::size_t entry = liar.rfind("PK\1\2");
    liar.replace(entry + 24, 4, std::string("\0\x10\0\0", 4));
    EXPECT_WORDS(printedSays("a.3mf", liar));
}

TEST(PrintingHostile, EntitiesOfAnyKindAreRefused) {
    for (const std::string entity : {"<!ENTITY a \"ha\">", "<!ENTITY a SYSTEM \"file:///etc/passwd\">"}) {
        std::string model = threeMfModel(threeMfObject(1, squareMesh()), kOneItem);
        model.insert(model.find("<model"), "<!DOCTYPE model [" + entity + "]>");
        EXPECT_WORDS(printedSays(model));
        EXPECT_WORDS(printedSays("a.amf", "<!DOCTYPE amf [" + entity + "]><amf>&a;</amf>"));
    }
}

TEST(PrintingHostile, WhatIsNoXmlOrAnotherOneIsNamedWithItsLine) {
    EXPECT_WORDS(printedSays("<html>\n</html>"));
    EXPECT_WORDS(printedSays("a.amf", "<html/>"));
    EXPECT_WORDS(printedSays("a.amf", ""));
    EXPECT_WORDS(printedSays("<model>\n<resources>\n</build>"));
    EXPECT_WORDS(printedSays("a.amf", "<amf>" + std::string(1'000'000, '<')));
    std::string deep;
    for (int i = 0; i < 100'000; ++i) deep += "<a>";
    EXPECT_WORDS(printedSays("a.amf", "<amf>" + deep));
    EXPECT_WORDS(printedSays("a.amf", "<amf name=\"" + std::string(10'000'000, 'x') + "\"/>"));
}

TEST(PrintingHostile, ComponentsThatMultiplyNestOrGoInCirclesAreBounded) {
    std::string many = threeMfObject(1, squareMesh()), deep = many, circle = many;
    for (int i = 2; i < 30; ++i) many += threeMfComponents(i, i - 1, 10);
    EXPECT_WORDS(printedSays(threeMfModel(many, "<item objectid=\"29\"/>")));
    for (int i = 2; i <= 40'000; ++i) deep += threeMfComponents(i, i - 1);
    EXPECT_WORDS(printedSays(threeMfModel(deep, "<item objectid=\"40000\"/>")));
    circle +=
        "<object id=\"2\"><components><component objectid=\"3\"/><component objectid=\"1\"/></components></object>" +
        threeMfComponents(3, 2);
    EXPECT_WORDS(printedSays(threeMfModel(circle, "<item objectid=\"2\"/>")));
    std::string constellations = "<amf><object id=\"1\"><mesh/></object>";
    for (int i = 2; i < 40; ++i)
        constellations += fmt::format(
            "<constellation id=\"{0}\"><instance objectid=\"{1}\"/><instance objectid=\"{1}\"/>"
            "</constellation>",
            i, i - 1);
    EXPECT_WORDS(printedSays("a.amf", constellations + "</amf>"));
    std::string items;
    for (int i = 0; i < 500'001; ++i) items += kOneItem;
    EXPECT_WORDS(printedSays(threeMfModel(threeMfObject(1, squareMesh()), items)));
}

TEST(PrintingHostile, WhatIsWrongInOnePlaceCostsThatPlace) {
    const auto with = [](const std::string& find, const std::string& by) {
        std::string mesh = squareMesh();
        mesh.replace(mesh.find(find), find.size(), by);
        return printedSays(threeMfModel(threeMfObject(1, mesh), kOneItem));
    };
    EXPECT_WORDS(with("v3=\"3\"", "v3=\"4\""));
    EXPECT_WORDS(with("v3=\"3\"", "v3=\"-1\""));
    EXPECT_WORDS(with("v3=\"3\"", ""));
    // The fourth vertex.
    EXPECT_WORDS(with("x=\"0\" y=\"1\"", "x=\"nan\" y=\"1\""));
    EXPECT_WORDS(with("x=\"0\" y=\"1\"", "x=\"1e99\" y=\"1\""));
    const auto placed = [](const std::string& items) {
        return printedSays(
            threeMfModel(threeMfObject(1, squareMesh()) + threeMfObject(1, squareMesh()), kOneItem + items));
    };
    EXPECT_WORDS(placed(""));
    EXPECT_WORDS(placed("<item objectid=\"7\"/>"));
    for (const char* transform : {"1 0 0 0 0 0 0 0 1 0 0 0", "1 2 3", "nan 0 0 0 1 0 0 0 1 0 0 0",
                                  "1e300 0 0 0 1 0 0 0 1 0 0 0", "1 0 0 0 1 0 0 0 1 0 0 0 0", "a"})
        EXPECT_WORDS(placed(fmt::format("<item objectid=\"1\" transform=\"{}\"/>", transform)));
    EXPECT_WORDS(placed("<item objectid=\"1\" p:path=\"/../../etc/passwd\"/>"));
    EXPECT_WORDS(printedSays(threeMfModel(threeMfObject(1, squareMesh()), "")));
    EXPECT_WORDS(printedSays(threeMfModel("", kOneItem)));
    EXPECT_WORDS(
        printedSays(threeMfModel("<object id=\"1\" pid=\"4\" pindex=\"0\">" + squareMesh() + "</object>", kOneItem)));
}

TEST(PrintingHostile, ExtensionsThatAreRequiredAndNotReadAreRefusedByName) {
    const auto model = [](const std::string& attributes) {
        return printedSays(threeMfModel(threeMfObject(1, squareMesh()), kOneItem, attributes));
    };
    EXPECT_WORDS(model("requiredextensions=\"v\" xmlns:v=\"http://schemas.3mf.io/volumetric/2022/01\""));
    EXPECT_WORDS(model("requiredextensions=\"q\""));
    expectPart(model("requiredextensions=\"m p\""), "(imported)");
}

TEST(PrintingHostile, ManySmallThingsTakeTheirTimeOnce) {
    // A volume for each triangle of very many vertices.
    std::string vertices, volumes;
    for (int i = 0; i < 20'000; ++i) {
        vertices += fmt::format("<vertex><coordinates><x>{}</x><y>1</y><z>{}</z></coordinates></vertex>", i, i * i % 7);
        volumes += "<volume><triangle><v1>0</v1><v2>1</v2><v3>2</v3></triangle></volume>";
    }
    expectPart(printedSays("a.amf", "<amf><object id=\"1\"><mesh><vertices>" + vertices + "</vertices>" + volumes +
                                        "</mesh></object></amf>"),
               "(imported)");
}

TEST(PrintingHostile, MoreSmallThingsThanTheirBytesBearAreRefused) {
    std::string objects, items, volumes;
    for (int i = 1; i <= 100'000; ++i) {
        objects += threeMfObject(i, squareMesh());
        items += fmt::format("<item objectid=\"{}\"/>", i);
        volumes += "<volume><triangle><v1>0</v1><v2>1</v2><v3>2</v3></triangle></volume>";
    }
    const std::string said = printedSays(threeMfModel(objects, items));
    EXPECT_WORDS(said);
    std::string vertices;
    for (const char* xyz : {"<x>0</x><y>0</y><z>0</z>", "<x>1</x><y>0</y><z>0</z>", "<x>0</x><y>1</y><z>0</z>"})
        vertices += fmt::format("<vertex><coordinates>{}</coordinates></vertex>", xyz);
    const std::string amf =
        "<amf><object id=\"1\"><mesh><vertices>" + vertices + "</vertices>" + volumes + "</mesh></object></amf>";
    EXPECT_WORDS(printedSays("a.amf", amf));
    items.clear();
    for (int i = 0; i < 490'000; ++i) items += kOneItem;
    EXPECT_WORDS(printedSays(threeMfModel(threeMfObject(1, squareMesh()), items)));
}

TEST(PrintingHostile, WhatIsMixedOfVeryManyIsMixedOnce) {
    constexpr int kParts = 20'000;
    std::string zeros, ones, triangles;
    for (int i = 0; i < kParts; ++i) {
        zeros += "0 ";
        ones += "1 ";
        triangles += "<triangle v1=\"0\" v2=\"1\" v3=\"2\" pid=\"2\" p1=\"0\" p2=\"0\" p3=\"0\"/>";
    }
    const std::string base = "<basematerials id=\"1\"><base name=\"Red\" displaycolor=\"#FF0000\"/></basematerials>",
                      object = threeMfObject(
                          3,
                          "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/>"
                          "<vertex x=\"0\" y=\"1\" z=\"0\"/></vertices><triangles>" +
                              triangles + "</triangles></mesh>");
    for (const std::string& mixed :
         {fmt::format("<compositematerials id=\"2\" matid=\"1\" matindices=\"{}\"><composite values=\"{}\"/>"
                      "</compositematerials>",
                      zeros, ones),
          fmt::format("<multiproperties id=\"2\" pids=\"{}\"><multi pindices=\"{}\"/></multiproperties>", ones, zeros)})
        expectPart(printedSays(threeMfModel(base + mixed + object, "<item objectid=\"3\"/>")), "(imported)");
}

TEST(PrintingHostile, PicturesAreDecodedAsFarAsTheirBytesBear) {
    std::string resources, triangles;
    ZipParts beside;
    for (int i = 0; i < 12; ++i) {
        resources += fmt::format(
            "<texture2d id=\"{0}\" path=\"/{0}.png\"/><texture2dgroup id=\"{1}\" texid=\"{0}\"><tex2coord u=\"0\" "
            "v=\"0\"/></texture2dgroup>",
            100 + i, 200 + i);
        triangles += fmt::format("<triangle v1=\"0\" v2=\"1\" v3=\"2\" pid=\"{}\" p1=\"0\"/>", 200 + i);
        beside.push_back({fmt::format("{}.png", 100 + i), blackPng(8000, 8000)});
    }
    const std::string said = printedSays(
        "a.3mf", threeMf(threeMfModel(resources + threeMfObject(1,
                                                                "<mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/>"
                                                                "<vertex x=\"1\" y=\"0\" z=\"0\"/><vertex "
                                                                "x=\"0\" y=\"1\" z=\"0\"/></vertices><triangles>" +
                                                                    triangles + "</triangles></mesh>"),
                                      kOneItem),
                         beside));
    expectPart(said, "(imported)");
    expectPart(said, "'/100.png' was reduced to 4000 × 4000 pixels");
    expectPart(said, "a PNG picture of 8000 × 8000 pixels, with the pictures before it, which are more than the");
}

/// As whole as a file can be: all that the readers know.
std::string allOfThreeMf() {
    return threeMfModel(
        "<basematerials id=\"5\"><base name=\"Red\" displaycolor=\"#FF0000\"/></basematerials><m:colorgroup id=\"3\">"
        "<m:color color=\"#102030\"/><m:color color=\"#40506080\"/></m:colorgroup><m:texture2d id=\"7\" "
        "path=\"/a.tga\" "
        "contenttype=\"image/png\"/><m:texture2dgroup id=\"8\" texid=\"7\"><m:tex2coord u=\"0\" v=\"0.5\"/>"
        "<m:tex2coord u=\"1\" v=\"1e0\"/></m:texture2dgroup><m:compositematerials id=\"6\" matid=\"5\" "
        "matindices=\"0\"><m:composite values=\"0.5\"/></m:compositematerials><m:multiproperties id=\"9\" "
        "pids=\"5 3 8\" blendmethods=\"multiply mix\"><m:multi pindices=\"0 1 1\"/></m:multiproperties>" +
            threeMfObject(1, squareMesh("pid=\"3\" p1=\"0\" p2=\"1\" p3=\"1\"", "pid=\"9\" p1=\"0\"")) +
            "<object id=\"2\" type=\"other\" pid=\"5\" pindex=\"0\">" + squareMesh() + "</object>" +
            "<object id=\"4\"><components><component objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 1 2 3\"/><component "
            "objectid=\"2\"/></components></object>",
        "<item objectid=\"4\" partnumber=\"X\"/><item objectid=\"1\" p:path=\"/b.model\"/>",
        "unit=\"inch\" requiredextensions=\"m p\"");
}
const std::string kWholeAmf =
    "<?xml version=\"1.0\"?><amf unit=\"inch\"><metadata type=\"name\">All</metadata><material id=\"2\"><metadata "
    "type=\"name\">M</metadata><color><r>0.1</r><g>1</g><b>0</b><a>0.5</a></color></material><object id=\"1\"><color>"
    "<r>1</r></color><mesh><vertices><vertex><coordinates><x>0</x><y>0</y><z>0</z></coordinates></vertex><vertex>"
    "<coordinates><x>1</x><y>0</y><z>0</z></coordinates><color><b>1</b></color></vertex><vertex><coordinates><x>0</x>"
    "<y>1</y><z>1e0</z></coordinates></vertex></vertices><volume materialid=\"2\"><triangle><v1>0</v1><v2>1</v2><v3>2"
    "</v3></triangle></volume><volume><triangle><color><g>1</g></color><v1>2</v1><v2>1</v2><v3>0</v3></triangle>"
    "</volume></mesh></object><constellation id=\"3\"><instance objectid=\"1\"><deltax>1</deltax><rz>45</rz></instance>"
    "<instance objectid=\"1\"/></constellation></amf>";

/// The parts of a file in XML, or the bytes of an archive.
enum class DamageTo : std::uint8_t { kThreeMfModel, kThreeMfArchive, kAmf, kAmfArchive };

class PrintingDamage : public testing::TestWithParam<DamageTo> {};

TEST_P(PrintingDamage, LeadsToASceneOrWords) {
    const Scratch scratch;
    const Seeds seeds;
    const std::string_view letters = "0123456789-+.eE/<>\"&;# xyzvpm";
    const ZipParts beside = {{"a.tga", pictureOf({{255, 0, 0, 255}, {0, 0, 255, 255}})},
                             {"b.model", threeMfModel(threeMfObject(1, squareMesh()), "")}};
    const std::string model = allOfThreeMf(), archive = threeMf(model, beside),
                      amfArchive = archiveOf({{"a.amf", kWholeAmf}});
    std::size_t read = 0;
    for (unsigned seed = seeds.first; seed < seeds.end; ++seed) {
        SCOPED_TRACE(fmt::format("TESSERA_SEED={} build/bin/unit_import --gtest_filter=*PrintingDamage*", seed));
        const bool isAmf = GetParam() == DamageTo::kAmf || GetParam() == DamageTo::kAmfArchive;
        const std::string bytes = GetParam() == DamageTo::kThreeMfModel ? threeMf(damaged(model, letters, seed), beside)
                                  : GetParam() == DamageTo::kThreeMfArchive ? damaged(archive, letters, seed)
                                  : GetParam() == DamageTo::kAmf            ? damaged(kWholeAmf, letters, seed)
                                                                            : damaged(amfArchive, letters, seed);
        const std::string path = scratch.write(isAmf ? "a.amf" : "a.3mf", bytes);
        const Expected<PlainScene> scene = isAmf ? readAmf(path, {}) : readThreeMf(path, {});
        if (scene) {
            ++read;
            expectSoundMeshes(*scene);
            for (const proto::scene::Mesh& made : scene->file.mesh())
                EXPECT_TRUE(made.normals_blob() != 0 && made.indices_blob() != 0);
        } else {
            EXPECT_FALSE(scene.error().message.empty());
        }
        if (testing::Test::HasFailure()) return;
    }
    expectSomeRead(read, seeds);
}

INSTANTIATE_TEST_SUITE_P(Of, PrintingDamage,
                         testing::Values(DamageTo::kThreeMfModel, DamageTo::kThreeMfArchive, DamageTo::kAmf,
                                         DamageTo::kAmfArchive));

TEST(PrintingHostile, CirclesThatNothingElseHoldsAreShownFromTheirFirst) {
    const std::string circle = threeMfObject(1, squareMesh()) +
                               threeMfObject(2,
                                             "<components><component objectid=\"1\"/><component objectid=\"3\"/>"
                                             "</components>") +
                               threeMfObject(3, "<components><component objectid=\"2\"/></components>");
    const PrintedScene package("model.3mf", threeMf(threeMfModel(circle, "")));
    EXPECT_EQ(package.corners().size(), 6u);
    EXPECT_WORDS(package.notes());
    const PrintedScene amf(
        "model.amf",
        "<?xml version=\"1.0\"?><amf unit=\"meter\"><object "
        "id=\"1\"><mesh><vertices><vertex><coordinates><x>0</x><y>0</y>"
        "<z>0</z></coordinates></vertex><vertex><coordinates><x>1</x><y>0</y><z>0</z></coordinates></vertex><vertex>"
        "<coordinates><x>0</x><y>1</y><z>0</z></coordinates></vertex></vertices><volume><triangle><v1>0</v1><v2>1</v2>"
        "<v3>2</v3></triangle></volume></mesh></object><constellation id=\"2\"><instance objectid=\"3\"/><instance "
        "objectid=\"1\"/></constellation><constellation id=\"3\"><instance objectid=\"2\"/></constellation></amf>");
    EXPECT_EQ(amf.corners().size(), 3u);
}

}  // namespace
}  // namespace tessera
