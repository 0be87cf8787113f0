// Who touches whom, asked between steps: what it costs, and the boxes that it looks at.
#include <cmath>
#include <limits>

#include "server/collision/pipeline/BoxesNear.h"
#include "tests/property/Seeds.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

TEST(BoxesNear, FindsWhatAllPairsFindButForTheOwnCompany) {
    forSeeds(100, [](Random& random) {
        std::vector<BoxesNear::Item> items;
        const auto count = random() % 200;
        for (std::uint32_t i = 0; i < count; ++i) {
            Box box;
            const auto from = [&] { return std::uniform_real_distribution(-5.0, 5.0)(random); };
            Vec3d at(from(), from(), from());
            if (random() % 3 == 0) at = at.array().round();  // many touch, and are the same
            box.extend(at);
            box.extend(at + Vec3d(random() % 3, random() % 3, random() % 3));
            if (random() % 50 == 0) box.upper.x() = std::numeric_limits<double>::infinity();
            if (random() % 50 == 0) box.lower = -(box.upper = Vec3d::Constant(std::numeric_limits<double>::infinity()));
            items.push_back({3 * i, random() % 2 ? BoxesNear::kAlone : static_cast<std::uint32_t>(random() % 4), box});
        }
        BoxesNear near(items);
        std::vector<std::uint32_t> found;
        for (const BoxesNear::Item& one : items) {
            std::vector<std::uint32_t> expected;
            for (const BoxesNear::Item& other : items)
                if (other.box.overlaps(one.box) && (one.company == BoxesNear::kAlone || one.company != other.company))
                    expected.push_back(other.item);
            near.find(one.box, one.company, found);
            ASSERT_EQ(found, expected);
        }
    });
}

/// Boxes looked at where so many parts below one Transform are put elsewhere, among a tenth as many that stand by
/// themselves.
std::uint64_t looksFor(int parts) {
    SceneMaker scene;
    const ObjectId carrier = scene.transform(Vec3d::Zero()), top = scene.node(kRootNode, carrier);
    const ObjectId box = scene.geometry(shapes::box(Vec3d::Ones()));
    const int side = static_cast<int>(std::ceil(std::sqrt(parts)));
    const auto at = [&](int i, double height) { return Vec3d(2 * (i % side), height, 2 * (i / side)); };
    for (int i = 0; i < parts; ++i) scene.node(scene.node(top, scene.transform(at(i, 0))), box);
    for (int i = 0; i < parts / 10; ++i) scene.node(scene.node(kRootNode, scene.transform(at(10 * i, 1.5))), box);
    scene.interest(top);
    (void)scene.frame();
    const std::uint64_t before = scene.pipeline.boxesLookedAt();
    const Pose up{.translation = Vec3d(0, 0.7, 0)};
    const auto after =
        scene.pipeline.overlapsAfter(scene.aspect, std::vector<CollisionPipeline::PosedTransforms>{{{carrier, up}}},
                                     CollisionPipeline::Against::kEverything);
    EXPECT_EQ(after.at(0).size(), static_cast<std::size_t>(parts / 10));
    return scene.pipeline.boxesLookedAt() - before;
}

TEST(Overlaps, CostWhatIsCarriedAndWhatItMeets) {
    const std::uint64_t few = looksFor(100), many = looksFor(10'000);
    EXPECT_LE(many, 100 * few * 4) << "a hundred times as many parts, and the way down a tree that is as much deeper";
}

TEST(Overlaps, WhatIsCarriedTogetherIsNotComparedHoweverItLies) {
    SceneMaker scene;
    const ObjectId carrier = scene.transform(Vec3d::Zero()), top = scene.node(kRootNode, carrier);
    const ObjectId box = scene.geometry(shapes::box(Vec3d::Ones()));
    constexpr std::size_t kParts = 2'000;
    for (std::size_t i = 0; i < kParts; ++i) scene.node(top, box);
    scene.node(scene.node(kRootNode, scene.transform(Vec3d(0, 5, 0))), box);
    scene.interest(top);
    (void)scene.frame();
    const std::uint64_t before = scene.pipeline.boxesLookedAt();
    const Pose up{.translation = Vec3d(0, 1, 0)};
    const auto after =
        scene.pipeline.overlapsAfter(scene.aspect, std::vector<CollisionPipeline::PosedTransforms>{{{carrier, up}}},
                                     CollisionPipeline::Against::kEverything);
    EXPECT_TRUE(after.at(0).empty());
    EXPECT_LE(scene.pipeline.boxesLookedAt() - before, 10 * kParts);
}

}  // namespace
}  // namespace tessera
