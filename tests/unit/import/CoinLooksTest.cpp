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
#include "tests/unit/import/ImportFixture.h"

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
        for (const Geometry* one : all<Geometry>()) EXPECT_EQ(one->colors.as<std::uint8_t>()[3], 255) << geometry;
    }
}

}  // namespace
}  // namespace tessera
