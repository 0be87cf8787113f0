// DXF: every kind of entity as ezdxf measures it, layers, blocks, letters, units, and how a drawing stands.

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <sstream>

#include "common/cores/Geometry.h"
#include "common/cores/Material.h"
#include "common/cores/Switch.h"
#include "common/cores/Text.h"
#include "common/cores/Transform.h"
#include "common/math/Box.h"
#include "common/math/Srgb.h"
#include "common/scene/Action.h"
#include "server/import/reader/DxfColors.h"
#include "server/import/reader/DxfCurves.h"
#include "server/import/reader/DxfText.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

const std::string kDxfFiles = TESSERA_SOURCE_DIR "/tests/data/dxf/";

struct Measured {
    double length = 0, area = 0;
    Box bounds;
};

class DxfScene {
public:
    explicit DxfScene(const std::string& path) : scene_(read(path)), aspect_(ImportedScene(scene_)) {}

    [[nodiscard]] const ImportedScene& scene() const { return scene_; }
    [[nodiscard]] const ImportedAspect& aspect() const { return aspect_; }
    [[nodiscard]] bool notes(std::string_view text) const { return hasNote(scene_, text); }
    template <typename Core>
    [[nodiscard]] std::vector<const Core*> all() const {
        return allOf<Core>(aspect_);
    }
    /// The children of the drawing, by name.
    [[nodiscard]] std::map<std::string, ObjectId> layers() const {
        std::map<std::string, ObjectId> found;
        for (const ObjectId id : aspect_->ids())
            if (const auto* node = aspect_->get<Node>(id))
                if (const auto* parent = aspect_->get<Node>(node->parent); parent && parent->name == "drawing")
                    found[node->name] = id;
        return found;
    }
    [[nodiscard]] Measured measure(ObjectId below) const {
        Measured sum;
        Action action;
        action.on<Geometry>([&](const Visit& visit, const Geometry& geometry) {
            bool within = false;
            for (ObjectId at = visit.nodeId; !within && at.value != 0;) {
                within = at == below;
                const auto* node = aspect_->get<Node>(at);
                at = node ? node->parent : ObjectId{};
            }
            if (!within) return Descend::kInto;
            const std::span<const float> xyz = geometry.positions.as<float>();
            std::vector<Vec3d> places;
            for (std::size_t i = 0; i + 2 < xyz.size(); i += 3)
                places.emplace_back(visit.world_T_node * Vec3d(xyz[i], xyz[i + 1], xyz[i + 2]));
            for (const Vec3d& place : places) sum.bounds.extend(place);
            const std::span<const std::uint32_t> corners = geometry.indices.as<std::uint32_t>();
            if (geometry.primitive == Geometry::kLines)
                for (std::size_t i = 0; i + 1 < corners.size(); i += 2)
                    sum.length += (places[corners[i]] - places[corners[i + 1]]).norm();
            if (geometry.primitive == Geometry::kTriangles)
                for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
                    sum.area += (places[corners[i + 1]] - places[corners[i]])
                                    .cross(places[corners[i + 2]] - places[corners[i]])
                                    .norm() /
                                2;
            return Descend::kInto;
        });
        action.run(*aspect_);
        return sum;
    }

private:
    static ImportedScene read(const std::string& path) {
        Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
        EXPECT_TRUE(scene) << messageOf(scene);
        return scene ? std::move(*scene) : ImportedScene();
    }
    ImportedScene scene_;
    ImportedAspect aspect_;
};

/// Groups of a file's entities, one a line: "0 LINE".
std::string dxf(const std::string& entities, const std::string& before = {}) {
    std::string text = before + "0 SECTION\n2 ENTITIES\n" + entities + "0 ENDSEC\n0 EOF\n", out;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        const std::size_t space = line.find(' ');
        out += line.substr(0, space) + "\n" + (space == line.npos ? "" : line.substr(space + 1)) + "\n";
    }
    return out;
}

TEST(DxfCurves, SweepsThatAreRoundedToAWholeTurnAreOne) {
    constexpr double kTurn = 2 * std::numbers::pi;
    for (const double end : {kTurn, 6.2831853072, 6.28319, 6.2832, -kTurn, 0.0, 2 * kTurn + 1e-5})
        EXPECT_DOUBLE_EQ(dxfSweep(0, end), kTurn) << end;
    EXPECT_DOUBLE_EQ(dxfSweep(1, 1 + 1e-5), (1 + 1e-5) - 1) << "an arc however short";
    EXPECT_NEAR(dxfSweep(0, 6.2831), 6.2831, 1e-12);
    EXPECT_NEAR(dxfSweep(6, 0.5), 0.5 - 6 + kTurn, 1e-12);
    EXPECT_NEAR(dxfSweep(kTurn - 3e-5, 0), 3e-5, 1e-12) << "flat arcs of roads cross 0, too";
}

/// Chords are a little shorter than curves.
void expectAsMeasured(const std::string& file, const std::string& numbers) {
    const DxfScene scene(kDxfFiles + file);
    const std::map<std::string, ObjectId> layers = scene.layers();
    std::istringstream rows(contentOf(kDxfFiles + numbers));
    std::size_t count = 0;
    for (std::string row; std::getline(rows, row); ++count) {
        std::ranges::replace(row, ',', ';');
        std::vector<std::string> cells;
        std::istringstream cut(row);
        for (std::string cell; std::getline(cut, cell, ';');) cells.push_back(cell);
        ASSERT_EQ(cells.size(), 9u);
        SCOPED_TRACE(file + ", layer " + cells[0]);
        const auto layer = layers.find(cells[0]);
        ASSERT_NE(layer, layers.end());
        const Measured is = scene.measure(layer->second);
        const auto number = [&](std::size_t i) { return std::stod(cells[i]); };
        EXPECT_NEAR(is.length, number(1), 2e-3 * number(1) + 1e-5);
        EXPECT_NEAR(is.area, number(2), 2e-3 * number(2) + 1e-5);
        for (int i = 0; i < 3; ++i) {
            EXPECT_NEAR(is.bounds.lower[i], number(3 + static_cast<std::size_t>(i)), 0.012) << i;
            EXPECT_NEAR(is.bounds.upper[i], number(6 + static_cast<std::size_t>(i)), 0.012) << i;
        }
    }
    EXPECT_EQ(count, layers.size());
}

TEST(Dxf, EveryKindOfEntityIsAsLongAndAsLargeAsOthersFindIt) {
    expectAsMeasured("kinds.dxf", "kinds.csv");
    expectAsMeasured("kinds-r12.dxf", "kinds-r12.csv");
}

TEST(Dxf, BinaryFilesOfBothKindsAreTheSame) {
    expectAsMeasured("kinds-binary.dxf", "kinds.csv");
    expectAsMeasured("kinds-r12-binary.dxf", "kinds-r12.csv");
}

TEST(Dxf, LayersBlocksAndLettersOfAPlanAreWhereTheyBelong) {
    for (const char* name : {"plan.dxf", "plan-r12.dxf"}) {
        SCOPED_TRACE(name);
        const DxfScene plan(kDxfFiles + name);
        const std::map<std::string, ObjectId> layers = plan.layers();
        for (const char* layer : {"WALLS", "DOORS", "FURNITURE", "DIMENSIONS", "TEXT", "HIDDEN", "FROZEN"})
            EXPECT_TRUE(layers.contains(layer)) << layer;
        // Two layers are not shown, and there.
        EXPECT_EQ(std::ranges::count_if(plan.all<Switch>(),
                                        [](const Switch* choice) { return choice->choice == Switch::kNone; }),
                  2 + 2);  // and in each of two dimensions the points that it measures
        // Six chairs of two colours, three doors of one: three meshes.
        std::size_t chairs = 0;
        for (const Node* node : plan.all<Node>()) chairs += node->name == "CHAIR";
        EXPECT_EQ(chairs, 6u);
        std::set<std::string> letters;
        for (const Text* text : plan.all<Text>()) letters.insert(text->text);
        EXPECT_TRUE(letters.contains("Saal Ø 7 m²"));
        EXPECT_TRUE(letters.contains("Küche 24 °"));
        EXPECT_TRUE(letters.contains("6"));
        // Millimetres, which R12 cannot say; upright, as a sheet.
        const double metres = plan.notes("it does not say its unit") ? 1000 : 1;
        const Measured walls = plan.measure(layers.at("WALLS"));
        EXPECT_NEAR(walls.bounds.size().x(), 9 * metres, 1e-3);
        EXPECT_NEAR(walls.bounds.size().y(), 6 * metres, 1e-3);
        for (const std::string& note : plan.scene().notes) EXPECT_WORDS(note);
    }
    const DxfScene plan(kDxfFiles + "plan.dxf");
    std::set<std::string> letters;
    for (const Text* text : plan.all<Text>()) letters.insert(text->text);
    EXPECT_TRUE(letters.contains("Tisch\nf1/2 1,40 m"));
    EXPECT_FALSE(plan.notes("it does not say its unit"));
}

TEST(Dxf, ABlockIsStoredOnceForEachLookThatInsertsGiveIt) {
    const Scratch scratch;
    const std::string block =
        "0 SECTION\n2 TABLES\n0 LAYER\n2 A\n62 1\n0 LAYER\n2 B\n62 5\n0 ENDSEC\n"
        "0 SECTION\n2 BLOCKS\n0 BLOCK\n2 OWN\n0 LINE\n8 A\n11 1\n0 ENDBLK\n"
        "0 BLOCK\n2 TAKES\n0 LINE\n8 0\n62 0\n11 1\n0 LINE\n8 0\n11 2\n0 ENDBLK\n0 ENDSEC\n";
    std::string inserts;
    for (int i = 0; i < 100; ++i) {
        inserts += fmt::format("0 INSERT\n2 own\n8 {}\n10 {}\n", i % 2 == 0 ? "A" : "B", i);
        inserts += fmt::format("0 INSERT\n2 TAKES\n8 {}\n62 {}\n10 {}\n", i % 2 == 0 ? "A" : "B", 2 + i % 3, i);
    }
    const DxfScene scene(scratch.write("blocks.dxf", dxf(inserts, block)));
    // OWN once; TAKES of two layers and three colours: the layer's colour, and the insert's.
    EXPECT_EQ(scene.all<Geometry>().size(), 1u + 2 * 3 * 2);
    EXPECT_NEAR(scene.measure(scene.layers().at("A")).length + scene.measure(scene.layers().at("B")).length,
                100 * 1 + 100 * 3, 1e-3);
}

TEST(Dxf, ALayerThatIsOffIsHiddenInBlocksToo) {
    const Scratch scratch;
    const DxfScene scene(scratch.write(
        "hidden.dxf",
        dxf("0 INSERT\n2 B\n8 OFF\n0 INSERT\n2 B\n8 ON\n0 LINE\n8 OFF\n11 1\n",
            "0 SECTION\n2 TABLES\n0 LAYER\n2 OFF\n62 -1\n0 ENDSEC\n0 SECTION\n2 BLOCKS\n"
            "0 BLOCK\n2 B\n0 LINE\n8 0\n11 1\n0 LINE\n8 OFF\n11 10\n0 LINE\n8 ON\n11 100\n0 ENDBLK\n0 ENDSEC\n")));
    // Shown is what the second insert has on layer 0 and on its own.
    EXPECT_NEAR(scene.measure(scene.layers().at("ON")).length, 101, 1e-4);
    EXPECT_EQ(scene.measure(scene.layers().at("OFF")).length, 0);
}

TEST(Dxf, ColoursAreThoseOfThePaletteOrTrueOnes) {
    const Scratch scratch;
    const DxfScene scene(scratch.write(
        "colours.dxf", dxf("0 LINE\n62 30\n11 1\n0 LINE\n420 1122867\n11 1\n0 LINE\n62 7\n11 1\n0 LINE\n11 1\n")));
    std::set<std::string> names;
    for (const Material* material : scene.all<Material>()) {
        EXPECT_TRUE(material->unlit);
        names.insert(fmt::format("{:.3f} {:.3f} {:.3f}", srgbOfLinear(material->baseColor.x()),
                                 srgbOfLinear(material->baseColor.y()), srgbOfLinear(material->baseColor.z())));
    }
    EXPECT_EQ(names, (std::set<std::string>{"1.000 0.498 0.000", "0.067 0.133 0.200", "0.851 0.851 0.851"}));
    EXPECT_EQ(dxfPaletteColor(249), 0x581317u);
    EXPECT_EQ(dxfPaletteColor(252), 0x666666u);
}

TEST(Dxf, CodesOfLettersBecomeWhatTheyMean) {
    EXPECT_EQ(dxfPlainText("%%c12 %%p0.5 at 30%%d 5%%% %%uline%%u %%65"), "Ø12 ±0.5 at 30° 5% line A");
    EXPECT_EQ(dxfPlainText("100%%"), "100%%");
    EXPECT_EQ(dxfParagraphs("{\\fArial|b0;one\\Ptwo} \\H2.5x;three\\~four \\S1/2; \\{x\\} a\\\\b^Jc"),
              "one\ntwo three four 1/2 {x} a\\b\nc");
    const Scratch scratch;
    const std::string western = "0 SECTION\n2 HEADER\n9 $ACADVER\n1 AC1015\n9 $DWGCODEPAGE\n3 ANSI_1252\n0 ENDSEC\n";
    const std::string later = "0 SECTION\n2 HEADER\n9 $ACADVER\n1 AC1021\n9 $INSUNITS\n70 1\n0 ENDSEC\n";
    // As DOS had it, and the same byte is another letter on each page.
    const auto ofPage = [&](const std::string& page) {
        std::string header = western;
        header.replace(header.find("ANSI_1252"), 9, page);
        const DxfScene scene(scratch.write("dos.dxf", dxf("0 TEXT\n40 1\n1 K\x81"
                                                          "che \x9d \xf8\n",
                                                          header)));
        return scene.all<Text>().at(0)->text;
    };
    EXPECT_EQ(ofPage("dos850"), "Küche Ø °");
    EXPECT_EQ(ofPage("dos437"), "Küche ¥ °");
    EXPECT_EQ(ofPage("ANSI_932"), "K_che _ _");
    const DxfScene old(scratch.write("old.dxf", dxf("0 TEXT\n40 1\n1 K\xfc"
                                                    "che \\U+2300\n",
                                                    western)));
    const DxfScene now(scratch.write("new.dxf", dxf("0 TEXT\n40 1\n1 K\xc3\xbc"
                                                    "che\n0 LINE\n11 1\n",
                                                    later)));
    ASSERT_EQ(old.all<Text>().size(), 1u);
    EXPECT_EQ(old.all<Text>()[0]->text, "Küche ⌀");
    ASSERT_EQ(now.all<Text>().size(), 1u);
    EXPECT_EQ(now.all<Text>()[0]->text, "Küche");
    EXPECT_NEAR(now.measure(now.layers().at("0")).length, 0.0254, 1e-7);
}

TEST(Dxf, WhatIsNotShownIsCounted) {
    const Scratch scratch;
    const DxfScene scene(scratch.write(
        "strange.dxf", dxf("0 LINE\n11 1\n0 3DSOLID\n1 x\n0 3DSOLID\n0 RAY\n0 LINE\n67 1\n0 IMAGE\n0 INSERT\n2 NONE\n"
                           "0 BANANA\n0 LINE\n11 1e300\n0 LINE\n10 nan\n0 DIMENSION\n0 MLINE\n")));
    for (const std::string& note : scene.scene().notes) EXPECT_WORDS(note);
    EXPECT_FALSE(scene.notes("it is cut off"));
}

TEST(Dxf, WhatIsNotFlatStandsOnItsXyPlane) {
    const Scratch scratch;
    const std::string file = dxf("0 LINE\n11 1\n0 LINE\n10 0\n20 0\n30 0\n11 0\n21 0\n31 5\n");
    const DxfScene scene(scratch.write("tall.dxf", file));
    EXPECT_FALSE(scene.notes("upright"));
    ImportOptions options = importOptions();
    options.placing = Placing{};
    const Expected<ImportedScene> placed = importScene(scratch.path("tall.dxf"), kRootNode, options);
    ASSERT_TRUE(placed) << messageOf(placed);
    EXPECT_FALSE(hasNote(*placed, "which way is up"));
}

}  // namespace
}  // namespace tessera
