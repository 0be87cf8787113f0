// What texels say of the surface: never less than there is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/base/Workers.h"
#include "server/collision/spherical/SphericalField.h"
#include "server/collision/tree/TreeStorage.h"
#include "tests/unit/spherical/FieldScenes.h"

namespace tessera {
namespace {

Vec3d onTriangle(const Triangle& t, FieldRandom& random) {
    double u = random.uniform(0, 1), v = random.uniform(0, 1);
    if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
    }
    if (random.below(4) == 0) return t[random.below(3)];
    return t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]);
}

TEST(SphericalField, HoldsEveryPointOfEveryTriangle) {
    for (std::uint64_t seed = 0; seed < 120; ++seed) {
        FieldRandom random(seed);
        const TriangleMesh mesh = fieldMesh(static_cast<unsigned>(seed), random);
        const TriangleTree tree(mesh);
        const SphericalField field(tree,
                                   {.level = static_cast<int>(random.below(7)) - 1, .centres = 1 + random.below(3)});
        const TreeStorage& s = tree.storage();
        for (int i = 0; i < 400; ++i) {
            const Vec3d p = onTriangle(mesh.triangle(random.below(static_cast<unsigned>(mesh.faceCount()))), random);
            // One centre sees it; each of its levels must hold it, in some texel within a rounding of its direction.
            bool held = false;
            for (std::size_t centre = 0; centre < field.centreCount() && !held; ++centre) {
                bool all = true;
                const double r = (p - field.centre(centre)).norm(), slack = 1e-5 * s.radius / s.unit;
                for (unsigned level = 0; level <= field.finestLevel(centre); ++level) {
                    bool here = false;
                    for (int nudge = 0; nudge < 9 && !here; ++nudge) {
                        Vec3d d = p - field.centre(centre);
                        if (nudge > 0)
                            d += 2e-5 * r * Vec3d(nudge & 1 ? 1 : -1, nudge & 2 ? 1 : -1, nudge & 4 ? 1 : -1);
                        if (d.isZero(0)) continue;
                        const FieldShell shell = field.shell(centre, d, level).value();
                        here = !shell.empty && r >= shell.inner - slack && r <= shell.outer + slack;
                    }
                    all = all && (here || r < slack);
                }
                held = all;
            }
            ASSERT_TRUE(held) << "seed " << seed << ", point " << p.transpose();
        }
    }
}

TEST(SphericalField, KnowsASphereToItsStatedError) {
    const TriangleTree tree(ballLike(64, [](const Vec3d&) { return 2.0; }).make());
    const SphericalField field(tree);
    ASSERT_EQ(field.centreCount(), 1U);
    EXPECT_LT(field.looseness(), 0.2);
    FieldRandom random(1);
    double last = 1e9;
    for (unsigned level = 0; level <= field.finestLevel(0); ++level) {
        double worst = 0;
        for (int i = 0; i < 500; ++i) {
            const Vec3d d = random.inBox(1);
            const FieldShell shell = field.shell(0, d, level).value();
            ASSERT_FALSE(shell.empty);
            const double middle = 0.5 * (shell.inner + shell.outer);
            EXPECT_LE(std::abs(middle - 2), shell.error + 0.01);
            EXPECT_GT(shell.normal.dot(d.normalized()), 0.57);  // of a whole face the corner is 54.7 degrees away
            worst = std::max(worst, shell.error);
        }
        EXPECT_LE(worst, last * 1.001);
        last = worst;
    }
    EXPECT_LT(last, 0.1);
}

TEST(SphericalField, IsTheSameForAnyNumberOfThreads) {
    const TriangleTree tree(ballLike(60, [](const Vec3d& d) { return 1 + 0.3 * std::sin(7 * d[2]); }).make());
    Workers two(2), five(5);
    const SphericalField one(tree), other(tree, {.workers = &two}), third(tree, {.workers = &five});
    for (const SphericalField* field : {&other, &third}) {
        ASSERT_EQ(field->entryCount(), one.entryCount());
        const kernel::FieldPart &a = one.views()[0], &b = field->views()[0];
        EXPECT_TRUE(std::equal(a.faces, a.faces + one.entryCount(), b.faces));
        for (unsigned level = 0; level <= a.finest; ++level)
            EXPECT_EQ(std::memcmp(a.texels[level], b.texels[level],
                                  (std::size_t{6} << (2 * level)) * sizeof(kernel::FieldTexel)),
                      0);
    }
}

TEST(SphericalField, GivesLongBodiesSeveralCentres) {
    FieldMesh rod = ballLike(12, [](const Vec3d&) { return 1.0; });
    for (std::size_t i = 0; i < rod.positions.size(); i += 3) rod.positions[i + 1] *= 10;
    const TriangleTree tree(rod.make());
    const SphericalField field(tree);
    EXPECT_EQ(field.centreCount(), 2U);
    EXPECT_EQ(SphericalField(TriangleTree(ballLike(12, [](const Vec3d&) { return 1.0; }).make())).centreCount(), 1U);
}

TEST(SphericalField, BoundsItsListsForTrianglesThatAreSeenEverywhere) {
    FieldRandom random(2);
    const TriangleTree tree(fieldMesh(7, random));
    const SphericalField field(tree, {.level = 8});
    EXPECT_LE(field.entryCount(), 12 * tree.mesh().faceCount() + 4096);
}

TEST(SphericalField, RefusesADirectionThatIsNone) {
    FieldRandom random(2);
    const TriangleTree tree(fieldMesh(0, random));
    const SphericalField field(tree);
    EXPECT_FALSE(field.shell(0, Vec3d::Zero()));
    EXPECT_FALSE(field.shell(0, Vec3d(0, std::nan(""), 1)));
    EXPECT_FALSE(field.shell(1, Vec3d(0, 0, 1)));
    EXPECT_TRUE(field.shell(0, Vec3d(0, 0, 1e-300)));
}

}  // namespace
}  // namespace tessera
