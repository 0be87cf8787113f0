// VRML 1 and 2, X3D and Inventor: what of them stands in the scene.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "common/cores/Animation.h"
#include "common/cores/Billboard.h"
#include "common/cores/Camera.h"
#include "common/cores/ComponentTransform.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/DistanceLOD.h"
#include "common/cores/Environment.h"
#include "common/cores/Geometry.h"
#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/cores/PointLight.h"
#include "common/cores/Switch.h"
#include "common/cores/Text.h"
#include "common/cores/Transform.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

const std::string kVrml2 = "#VRML V2.0 utf8\n";
const std::string kInventor = "#Inventor V2.1 ascii\n";
const std::string kLit = "appearance Appearance { material Material { diffuseColor 1 0 0 } } ";

class CoinFiles : public testing::Test {
protected:
    Expected<ImportedScene> load(const std::string& name, const std::string& text) {
        return importScene(scratch_.write(name, text), kRootNode, importOptions());
    }
    /// With no note.
    ImportedAspect read(const std::string& name, const std::string& text) {
        Expected<ImportedScene> scene = load(name, text);
        EXPECT_TRUE(scene) << messageOf(scene);
        if (!scene) return ImportedAspect({});
        for (const std::string& note : scene->notes) ADD_FAILURE() << note;
        triangles_ = scene->triangles;
        return ImportedAspect(std::move(*scene));
    }
    std::string notesOf(const std::string& name, const std::string& text) {
        const Expected<ImportedScene> scene = load(name, text);
        EXPECT_TRUE(scene) << messageOf(scene);
        return scene ? fmt::format("{}", fmt::join(scene->notes, "\n")) : std::string();
    }
    template <typename Core>
    static std::vector<const Core*> all(const ImportedAspect& aspect) {
        std::vector<const Core*> found;
        for (const ObjectId id : aspect->ids())
            if (const auto* core = aspect->template get<Core>(id)) found.push_back(core);
        return found;
    }
    const Scratch scratch_;
    std::uint64_t triangles_ = 0;
};

TEST_F(CoinFiles, ShareOneGeometryAmongUses) {
    const ImportedAspect aspect =
        read("a.wrl", kVrml2 + "DEF Top Transform { translation 1 2 3 children [ DEF S Shape { " + kLit +
                          "geometry Box {} } Transform { translation 0 3 0 children USE S } ] } USE S");
    EXPECT_EQ(triangles_, 36u);
    EXPECT_EQ(all<Geometry>(aspect).size(), 1u);
    ASSERT_EQ(all<Material>(aspect).size(), 1u);
    EXPECT_EQ(all<Material>(aspect)[0]->baseColor, Vec4f(1, 0, 0, 1));
    const auto* top = aspect.core<Transform>("/a/Top");
    ASSERT_NE(top, nullptr);
    EXPECT_EQ(top->translation, Vec3d(1, 2, 3));
    EXPECT_NE(aspect.core<Geometry>("/a/Top/S"), nullptr);
    EXPECT_NE(aspect.core<Geometry>("/a/Top/Transform/S"), nullptr);
}

TEST_F(CoinFiles, PlaceWhatTransformsSay) {
    const ImportedAspect aspect =
        read("a.wrl", kVrml2 +
                          "Transform { translation 1 0 0 center 1 0 0 rotation 0 0 1 1.5707963 scale 2 2 2 children "
                          "Shape { geometry PointSet { coord Coordinate { point [ 2 0 0 ] } } } }");
    const auto* place = aspect.core<Transform>("/a/Transform");
    ASSERT_NE(place, nullptr);
    const Vec3d there = place->translation + place->rotation * Vec3d(place->scale.cwiseProduct(Vec3d(2, 0, 0)));
    EXPECT_LT((there - Vec3d(2, 2, 0)).norm(), 1e-5);
}

TEST_F(CoinFiles, MakePrototypesOfThisFileAndOfOthers) {
    const std::string proto =
        "PROTO Ball [ field SFColor c 1 0 0 field SFVec3f at 0 0 0 ] { Transform { translation IS at "
        "children Shape { appearance Appearance { material Material { diffuseColor IS c } } "
        "geometry Box {} } } }\n";
    const ImportedAspect own = read("own.wrl", kVrml2 + proto + "Ball { c 0 1 0 at 5 0 0 } Ball {}");
    EXPECT_EQ(all<Material>(own).size(), 2u);
    std::set<double> places;
    for (const Transform* one : all<Transform>(own)) places.insert(one->translation.x());
    EXPECT_TRUE(places.contains(5));
    scratch_.write("lib.wrl", kVrml2 + proto);
    const ImportedAspect other =
        read("other.wrl", kVrml2 +
                              "EXTERNPROTO Ball [ field SFColor c field SFVec3f at ] \"lib.wrl#Ball\"\n"
                              "Ball { c 0 0 1 at 7 0 0 }");
    ASSERT_EQ(all<Material>(other).size(), 1u);
    EXPECT_EQ(all<Material>(other)[0]->baseColor, Vec4f(0, 0, 1, 1));
    EXPECT_WORDS(notesOf("gone.wrl", kVrml2 +
                                         "EXTERNPROTO X [ field SFColor c ] [ \"urn:x\" \"gone.wrl2\" ]\nX { c 1 0 0 } "
                                         "Shape { geometry Box {} }"));
}

TEST_F(CoinFiles, KeepWhatSwitchesAndLevelsHide) {
    const ImportedAspect aspect =
        read("a.wrl", kVrml2 +
                          "DEF W Switch { whichChoice 1 choice [ Group {} DEF One Shape { geometry Box {} } ] }\n"
                          "DEF L LOD { range [ 5 10 ] center 0 1 0 level [ Shape { geometry Box {} } "
                          "Shape { geometry Cone {} } WorldInfo {} ] }");
    const auto* shown = aspect.core<Switch>("/a/W/choice");
    ASSERT_NE(shown, nullptr);
    EXPECT_EQ(shown->choice, 1);
    EXPECT_NE(aspect.core<Geometry>("/a/W/choice/One"), nullptr);
    const auto* levels = aspect.core<DistanceLOD>("/a/L/levels");
    ASSERT_NE(levels, nullptr);
    const auto ranges = levels->ranges.as<double>();
    EXPECT_EQ(std::vector<double>(ranges.begin(), ranges.end()), (std::vector<double>{5, 10}));
    EXPECT_EQ(levels->center, Vec3d(0, 1, 0));
    const Expected<ObjectId> node = findNode(*aspect, "/a/L/levels");
    ASSERT_TRUE(node);
    EXPECT_EQ(aspect->get<Node>(*node)->children.size(), 3u) << "a level that shows nothing is one";
}

TEST_F(CoinFiles, TakeInFilesOfTheFolderOnceAndNoOthers) {
    scratch_.write("sub/part.wrl", kVrml2 + "Shape { geometry Box {} } Inline { url \"deeper.wrl\" }");
    scratch_.write("sub/deeper.wrl", kVrml2 + "DEF D Shape { geometry Box {} } Inline { url \"../a.wrl\" }");
    const Expected<ImportedScene> scene =
        load("a.wrl", kVrml2 +
                          "Inline { url \"sub/part.wrl\" } Inline { url [ \"gone.wrl\" \"sub/part.wrl\" ] } Inline { "
                          "url \"http://there/x.wrl\" } Inline { url \"../../etc/passwd\" }");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->triangles, 48u);
    EXPECT_EQ(scene->geometries, 1u);
    for (const std::string& note : scene->notes) EXPECT_WORDS(note);
}

TEST_F(CoinFiles, LightAndLookAsTheySay) {
    const ImportedAspect aspect =
        read("a.wrl", kVrml2 +
                          "Background { skyColor 0 0 1 }\nDEF V Viewpoint { position 0 0 20 description \"Front\" }\n"
                          "DEF G Group { children [ DEF D DirectionalLight { direction 1 0 0 intensity 0.5 } Shape { "
                          "geometry Box {} } ] }\nPointLight { location 1 2 3 radius 7 attenuation 0 1 0 on FALSE }");
    const auto sun = all<DirectionalLight>(aspect);
    ASSERT_EQ(sun.size(), 1u);
    EXPECT_EQ(sun[0]->intensity, 0.5f);
    EXPECT_EQ(sun[0]->scope, *findNode(*aspect, "/a/G")) << "it lights its group alone";
    const auto* turned = aspect.core<Transform>("/a/G/D");
    ASSERT_NE(turned, nullptr);
    EXPECT_LT((turned->rotation * Vec3d(0, 0, -1) - Vec3d(1, 0, 0)).norm(), 1e-6);
    const auto lamps = all<PointLight>(aspect);
    ASSERT_EQ(lamps.size(), 1u);
    EXPECT_FALSE(lamps[0]->on);
    EXPECT_EQ(lamps[0]->range, 7);
    EXPECT_EQ(lamps[0]->attenuation, Vec3f(0, 1, 0));
    const auto cameras = all<Camera>(aspect);
    ASSERT_EQ(cameras.size(), 1u);
    EXPECT_TRUE(cameras[0]->enabled);
    EXPECT_NE(aspect.core<Transform>("/a/Front/wall"), nullptr);
    const auto skies = all<Environment>(aspect);
    ASSERT_EQ(skies.size(), 1u);
    EXPECT_EQ(skies[0]->background, Vec3f(0, 0, 1));
}

TEST_F(CoinFiles, CutConcaveFacesAndMakeAllShapes) {
    const auto trianglesOf = [&](const std::string& geometry) {
        read("a.wrl", kVrml2 + "Shape { geometry " + geometry + " }");
        return triangles_;
    };
    EXPECT_EQ(
        trianglesOf("IndexedFaceSet { convex FALSE coord Coordinate { point [ 0 0 0, 2 0 0, 2 2 0, 1 1 0, 0 2 0 ] "
                    "} coordIndex [ 0 1 2 3 4 -1 ] }"),
        3u);
    EXPECT_EQ(trianglesOf("Box {}"), 12u);
    EXPECT_EQ(trianglesOf("ElevationGrid { xDimension 3 zDimension 3 height [ 0 1 2 0 1 2 0 1 2 ] }"), 8u);
    EXPECT_EQ(trianglesOf("Extrusion { beginCap FALSE endCap FALSE }"), 8u);
    for (const char* round : {"Sphere {}", "Cone {}", "Cylinder {}"}) EXPECT_GT(trianglesOf(round), 40u) << round;
    const ImportedAspect lines =
        read("l.wrl", kVrml2 +
                          "Shape { appearance Appearance { material Material { emissiveColor 0 1 0 } } geometry "
                          "IndexedLineSet { coord Coordinate { point [ 0 0 0, 1 0 0, 1 1 0 ] } coordIndex [ 0 1 2 -1 "
                          "] } }");
    const auto found = all<Geometry>(lines);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0]->primitive, Geometry::kLines);
    EXPECT_EQ(found[0]->indices.as<std::uint32_t>().size(), 4u);
    ASSERT_EQ(all<Material>(lines).size(), 1u);
    EXPECT_EQ(all<Material>(lines)[0]->baseColor, Vec4f(0, 1, 0, 1));
    EXPECT_TRUE(all<Material>(lines)[0]->unlit);
    const ImportedAspect points = read("p.wrl", kVrml2 +
                                                    "Shape { geometry PointSet { coord Coordinate { point [ 0 0 0, 1 "
                                                    "0 0 ] } color Color { color [ 1 0 0, 0 0 1 ] } } }");
    ASSERT_EQ(all<Geometry>(points).size(), 1u);
    const auto colors = all<Geometry>(points)[0]->colors.as<std::uint8_t>();
    EXPECT_EQ(std::vector<std::uint8_t>(colors.begin(), colors.end()),
              (std::vector<std::uint8_t>{255, 0, 0, 255, 0, 0, 255, 255}));
}

TEST_F(CoinFiles, LayPicturesOverShapes) {
    const ImportedAspect aspect = read(
        "a.wrl", kVrml2 +
                     "Shape { appearance Appearance { material Material {} texture PixelTexture { image 1 2 3 "
                     "0xff0000 0x0000ff repeatS FALSE } textureTransform TextureTransform { scale 3 1 } } geometry "
                     "IndexedFaceSet { coord Coordinate { point [ 0 0 0, 1 0 0, 1 1 0 ] } texCoord "
                     "TextureCoordinate { point [ 0 0, 1 0, 1 1 ] } coordIndex [ 0 1 2 ] } }");
    const auto images = all<Image>(aspect);
    ASSERT_EQ(images.size(), 1u);
    EXPECT_EQ(images[0]->wrapU, Image::kClamp);
    EXPECT_EQ(images[0]->wrapV, Image::kRepeat);
    const auto pixels = images[0]->pixels.as<std::uint8_t>();
    EXPECT_EQ(std::vector<int>(pixels.begin(), pixels.end()), (std::vector<int>{0, 0, 255, 255, 255, 0, 0, 255}))
        << "VRML's rows begin below";
    const auto places = all<Geometry>(aspect).at(0)->texcoords.as<float>();
    EXPECT_EQ(*std::ranges::max_element(places), 3.0f) << "the TextureTransform is in the coordinates";
    EXPECT_EQ(all<Material>(aspect).at(0)->baseColor, Vec4f(1, 1, 1, 1)) << "a picture of colours replaces the colour";
    EXPECT_WORDS(notesOf("b.wrl", kVrml2 + "Shape { appearance Appearance { texture ImageTexture { url "
                                           "\"gone.png\" } } geometry Box {} }"));
}

TEST_F(CoinFiles, ShowPicturesOfColoursInPlaceOfColours) {
    const auto colorsWith = [&](const char* picture) {
        const ImportedAspect aspect =
            read("a.wrl", kVrml2 +
                              "Shape { appearance Appearance { material Material { diffuseColor 1 0 0 } texture "
                              "PixelTexture { image " +
                              picture +
                              " } } geometry IndexedFaceSet { coord Coordinate { point [ 0 0 0, 1 0 0, 1 1 0 ] } color "
                              "Color { color [ 1 0 0, 0 1 0, 0 0 1 ] } coordIndex [ 0 1 2 ] } }");
        return all<Geometry>(aspect).at(0)->colors.as<std::uint8_t>().size();
    };
    EXPECT_EQ(colorsWith("1 1 3 0xff0000"), 0u);
    EXPECT_EQ(colorsWith("1 1 1 0x80"), 12u) << "a grey one makes the colours darker";
}

TEST_F(CoinFiles, SeeFlatShapesOfX3dFromBothSides) {
    const auto isTwoSided = [&](const char* attributes) {
        const ImportedAspect aspect =
            read("a.x3d", fmt::format("<X3D><Scene><Shape><Appearance><Material/></Appearance><Rectangle2D {}/></Shape>"
                                      "</Scene></X3D>",
                                      attributes));
        return all<Material>(aspect).at(0)->doubleSided;
    };
    EXPECT_TRUE(isTwoSided(""));
    EXPECT_TRUE(isTwoSided("solid='false'"));
    EXPECT_FALSE(isTwoSided("solid='true'"));
}

TEST_F(CoinFiles, OfX3dSayWhereLightsGo) {
    const auto notes = [&](const char* light) {
        return notesOf("a.x3d", fmt::format("<X3D><Scene><{}/><Shape><Box/></Shape></Scene></X3D>", light));
    };
    EXPECT_EQ(notes("PointLight global='true'"), "");
    EXPECT_EQ(notes("DirectionalLight global='false'"), "");
    EXPECT_TRUE(
        notes("PointLight global='false'").ends_with("a PointLight lights everything, whatever its 'global' says"));
    EXPECT_TRUE(notes("DirectionalLight global='true'")
                    .ends_with("a DirectionalLight lights its group alone, whatever its 'global' says"));
}

TEST_F(CoinFiles, WriteLettersAndTurnBillboards) {
    const ImportedAspect aspect = read(
        "a.wrl", kVrml2 +
                     "Billboard { axisOfRotation 0 0 0 children Shape { geometry Text { string [ \"one\" \"two\" ] "
                     "fontStyle FontStyle { size 2 justify \"MIDDLE\" family \"SANS\" } } } }");
    const auto texts = all<Text>(aspect);
    ASSERT_EQ(texts.size(), 1u);
    EXPECT_EQ(texts[0]->text, "one\ntwo");
    EXPECT_EQ(texts[0]->size, 2);
    EXPECT_EQ(texts[0]->alignment, Text::kCenter);
    ASSERT_EQ(all<Billboard>(aspect).size(), 1u);
    EXPECT_EQ(all<Billboard>(aspect)[0]->axis, Vec3d(0, 0, 0));
}

TEST_F(CoinFiles, PlayWhatTimeSensorsDrive) {
    const std::string shape = "Shape { appearance Appearance { material DEF M Material {} } geometry Box {} }";
    const ImportedAspect aspect = read(
        "a.wrl",
        kVrml2 + "DEF B Transform { translation 9 0 0 children " + shape + " }\nDEF C Transform { center 1 0 0 }\n" +
            "DEF T TimeSensor { loop TRUE cycleInterval 4 }\nDEF P PositionInterpolator { key [ 0 0.5 1 ] keyValue [ 0 "
            "0 "
            "0, 0 5 0, 0 0 0 ] }\nDEF O OrientationInterpolator { key [ 0.5 ] keyValue [ 0 1 0 1 ] }\nDEF K "
            "ColorInterpolator { key [ 0 1 ] keyValue [ 1 0 0, 0 0 1 ] }\n"
            "ROUTE T.fraction_changed TO P.set_fraction\nROUTE P.value_changed TO B.set_translation\nROUTE "
            "T.fraction_changed TO O.set_fraction\nROUTE O.value_changed TO C.rotation\nROUTE T.fraction_changed TO "
            "K.set_fraction\nROUTE K.value_changed TO M.diffuseColor");
    const auto animations = all<Animation>(aspect);
    ASSERT_EQ(animations.size(), 1u);
    EXPECT_TRUE(animations[0]->playing);
    EXPECT_EQ(animations[0]->mode, Animation::kLoop);
    std::map<std::string, const KeyFrames*> channels;
    for (const KeyFrames* one : all<KeyFrames>(aspect)) channels[one->field] = one;
    ASSERT_EQ(channels.size(), 3u);
    const auto times = channels.at("translation")->times.as<double>();
    EXPECT_EQ(std::vector<double>(times.begin(), times.end()), (std::vector<double>{0, 2, 4}));
    EXPECT_EQ(channels.at("rotation")->times.as<double>().size(), 3u) << "what has one key has it all the time";
    EXPECT_EQ(channels.at("baseColor")->values.as<double>().size(), 8u);
    EXPECT_EQ(aspect.core<Transform>("/a/B")->translation, Vec3d(9, 0, 0)) << "as the file has it at rest";
    EXPECT_EQ(aspect.core<ComponentTransform>("/a/C")->center, Vec3d(1, 0, 0));
}

TEST_F(CoinFiles, CutKeysAtTheCycle) {
    const std::string text = kVrml2 +
                             "DEF B Transform { children Shape { geometry Box {} } }\n"
                             "DEF T TimeSensor { loop TRUE cycleInterval 4 }\n"
                             "DEF P PositionInterpolator { key [ -1 0.5 2 ] keyValue [ 0 0 0, 3 0 0, 3 6 0 ] }\n"
                             "DEF O OrientationInterpolator { key [ -1 1 ] keyValue [ 0 0 1 0, 0 0 1 2 ] }\n"
                             "DEF S PositionInterpolator { key [ 3 4 ] keyValue [ 2 2 2, 5 5 5 ] }\n"
                             "ROUTE T.fraction_changed TO P.set_fraction ROUTE P.value_changed TO B.set_translation\n"
                             "ROUTE T.fraction_changed TO O.set_fraction ROUTE O.value_changed TO B.set_rotation\n"
                             "ROUTE T.fraction_changed TO S.set_fraction ROUTE S.value_changed TO B.set_scale";
    const ImportedAspect aspect = read("a.wrl", text);
    std::map<std::string, const KeyFrames*> channels;
    for (const KeyFrames* one : all<KeyFrames>(aspect)) channels[one->field] = one;
    ASSERT_EQ(channels.size(), 3u);
    const auto numbers = [](const Blob& blob) {
        const auto all = blob.as<double>();
        return std::vector<double>(all.begin(), all.end());
    };
    EXPECT_EQ(numbers(channels["translation"]->times), (std::vector<double>{0, 2, 4}));
    EXPECT_EQ(numbers(channels["translation"]->values), (std::vector<double>{2, 0, 0, 3, 0, 0, 3, 2, 0}));
    EXPECT_EQ(numbers(channels["scale"]->values), (std::vector<double>{2, 2, 2, 2, 2, 2}));
    EXPECT_EQ(numbers(channels["rotation"]->times), (std::vector<double>{0, 4}));
    const std::vector<double> turns = numbers(channels["rotation"]->values);
    ASSERT_EQ(turns.size(), 8u);
    const double expected[] = {std::cos(0.5), 0, 0, std::sin(0.5), std::cos(1.0), 0, 0, std::sin(1.0)};
    for (std::size_t i = 0; i < 8; ++i) EXPECT_NEAR(turns[i], expected[i], 1e-6) << i;
}

TEST_F(CoinFiles, SayWhichOfTwoInterpolatorsMovesAField) {
    const std::string text =
        kVrml2 +
        "DEF B Transform { children DEF S Shape { geometry Box {} } } DEF C Transform { children USE S }\n"
        "DEF T TimeSensor { loop TRUE }\n"
        "DEF P PositionInterpolator { key [ 0 1 ] keyValue [ 0 0 0, 1 0 0 ] }\n"
        "ROUTE T.fraction_changed TO P.set_fraction\n"
        "ROUTE P.value_changed TO C.set_translation ROUTE P.value_changed TO B.set_translation\n";
    const std::string further =
        "DEF Q PositionInterpolator { key [ 0 1 ] keyValue [ 0 0 0, 0 2 0 ] }\n"
        "ROUTE T.fraction_changed TO Q.set_fraction ROUTE Q.value_changed TO B.set_translation";
    EXPECT_EQ(notesOf("a.wrl", text), "");
    EXPECT_WORDS(notesOf("b.wrl", text + further));
    Expected<ImportedScene> scene = load("b.wrl", text + further);
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    ASSERT_EQ(all<KeyFrames>(aspect).size(), 2u);
    EXPECT_EQ(all<KeyFrames>(aspect)[0]->values.as<double>()[4], 2) << "of B, which stands before C";
}

TEST_F(CoinFiles, NameWhatIsLeftOut) {
    EXPECT_WORDS(notesOf(
        "a.wrl", kVrml2 + "DEF Run Script { url \"javascript:\" } Fog {} TouchSensor {} Nothing { a 1 b [ 2 { } ] } "
                          "Shape { geometry Box {} } Shape { geometry Nurbs { x 1 } }"));
}

TEST_F(CoinFiles, KeepLongNamesAndSayWhichAreCut) {
    const std::string name(1024, 'n');
    const auto boxes = [](const std::string& first, const std::string& second) {
        const std::string box = " Shape { " + kLit + "geometry Box {} }\n";
        return kVrml2 + "DEF " + first + box + "DEF " + second + box;
    };
    const auto namesOf = [&](const ImportedAspect& aspect) {
        std::set<std::string> names;
        for (const Node* node : all<Node>(aspect))
            if (node->name.starts_with("nnn")) names.insert(node->name);
        return names;
    };
    EXPECT_EQ(namesOf(read("a.wrl", boxes(name, name.substr(1) + "y"))),
              (std::set<std::string>{name, name.substr(1) + "y"}));
    // Names that are cut to the same keep their numbers.
    const std::string text = boxes(name + "y", name + "z");
    const std::string notes = notesOf("a.wrl", text);
    EXPECT_NE(notes.find("of a name what is beyond 1024 bytes is left out, 2 times"), std::string::npos) << notes;
    Expected<ImportedScene> cut = load("a.wrl", text);
    ASSERT_TRUE(cut);
    EXPECT_EQ(namesOf(ImportedAspect(std::move(*cut))).size(), 2u);
}

TEST_F(CoinFiles, OfInventorInheritWhatWentBefore) {
    const ImportedAspect aspect = read(
        "a.iv", kInventor +
                    "Material { diffuseColor [ 1 0 0, 0 1 0 ] } Coordinate3 { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] "
                    "} Translation { translation 1 0 0 }\nGroup { Translation { translation 0 2 0 } }\n"
                    "Separator { Translation { translation 100 0 0 } }\nMaterialBinding { value PER_FACE } DEF F "
                    "IndexedFaceSet { coordIndex [ 0 1 2 -1 0 2 3 -1 ] }\nSwitch { Cube {} }");
    EXPECT_EQ(triangles_, 14u);
    const auto* place = aspect.core<Transform>("/a/F");
    ASSERT_NE(place, nullptr);
    EXPECT_EQ(place->translation, Vec3d(1, 2, 0)) << "of a group, and not of a separator";
    const auto* faces = aspect.core<Geometry>("/a/F/F");
    ASSERT_NE(faces, nullptr);
    EXPECT_EQ(faces->colors.as<std::uint8_t>().size(), 4u * 6u) << "each face has its own colour";
    const ImportedAspect old = read("b.wrl",
                                    "#VRML V1.0 ascii\nSeparator { Material { diffuseColor 0 1 0 } Cube {} } "
                                    "AsciiText { string \"hi\" }");
    EXPECT_EQ(all<Text>(old).at(0)->text, "hi");
    EXPECT_EQ(all<Material>(old).at(0)->baseColor, Vec4f(0, 1, 0, 1));
}

TEST_F(CoinFiles, OfX3dAreTheSameInBothEncodings) {
    const std::string xml =
        "<X3D><Scene><Switch whichChoice='0'><Shape><IndexedTriangleSet index='0 1 2 0 2 3'><Coordinate point='0 0 0 1 "
        "0 "
        "0 1 1 0 0 1 0'/></IndexedTriangleSet></Shape></Switch><ProtoDeclare name='P'><ProtoInterface><field "
        "accessType='inputOutput' name='c' type='SFColor' value='1 0 "
        "0'/></ProtoInterface><ProtoBody><Shape><Appearance>"
        "<Material><IS><connect nodeField='diffuseColor' protoField='c'/></IS></Material></Appearance><Rectangle2D/>"
        "</Shape></ProtoBody></ProtoDeclare><ProtoInstance name='P'><fieldValue name='c' value='0 1 "
        "0'/></ProtoInstance>"
        "</Scene></X3D>";
    const std::string classic =
        "#X3D V3.2 utf8\nPROFILE Immersive\nMETA \"a\" \"b\"\nSwitch { whichChoice 0 children [ Shape { geometry "
        "IndexedTriangleSet { index [ 0 1 2 0 2 3 ] coord Coordinate { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] } } } ] }\n"
        "PROTO P [ inputOutput SFColor c 1 0 0 ] { Shape { appearance Appearance { material Material { diffuseColor IS "
        "c } "
        "} geometry Rectangle2D {} } }\nP { c 0 1 0 }";
    for (const auto& [name, text] : {std::pair("a.x3d", xml), std::pair("a.x3dv", classic)}) {
        const ImportedAspect aspect = read(name, text);
        EXPECT_EQ(triangles_, 4u) << name;
        EXPECT_EQ(all<Switch>(aspect).size(), 1u) << name;
        const auto materials = all<Material>(aspect);
        EXPECT_TRUE(std::ranges::any_of(materials, [](const Material* one) {
            return one->baseColor == Vec4f(0, 1, 0, 1);
        })) << name;
    }
}

}  // namespace
}  // namespace tessera
