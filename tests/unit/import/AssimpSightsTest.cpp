// Lights and cameras of the formats that assimp reads: each format as it means them.

#include <fmt/format.h>

#include <numbers>

#include "common/cores/Camera.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/Environment.h"
#include "common/cores/PointLight.h"
#include "common/cores/SpotLight.h"
#include "common/scene/Action.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

struct Seen {
    ImportedScene scene;
    std::unique_ptr<ImportedAspect> aspect;

    template <typename Core>
    [[nodiscard]] Affine3d placeOf() const {
        Affine3d place = Affine3d::Identity();
        Action action;
        action.on<Core>([&](const Visit& visit, const Core&) {
            place = visit.world_T_node;
            return Descend::kInto;
        });
        action.run(**aspect);
        return place;
    }
    /// Along -Z.
    template <typename Core>
    [[nodiscard]] Vec3d directionOf() const {
        return -placeOf<Core>().linear().col(2).normalized();
    }
    template <typename Core>
    [[nodiscard]] std::vector<const Core*> all() const {
        return allOf<Core>(*aspect);
    }
};

Seen seen(const std::string& path) {
    Seen file;
    Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
    EXPECT_TRUE(scene) << messageOf(scene);
    if (scene) file.scene = *scene;
    file.aspect = std::make_unique<ImportedAspect>(ImportedScene(file.scene));
    return file;
}

/// A triangle, and these lights and cameras, each in a node of its own; in centimetres.
std::string collada(const std::string& lights, const std::string& cameras, const std::string& nodes) {
    return fmt::format(R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.01" name="cm"/><up_axis>Y_UP</up_axis></asset>
<library_lights>{}</library_lights><library_cameras>{}</library_cameras>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="9">0 0 0 100 0 0 0 100 0</float_array><technique_common>
<accessor source="#pa" count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n" name="n"><instance_geometry url="#g"/></node>{}
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)",
                       lights, cameras, nodes);
}

TEST(AssimpSights, ALightOfColladaHasItsFalloffInMetresAndItsConeFromTheAxis) {
    const Scratch scratch;
    const Seen file = seen(scratch.write(
        "lamp.dae",
        collada(R"(<light id="l"><technique_common><spot><color>1 0.5 0</color>
<constant_attenuation>1</constant_attenuation><linear_attenuation>0.02</linear_attenuation>
<quadratic_attenuation>0.0003</quadratic_attenuation><falloff_angle>60</falloff_angle></spot></technique_common></light>
<light id="a"><technique_common><ambient><color>1 1 1</color></ambient></technique_common></light>)",
                "", R"(<node id="m" name="lamp"><translate>0 0 300</translate><instance_light url="#l"/></node>
<node id="k" name="glow"><instance_light url="#a"/></node>)")));
    const auto spots = file.all<SpotLight>();
    ASSERT_EQ(spots.size(), 1u);
    EXPECT_TRUE(spots[0]->color.isApprox(Vec3f(1, 0.5F, 0), 1e-6F));
    EXPECT_TRUE(spots[0]->attenuation.isApprox(Vec3f(1, 2, 3), 1e-4F)) << spots[0]->attenuation.transpose();
    EXPECT_NEAR(spots[0]->outerAngle, std::numbers::pi / 6, 1e-5);
    EXPECT_TRUE(file.placeOf<SpotLight>().translation().isApprox(Vec3d(0, 0, 3), 1e-5));
    EXPECT_TRUE(file.directionOf<SpotLight>().isApprox(-Vec3d::UnitZ(), 1e-5));
    EXPECT_WORDS(notesIn(file.scene));
}

TEST(AssimpSights, ACameraOfColladaShowsWhatItSays) {
    const Scratch scratch;
    const auto withCamera = [&](const std::string& name, const std::string& optics) {
        return seen(scratch.write(
            "view.dae", collada("",
                                fmt::format("<camera id=\"c\" {}><optics><technique_common>{}</technique_common>"
                                            "</optics></camera>",
                                            name, optics),
                                R"(<node id="m" name="view"><translate>50 50 300</translate>
<instance_camera url="#c"/></node>)")));
    };
    const double tangent = std::tan(std::numbers::pi / 12);
    const Seen said = withCamera(
        "name=\"c\"",
        "<perspective><yfov>30</yfov><aspect_ratio>1.5</aspect_ratio><znear>1</znear><zfar>9</zfar></perspective>");
    ASSERT_EQ(said.all<Camera>().size(), 1u);
    // The window, 1.8 m high, covers what the camera shows at the triangle, three metres away.
    EXPECT_NEAR(said.all<Camera>()[0]->worldUnitsPerMetre, 2 * 3 * tangent / 1.8, 1e-4);
    EXPECT_TRUE(said.scene.notes.empty());
    // Assimp 5.2.5 does not read the optics of a camera without a name.
    const Seen nameless = withCamera("", "<perspective><yfov>30</yfov></perspective>");
    EXPECT_WORDS(notesIn(nameless.scene));
    EXPECT_NEAR(said.placeOf<Camera>().translation().z(), 0, 1e-4);
}

TEST(AssimpSights, WhatAssimpLeavesToAFormatIsKnownHere) {
    const std::string models = kDebianModels;
    if (!std::filesystem::exists(models)) GTEST_SKIP() << "package assimp-testmodels is not here";
    // Both look at the middle, though assimp says of one that it looks along +Z and of the other along +X.
    for (const char* name : {"/ASE/CameraRollAnim.ase", "/FBX/global_settings.fbx", "/LWS/move_x.lws"}) {
        const Seen file = seen(models + name);
        ASSERT_FALSE(file.all<Camera>().empty()) << name;
        const Affine3d wall = file.placeOf<Camera>();
        // The wall stands about where the model is.
        const Vec3d inWall = file.all<Camera>()[0]->worldUnitsPerMetre * Vec3d(0, 1.5, 2.4);
        const Vec3d eye = wall.translation() + wall.linear().colwise().normalized() * inWall,
                    ahead = file.directionOf<Camera>();
        EXPECT_GT(ahead.dot(-eye.normalized()), 0.9) << name;
    }
    const Seen sun = seen(models + "/Collada/duck.dae");
    EXPECT_EQ(sun.all<DirectionalLight>().size(), 1u);
    EXPECT_TRUE(sun.scene.notes.empty()) << sun.scene.notes.front();
    // A thousand watts of Blender's: exposed for.
    const Seen strong = seen(models + "/FBX/animation_with_skeleton.fbx");
    ASSERT_EQ(strong.all<PointLight>().size(), 1u);
    EXPECT_FLOAT_EQ(strong.all<PointLight>()[0]->intensity, 1000);
    EXPECT_FLOAT_EQ(strong.all<PointLight>()[0]->attenuation.x(), 1);
    ASSERT_EQ(strong.all<Environment>().size(), 1u);
    EXPECT_TRUE(strong.all<Environment>()[0]->metered);
    // Bytes as colours, of before LightWave 6.
    const Seen old = seen(models + "/LWS/move_x_oldformat_56.lws");
    ASSERT_EQ(old.all<PointLight>().size(), 1u);
    EXPECT_FLOAT_EQ(old.all<PointLight>()[0]->intensity, 1);
    EXPECT_TRUE(old.all<Environment>().empty());
    EXPECT_WORDS(notesIn(seen(models + "/3DS/CameraRollAnim.3ds").scene));
    EXPECT_WORDS(notesIn(seen(models + "/OpenGEX/camera.ogex").scene));
}

}  // namespace
}  // namespace tessera
