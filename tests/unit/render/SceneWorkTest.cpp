// One changed object costs the same in a scene of 1,000 and in one of 100,000: counted, not timed.
#include "tests/unit/render/EditStage.h"

namespace tessera {
namespace {

/// The mean work of one edit of each kind.
std::vector<double> workOf(Layout layout, int count) {
    constexpr int kTurns = 12;
    EditStage stage(layout, count);
    std::vector<double> work;
    for (const EditKind& kind : editKinds()) {
        const std::uint64_t before = stage.all.impl().work();
        for (int turn = 0; turn < kTurns; ++turn) {
            kind.edit(stage, turn);
            const ChangeList list = stage.scene.apply();
            stage.all.update(stage.scene.aspect, &list);
        }
        work.push_back(static_cast<double>(stage.all.impl().work() - before) / kTurns);
    }
    EXPECT_EQ(stage.all.impl().rebuilds, 1u);
    return work;
}

class SceneWorkIn : public testing::TestWithParam<Layout> {};

TEST_P(SceneWorkIn, OfOneChangedObjectDoesNotGrowWithTheScene) {
    const std::vector<double> small = workOf(GetParam(), 1'000);
    const std::vector<double> large = workOf(GetParam(), 100'000);
    for (std::size_t i = 0; i < editKinds().size(); ++i) {
        // The tree of boxes is log 100,000 / log 1,000 = 5/3 times as deep; a chain has 250 places to count.
        EXPECT_LE(large[i], 2.5 * small[i] + 10) << editKinds()[i].name;
        EXPECT_LE(large[i], GetParam() == Layout::kDeep ? 1200 : 250) << editKinds()[i].name;
        EXPECT_GT(small[i], 0) << editKinds()[i].name;
        RecordProperty(editKinds()[i].name, std::to_string(small[i]) + " " + std::to_string(large[i]));
    }
}

std::string nameOf(const testing::TestParamInfo<Layout>& layout) {
    return layout.param == Layout::kBushy ? "Bushy" : layout.param == Layout::kFlat ? "Flat" : "Deep";
}
INSTANTIATE_TEST_SUITE_P(Scenes, SceneWorkIn, testing::Values(Layout::kBushy, Layout::kFlat, Layout::kDeep), nameOf);

TEST(SceneWork, OfASwitchAmongAHundredThousandChildrenIsThatOfThoseThatComeAndGo) {
    TestScene scene;
    const ObjectId choice = scene.create(typeOf<Switch>());
    const ObjectId parent = scene.node(choice);
    const ObjectId core = scene.geometry(makeBox({1, 1, 1}));
    std::vector<ObjectId> children;
    for (int i = 0; i < 100'000; ++i) children.push_back(scene.node(core, parent));
    const auto choose = [&](std::int64_t value) {
        scene.edit.set(choice, typeOf<Switch>(), fieldId<&Switch::choice>, toValue(value));
    };
    choose(17);
    scene.apply();
    RenderScene all;
    all.update(scene.aspect, nullptr);
    const auto follow = [&] {
        const std::uint64_t before = all.impl().work();
        const ChangeList list = scene.apply();
        all.update(scene.aspect, &list);
        EXPECT_LE(all.impl().work() - before, 60u);
        return nodesOf(RenderAction(CullerKind::kNone).run(all, TestCamera().camera(), TestCamera().tile(), nullptr));
    };
    choose(40'000);
    EXPECT_EQ(follow(), std::vector<ObjectId>{children[40'000]});
    // One before it comes, one goes: the child at the index is another.
    const ObjectId first = scene.node(core);
    scene.edit.place(first, parent, 0);
    EXPECT_EQ(follow(), std::vector<ObjectId>{children[39'999]});
    scene.edit.detach(children[3]);
    EXPECT_EQ(follow(), std::vector<ObjectId>{children[40'000]});
    scene.edit.detach(children[40'000]);
    EXPECT_EQ(follow(), std::vector<ObjectId>{children[40'001]});
    choose(Switch::kNone);
    EXPECT_TRUE(follow().empty());
}

TEST(SceneWork, OfAMaterialThatOnlyChangesItsColourIsNoneHoweverManyUseIt) {
    TestScene scene;
    const ObjectId material = scene.material(1.0f);
    const ObjectId core = scene.geometry(makeBox({1, 1, 1}), material);
    for (int i = 0; i < 10'000; ++i) scene.node(core);
    scene.apply();
    RenderScene all;
    all.update(scene.aspect, nullptr);
    scene.edit.set(material, typeOf<Material>(), fieldId<&Material::baseColor>, toValue(Vec4f(1, 0, 0, 1)));
    const std::uint64_t before = all.impl().work();
    const ChangeList list = scene.apply();
    all.update(scene.aspect, &list);
    EXPECT_LE(all.impl().work() - before, 2u);
}

}  // namespace
}  // namespace tessera
