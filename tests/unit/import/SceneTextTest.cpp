// Tessera's own text format: what it becomes.
#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "common/scene/Action.h"
#include "common/scene/Cores.h"
#include "proto/scene.pb.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

Expected<ImportedScene> importText(const std::string& text) {
    const Scratch scratch;
    return importScene(scratch.write("scene.tsct", text), kRootNode, importOptions());
}

TEST(SceneText, PlacesItsTopLevelNodesDirectlyBelowTheParent) {
    Expected<ImportedScene> scene = importText(R"(
        node { name: "hall" node { name: "crane" transform { translation { x: 1.5 } } } }
        node { name: "yard" })");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->tops.size(), 2u);
    EXPECT_EQ(scene->top, scene->tops.front());
    EXPECT_EQ(scene->nodes, 3u);
    const ImportedAspect aspect(std::move(*scene));
    const auto* crane = aspect.core<Transform>("/hall/crane");
    ASSERT_NE(crane, nullptr);
    EXPECT_EQ(crane->translation, Vec3d(1.5, 0, 0));
    EXPECT_TRUE(findNode(*aspect, "/yard"));
}

TEST(SceneText, MakesEqualShapesOneCore) {
    Expected<ImportedScene> scene = importText(R"(
        material { name: "oak" base_color { r: 0.5 g: 0.3 b: 0.1 } }
        node { name: "crates" material: "oak"
          node { box { size { x: 1 y: 1 z: 1 } } }
          node { transform { translation { x: 2 } } box { size { x: 1 y: 1 z: 1 } } }
          node { box { size { x: 1 y: 2 z: 1 } } } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->geometries, 2u);
    EXPECT_EQ(scene->triangles, 36u);
    EXPECT_EQ(scene->trianglesStored, 24u);
    const ImportedAspect aspect(std::move(*scene));
    const auto* geometry = aspect.core<Geometry>("/crates/geometry");
    ASSERT_NE(geometry, nullptr);
    const auto* oak = aspect->get<Material>(geometry->material);
    ASSERT_NE(oak, nullptr) << "a shape takes the material of the nearest node that names one";
    EXPECT_FLOAT_EQ(oak->baseColor.y(), 0.3f);
}

TEST(SceneText, WritesRepeatsOut) {
    Expected<ImportedScene> scene = importText(R"(
        node { name: "row" repeat { count: 3 step { x: 2 } } transform { translation { y: 1 } }
          node { name: "post" repeat { count: 2 step { z: 5 } } cylinder { radius: 0.1 height: 3 } } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    EXPECT_EQ(aspect.core<Transform>("/row[2]")->translation, Vec3d(4, 1, 0));
    EXPECT_NE(aspect.core<Geometry>("/row[1]/post"), nullptr);
    EXPECT_EQ(aspect.core<Transform>("/row[1]/post[1]")->translation, Vec3d(0, 0, 5));
}

TEST(SceneText, ReadsWhatFollowsFromTheTableOfTypes) {
    Expected<ImportedScene> scene = importText(R"(
        node { name: "lamp" transform { translation { y: 3 } }
          spot_light { color { r: 1 g: 0.5 } intensity: 4 range: 9 inner_angle_deg: 10 outer_angle_deg: 30 } }
        node { name: "plain" spot_light {} }
        node { name: "flat" spot_light { inner_angle_deg: 90 outer_angle_deg: 90 } }
        node { name: "bent" transform { translation { x: 5 } }
          component_transform { translation { x: 1 } center { y: 2 } rotation { axis { z: 1 } angle_deg: 90 }
                                scale_orientation { quaternion { w: 1 } } scale { y: 3 } }
          node { name: "load" box { size { x: 1 y: 1 z: 1 } } }
          node { name: "out" inverse_transform {} node { name: "there" transform { translation { z: 7 } } } } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const auto* lamp = aspect.core<SpotLight>("/lamp/light");
    ASSERT_NE(lamp, nullptr) << "content beside a transform stands in a node of its own";
    EXPECT_EQ(lamp->color, Vec3f(1, 0.5f, 0));
    EXPECT_EQ(lamp->intensity, 4);
    EXPECT_EQ(lamp->range, 9);
    EXPECT_NEAR(lamp->innerAngle, 10 * EIGEN_PI / 180, 1e-7);
    EXPECT_NEAR(lamp->outerAngle, 30 * EIGEN_PI / 180, 1e-7);
    const auto* plain = aspect.core<SpotLight>("/plain");
    ASSERT_NE(plain, nullptr);
    EXPECT_EQ(plain->outerAngle, SpotLight().outerAngle) << "what is not said is the default";
    const auto* flat = aspect.core<SpotLight>("/flat");
    ASSERT_NE(flat, nullptr);
    EXPECT_EQ(flat->outerAngle, static_cast<float>(EIGEN_PI / 2));
    const auto* bent = aspect.core<ComponentTransform>("/bent/transform");
    ASSERT_NE(bent, nullptr);
    EXPECT_EQ(bent->translation, Vec3d(1, 0, 0));
    EXPECT_EQ(bent->center, Vec3d(0, 2, 0));
    EXPECT_TRUE(bent->rotation.isApprox(Quatd(Eigen::AngleAxisd(EIGEN_PI / 2, Vec3d::UnitZ()))));
    EXPECT_EQ(bent->scale, Vec3d(1, 3, 1));
    EXPECT_TRUE(findNode(*aspect, "/bent/transform/load")) << "it holds what is below the node";
    const auto there = findNode(*aspect, "/bent/transform/out/there");
    ASSERT_TRUE(there) << there.error().message;
    EXPECT_EQ(worldTransform(*aspect, *there).translation(), Vec3d(0, 0, 7));
}

TEST(SceneText, InstancesShareGeometryAndMaterialButNotTransforms) {
    Expected<ImportedScene> scene = importText(R"(
        material { name: "red" base_color { r: 1 } }
        definition { name: "wheel" node { name: "wheel" material: "red"
          transform { rotation { axis { x: 1 } angle_deg: 90 } } torus { ring_radius: 1 pipe_radius: 0.2 } } }
        node { name: "front" instance: "wheel" }
        node { name: "back" transform { translation { z: 4 } } instance: "wheel" })");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->geometries, 1u);
    const ImportedAspect aspect(std::move(*scene));
    const ObjectId front = *findNode(*aspect, "/front/wheel"), back = *findNode(*aspect, "/back/wheel");
    EXPECT_NE(aspect->get<Node>(front)->core, aspect->get<Node>(back)->core);
    EXPECT_EQ(aspect.core<Geometry>("/front/wheel/geometry"), aspect.core<Geometry>("/back/wheel/geometry"));
}

TEST(SceneText, GivesInstancesTheirOwnMaterialWhereTheDefinitionNamesNone) {
    Expected<ImportedScene> scene = importText(R"(
        material { name: "ivory" base_color { g: 1 } } material { name: "ebony" base_color { b: 1 } }
          material { name: "felt" base_color { r: 1 } }
        definition { name: "head" node { name: "ball" sphere { radius: 1 } } }
        definition { name: "pawn" node { name: "stem" cylinder { radius: 1 height: 2 } }
          node { name: "foot" material: "felt" cylinder { radius: 1 height: 2 } }
          node { name: "top" instance: "head" } }
        node { name: "white" material: "ivory" node { name: "pawn" repeat { count: 2 step { x: 3 } }
          instance: "pawn" } }
        node { name: "black" material: "ebony" instance: "pawn" }
        node { name: "plain" instance: "pawn" })");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->geometries, 7u) << "a stem and a ball of three materials each, one foot";
    const ImportedAspect aspect(std::move(*scene));
    const auto colorOf = [&](const char* path) {
        const auto* material = aspect->get<Material>(aspect.core<Geometry>(path)->material);
        return material == nullptr ? Vec3f::Zero().eval() : Vec3f(material->baseColor.head<3>());
    };
    EXPECT_EQ(colorOf("/white/pawn[1]/stem"), Vec3f(0, 1, 0));
    EXPECT_EQ(colorOf("/white/pawn[1]/foot"), Vec3f(1, 0, 0));
    EXPECT_EQ(colorOf("/white/pawn[1]/top/ball"), Vec3f(0, 1, 0));
    EXPECT_EQ(colorOf("/black/stem"), Vec3f(0, 0, 1));
    EXPECT_EQ(colorOf("/black/top/ball"), Vec3f(0, 0, 1));
    EXPECT_EQ(colorOf("/plain/stem"), Vec3f::Zero());
    EXPECT_EQ(colorOf("/plain/foot"), Vec3f(1, 0, 0));
}

TEST(SceneText, FindsMotionTargetsAndInterestsByName) {
    Expected<ImportedScene> scene = importText(R"(
        node { name: "hall"
          node { name: "crane" transform {} node { name: "load" box { size { x: 1 y: 1 z: 1 } } }
            node { name: "drive" motion { mode: PING_PONG key { time: 0 }
              key { time: 2 transform { translation { x: 3 } uniform_scale: 2 } } } } }
          node { name: "pusher" motion { target: "crane" paused: true key { time: 0.5 } } }
          node { name: "guard" interest { object: "crane" against: "/hall/wall" response: REPORT } }
          node { name: "wall" } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const ObjectId crane = *findNode(*aspect, "/hall/crane");
    const auto* drive = aspect.core<Motion>("/hall/crane/drive");
    ASSERT_NE(drive, nullptr);
    EXPECT_EQ(drive->target, aspect->get<Node>(crane)->core) << "no target: the nearest transform above";
    EXPECT_EQ(drive->mode, Motion::kPingPong);
    const auto keys = drive->keys.as<double>();
    ASSERT_EQ(keys.size(), 22u);
    EXPECT_EQ(keys[11], 2.0);
    EXPECT_EQ(keys[12], 3.0);
    EXPECT_EQ(keys[15], 1.0) << "rotation w";
    EXPECT_EQ(keys[19], 2.0) << "scale x";
    const auto* pusher = aspect.core<Motion>("/hall/pusher");
    EXPECT_EQ(pusher->target, drive->target);
    EXPECT_EQ(pusher->playing, 0);
    const auto* guard = aspect.core<Interest>("/hall/guard");
    EXPECT_EQ(guard->object, crane);
    EXPECT_EQ(guard->against, *findNode(*aspect, "/hall/wall"));
    EXPECT_EQ(guard->response, Interest::kReport);
}

TEST(SceneText, ReadsEverythingThatAnInterestSays) {
    Expected<ImportedScene> scene = importText(R"(
        node { name: "a" } node { name: "b" }
        node { name: "plain" interest { object: "a" } }
        node { name: "full" interest { object: "a" against: "b" response: BOUNCE mode: DISTANCE most_faces: 7
          disabled: true
               object_layers: 6 against_layers: -8 threshold: 0.25 show_points: true show_faces: true patience: 3 } }
        node { name: "brief" interest { object: "a" response: ROLLBACK mode: DYNAMIC yes_or_no: true
          show_normals: true } }
        node { name: "slide" interest { object: "a" response: SLIDE mode: STATIC } }
        node { name: "ask" interest { object: "a" response: ASK mode: IGNORE } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    const auto* plain = aspect.core<Interest>("/plain");
    const Interest fresh;
    EXPECT_EQ(plain->response, fresh.response);
    EXPECT_EQ(plain->mode, fresh.mode);
    EXPECT_EQ(plain->detail, fresh.detail);
    EXPECT_EQ(plain->objectLayers, fresh.objectLayers);
    EXPECT_EQ(plain->againstLayers, fresh.againstLayers);
    EXPECT_EQ(plain->patience, fresh.patience);
    EXPECT_EQ(plain->show, 0);
    EXPECT_FALSE(plain->against);
    const auto* full = aspect.core<Interest>("/full");
    EXPECT_EQ(full->against, *findNode(*aspect, "/b"));
    EXPECT_EQ(full->response, Interest::kBounce);
    EXPECT_EQ(full->mode, Interest::kDistance);
    EXPECT_EQ(full->detail, 7);
    EXPECT_EQ(full->enabled, 0);
    EXPECT_EQ(full->objectLayers, 6);
    EXPECT_EQ(full->againstLayers, -8);
    EXPECT_EQ(full->threshold, 0.25);
    EXPECT_EQ(full->show, Interest::kShowPoints | Interest::kShowFaces);
    EXPECT_EQ(full->patience, 3);
    const auto* brief = aspect.core<Interest>("/brief");
    EXPECT_EQ(brief->response, Interest::kRollback);
    EXPECT_EQ(brief->mode, Interest::kDynamic);
    EXPECT_EQ(brief->detail, Interest::kYesOrNo);
    EXPECT_EQ(brief->show, Interest::kShowNormals);
    EXPECT_EQ(aspect.core<Interest>("/slide")->response, Interest::kSlide);
    EXPECT_EQ(aspect.core<Interest>("/slide")->mode, Interest::kStatic);
    EXPECT_EQ(aspect.core<Interest>("/ask")->response, Interest::kAsk);
    EXPECT_EQ(aspect.core<Interest>("/ask")->mode, Interest::kIgnore);
}

TEST(SceneText, ReadsEverythingThatACollisionObjectSays) {
    Expected<ImportedScene> scene = importText(R"(
        node { name: "air" environment { gravity { y: -9.81 z: 0.5 } } }
        node { name: "bolt" transform {} collision_object {} }
        node { name: "plate" node { name: "slab" box { size { x: 1 y: 1 z: 1 } } } }
        node { name: "body" collision_object { node: "plate/slab" kind: STATIC division: EACH_GEOMETRY
          shape: DISTANCE_FIELD layers: 10
               restitution: 0.9 friction: 2 level: 7 error: 1.5 velocity { x: 1 y: 2 z: 3 } spin { y: -4 } } }
        node { name: "nut" transform {} node { name: "body"
          collision_object { kind: DEFORMING division: EACH_CHILD layers: 0 } } }
        node { name: "ball" transform {} node { name: "body" collision_object { mass: 2.5 } } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty());
    const ImportedAspect aspect(std::move(*scene));
    EXPECT_EQ(aspect.core<Environment>("/air")->gravity, Vec3d(0, -9.81, 0.5));
    const CollisionObject fresh;
    const auto* bolt = aspect.core<CollisionObject>("/bolt/collision_object");
    ASSERT_NE(bolt, nullptr) << "beside a transform it has a node of its own below";
    EXPECT_EQ(bolt->node, *findNode(*aspect, "/bolt")) << "absent: the node of the nearest transform";
    EXPECT_EQ(bolt->kind, CollisionObject::kRigid);
    EXPECT_EQ(bolt->division, CollisionObject::kWhole);
    EXPECT_EQ(bolt->shape, CollisionObject::kTriangles);
    EXPECT_EQ(bolt->layers, fresh.layers);
    EXPECT_EQ(bolt->mass, 0);
    EXPECT_EQ(bolt->restitution, fresh.restitution);
    EXPECT_EQ(bolt->friction, fresh.friction);
    EXPECT_EQ(bolt->level, 0);
    const auto* body = aspect.core<CollisionObject>("/body");
    EXPECT_EQ(body->node, *findNode(*aspect, "/plate/slab"));
    EXPECT_EQ(body->kind, CollisionObject::kStatic);
    EXPECT_EQ(body->division, CollisionObject::kEachGeometry);
    EXPECT_EQ(body->shape, CollisionObject::kDistanceField);
    EXPECT_EQ(body->layers, 10);
    EXPECT_EQ(std::pair(body->restitution, body->friction), std::pair(0.9, 2.0));
    EXPECT_EQ(std::pair(body->level, body->error), std::pair(std::int64_t{7}, 1.5));
    EXPECT_EQ(body->velocity, Vec3d(1, 2, 3));
    EXPECT_EQ(body->spin, Vec3d(0, -4, 0));
    const auto* nut = aspect.core<CollisionObject>("/nut/body");
    EXPECT_EQ(nut->node, *findNode(*aspect, "/nut"));
    EXPECT_EQ(nut->kind, CollisionObject::kDeforming);
    EXPECT_EQ(nut->division, CollisionObject::kEachChild);
    EXPECT_EQ(nut->layers, 0);
    EXPECT_EQ(aspect.core<CollisionObject>("/ball/body")->mass, 2.5);
}

TEST(SceneText, EveryCopyOfARepeatedNodeIsACollisionObjectOfItsOwn) {
    // Three ways to say it, each in copies of copies: no name, the copy's own name, a name within the copy.
    Expected<ImportedScene> scene = importText(R"(
        definition { name: "nut" node { name: "nut" transform {} collision_object { node: "nut" mass: 1 } } }
        node { name: "layer" repeat { count: 2 step { y: 3 } }
          node { name: "row" transform {} repeat { count: 3 step { z: 2 } }
            node { name: "bolt" transform {} repeat { count: 4 step { x: 1 } }
              node { name: "head" transform {} sphere { radius: 0.1 } }
              node { name: "nameless" collision_object { mass: 1 } }
              node { name: "named" collision_object { node: "bolt" mass: 1 } }
              node { name: "inner" collision_object { node: "head" mass: 1 } }
              node { name: "drive" motion { target: "row" paused: true key {} } }
              node { instance: "nut" name: "place" } } } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty());
    const ImportedAspect aspect(std::move(*scene));
    for (int layer = 0; layer < 2; ++layer)
        for (int row = 0; row < 3; ++row)
            for (int bolt = 0; bolt < 4; ++bolt) {
                const std::string rowPath = fmt::format("/layer[{}]/row[{}]", layer, row);
                const std::string path = fmt::format("{}/bolt[{}]", rowPath, bolt);
                const ObjectId own = *findNode(*aspect, path);
                EXPECT_EQ(aspect.core<CollisionObject>(path + "/nameless")->node, own) << path;
                EXPECT_EQ(aspect.core<CollisionObject>(path + "/named")->node, own) << path;
                EXPECT_EQ(aspect.core<CollisionObject>(path + "/inner")->node, *findNode(*aspect, path + "/head"));
                EXPECT_EQ(aspect.core<CollisionObject>(path + "/place/nut/collision_object")->node,
                          *findNode(*aspect, path + "/place/nut"));
                EXPECT_EQ(aspect.core<Motion>(path + "/drive")->target,
                          aspect->get<Node>(*findNode(*aspect, rowPath))->core);
            }
}

TEST(SceneText, FindsWhatIsNamedLikeTheNodeThatNamesIt) {
    Expected<ImportedScene> scene = importText(R"(
        node { name: "crane" transform {} }
        node { name: "crane" motion { target: "crane" key {} } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    EXPECT_EQ(aspect.core<Motion>("/crane[1]")->target, aspect->get<Node>(*findNode(*aspect, "/crane"))->core);
}

TEST(SceneText, WritesThousandsOfBodiesInAFewLines) {
    Expected<ImportedScene> scene = importText(R"(
        node { name: "pour" node { transform {} repeat { count: 25 step { y: 1 } }
          node { transform {} repeat { count: 20 step { z: 1 } }
            node { name: "body" transform {} repeat { count: 20 step { x: 1 } }
              node { box { size { x: 0.5 y: 0.5 z: 0.5 } } }
                node { collision_object { mass: 1 shape: HULL } } } } } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->geometries, 1u);
    const ImportedAspect aspect(std::move(*scene));
    std::vector<ObjectId> nodes;
    for (const ObjectId id : aspect->ids())
        if (const auto* object = aspect->get<CollisionObject>(id)) nodes.push_back(object->node);
    EXPECT_EQ(nodes.size(), 10'000u);
    std::sort(nodes.begin(), nodes.end());
    EXPECT_EQ(std::unique(nodes.begin(), nodes.end()), nodes.end());
}

TEST(SceneText, SaysOnceWhereAMassMeansNothing) {
    const Scratch scratch;
    const std::string path =
        scratch.write("scene.tsct", R"(node { name: "static" transform {} collision_object { mass: 1 kind: STATIC } }
node { name: "parts" transform {} repeat { count: 3 step { x: 1 } } collision_object { mass: 1 division: EACH_CHILD } }
node { name: "still" node { name: "body" collision_object { node: "still" mass: 1 } } }
node { name: "flat" transform { scale { y: 2 } } node { transform { scale { y: 0.5 } } collision_object { mass: 1 } } }
node { name: "even" transform { uniform_scale: 2 }
  node { transform { scale { y: 3 } } collision_object { mass: 1 } } })");
    const Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    const std::vector<std::string> expected = {
        path + ":1:36: it is not RIGID, so its mass means nothing",
        path + ":2:69: it is divided into several objects, so its mass means nothing",
        path + ":3:42: the node 'still' has no transform of its own that could move, so its mass means nothing",
        path + ":4:88: the node 'flat' above it scales its axes differently, so its mass means nothing"};
    EXPECT_EQ(scene->notes, expected);
}

TEST(SceneText, HoldsLightsCameraSwitchEnvironmentAndWrittenOutMeshes) {
    Expected<ImportedScene> scene = importText(R"(
        mesh { name: "flag" position: [0,0,0, 1,0,0, 0,1,0] texcoord: [0,1, 1,1, 0,0]
          color: [0xff0000ff, 0x00ff0080, 0x0000ffff] index: [0,1,2] }
        node { name: "flag" geometry { mesh: "flag" } }
        node { name: "sun" transform { rotation { axis { x: 1 } angle_deg: -90 } }
          directional_light { color { r: 1 g: 0.5 } intensity: 3 } }
        node { name: "lamp" point_light { range: 7 } }
        node { name: "eye" transform { translation { z: 9 } } camera { world_units_per_metre: 2.5 } }
        node { name: "choice" switch { choice: 1 } node { name: "a" } node { name: "b" } }
        node { name: "air" environment { sky { b: 1 } } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->hasCamera);
    const ImportedAspect aspect(std::move(*scene));
    const auto* flag = aspect.core<Geometry>("/flag");
    ASSERT_NE(flag, nullptr);
    EXPECT_EQ(flag->colors.as<std::uint8_t>()[7], 0x80);
    ASSERT_EQ(flag->normals.as<float>().size(), 9u) << "computed where the file has none";
    EXPECT_FLOAT_EQ(flag->normals.as<float>()[2], 1.0f);
    EXPECT_FLOAT_EQ(aspect.core<DirectionalLight>("/sun/light")->intensity, 3.0f);
    EXPECT_FLOAT_EQ(aspect.core<PointLight>("/lamp")->range, 7.0f);
    EXPECT_EQ(aspect.core<Camera>("/eye/camera")->worldUnitsPerMetre, 2.5);
    EXPECT_EQ(aspect.core<Switch>("/choice")->choice, 1);
    EXPECT_EQ(aspect->get<Node>(*findNode(*aspect, "/choice"))->children.size(), 2u);
    EXPECT_EQ(aspect.core<Environment>("/air")->sky, Vec3f(0, 0, 1));
}

TEST(SceneText, ImportsOtherFilesBesideItAndReadsEachOnce) {
    const Scratch scratch;
    scratch.write("parts/bolt.tsct", R"(node { name: "bolt" cylinder { radius: 1 height: 2 } } node { camera {} })");
    const std::string path = scratch.write("all.tsct", R"(
        node { name: "left" import { uri: "parts/bolt.tsct" } }
        node { name: "right" transform { translation { x: 3 } } import { uri: "parts/bolt.tsct" } })");
    Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->geometries, 1u);
    EXPECT_FALSE(scene->hasCamera) << "an imported file's camera is not in use unless asked for";
    const ImportedAspect aspect(std::move(*scene));
    EXPECT_EQ(aspect.core<Geometry>("/left/bolt"), aspect.core<Geometry>("/right/bolt"));
}

TEST(SceneText, AMaterialBesideAnImportIsThatOfEverythingInIt) {
    const Scratch scratch;
    scratch.write("bolt.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const std::string path = scratch.write("all.tsct", R"(
        material { name: "brass" base_color { r: 1 } } material { name: "steel" base_color { b: 1 } }
        node { name: "tray" material: "steel"
          node { name: "painted" material: "brass" import { uri: "bolt.obj" } }
          node { name: "again" material: "brass" import { uri: "bolt.obj" } }
          node { name: "plain" import { uri: "bolt.obj" } } })");
    Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->geometries, 2u);
    EXPECT_EQ(scene->triangles, 3u);
    const ImportedAspect aspect(std::move(*scene));
    const auto materialOf = [&](std::string_view name) {
        const Material* found = nullptr;
        Action action;
        action.on<Geometry>([&](const Visit&, const Geometry& geometry) {
            found = aspect->get<Material>(geometry.material);
            return Descend::kInto;
        });
        action.run(*aspect, *findNode(*aspect, name));
        return found;
    };
    EXPECT_EQ(materialOf("/tray/painted")->baseColor.x(), 1);
    EXPECT_EQ(materialOf("/tray/again"), materialOf("/tray/painted"));
    const Material* plain = materialOf("/tray/plain");
    EXPECT_TRUE(plain == nullptr || plain->baseColor.z() < 1) << "what stands above an import does not repaint it";
}

TEST(SceneText, SeveralFilesBecomeOneList) {
    const Scratch scratch;
    const std::vector<std::string> paths = {
        scratch.write("a.tsct", R"(node { name: "a" box { size { x: 1 y: 1 z: 1 } } })"),
        scratch.write("b.tsct", R"(node { name: "b" sphere { radius: 1 } })")};
    Expected<ImportedScene> scene = importScenes(paths, kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    EXPECT_TRUE(findNode(*aspect, "/a"));
    EXPECT_TRUE(findNode(*aspect, "/b"));
}

TEST(SceneText, HalvesImagesUntilTheyFitAndSaysSo) {
    // An uncompressed TGA of 5000 × 2 pixels: left half black, right half white.
    std::string tga("\0\0\2\0\0\0\0\0\0\0\0\0", 12);
    for (const int part : {5000 & 255, 5000 >> 8, 2, 0, 24, 0}) tga.push_back(static_cast<char>(part));
    for (int row = 0; row < 2; ++row) tga += std::string(7500, '\0') + std::string(7500, '\xff');
    const Scratch scratch;
    scratch.write("wide.tga", tga);
    const std::string path = scratch.write("scene.tsct", R"(
        image { name: "wide" uri: "wide.tga" } material { name: "m" base_color_image: "wide" }
        node { material: "m" box { size { x: 1 y: 1 z: 1 } } })");
    Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    ASSERT_EQ(scene->notes.size(), 1u);
    EXPECT_EQ(scene->notes.front(), path + ": 'wide.tga' was reduced to 2500 × 1 pixels");
    const ImportedAspect aspect(std::move(*scene));
    for (const ObjectId id : aspect->ids())
        if (const auto* image = aspect->get<Image>(id)) {
            EXPECT_EQ(image->widthPx, 2500);
            EXPECT_EQ(image->heightPx, 1);
            ASSERT_EQ(image->pixels.sizeBytes(), 10'000u);
            EXPECT_EQ(image->pixels.as<std::uint8_t>()[0], 0);
            EXPECT_EQ(image->pixels.as<std::uint8_t>()[9996], 255);
        }
}

TEST(SceneBinary, HoldsTheSameMessageAsTheText) {
    proto::scene::SceneFile file;
    file.add_material()->set_name("red");
    proto::scene::Node* node = file.add_node();
    node->set_name("ball");
    node->set_material("red");
    node->mutable_sphere()->set_radius(2);
    proto::scene::Mesh* mesh = file.add_mesh();
    mesh->set_name("triangle");
    mesh->set_positions_blob(1);
    mesh->set_indices_blob(2);
    const std::vector<float> positions = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const std::vector<std::uint32_t> indices = {0, 1, 2};
    file.add_blob(reinterpret_cast<const char*>(positions.data()), 36);
    file.add_blob(reinterpret_cast<const char*>(indices.data()), 12);
    proto::scene::Node* flat = file.add_node();
    flat->set_name("flat");
    flat->mutable_geometry()->set_mesh("triangle");
    const Scratch scratch;
    Expected<ImportedScene> scene =
        importScene(scratch.write("scene.tsc", file.SerializeAsString()), kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    ASSERT_NE(aspect.core<Geometry>("/ball"), nullptr);
    EXPECT_NE(aspect->get<Material>(aspect.core<Geometry>("/ball")->material), nullptr);
    ASSERT_NE(aspect.core<Geometry>("/flat"), nullptr);
    EXPECT_EQ(aspect.core<Geometry>("/flat")->positions.as<float>()[3], 1.0f);
}

TEST(SceneText, NamesTheAssetAndThePackageThatAreMissing) {
    ImportOptions options = importOptions();
    options.assetFolders = {"/nowhere", "/usr/share"};
    const Scratch scratch;
    const std::string path = scratch.write("scene.tsct", "node {\n  import { uri: \"asset://glTF2/none.glb\" }\n}");
    const Expected<ImportedScene> scene = importScene(path, kRootNode, options);
    ASSERT_FALSE(scene);
    EXPECT_EQ(scene.error().code, ErrorCode::kNotFound);
    EXPECT_EQ(scene.error().message,
              path +
                  ":2:3: there is no asset 'glTF2/none.glb' (looked in /nowhere, /usr/share); name its folder with "
                  "--assets, or, for the models that Debian packages, install assimp-testmodels");
}

}  // namespace
}  // namespace tessera
