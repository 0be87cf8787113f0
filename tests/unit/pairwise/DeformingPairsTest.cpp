// Shapes whose vertices move again and again: groups and trees that lag behind answer as shapes that are made anew.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "common/math/Compose.h"
#include "server/collision/pairwise/PairTable.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

using namespace bodies;

struct Moving {
    std::shared_ptr<CollisionShape> shape;
    std::vector<Vec3d> rest, now;

    explicit Moving(const TriangleMesh& mesh)
        : shape(CollisionShape::ofTriangles(mesh, {.volume = kAutomaticDeformingVolume})) {
        shape->setDeforms();
        for (const Vec3d p : mesh.positions()) rest.push_back(p);
        now = rest;
    }
    /// Waves, a twist, noise: of all, or of a range.
    void deform(Random& random, bool all) {
        const std::size_t first = all ? 0 : random() % rest.size();
        const std::size_t count = all ? rest.size() : 1 + random() % (rest.size() - first);
        const Vec3d wave = inCube(random, 4);
        const double noise = random() % 3 == 0 ? 0.2 : 0.0;
        for (std::size_t i = first; i < first + count; ++i)
            now[i] = rest[i] * (1 + 0.2 * std::sin(wave.dot(rest[i]))) + inCube(random, noise);
        const std::span<const Vec3d> range(now.data() + first, count);
        ASSERT_TRUE(shape->move(first, range));
    }
    [[nodiscard]] std::shared_ptr<CollisionShape> anew() const {
        TriangleMesh mesh = shape->mesh();
        return CollisionShape::ofTriangles(std::move(mesh));
    }
};

TEST(DeformingPairs, AnswerAsShapesMadeAnew) {
    int met = 0, byGroups = 0;
    const auto check = [&](std::uint64_t seed) {
        SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed) +
                     " build/bin/unit_pairwise --gtest_filter=DeformingPairs.Answer*");
        Random random(seed);
        // Of three groups, or of more than a block of them.
        Moving a(seed % 4 == 3 ? bumpy(random, 26, 36) : bumpy(random, 8, 12)),
            b(seed % 2 == 0 ? bumpy(random, 6, 9) : strewn(random, 150, 0.3));
        const auto still = CollisionShape::ofTriangles(strewn(random, 90, 0.5)),
                   hull = CollisionShape::ofHull(bumpy(random, 4, 6));
        PairHints hints;
        for (int step = 0; step < 40; ++step) {
            a.deform(random, step < 10 || random() % 2 == 0);
            if (random() % 3 != 0) b.deform(random, random() % 4 != 0);
            if (testing::Test::HasFatalFailure()) return;
            const auto newA = a.anew(), newB = b.anew();
            const Affine3d here = composeTransform(inCube(random, 0.3), anyRotation(random), Vec3d::Ones()),
                           there = composeTransform(inCube(random, 1.3), anyRotation(random),
                                                    Vec3d(1, random() % 2 ? 1 : -1, 1.2));
            const auto compare = [&](const CollisionShape& x, const CollisionShape& y, const CollisionShape& newX,
                                     const CollisionShape& newY) {
                QueryWork work;
                const PairTouch found = contactsOf({x, here}, {y, there}, 100000, {work}),
                                truth = contactsOf({newX, here}, {newY, there}, 100000, {work});
                ASSERT_EQ(found.touch, truth.touch);
                ASSERT_EQ(found.count, truth.count);
                ASSERT_EQ(found.faces, truth.faces);
                const PairTouch one = touchOf({x, here}, {y, there}, {work, &hints});
                ASSERT_EQ(one.touch, truth.touch);
                if (!one.faces.empty()) {
                    ASSERT_TRUE(std::ranges::binary_search(truth.faces, one.faces.front()));
                }
                met += truth.touch == Touch::kYes;
                byGroups += x.followsByGroups() || y.followsByGroups();
            };
            compare(*a.shape, *b.shape, *newA, *newB);
            compare(*a.shape, *still, *newA, *still);
            compare(*hull, *a.shape, *hull, *newA);
            if (testing::Test::HasFatalFailure()) return;
            // Now and then somebody wants a tree, which lags behind.
            if (random() % 5 != 0) continue;
            QueryWork work;
            ASSERT_EQ(distanceInWorld({*a.shape, here}, {*b.shape, there}, {}, work).distance,
                      distanceInWorld({*newA, here}, {*newB, there}, {}, work).distance);
            for (const VolumeKind kind : {VolumeKind::kDop14, VolumeKind::kAabb})
                ASSERT_LE(a.shape->tree(kind).decay(), TriangleTree::kRebuildAbove);
        }
    };
    if (const char* only = std::getenv("TESSERA_SEED")) return check(std::strtoull(only, nullptr, 10));
    for (std::uint64_t seed = 0; seed < 24 && !HasFatalFailure(); ++seed) check(seed);
    EXPECT_GT(met, 500);
    EXPECT_GT(byGroups, 300);
}

TEST(DeformingPairs, GroupsComeWithUseAndGoWhereTreesAreAskedFor) {
    Random random(3);
    Moving a(bumpy(random, 8, 12));
    const auto other = CollisionShape::ofTriangles(bumpy(random, 8, 12));
    (void)a.shape->tree();
    const Affine3d here = Affine3d::Identity();
    const auto touch = [&] {
        QueryWork work;
        return touchOf({*a.shape, here}, {*other, here}, {work}).touch;
    };
    for (std::size_t step = 1; step < CollisionShape::kMovesBeforeGroups; ++step) {
        a.deform(random, true);
        ASSERT_FALSE(a.shape->followsByGroups()) << "not for a few edits";
        EXPECT_EQ(touch(), Touch::kYes);
    }
    for (int step = 0; step < 20; ++step) {
        a.deform(random, true);
        ASSERT_TRUE(a.shape->followsByGroups());
        EXPECT_EQ(touch(), Touch::kYes);
        // Not from move to move.
        if (step % 3 == 0) (void)a.shape->tree();
    }
    const std::size_t bytes = a.shape->memoryBytes();
    for (std::size_t step = 0; step <= CollisionShape::kMovesWithTrees; ++step) {
        (void)a.shape->tree();
        a.deform(random, true);
    }
    EXPECT_FALSE(a.shape->followsByGroups());
    EXPECT_LT(a.shape->memoryBytes(), bytes);
    for (int step = 0; step < 20; ++step) {
        a.deform(random, true);
        ASSERT_FALSE(a.shape->followsByGroups()) << "for good";
        EXPECT_EQ(touch(), Touch::kYes);
    }
}

TEST(DeformingPairs, WhatIsRefusedChangesNothing) {
    Random random(4);
    Moving a(bumpy(random, 8, 12));
    for (int step = 0; step < 12; ++step) a.deform(random, true);
    ASSERT_TRUE(a.shape->followsByGroups());
    const auto before = a.anew();
    const std::vector<Vec3d> wrong{Vec3d(0, std::nan(""), 0)}, many(a.rest.size() + 1, Vec3d::Zero());
    EXPECT_FALSE(a.shape->move(3, wrong));
    EXPECT_FALSE(a.shape->move(many));
    const Affine3d here = Affine3d::Identity(), there = here * Eigen::Translation3d(0.7, 0, 0);
    QueryWork work;
    const PairTouch found = contactsOf({*a.shape, here}, {*a.shape, there}, 100000, {work}),
                    truth = contactsOf({*before, here}, {*before, there}, 100000, {work});
    EXPECT_EQ(found.faces, truth.faces);
    EXPECT_GT(truth.count, 0U);
}

}  // namespace
}  // namespace tessera
