// Lights that light a part of the scene alone: who lies in which scope, what that costs, and how many scopes there are.
#include <bit>

#include "client/render/scene/SceneItems.h"
#include "common/cores/PointLight.h"
#include "tests/unit/render/TestScene.h"

namespace tessera {
namespace {

/// A grid of boxes: `rows` nodes with `inRow` items each below.
struct Rows {
    TestScene scene;
    std::vector<ObjectId> rows;
    std::vector<ObjectId> firsts;  ///< the first item of each row
    RenderScene all;

    Rows(int count, int inRow) {
        const ObjectId box = scene.geometry(makeBox({1, 1, 1}));
        for (int i = 0; i < count; ++i) {
            rows.push_back(scene.node(scene.transform({0, 2.0 * i, -9})));
            for (int k = 0; k < inRow; ++k) {
                const ObjectId node = scene.node(box, scene.node(scene.transform({2.0 * k, 0, 0}), rows.back()));
                if (k == 0) firsts.push_back(node);
            }
        }
        scene.apply();
        all.update(scene.aspect, nullptr);
    }
    ObjectId lamp(ObjectId scope, bool outside = false) {
        const ObjectId lamp = scene.create(typeOf<PointLight>());
        setField<&PointLight::scope>(scene.edit, lamp, scope);
        setField<&PointLight::outside>(scene.edit, lamp, outside);
        scene.node(lamp);
        return lamp;
    }
    /// What following the edits has looked at.
    std::uint64_t follow() {
        const std::uint64_t before = all.impl().work();
        const ChangeList list = scene.apply();
        all.update(scene.aspect, &list);
        return all.impl().work() - before;
    }
    /// By row: whether the light with this number lights it.
    std::vector<bool> lit(std::size_t light) {
        const DrawList list = RenderAction(CullerKind::kNone).run(all, TestCamera().camera(), {0, 0, 64, 64}, nullptr);
        std::vector<bool> found(rows.size(), false);
        const LightItem& of = list.lights.at(light);
        for (std::size_t i = 0; i < rows.size(); ++i)
            for (const DrawItem& item : list.opaque)
                if (item.node == firsts[i])
                    found[i] = of.scope == 0 || ((item.scopes >> (of.scope - 1u) & 1u) != 0) != of.outside;
        return found;
    }
};

using Lit = std::vector<bool>;

TEST(LightScopes, FollowNodesThatGoAndComeAndScopesThatAreOthers) {
    Rows rows(3, 2);
    const ObjectId inside = rows.lamp(rows.rows[1]), outside = rows.lamp(rows.rows[1], true);
    rows.lamp({});
    rows.follow();
    EXPECT_EQ(rows.lit(0), (Lit{false, true, false}));
    EXPECT_EQ(rows.lit(1), (Lit{true, false, true}));
    EXPECT_EQ(rows.lit(2), (Lit{true, true, true}));
    // A row goes below another one.
    rows.scene.edit.place(rows.rows[2], rows.rows[1]);
    rows.follow();
    EXPECT_EQ(rows.lit(0), (Lit{false, true, true}));
    EXPECT_EQ(rows.lit(1), (Lit{true, false, false}));
    setField<&PointLight::scope>(rows.scene.edit, inside, rows.rows[2]);
    rows.follow();
    EXPECT_EQ(rows.lit(0), (Lit{false, false, true}));
    EXPECT_EQ(rows.lit(1), (Lit{true, false, false})) << "scopes lie in each other";
    rows.scene.edit.place(rows.rows[2], kRootNode);
    setField<&PointLight::scope>(rows.scene.edit, outside, kRootNode);
    rows.follow();
    EXPECT_EQ(rows.lit(0), (Lit{false, false, true}));
    EXPECT_EQ(rows.lit(1), (Lit{false, false, false})) << "there is nothing outside of the root";
    // Who is out of the scene has nothing in it below.
    setField<&PointLight::scope>(rows.scene.edit, outside, rows.rows[0]);
    rows.scene.edit.detach(rows.rows[0]);
    rows.follow();
    EXPECT_EQ(rows.lit(1), (Lit{false, true, true}));
    rows.scene.edit.place(rows.rows[0], kRootNode);
    setField<&PointLight::on>(rows.scene.edit, inside, false);
    rows.follow();
    EXPECT_EQ(rows.lit(0), (Lit{false, true, true})) << "the first one is off";
}

TEST(LightScopes, CostWhatLiesInThem) {
    for (const int count : {100, 1000}) {
        Rows rows(count, 10);
        const ObjectId lamp = rows.lamp(rows.rows[1]);
        rows.follow();
        setField<&PointLight::scope>(rows.scene.edit, lamp, rows.rows[2]);
        EXPECT_LT(rows.follow(), 100u) << "two rows of 20 nodes, of " << count;
        // What goes elsewhere costs what it costs without any light.
        Rows dark(count, 10);
        dark.scene.edit.place(dark.rows[2], dark.rows[3]);
        const std::uint64_t moved = dark.follow();
        rows.scene.edit.place(rows.rows[2], rows.rows[3]);
        EXPECT_LE(rows.follow(), moved + 2) << count;
    }
}

TEST(LightScopes, BeyondTheFirst32TheirLightsAreLeftOutAndCounted) {
    Rows rows(40, 1);
    std::vector<ObjectId> lamps;
    for (int i = 0; i < 40; ++i) lamps.push_back(rows.lamp(rows.rows[static_cast<std::size_t>(i)]));
    rows.lamp(rows.rows[3], true);
    rows.lamp({});
    rows.follow();
    EXPECT_EQ(rows.all.impl().lights.size(), 34u);
    EXPECT_EQ(rows.all.impl().scopesLeftOut, 8u);
    EXPECT_TRUE(rows.lit(31)[31]);
    // One goes: the next one in the document takes its place.
    setField<&PointLight::on>(rows.scene.edit, lamps[5], false);
    rows.follow();
    EXPECT_EQ(rows.all.impl().lights.size(), 34u);
    EXPECT_EQ(rows.all.impl().scopesLeftOut, 7u);
    Lit alone(40, false);
    alone[32] = true;
    EXPECT_EQ(rows.lit(31), alone);
}

}  // namespace
}  // namespace tessera
