#include "common/cores/InverseTransform.h"
#include "common/cores/Switch.h"
#include "common/rays/BoundsAction.h"

#include <gtest/gtest.h>

#include <map>

#include "common/drawable/Drawable.h"
#include "common/geometry/Mesh.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"
#include "tests/property/Seeds.h"
#include "tests/unit/drawable/ControlCube.h"

namespace tessera {
namespace {

using Affine3l = Eigen::Transform<long double, 3, Eigen::Affine>;
using Vec3l = Eigen::Matrix<long double, 3, 1>;

/// A scene under change, and an action that follows it.
struct BoundedScene {
    Aspect aspect;
    BoundsAction action;
    ChangeListBuilder list;
    std::uint64_t next = 100;

    BoundedScene() { action.lookAnew(aspect); }
    void apply() {
        const ChangeList taken = list.take();
        const Expected<void> applied = aspect.apply(taken);
        ASSERT_TRUE(applied) << applied.error().message;
        action.follow(aspect, taken);
    }
    ObjectId make(ObjectType type) {
        list.create(ObjectId(next), type);
        return ObjectId(next++);
    }
    ObjectId node(ObjectId parent, ObjectId core = {}) {
        const ObjectId id = make(typeOf<Node>());
        if (core) setField<&Node::core>(list, id, core);
        if (parent) list.place(id, parent);
        return id;
    }
    ObjectId transform(const Vec3d& at, const Vec3d& scale = Vec3d::Ones(), const Quatd& turn = Quatd::Identity()) {
        const ObjectId core = make(typeOf<Transform>());
        setField<&Transform::translation>(list, core, at);
        setField<&Transform::rotation>(list, core, turn);
        setField<&Transform::scale>(list, core, scale);
        return core;
    }
    ObjectId triangle(const std::vector<float>& corners) {
        const ObjectId core = make(typeOf<Geometry>());
        setField<&Geometry::positions>(list, core, Blob::of(std::span<const float>(corners)));
        const std::uint32_t indices[] = {0, 1, 2};
        setField<&Geometry::indices>(list, core, Blob::of(std::span<const std::uint32_t>(indices)));
        return core;
    }
};

/// Every vertex that is drawn below a node, in coordinates of `from`: matrices multiplied in long double.
void everyVertex(const Aspect& aspect, ObjectId id, const Affine3l& from_T_node, const Affine3l& from_T_world,
                 std::vector<Vec3l>& all) {
    const Node& node = *aspect.get<Node>(id);
    if (const Drawable drawable = drawableOf(aspect, node)) {
        for (unsigned step = 0; step <= (drawable.byScreen() ? drawable.finest() : 0); ++step) {
            const MeshArrays arrays = drawable.at(Fineness(step)).arrays();
            const std::span<const float> p = arrays.positions.as<float>();
            for (std::size_t i = 0; i + 2 < p.size(); i += 3)
                all.push_back(from_T_node * Vec3l(p[i], p[i + 1], p[i + 2]));
            if (step > 1) break;
        }
    }
    for (const ObjectId child : node.children) {
        const Node& below = *aspect.get<Node>(child);
        if (aspect.coreOf<InverseTransform>(below))
            everyVertex(aspect, child, from_T_world, from_T_world, all);
        else
            everyVertex(aspect, child, from_T_node * placeNode(aspect, below, Affine3d::Identity()).cast<long double>(),
                        from_T_world, all);
    }
}

void expectAround(const BoundedScene& scene, ObjectId id) {
    Affine3l world_T_node = Affine3l::Identity();
    std::vector<ObjectId> path;
    for (ObjectId at = id; at; at = scene.aspect.get<Node>(at)->parent) path.insert(path.begin(), at);
    for (const ObjectId at : path) {
        const Node& node = *scene.aspect.get<Node>(at);
        world_T_node = scene.aspect.coreOf<InverseTransform>(node)
                           ? Affine3l::Identity()
                           : world_T_node * placeNode(scene.aspect, node, Affine3d::Identity()).cast<long double>();
    }
    std::vector<Vec3l> all;
    everyVertex(scene.aspect, id, Affine3l::Identity(), world_T_node.inverse(), all);
    const Box box = scene.action.box(id), world = scene.action.worldBox(scene.aspect, id);
    const Sphere sphere = scene.action.sphere(id);
    EXPECT_EQ(box.empty(), all.empty()) << "#" << id.value;
    EXPECT_EQ(sphere.empty(), all.empty());
    for (const Vec3l& p : all) {
        ASSERT_TRUE((p.array() >= box.lower.cast<long double>().array()).all() &&
                    (p.array() <= box.upper.cast<long double>().array()).all())
            << "#" << id.value << ": " << p.transpose() << " is not in " << box.lower.transpose() << " … "
            << box.upper.transpose();
        ASSERT_LE((p - sphere.center.cast<long double>()).norm(), static_cast<long double>(sphere.radius));
        const Vec3l there = world_T_node * p;
        ASSERT_TRUE((there.array() >= world.lower.cast<long double>().array()).all() &&
                    (there.array() <= world.upper.cast<long double>().array()).all());
    }
}

void expectAsAFreshLook(const BoundedScene& scene) {
    BoundsAction fresh;
    fresh.lookAnew(scene.aspect);
    for (const ObjectId id : scene.aspect.ids()) {
        if (!scene.aspect.get<Node>(id)) continue;
        const Box now = scene.action.box(id), anew = fresh.box(id);
        EXPECT_TRUE((now.empty() && anew.empty()) || (now.lower == anew.lower && now.upper == anew.upper))
            << "#" << id.value;
    }
}

TEST(BoundsAction, IsAroundWhatIsBelowInTheCoordinatesOfWhatIsBelow) {
    BoundedScene scene;
    const ObjectId place = scene.transform(Vec3d(10, 0, 0), Vec3d(2, 2, 2));
    const ObjectId top = scene.node(kRootNode, place),
                   leaf = scene.node(top, scene.triangle({0, 0, 0, 1, 0, 0, 0, 1, 0})), none = scene.node(top);
    scene.apply();
    EXPECT_TRUE(scene.action.box(none).empty());
    EXPECT_TRUE(scene.action.box(ObjectId(99)).empty());
    EXPECT_EQ(scene.action.box(leaf).upper, Vec3d(1, 1, 0));
    EXPECT_TRUE(scene.action.box(top).upper.isApprox(Vec3d(1, 1, 0)));
    EXPECT_TRUE(scene.action.box(kRootNode).lower.isApprox(Vec3d(10, 0, 0), 1e-9));
    EXPECT_TRUE(scene.action.box(kRootNode).upper.isApprox(Vec3d(12, 2, 0), 1e-9));
    EXPECT_TRUE(scene.action.worldBox(scene.aspect, leaf).upper.isApprox(Vec3d(12, 2, 0), 1e-9));
}

TEST(BoundsAction, WhatASwitchHidesAndABillboardTurnsIsInside) {
    BoundedScene scene;
    const ObjectId hidden = scene.make(typeOf<Switch>());
    setField<&Switch::choice>(scene.list, hidden, Switch::kNone);
    const ObjectId choice = scene.node(kRootNode, hidden);
    scene.node(choice, scene.triangle({0, 0, 0, 1, 0, 0, 0, 1, 0}));
    const ObjectId sign = scene.node(kRootNode, scene.make(typeOf<Billboard>()));
    scene.node(sign, scene.triangle({0, 0, 0, 3, 0, 0, 0, 4, 0}));
    scene.apply();
    EXPECT_FALSE(scene.action.box(choice).empty());
    EXPECT_LE(scene.action.box(sign).lower.z(), -4);
}

TEST(BoundsAction, SurfacesAreInsideAsFineAsScreensDrawThem) {
    BoundedScene scene;
    SubdivisionSurface cube = test::controlGrid(2);
    cube.screenError = 0.5;
    const ObjectId core = scene.make(typeOf<SubdivisionSurface>());
    const TypeInfo& type = *findType(typeOf<SubdivisionSurface>());
    for (const FieldEntry& field : type.fields)
        if (!field.holdsRefs()) scene.list.set(core, type.type, field.id, field.load(Object::of(cube)));
    const ObjectId node = scene.node(kRootNode, core);
    scene.apply();
    EXPECT_FALSE(scene.action.box(node).empty());
    expectAround(scene, node);
}

TEST(BoundsAction, WhatNoNumberSaysIsEverywhere) {
    BoundedScene scene;
    const ObjectId flat = scene.node(kRootNode, scene.transform(Vec3d::Zero(), Vec3d(1, 0, 1)));
    const ObjectId world = scene.node(flat, scene.make(typeOf<InverseTransform>()));
    scene.node(world, scene.triangle({0, 0, 0, 1, 0, 0, 0, 1, 0}));
    scene.apply();
    EXPECT_TRUE(scene.action.box(world).upper.isApprox(Vec3d(1, 1, 0)));
    EXPECT_FALSE(scene.action.box(flat).upper.allFinite());
    EXPECT_FALSE(std::isfinite(scene.action.sphere(kRootNode).radius));
}

TEST(BoundsAction, OverRandomHistoriesContainsEveryVertexAndIsAsAFreshLook) {
    forSeeds(40, [](Random& random) {
        BoundedScene scene;
        std::vector<ObjectId> nodes{kRootNode}, transforms, meshes;
        const auto number = [&] {
            return (static_cast<double>(below(random, 2001)) - 1000) * (oneIn(random, 9) ? 1e6 : 0.01);
        };
        const auto corners = [&] {
            std::vector<float> p;
            for (int i = 0; i < 9; ++i) p.push_back(static_cast<float>(number()));
            return p;
        };
        const auto any = [&](const std::vector<ObjectId>& some) { return some[below(random, some.size())]; };
        for (int turn = 0; turn < 80 && !testing::Test::HasFailure(); ++turn) {
            switch (below(random, 10)) {
                case 0:
                    transforms.push_back(
                        scene.transform(Vec3d(number(), number(), number()),
                                        Vec3d(number() + 0.013, number() + 0.017, number() + 0.019),
                                        Quatd(number() + 0.003, number(), number(), number()).normalized()));
                    nodes.push_back(scene.node(any(nodes), transforms.back()));
                    break;
                case 1:
                case 2:
                    if (meshes.empty() || oneIn(random, 2)) meshes.push_back(scene.triangle(corners()));
                    nodes.push_back(scene.node(any(nodes), any(meshes)));
                    break;
                case 3:
                    nodes.push_back(
                        scene.node(any(nodes), oneIn(random, 3) ? scene.make(typeOf<InverseTransform>()) : ObjectId()));
                    break;
                case 4:
                case 5:
                    if (!transforms.empty())
                        setField<&Transform::translation>(scene.list, any(transforms),
                                                          Vec3d(number(), number(), number()));
                    break;
                case 6:
                    if (!meshes.empty()) {
                        const std::vector<float> p = corners();
                        setField<&Geometry::positions>(scene.list, any(meshes), Blob::of(std::span<const float>(p)));
                    }
                    break;
                case 7: {  // hangs elsewhere, or nowhere
                    const ObjectId node = any(nodes), parent = any(nodes);
                    bool inside = node == kRootNode;
                    for (ObjectId at = parent; at; at = scene.aspect.get<Node>(at)->parent)
                        inside = inside || at == node;
                    if (!inside) oneIn(random, 4) ? scene.list.detach(node) : scene.list.place(node, parent);
                    break;
                }
                case 8: {  // bears another core
                    const ObjectId node = any(nodes);
                    if (node != kRootNode && !meshes.empty())
                        setField<&Node::core>(scene.list, node, oneIn(random, 3) ? ObjectId() : any(meshes));
                    break;
                }
                default: {
                    const ObjectId node = any(nodes);
                    if (node == kRootNode || !scene.aspect.get<Node>(node)->children.empty()) break;
                    scene.list.detach(node);
                    scene.list.destroy(node);
                    std::erase(nodes, node);
                }
            }
            if (!scene.list.empty()) scene.apply();
            expectAsAFreshLook(scene);
        }
        for (const ObjectId id : nodes) expectAround(scene, id);
    });
}

TEST(BoundsAction, CostsWhatAListChanges) {
    std::map<std::size_t, BoundsAction::Work> moves, rests;
    for (const std::size_t count : {1'000u, 100'000u}) {
        BoundedScene scene;
        const ObjectId mesh = scene.triangle({0, 0, 0, 1, 0, 0, 0, 1, 0}), place = scene.transform(Vec3d::Zero()),
                       group = scene.node(kRootNode);
        const ObjectId holder = scene.node(group, place);
        scene.node(holder, mesh);
        for (std::size_t i = 1; i < count; ++i) scene.node(group, mesh);
        scene.apply();
        EXPECT_EQ(scene.action.work().meshes, 1u) << "one mesh, however many show it";
        const auto since = [&](const BoundsAction::Work& before) {
            return BoundsAction::Work{.boxes = scene.action.work().boxes - before.boxes,
                                      .meshes = scene.action.work().meshes - before.meshes};
        };
        BoundsAction::Work before = scene.action.work();
        setField<&Node::name>(scene.list, holder, std::string("renamed"));
        scene.apply();
        rests[count] = since(before);
        before = scene.action.work();
        for (int i = 1; i <= 10; ++i) {
            setField<&Transform::translation>(scene.list, place, Vec3d(100 * i, 0, 0));
            scene.apply();
        }
        moves[count] = since(before);
        EXPECT_EQ(moves[count].meshes, 0u);
    }
    EXPECT_EQ(rests[100'000].boxes, 0u);
    // Once up the tournament of its siblings: 10 and 17 rounds.
    EXPECT_LE(moves[1'000].boxes, 10u * 20);
    EXPECT_LE(moves[100'000].boxes, 10u * 27);
}

}  // namespace
}  // namespace tessera
