// VRML, X3D and Inventor: which of a material, a picture and colours of corners is seen, at rest and while it moves.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <optional>
#include <vector>

#include "common/cores/Animation.h"
#include "common/cores/Geometry.h"
#include "common/cores/Material.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"
#include "tests/unit/import/PngBytes.h"

namespace tessera {
namespace {

const std::string kLooksHead = "#VRML V2.0 utf8\n";
const std::string kRedCorners = "color Color { color [ 1 0 0, 1 0 0, 1 0 0 ] } ";
const std::string kThreePoints = "coord Coordinate { point [ 0 0 0, 1 0 0, 0 1 0 ] } ";

class CoinLooks : public testing::Test {
protected:
    void read(const std::string& name, const std::string& text) {
        Expected<ImportedScene> scene = importScene(scratch_.write(name, text), kRootNode, importOptions());
        ASSERT_TRUE(scene) << messageOf(scene);
        notes_ = fmt::format("{}", fmt::join(scene->notes, "\n"));
        aspect_.emplace(std::move(*scene));
    }
    template <typename Core>
    [[nodiscard]] std::vector<const Core*> all() const {
        std::vector<const Core*> found;
        for (const ObjectId id : (**aspect_).ids())
            if (const auto* core = (**aspect_).template get<Core>(id)) found.push_back(core);
        return found;
    }
    /// Of the only geometry.
    [[nodiscard]] std::vector<int> cornerColors() const {
        const auto geometries = all<Geometry>();
        if (geometries.size() != 1) return {};
        const auto colors = geometries[0]->colors.as<std::uint8_t>();
        return {colors.begin(), colors.end()};
    }

    const Scratch scratch_;
    std::optional<ImportedAspect> aspect_;
    std::string notes_;
};

std::string shapeOf(const std::string& material, const std::string& geometry, const std::string& more = "") {
    return fmt::format("Shape {{ appearance Appearance {{ material {} {} }} geometry {} }}\n", material, more,
                       geometry);
}

std::string facesWith(const std::string& colors) {
    return "IndexedFaceSet { " + kThreePoints + colors + "coordIndex [ 0 1 2 -1 ] }";
}

TEST_F(CoinLooks, ColoursOfCornersCountEvenIfAllAreTheSame) {
    const std::vector<int> red = {255, 0, 0, 255, 255, 0, 0, 255, 255, 0, 0, 255};
    const std::string blue = "Material { diffuseColor 0 0 1 }";
    const std::string faces = facesWith("color Color { color [ 1 0 0 ] } colorPerVertex FALSE ");
    const std::string lines = "IndexedLineSet { " + kThreePoints + kRedCorners + "coordIndex [ 0 1 2 -1 ] }";
    for (const std::string& text : {shapeOf("Material {}", faces), shapeOf(blue, faces),
                                    "Shape { geometry " + facesWith(kRedCorners) + " }", shapeOf(blue, lines)}) {
        read("a.wrl", kLooksHead + text);
        EXPECT_EQ(notes_, "");
        EXPECT_EQ(cornerColors(), red) << text;
        ASSERT_EQ(all<Material>().size(), 1u);
        EXPECT_EQ(all<Material>()[0]->baseColor, Vec4f(1, 1, 1, 1)) << text;
    }
    read("a.wrl", kLooksHead + shapeOf(blue,
                                       "ElevationGrid { xDimension 2 zDimension 2 height [ 0 0 0 0 ] color Color "
                                       "{ color [ 1 0 0, 1 0 0, 1 0 0, 1 0 0 ] } }"));
    EXPECT_EQ(cornerColors().size(), 16u);
    read("a.x3d",
         "<X3D><Scene><Shape><Appearance><Material/></Appearance><IndexedTriangleSet index='0 1 2'><Coordinate "
         "point='0 0 0 1 0 0 0 1 0'/><Color color='1 0 0 1 0 0 1 0 0'/></IndexedTriangleSet></Shape></Scene></X3D>");
    EXPECT_EQ(cornerColors(), red);
    // None at all are no colours.
    read("a.wrl", kLooksHead + shapeOf(blue, facesWith("color Color { color [ ] } ")));
    EXPECT_TRUE(cornerColors().empty());
    EXPECT_EQ(all<Material>().at(0)->baseColor, Vec4f(0, 0, 1, 1));
}

TEST_F(CoinLooks, ColouredCornersHaveTheTransparencyOfEachMaterial) {
    const std::string faces = "IndexedFaceSet { " + kThreePoints + kRedCorners + "coordIndex [ 0 1 2 -1 ] }";
    for (const std::string& geometry : {faces, "PointSet { " + kThreePoints + kRedCorners + "}"}) {
        read("a.wrl", kLooksHead + shapeOf("Material { transparency 0.5 }", "DEF G " + geometry) +
                          shapeOf("Material { transparency 0.25 }", "USE G"));
        EXPECT_EQ(notes_, "");
        std::vector<float> opacities;
        for (const Material* one : all<Material>()) opacities.push_back(one->baseColor.w());
        std::ranges::sort(opacities);
        EXPECT_EQ(opacities, (std::vector<float>{0.5f, 0.75f})) << geometry;
        for (const Geometry* one : all<Geometry>()) {
            ASSERT_EQ(one->colors.as<std::uint8_t>().size(), 12u) << geometry;
            EXPECT_EQ(one->colors.as<std::uint8_t>()[3], 255) << geometry;
        }
    }
}

/// One block of middle grey. `components`: 1 is grey, 3 are colours.
std::string jpegOf(int components) {
    const auto segment = [](int marker, const std::string& data) {
        return std::string("\xff") + static_cast<char>(marker) + big(data.size() + 2, 2) + data;
    };
    std::string frame = big(8, 1) + big(8, 2) + big(8, 2) + big(static_cast<unsigned>(components), 1);
    std::string scan = big(static_cast<unsigned>(components), 1);
    for (int c = 1; c <= components; ++c) {
        frame += big(static_cast<unsigned>(c), 1) + std::string("\x11\0", 2);
        scan += big(static_cast<unsigned>(c), 1) + std::string("\0", 1);
    }
    // Each table has one code, a bit of zero.
    const std::string codes = "\1" + std::string(16, '\0');
    return "\xff\xd8" + segment(0xdb, std::string(1, '\0') + std::string(64, '\1')) + segment(0xc0, frame) +
           segment(0xc4, std::string(1, '\0') + codes) + segment(0xc4, "\x10" + codes) +
           segment(0xda, scan + std::string("\0\x3f\0", 3)) + (components == 1 ? "\x3f" : "\x03") + "\xff\xd9";
}

TEST_F(CoinLooks, GreyPicturesOfFilesMakeTheColourDarker) {
    const auto colorWith = [&](const std::string& name, const std::string& content) {
        scratch_.write(name, content);
        read("a.wrl", kLooksHead + shapeOf("Material { diffuseColor 1 0 0 }", "Box {}",
                                           "texture ImageTexture { url \"" + name + "\" }"));
        EXPECT_EQ(notes_, "") << name;
        const auto materials = all<Material>();
        return materials.size() == 1 && materials[0]->baseColorImage ? materials[0]->baseColor : Vec4f(0, 0, 0, 0);
    };
    const auto png = [](unsigned colours, const std::string& pixel) {
        return pngOf(1, 1, {.colours = colours}, std::string(1, '\0') + pixel);
    };
    const Vec4f red(1, 0, 0, 1), white(1, 1, 1, 1);
    EXPECT_EQ(colorWith("grey.png", png(0, "\x80")), red);
    EXPECT_EQ(colorWith("opacity.png", png(4, "\x80\x40")), red);
    EXPECT_EQ(colorWith("colours.png", png(2, "\x80\x80\x80")), white);
    EXPECT_EQ(colorWith("all.png", png(6, "\x80\x80\x80\x40")), white);
    EXPECT_EQ(colorWith("grey.jpg", jpegOf(1)), red);
    EXPECT_EQ(colorWith("colours.jpg", jpegOf(3)), white);
}

/// Numbers of the only channel, and its field.
struct OnlyChannel {
    std::string field;
    std::vector<double> times, values;
};

std::string driven(const std::string& kind, const std::string& values, const std::string& to,
                   const std::string& keys = "0 1", const std::string& clock = "T") {
    static int number = 0;
    const std::string name = fmt::format("I{}", ++number);
    return fmt::format(
        "DEF {0} {1} {{ key [ {2} ] keyValue [ {3} ] }} ROUTE {4}.fraction_changed TO {0}.set_fraction ROUTE "
        "{0}.value_changed TO {5}\n",
        name, kind, keys, values, clock, to);
}

class CoinMovingLooks : public CoinLooks {
protected:
    void readMoving(const std::string& text) {
        read("a.wrl", kLooksHead + text.substr(0, text.find("DEF I")) +
                          "DEF T TimeSensor { cycleInterval 4 loop TRUE } DEF U TimeSensor { loop TRUE }\n" +
                          text.substr(text.find("DEF I")));
    }
    [[nodiscard]] OnlyChannel channel() const {
        const auto found = all<KeyFrames>();
        EXPECT_EQ(found.size(), 1u);
        if (found.size() != 1) return {};
        const auto times = found[0]->times.as<double>(), values = found[0]->values.as<double>();
        return {found[0]->field, {times.begin(), times.end()}, {values.begin(), values.end()}};
    }
};

const std::string kGreen = "0 1 0, 0 1 0";
const std::string kNamed = "DEF M Material { diffuseColor 1 1 1 emissiveColor 1 0 0 }";

TEST_F(CoinMovingLooks, ColoursThatAreNotSeenMoveNothing) {
    const std::string lines = "IndexedLineSet { " + kThreePoints + "coordIndex [ 0 1 2 -1 ] }";
    const std::string different = "color Color { color [ 1 0 0, 0 1 0, 0 0 1 ] } ";
    const std::string diffuse = driven("ColorInterpolator", kGreen, "M.diffuseColor");
    for (const std::string& shape :
         {shapeOf(kNamed, "Box {}", "texture PixelTexture { image 1 1 3 0xff0000 }"),
          shapeOf(kNamed, facesWith(kRedCorners)), shapeOf(kNamed, facesWith(different)), shapeOf(kNamed, lines)}) {
        readMoving(shape + diffuse);
        EXPECT_EQ(notes_, "");
        EXPECT_TRUE(all<KeyFrames>().empty()) << shape;
    }
    readMoving(shapeOf(kNamed, lines) + driven("ColorInterpolator", kGreen, "M.emissiveColor"));
    EXPECT_EQ(channel().field, "baseColor") << "nothing lights lines";
    EXPECT_EQ(channel().values, (std::vector<double>{0, 1, 0, 1, 0, 1, 0, 1}));
    EXPECT_EQ(all<Material>().at(0)->baseColor, Vec4f(1, 0, 0, 1));
    readMoving(shapeOf(kNamed, "Box {}") + driven("ColorInterpolator", kGreen, "M.emissiveColor"));
    EXPECT_EQ(channel().field, "emissive");
    // A grey picture makes the colour darker.
    readMoving(shapeOf(kNamed, "Box {}", "texture PixelTexture { image 1 1 1 0x80 }") + diffuse);
    EXPECT_EQ(channel().field, "baseColor");
    // Both are white at rest, and one of them moves.
    readMoving(
        shapeOf(kNamed, "Box {}") +
        shapeOf("USE M", "IndexedFaceSet { solid TRUE " + kThreePoints + kRedCorners + "coordIndex [ 0 1 2 -1 ] }") +
        diffuse);
    EXPECT_EQ(all<Material>().size(), 2u);
    EXPECT_EQ(channel().field, "baseColor");
}

TEST_F(CoinMovingLooks, TransparencyMovesColouredCorners) {
    readMoving(shapeOf("DEF M Material { transparency 0.5 }", facesWith(kRedCorners)) +
               driven("ScalarInterpolator", "0 1", "M.transparency"));
    EXPECT_EQ(notes_, "");
    EXPECT_EQ(channel().values, (std::vector<double>{1, 1, 1, 1, 1, 1, 1, 0}));
    EXPECT_EQ(cornerColors().at(3), 255);
}

TEST_F(CoinMovingLooks, ColourAndTransparencyAreOneTrack) {
    const std::string box = shapeOf("DEF M Material { diffuseColor 1 0 0 transparency 0.25 }", "Box {}");
    const std::string color = driven("ColorInterpolator", "0 0 0, 0 1 0, 0 0 0", "M.diffuseColor", "0 0.5 1");
    readMoving(box + driven("ScalarInterpolator", "0 1 1", "M.transparency", "0 0.25 1") + color);
    EXPECT_EQ(notes_, "");
    EXPECT_EQ(channel().field, "baseColor");
    EXPECT_EQ(channel().times, (std::vector<double>{0, 1, 2, 4}));
    EXPECT_EQ(channel().values, (std::vector<double>{0, 0, 0, 1, 0, 0.5, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0}));
    readMoving(box + driven("ScalarInterpolator", "0 1 1", "M.transparency", "0 0.25 1", "U") + color);
    EXPECT_WORDS(notes_);
    EXPECT_EQ(channel().times, (std::vector<double>{0, 2, 4}));
    EXPECT_EQ(channel().values.at(3), 0.75) << "as at rest";
    // An interpolator without keys takes nothing of the other one.
    readMoving(box + driven("ScalarInterpolator", "0 1", "M.transparency", "0 1", "U") +
               driven("ColorInterpolator", "", "M.diffuseColor", ""));
    EXPECT_EQ(channel().times, (std::vector<double>{0, 1}));
    EXPECT_EQ(channel().values, (std::vector<double>{1, 0, 0, 1, 1, 0, 0, 0}));
}

}  // namespace
}  // namespace tessera
