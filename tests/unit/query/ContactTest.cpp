#include <gtest/gtest.h>

#include "common/base/Workers.h"
#include "common/math/Compose.h"
#include "server/collision/query/ContactQuery.h"
#include "tests/unit/query/Bodies.h"

namespace tessera {
namespace {

using namespace bodies;

double apart(const Triangle& t, const Vec3d& p) {
    double least = isDegenerate(t) ? 1e300 : (nearestOnTriangle(t, p) - p).norm();
    for (std::size_t i = 0; i < 3; ++i) least = std::min(least, nearestOnSegments(t[i], t[(i + 1) % 3], p, p).distance);
    return least;
}

TEST(Contacts, OnePerPairThatMeetsOnBothTriangles) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        Random random(seed);
        const TriangleTree a(seed % 2 ? bumpy(random, 14, 20) : strewn(random, 300, 0.3)), b(bumpy(random, 14, 20));
        for (const NamedMap& m : everyKindOfMap(random)) {
            if (m.map.linear().norm() > 1e9) continue;
            QueryWork work, alike;
            const BodyContacts found = contactsBetween(a, b, m.map, work);
            const FacePairs pairs = allTouching(a, b, m.map, alike);
            EXPECT_TRUE(found.complete);
            EXPECT_EQ(work.boxTests, alike.boxTests);
            ASSERT_EQ(found.contacts.size(), pairs.pairs.size()) << "seed " << seed << ", " << m.name;
            for (std::size_t i = 0; i < pairs.pairs.size(); ++i) {
                const BodyContact& c = found.contacts[i];
                ASSERT_EQ(c.faces, pairs.pairs[i]);
                const Triangle ta = a.mesh().triangle(c.faces.a), tb = transformed(m.map, b.mesh().triangle(c.faces.b));
                double size = 1e-3;
                for (const Vec3d& p : {ta[0], ta[1], ta[2], tb[0], tb[1], tb[2]})
                    size = std::max(size, p.cwiseAbs().maxCoeff());
                for (const Vec3d& p : {c.contact.from, c.contact.to, c.contact.point}) {
                    ASSERT_LT(apart(ta, p), 1e-7 * size) << "seed " << seed << ", " << m.name << ", contact " << i;
                    ASSERT_LT(apart(tb, p), 1e-7 * size) << "seed " << seed << ", " << m.name << ", contact " << i;
                }
                ASSERT_NEAR(c.contact.normal.norm(), 1, 1e-12);
            }
        }
    }
}

TEST(Contacts, TheFirstFewAreTheFirstFew) {
    Random random(2);
    const TriangleTree a(bumpy(random, 20, 30)), b(bumpy(random, 20, 30));
    const Affine3d pose = composeTransform(Vec3d(0.9, 0, 0), anyRotation(random), Vec3d::Ones());
    QueryWork work;
    const BodyContacts all = contactsBetween(a, b, pose, work);
    ASSERT_GT(all.contacts.size(), 20U);
    for (const std::size_t most :
         {std::size_t{0}, std::size_t{1}, std::size_t{17}, all.contacts.size(), all.contacts.size() + 1}) {
        const BodyContacts some = contactsBetween(a, b, pose, work, most);
        ASSERT_EQ(some.contacts.size(), std::min(most, all.contacts.size()));
        EXPECT_EQ(some.complete, most >= all.contacts.size());
        for (std::size_t i = 0; i < some.contacts.size(); ++i) EXPECT_EQ(some.contacts[i].faces, all.contacts[i].faces);
    }
}

TEST(Contacts, ThreadsChangeNotABit) {
    Random random(4);
    const TriangleTree a(bumpy(random, 60, 80)), b(bumpy(random, 60, 80));
    const Affine3d pose = composeTransform(Vec3d(0.4, 0.2, 0), anyRotation(random), Vec3d::Ones());
    QueryWork alone;
    const BodyContacts expected = contactsBetween(a, b, pose, alone);
    ASSERT_GT(expected.contacts.size(), 500U);
    for (const unsigned threads : {1U, 2U, 3U}) {
        Workers workers(threads);
        TouchOptions options;
        options.workers = &workers;
        QueryWork work;
        const BodyContacts found = contactsBetween(a, b, pose, work, ~std::size_t{0}, options);
        ASSERT_EQ(found.contacts.size(), expected.contacts.size());
        for (std::size_t i = 0; i < found.contacts.size(); ++i) {
            const BodyContact &x = found.contacts[i], &y = expected.contacts[i];
            ASSERT_EQ(x.faces, y.faces);
            ASSERT_EQ(x.contact.from, y.contact.from);
            ASSERT_EQ(x.contact.to, y.contact.to);
            ASSERT_EQ(x.contact.normal, y.contact.normal);
        }
        EXPECT_EQ(work.boxTests, alone.boxTests);
        EXPECT_EQ(work.triangleTests, alone.triangleTests);
    }
}

TEST(Contacts, ABoxThatSinksIntoAnotherIsPushedBackTheShortWay) {
    const TriangleTree table(meshOf(shapes::box(Vec3d(4, 4, 1)))), box(meshOf(shapes::box(Vec3d(1, 1, 1))));
    Affine3d pose = Affine3d::Identity();
    pose.translation() = Vec3d(0.13, -0.21, 0.9);  // 0.1 deep
    QueryWork work;
    const BodyContacts found = contactsBetween(table, box, pose, work);
    ASSERT_FALSE(found.contacts.empty());
    double around = 0;
    for (const BodyContact& c : found.contacts) {
        EXPECT_NEAR(c.contact.point.z(), 0.5, 1e-12);
        EXPECT_LT((c.contact.normal - Vec3d::UnitZ()).norm(), 1e-12);
        around += (c.contact.to - c.contact.from).norm();
    }
    EXPECT_NEAR(around, 4, 1e-9) << "the outline of the box in the table's top";
}

}  // namespace
}  // namespace tessera
