// What a ray through the scene hits.
#include <gtest/gtest.h>

#include <random>

#include "server/collision/pipeline/ScenePicker.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

TEST(Pick, TheNearestVisibleTriangle) {
    SceneMaker scene;
    scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -5));
    const auto near = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -2));
    const std::optional<PickHit> hit = scene.pipeline.pickNode(scene.aspect, {Vec3d(0.1, 0.2, 0), -Vec3d::UnitZ()});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->node, near.shape);
    EXPECT_DOUBLE_EQ(hit->t, 1.5);
    EXPECT_TRUE(hit->details.normal.isApprox(Vec3d::UnitZ()));
    EXPECT_NEAR(hit->details.weights.sum(), 1, 1e-15);
    EXPECT_FALSE(scene.pipeline.pickNode(scene.aspect, {Vec3d(0.1, 0.2, 0), Vec3d::UnitZ()}));
    EXPECT_FALSE(scene.pipeline.pickNode(scene.aspect, {Vec3d(0.6, 0, 0), -Vec3d::UnitZ()}));
}

TEST(Pick, WhatIsLargeIsAnsweredAsideAndThenKept) {
    SceneMaker scene;
    const auto near = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -2));
    const auto far = scene.body(kRootNode, shapes::box(Vec3d(9, 9, 1)), Vec3d(0, 0, -5));
    const auto cache = std::make_shared<ShapeCache>(0);  // keeps nothing that nobody holds
    ObjectHandler handler(cache);
    handler.update(scene.aspect, nullptr);
    ScenePicker picker(cache);
    const auto rayAt = [](double x) { return Ray{Vec3d(x, 0.1, 0), -Vec3d::UnitZ()}; };
    const auto atOnce = [&](double x, bool& over) {
        PickPatience patience{.maxMadeFaces = 4};
        const auto hit = picker.pick(scene.aspect, handler, rayAt(x), &patience);
        over = patience.over();
        return hit;
    };
    const auto aside = [&](double x) {
        std::optional<AsidePick> question = picker.pickAside(scene.aspect, handler, rayAt(x));
        question->answer();
        const std::size_t made = question->made.size();
        picker.put(std::move(question->made));
        EXPECT_TRUE(picker.takeReleased().empty());
        return std::pair(question->found->node, made);
    };
    bool over = false;
    EXPECT_FALSE(atOnce(0.1, over)) << "what is far may not be told while something nearer is not there";
    EXPECT_TRUE(over);
    EXPECT_EQ(aside(0.1), std::pair(near.shape, std::size_t{1})) << "what the nearest hides is not made";
    EXPECT_EQ(atOnce(0.1, over)->node, near.shape);
    EXPECT_FALSE(over);
    EXPECT_FALSE(atOnce(3, over));
    EXPECT_TRUE(over);
    EXPECT_EQ(aside(3), std::pair(far.shape, std::size_t{1}));
    EXPECT_EQ(aside(3), std::pair(far.shape, std::size_t{0})) << "it is there by now";
    cache->forgetIdle();
    EXPECT_EQ(atOnce(0.1, over)->node, near.shape) << "both have been asked about";
    EXPECT_EQ(atOnce(3, over)->node, far.shape);
    EXPECT_FALSE(over);
    // Too much to look at: nothing, and not something.
    PickPatience little{.work = {.limit = 1}};
    EXPECT_FALSE(picker.pick(scene.aspect, handler, rayAt(3), &little));
    EXPECT_TRUE(little.over());
}

TEST(Pick, OfManySmallOnesNoMoreAreMadeAtOnceThanOfOneLargeOne) {
    SceneMaker scene;
    for (int i = 0; i < 100; ++i) scene.body(kRootNode, shapes::sphere(1 + 0.001 * i, 8, 12), Vec3d(3 * i, 0, 0));
    PickPatience patience{.maxMadeFaces = 1000};
    const Ray beside{Vec3d(-5, 0.9, 0.9), Vec3d::UnitX()};  // within their boxes
    EXPECT_FALSE(scene.pipeline.pickNode(scene.aspect, beside, &patience));
    EXPECT_TRUE(patience.over());
    std::optional<AsidePick> question = scene.pipeline.pickAside(scene.aspect, beside);
    ASSERT_TRUE(question);
    question->answer();
    EXPECT_FALSE(question->found);
    EXPECT_EQ(question->made.size(), 95u) << "five are there";
    std::optional<AsidePick> stopped = scene.pipeline.pickAside(scene.aspect, beside);
    const std::atomic<bool> stop = true;
    stopped->answer(&stop);
    EXPECT_TRUE(stopped->exhausted);
    EXPECT_TRUE(stopped->made.empty());
    // What has been asked for is kept to a bound, and what goes for that is handed out.
    PickPatience all;
    scene.pipeline.putShapes(question->made);
    EXPECT_FALSE(scene.pipeline.pickNode(scene.aspect, beside, &all));
    EXPECT_FALSE(all.over());
}

/// Turned, stretched and flat things in one another's way, of which some share a geometry and some lie in one place.
TEST(Pick, AsideIsWhatItIsAtOnce) {
    const char* given = std::getenv("TESSERA_SEED");
    const unsigned seed = given ? static_cast<unsigned>(std::strtoul(given, nullptr, 10)) : std::random_device{}();
    SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed
                                    << " build/bin/unit_pipeline --gtest_filter=Pick.Aside*");
    std::mt19937 random(seed);
    const auto number = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
    const auto somewhere = [&](double reach) {
        return Vec3d(number(-reach, reach), number(-reach, reach), number(-reach, reach));
    };
    int hits = 0, misses = 0;
    for (int round = 0; round < 6; ++round) {
        SceneMaker scene;
        const std::vector<ObjectId> cores{scene.geometry(shapes::sphere(1, 8, 12)), scene.geometry(shapes::sheet(2, 3)),
                                          scene.geometry(shapes::box({9, 1e-7, 1e-9}))};
        std::vector<ObjectId> transforms;
        for (int i = 0; i < 40; ++i) {
            const Vec3d scale = i % 5 == 0 ? Vec3d(1, 3, 0.2) : i % 7 == 0 ? Vec3d(1, 0, 1) : Vec3d::Ones();
            const Quatd turn = Quatd(number(-1, 1), number(-1, 1), number(-1, 1), number(-1, 1)).normalized();
            transforms.push_back(scene.transform(somewhere(6), turn, scale));
            for (int twice = 0; twice < 1 + i % 2; ++twice)
                scene.node(scene.node(kRootNode, transforms.back()), cores[static_cast<std::size_t>(i) % 3]);
        }
        for (int change = 0; change < 50; ++change) {
            scene.set<Transform>(transforms[random() % transforms.size()], fieldId<&Transform::translation>,
                                 somewhere(6));
            const Vec3d from = somewhere(9);
            const Ray ray{from, change % 3 == 0 ? somewhere(1) : Vec3d(somewhere(6) - from)};
            std::optional<AsidePick> question = scene.pipeline.pickAside(scene.aspect, ray);
            ASSERT_TRUE(question);
            question->answer();
            scene.pipeline.putShapes(question->made);
            const std::optional<PickHit> told = scene.pipeline.pickNode(scene.aspect, ray);
            ASSERT_EQ(question->found.has_value(), told.has_value());
            ++(told ? hits : misses);
            if (!told) continue;
            ASSERT_EQ(question->found->node, told->node);
            ASSERT_EQ(question->found->face, told->face);
            ASSERT_EQ(question->found->t, told->t);
            ASSERT_EQ(question->found->point, told->point);
            ASSERT_EQ(question->found->details.weights, told->details.weights);
        }
    }
    EXPECT_GT(hits, 30);
    EXPECT_GT(misses, 30);
}

TEST(KeptShapes, HaveABoundAndTheOldestGoes) {
    const auto cache = std::make_shared<ShapeCache>();
    KeptShapes kept(cache);
    const shapes::Soup ball = shapes::sphere(1, 64, 1024);  // 129,024 faces
    const auto arraysOf = [&](int which) {
        return MeshArrays{.positions = Blob::of(std::span<const float>(ball.positions)),
                          .indices = Blob::of(std::span<const std::uint32_t>(ball.indices)),
                          .pointRadius = static_cast<double>(which)};  // another one to the cache
    };
    const auto make = [&](int which) { return cache->shape(arraysOf(which)); };
    std::shared_ptr<const CollisionShape> mine = make(1);
    const int all = 60;
    for (int i = 0; i < all; ++i) {
        kept.add(arraysOf(i), make(i));
        if (i > 0) kept.used(cache->shape(arraysOf(0)));
    }
    const std::size_t fits = kept.size();
    EXPECT_GT(fits, 20u);
    EXPECT_LT(fits, 40u);
    EXPECT_EQ(cache->size(), fits + 1) << "one is held elsewhere";
    EXPECT_EQ(kept.takeReleased().size(), all - fits - 1);
    EXPECT_TRUE(cache->isMade(arraysOf(0))) << "somebody asks for it all the time";
    EXPECT_TRUE(cache->isMade(arraysOf(1)));
    EXPECT_FALSE(cache->isMade(arraysOf(2)));
    EXPECT_TRUE(cache->isMade(arraysOf(all - 1)));
    mine.reset();
    kept.add(arraysOf(all), make(all));
    EXPECT_FALSE(cache->isMade(arraysOf(1))) << "it goes once nobody has it any more";
    EXPECT_EQ(kept.takeReleased().size(), 2u);
}

/// All that picks have made, at once or aside, whatever becomes of it.
TEST(Pick, WhatIsMadeForPicksIsLetGoOf) {
    SceneMaker scene;
    const auto cache = std::make_shared<ShapeCache>();
    ObjectHandler handler(cache);
    const ObjectId geometry = scene.geometry(shapes::sphere(1, 16, 64));
    scene.node(kRootNode, geometry);
    handler.update(scene.aspect, nullptr);
    ScenePicker picker(cache);
    const std::size_t before = cache->size();
    const Ray ray{Vec3d(0, 0, 9), -Vec3d::UnitZ()};
    const std::size_t bytes = 100 * std::size_t{16 * 64 * 2};  // of one, at least
    const std::size_t rounds = 2 * KeptShapes::kMostBytes / bytes;
    std::size_t most = 0;
    for (std::size_t i = 0; i < std::min<std::size_t>(rounds, 5000); ++i) {
        shapes::Soup soup = shapes::sphere(1 + 1e-4 * static_cast<double>(i), 16, 64);
        ChangeListBuilder b;
        setField<&Geometry::positions>(b, geometry, Blob::of(std::span<const float>(soup.positions)));
        const ChangeList list = b.take();
        ASSERT_TRUE(scene.aspect.apply(list));
        handler.update(scene.aspect, &list);
        PickPatience patience{.maxMadeFaces = i % 2 == 0 ? std::size_t{5000} : std::size_t{0}};
        if (!picker.pick(scene.aspect, handler, ray, &patience)) {
            std::optional<AsidePick> question = picker.pickAside(scene.aspect, handler, ray);
            question->answer();
            picker.put(std::move(question->made));
        }
        (void)picker.takeReleased();
        most = std::max(most, cache->size());
    }
    EXPECT_LT(most - before, 2 * KeptShapes::kMostBytes / bytes);
    EXPECT_GT(most - before, 1000u);
}

TEST(Pick, APointIsAsLargeAsItsRadius) {
    SceneMaker scene;
    const std::vector<float> places = {0, 0, 0, 3, 0, 0};
    const ObjectId points = scene.geometry({places, {}});
    const ObjectId node = scene.node(scene.node(kRootNode, scene.transform(Vec3d(0, 0, -5))), points);
    const auto pick = [&](double x, double y) {
        return scene.pipeline.pickNode(scene.aspect, {Vec3d(x, y, 0), -Vec3d::UnitZ()});
    };
    EXPECT_FALSE(pick(3, 0)) << "triangles without indices";
    scene.set<Geometry>(points, fieldId<&Geometry::primitive>, Geometry::kPoints);
    scene.set<Geometry>(points, fieldId<&Geometry::pointRadius>, 0.5);
    const std::optional<PickHit> hit = pick(3.1, 0.1);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->node, node);
    EXPECT_EQ(hit->face, 8u) << "of the second point, where +X, +Y and +Z meet";
    EXPECT_NEAR(hit->t, 5 - 0.3, 1e-6) << "|x| + |y| + |z| = radius";
    EXPECT_TRUE(pick(0, 0.45));
    EXPECT_FALSE(pick(1.5, 0)) << "between the two";
    scene.set<Geometry>(points, fieldId<&Geometry::pointRadius>, 0.2);
    EXPECT_FALSE(pick(0, 0.45)) << "smaller now";
    scene.set<Geometry>(points, fieldId<&Geometry::pointRadius>, 0.0);
    EXPECT_TRUE(pick(0, 0.0005)) << "of no radius: a two-thousandth of 3";
    EXPECT_FALSE(pick(0, 0.0016));
}

TEST(Pick, GoesThroughWhatTakesPartInNothing) {
    SceneMaker scene;
    const auto far = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -5));
    CollisionObject object;
    object.layers = 0;
    const ObjectId core = scene.object(object);
    const ObjectId marks = scene.node(kRootNode, core);
    scene.body(marks, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -2));
    EXPECT_NE(scene.pipeline.pickNode(scene.aspect, {Vec3d(0.1, 0.2, 0), -Vec3d::UnitZ()})->node, far.shape);
    scene.set<CollisionObject>(core, fieldId<&CollisionObject::node>, marks);
    EXPECT_EQ(scene.pipeline.pickNode(scene.aspect, {Vec3d(0.1, 0.2, 0), -Vec3d::UnitZ()})->node, far.shape);
}

/// A step's values are laid over the scene until it has them: who picks meanwhile changes nothing for later picks.
TEST(Pick, WhatAStepHasMovedIsHitWhereTheSceneHasIt) {
    const Ray here{Vec3d(0.1, 0.2, 0), -Vec3d::UnitZ()}, there{Vec3d(5.1, 0.2, 0), -Vec3d::UnitZ()};
    for (const bool first : {false, true})
        for (const bool committed : {false, true}) {
            SCOPED_TRACE(testing::Message() << "first " << first << ", committed " << committed);
            SceneMaker scene;
            const auto moving = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -2));
            scene.interest(moving.node);
            if (first) {
                EXPECT_TRUE(scene.pipeline.pickNode(scene.aspect, here));
            }
            const TentativeTransform wish{.transform = moving.transform, .translation = Vec3d(5, 0, -2)};
            ASSERT_EQ(scene.pipeline.step(scene.aspect, std::vector{wish}).accepted.size(), 1u);
            EXPECT_TRUE(scene.pipeline.pickNode(scene.aspect, here)) << "it is not there yet";
            EXPECT_FALSE(scene.pipeline.pickNode(scene.aspect, there));
            if (committed)
                scene.commit(wish);
            else
                scene.node(kRootNode);
            EXPECT_EQ(scene.pipeline.pickNode(scene.aspect, here).has_value(), !committed);
            EXPECT_EQ(scene.pipeline.pickNode(scene.aspect, there).has_value(), committed);
        }
}

}  // namespace
}  // namespace tessera
