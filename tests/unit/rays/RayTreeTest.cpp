#include "common/rays/RayTree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "common/rays/AimedRay.h"
#include "common/rays/TreeDivision.h"
#include "tests/property/Seeds.h"

namespace tessera {
namespace {

using Real = long double;

double uniform(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
Vec3d anywhere(Random& random, double reach = 1) {
    return {uniform(random, -reach, reach), uniform(random, -reach, reach), uniform(random, -reach, reach)};
}

struct Soup {
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;

    void add(const Vec3d& p) {
        for (int k = 0; k < 3; ++k) positions.push_back(static_cast<float>(p[k]));
    }
    [[nodiscard]] Vec3d at(std::uint32_t vertex) const {
        return {positions[3 * vertex], positions[3 * vertex + 1], positions[3 * vertex + 2]};
    }
    [[nodiscard]] std::size_t faces() const { return indices.size() / 3; }
};

/// Faces of one size and of very different ones, needles, some without area, some of which corners are shared.
Soup randomSoup(Random& random, std::size_t faces, double scale, const Vec3d& centre) {
    Soup soup;
    const double size = std::pow(10, uniform(random, -3, 0.3));
    const std::size_t vertices = 3 + below(random, 2 * faces + 1);
    for (std::size_t i = 0; i < vertices; ++i) {
        Vec3d p = anywhere(random);
        if (oneIn(random, 3) && i > 0)
            p = (soup.at(static_cast<std::uint32_t>(below(random, i))) - centre) / scale + anywhere(random, size);
        if (oneIn(random, 8)) p = (4 * p).array().round() / 4;  // many in one plane
        soup.add(centre + scale * p);
    }
    for (std::size_t i = 0; i < 3 * faces; ++i)
        soup.indices.push_back(static_cast<std::uint32_t>(below(random, vertices)));
    return soup;
}

Ray randomRay(Random& random, const Soup& soup, double scale, const Vec3d& centre) {
    Ray ray{centre + scale * anywhere(random, oneIn(random, 3) ? 0.5 : 3), anywhere(random)};
    const Vec3d target = soup.at(static_cast<std::uint32_t>(below(random, soup.positions.size() / 3)));
    if (oneIn(random, 2)) ray.direction = target + scale * anywhere(random, 0.1) - ray.origin;
    if (oneIn(random, 6)) ray.direction = Vec3d::Unit(static_cast<int>(below(random, 3))) * (oneIn(random, 2) ? 1 : -1);
    if (oneIn(random, 6)) ray.direction[static_cast<Eigen::Index>(below(random, 3))] = oneIn(random, 2) ? 0.0 : -0.0;
    if (oneIn(random, 8)) ray.origin = target;  // on the surface
    if (oneIn(random, 8))
        ray.origin = centre + 1e5 * (ray.origin - centre), ray.direction = target - ray.origin;  // from afar
    ray.direction *= std::pow(10, uniform(random, -5, 5));
    if (ray.direction.isZero(0)) ray.direction = Vec3d::UnitX();
    return ray;
}

/// One face and a ray, exactly enough; and what doubles may be wrong by.
struct Meeting {
    Real t = 0, slackT = 0;  ///< in lengths of the direction
    Real least = -1;         ///< of the weights: how far inside
    Real slack = 0;          ///< of the weights
    bool edgeOn = true;
};

/// The same shear as the tree's, in long double. Products of coordinates up to R differ from the exact ones by a few
/// roundings of R²; divided by twice the face's area as the ray sees it that is what weights are wrong by, and t, which
/// they mix from the corners' depths up to R, by R times that.
Meeting meetingOf(const Soup& soup, std::uint32_t face, const Ray& ray, double reach) {
    int z = 0;
    const double length = ray.direction.cwiseAbs().maxCoeff(&z);
    const int x = (z + 1) % 3, y = (z + 2) % 3;
    Real p[3][3], farthest = 0;
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec3d corner = soup.at(soup.indices[3 * face + i]);
        const Real dz = Real(corner[z]) - ray.origin[z];
        p[i][0] = Real(corner[x]) - ray.origin[x] - Real(ray.direction[x]) / ray.direction[z] * dz;
        p[i][1] = Real(corner[y]) - ray.origin[y] - Real(ray.direction[y]) / ray.direction[z] * dz;
        p[i][2] = dz;
        for (int k = 0; k < 3; ++k) farthest = std::max(farthest, std::abs(Real(corner[k]) - ray.origin[k]));
    }
    const Real u = p[2][0] * p[1][1] - p[2][1] * p[1][0], v = p[0][0] * p[2][1] - p[0][1] * p[2][0],
               w = p[1][0] * p[0][1] - p[1][1] * p[0][0];
    const Real area = u + v + w;
    Meeting out;
    // The origin of a ray from afar is rounded once it has come near: that moves corners by so much of the way.
    const Real unit = 0x1p-53L, corners = 8 * unit * farthest + 4 * unit * ray.origin.cwiseAbs().maxCoeff();
    const Real size = std::min<Real>(farthest, 40 * Real(reach) + 0);
    Real flat = 0;
    for (const auto& corner : p) flat = std::max({flat, std::abs(corner[0]), std::abs(corner[1])});
    const Real slackArea = 8 * (corners * flat + unit * flat * flat);
    if (std::abs(area) <= 4 * slackArea) return out;
    out.edgeOn = false;
    out.least = std::min({u / area, v / area, w / area});
    out.slack = 4 * slackArea / std::abs(area);
    const Real depth = (u * p[0][2] + v * p[1][2] + w * p[2][2]) / area;
    out.t = depth / ray.direction[z];
    out.slackT = (out.slack * size * 4 + 8 * corners) / length + 8 * unit * std::abs(out.t);
    return out;
}

TEST(RayTree, FindsWhatBruteForceFinds) {
    std::size_t hits = 0, misses = 0;
    forSeeds(400, [&](Random& random) {
        const double scale = oneIn(random, 3) ? std::pow(10, uniform(random, -12, 12)) : 1;
        const Vec3d centre = oneIn(random, 3) ? Vec3d(scale * anywhere(random, 100)) : Vec3d(Vec3d::Zero());
        const Soup soup = randomSoup(random, 1 + below(random, 120), scale, centre);
        const Expected<RayTree> tree = RayTree::build(soup.positions, soup.indices);
        ASSERT_TRUE(tree);
        double reach = 0;
        for (const float p : soup.positions) reach = std::max(reach, std::abs(double{p}));
        for (int i = 0; i < 60; ++i) {
            const Ray ray = randomRay(random, soup, scale, centre);
            const double maxT =
                oneIn(random, 3) ? uniform(random, 0, 2) * scale / ray.direction.norm() : RayTree::kForever;
            const std::optional<TriangleHit> hit = tree->nearest(ray, maxT);
            // Nothing that is certain to be met lies before the hit, and where one is certain to be there, there is
            // one.
            bool certain = false;
            for (std::uint32_t face = 0; face < soup.faces(); ++face) {
                const Meeting m = meetingOf(soup, face, ray, reach);
                if (m.edgeOn || m.least <= m.slack || m.t <= m.slackT || m.t + m.slackT >= maxT) continue;
                certain = true;
                ASSERT_TRUE(hit) << "face " << face;
                EXPECT_LE(hit->t, static_cast<double>(m.t + m.slackT)) << "face " << face << " is nearer";
            }
            EXPECT_EQ(tree->any(ray, maxT), hit.has_value());
            const std::vector<TriangleHit> all = tree->all(ray, maxT);
            EXPECT_EQ(all.empty(), !hit);
            (certain ? hits : misses) += 1;
            if (!hit) continue;
            ASSERT_LT(hit->face, soup.faces());
            EXPECT_GE(hit->t, 0);
            EXPECT_LE(hit->t, maxT * (1 + 1e-15));
            EXPECT_EQ(all.front().t, hit->t);
            EXPECT_TRUE(std::ranges::any_of(
                all, [&](const TriangleHit& one) { return one.face == hit->face && one.t == hit->t; }));
            EXPECT_NEAR(hit->weights[0] + hit->weights[1] + hit->weights[2], 1, 1e-14);
            const Meeting m = meetingOf(soup, hit->face, ray, reach);
            if (m.edgeOn) continue;
            EXPECT_GE(m.least, -m.slack) << "the ray passes by face " << hit->face;
            EXPECT_NEAR(hit->t, static_cast<double>(m.t), static_cast<double>(m.slackT));
        }
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(hits, 5000u);
    EXPECT_GT(misses, 2000u);
}

TEST(RayTree, TellsAllHitsInOrderOrTheNearestOfThem) {
    forSeeds(150, [&](Random& random) {
        const Soup soup = randomSoup(random, 20 + below(random, 200), 1, Vec3d::Zero());
        const Expected<RayTree> tree = RayTree::build(soup.positions, soup.indices);
        for (int i = 0; i < 20; ++i) {
            const Ray ray = randomRay(random, soup, 1, Vec3d::Zero());
            const std::vector<TriangleHit> all = tree->all(ray);
            std::vector<bool> met(soup.faces());
            for (std::size_t k = 0; k < all.size(); ++k) {
                EXPECT_FALSE(met[all[k].face]) << "twice";
                met[all[k].face] = true;
                if (k > 0) {
                    EXPECT_TRUE(all[k - 1].t < all[k].t || (all[k - 1].t == all[k].t && all[k - 1].face < all[k].face));
                }
            }
            for (std::uint32_t face = 0; face < soup.faces(); ++face) {
                const Meeting m = meetingOf(soup, face, ray, 2);
                if (!m.edgeOn && m.least > m.slack && m.t > m.slackT) {
                    EXPECT_TRUE(met[face]) << "face " << face;
                }
                if (m.edgeOn) continue;
                if (m.least < -m.slack || m.t < -m.slackT) {
                    EXPECT_FALSE(met[face]) << "face " << face;
                }
            }
            const std::size_t most = below(random, all.size() + 2);
            const std::vector<TriangleHit> some = tree->all(ray, RayTree::kForever, most);
            ASSERT_EQ(some.size(), std::min(most, all.size()));
            for (std::size_t k = 0; k < some.size(); ++k) EXPECT_EQ(some[k].t, all[k].t);
        }
    });
}

/// A ball with dents, its vertices at random: closed.
Soup dentedBall(Random& random, std::uint32_t rings, double scale, const Vec3d& centre) {
    Soup soup;
    const std::uint32_t around = rings + 3;
    soup.add(centre + scale * Vec3d(0, 1, 0));
    soup.add(centre - scale * Vec3d(0, 1, 0));
    for (std::uint32_t j = 0; j < rings; ++j)
        for (std::uint32_t i = 0; i < around; ++i) {
            const double u = 2 * std::numbers::pi * i / around, v = std::numbers::pi * (j + 1) / (rings + 1),
                         r = uniform(random, 0.7, 1.3);
            soup.add(centre + scale * r * Vec3d(std::sin(v) * std::cos(u), std::cos(v), std::sin(v) * std::sin(u)));
        }
    const auto vertex = [&](std::uint32_t j, std::uint32_t i) { return 2 + j * around + i % around; };
    const auto face = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        soup.indices.insert(soup.indices.end(), {a, b, c});
    };
    for (std::uint32_t i = 0; i < around; ++i) {
        face(0, vertex(0, i), vertex(0, i + 1));
        face(1, vertex(rings - 1, i + 1), vertex(rings - 1, i));
        for (std::uint32_t j = 0; j + 1 < rings; ++j) {
            face(vertex(j, i), vertex(j + 1, i), vertex(j + 1, i + 1));
            face(vertex(j, i), vertex(j + 1, i + 1), vertex(j, i + 1));
        }
    }
    return soup;
}

TEST(RayTree, NoRayPassesBetweenTrianglesThatShareAnEdgeOrACorner) {
    forSeeds(200, [&](Random& random) {
        const double scale = std::pow(10, uniform(random, -6, 6));
        const Vec3d centre = oneIn(random, 2) ? Vec3d(scale * anywhere(random, 1000)) : Vec3d(Vec3d::Zero());
        const Soup soup = dentedBall(random, 2 + static_cast<std::uint32_t>(below(random, 12)), scale, centre);
        const Expected<RayTree> tree = RayTree::build(soup.positions, soup.indices);
        for (int i = 0; i < 200; ++i) {
            const Vec3d from = centre + scale * anywhere(random, 0.3);
            const std::size_t face = below(random, soup.faces()), corner = below(random, 3);
            const Vec3d a = soup.at(soup.indices[3 * face + corner]),
                        b = soup.at(soup.indices[3 * face + (corner + 1) % 3]);
            const double along = oneIn(random, 3) ? 0 : oneIn(random, 3) ? 0.5 : uniform(random, 0, 1);
            Ray ray{from, (a + along * (b - a) - from) * std::pow(10, uniform(random, -3, 3))};
            if (oneIn(random, 10)) {
                // Right along an axis, from straight before a corner.
                const auto k = static_cast<Eigen::Index>(below(random, 3));
                ray.direction = Vec3d::Zero();
                ray.direction[k] = a[k] > centre[k] ? 1 : -1;
                if ((a - centre).cwiseAbs().maxCoeff() != std::abs((a - centre)[k])) continue;
                ray.origin = a;
                ray.origin[k] = centre[k];
                // Dents and bumps keep it inside only near the axis.
                if ((ray.origin - centre).norm() > 0.3 * scale) continue;
            }
            ASSERT_TRUE(tree->nearest(ray)) << "to a corner or an edge of face " << face << ", from within";
            ASSERT_TRUE(tree->any(ray));
        }
    });
}

TEST(RayTree, AnswersAreTheSameOnBothKindsOfProcessor) {
    if (!__builtin_cpu_supports("avx2")) GTEST_SKIP() << "this processor has one of them alone";
    forSeeds(60, [&](Random& random) {
        const Soup soup = randomSoup(random, 1 + below(random, 300), 1, Vec3d::Zero());
        const rays::Divided divided = rays::divide(soup.positions, soup.indices);
        const rays::Tree tree{divided.nodes.data(), divided.leaves.data(), divided.root};
        for (int i = 0; i < 60; ++i) {
            const std::optional<rays::AimedRay> aimed =
                rays::aim(randomRay(random, soup, 1, Vec3d::Zero()), RayTree::kForever, divided.reach);
            if (!aimed) continue;
            rays::Hit one{aimed->limit, {}, 0}, other{aimed->limit, {}, 0};
            ASSERT_EQ(rays::sse2::kKernels.nearest(tree, aimed->ray, &one),
                      rays::avx2::kKernels.nearest(tree, aimed->ray, &other));
            EXPECT_EQ(std::bit_cast<std::uint64_t>(one.t), std::bit_cast<std::uint64_t>(other.t));
            EXPECT_EQ(one.face, other.face);
            EXPECT_EQ(rays::sse2::kKernels.any(tree, aimed->ray, aimed->limit),
                      rays::avx2::kKernels.any(tree, aimed->ray, aimed->limit));
        }
    });
}

TEST(RayTree, FromEitherSideFromTheSurfaceAndNotBehind) {
    Soup wall;
    for (const Vec3d& p : {Vec3d(-1, -1, 0), Vec3d(1, -1, 0), Vec3d(0, 1, 0)}) wall.add(p);
    wall.indices = {0, 1, 2};
    const Expected<RayTree> tree = RayTree::build(wall.positions, wall.indices);
    EXPECT_EQ(tree->nearest({Vec3d(0, 0, 2), Vec3d(0, 0, -4)})->t, 0.5);
    EXPECT_EQ(tree->nearest({Vec3d(0, 0, -2), Vec3d(0, 0, 1)})->t, 2);
    EXPECT_EQ(tree->nearest({Vec3d(0, 0, 0), Vec3d(0, 0, 1)})->t, 0);
    EXPECT_FALSE(tree->nearest({Vec3d(0, 0, 2), Vec3d(0, 0, 1)}));
    EXPECT_FALSE(tree->nearest({Vec3d(0, 0, 2), Vec3d(0, 0, -1)}, 1.999));
    EXPECT_TRUE(tree->nearest({Vec3d(0, 0, 2), Vec3d(0, 0, -1)}, 2));
    EXPECT_FALSE(tree->nearest({Vec3d(0, 0.5, 0), Vec3d(0, -1, 0)})) << "along the face: it is seen from its edge";
    const TriangleHit hit = *tree->nearest({Vec3d(0, 0, 1e12), Vec3d(0, 0, -1)});
    EXPECT_EQ(hit.t, 1e12);
    EXPECT_EQ(hit.weights, (std::array<double, 3>{0.25, 0.25, 0.5}));
    EXPECT_FALSE(tree->nearest({Vec3d(0, 0, 2), Vec3d(0, 0, -5e-324)}, 1)) << "of no length to speak of";
}

TEST(RayTree, BadInputMeetsNothingOrIsRefused) {
    constexpr double infinity = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
    Soup wall;
    for (const Vec3d& p : {Vec3d(-1, -1, 0), Vec3d(1, -1, 0), Vec3d(0, 1, 0), Vec3d(nan, 0, 0), Vec3d(0, infinity, 0)})
        wall.add(p);
    wall.indices = {0, 1, 2, 0, 1, 3, 1, 2, 4, 0, 0, 1, 2, 2, 2};
    const Expected<RayTree> tree = RayTree::build(wall.positions, wall.indices);
    EXPECT_EQ(tree->faceCount(), 3u) << "corners that are not finite";
    const Ray good{Vec3d(0, 0, 2), Vec3d(0, 0, -1)};
    EXPECT_EQ(tree->all(good).size(), 1u);
    for (const Ray& ray : {Ray{good.origin, Vec3d::Zero()}, Ray{good.origin, Vec3d(0, 0, -infinity)},
                           Ray{good.origin, Vec3d(nan, 0, -1)}, Ray{Vec3d(nan, 0, 2), good.direction},
                           Ray{Vec3d(0, infinity, 2), good.direction}}) {
        EXPECT_FALSE(tree->nearest(ray));
        EXPECT_FALSE(tree->any(ray));
        EXPECT_TRUE(tree->all(ray).empty());
    }
    EXPECT_FALSE(tree->nearest(good, nan));
    EXPECT_FALSE(tree->nearest(good, -1));
    EXPECT_FALSE(RayTree::build({}, {})->nearest(good));
    EXPECT_EQ(RayTree::build(wall.positions, std::array<std::uint32_t, 3>{0, 1, 5}).error().code, ErrorCode::kBadInput);
    EXPECT_EQ(RayTree::build(wall.positions, std::array<std::uint32_t, 2>{0, 1}).error().code, ErrorCode::kBadInput);
    EXPECT_EQ(RayTree::build(std::array<float, 4>{}, {}).error().code, ErrorCode::kBadInput);
}

TEST(RayTree, NoMeshIsTooDeepForAWalk) {
    Soup coincident, growing;
    for (std::uint32_t i = 0; i < 20'000; ++i)
        for (const Vec3d& p : {Vec3d(-1, -1, 0), Vec3d(1, -1, 0), Vec3d(0, 1, 0)}) coincident.add(p);
    // Each twice as large as the one before, and as far away: a cut by surfaces takes off one at a time.
    for (int i = -120; i < 120; ++i)
        for (const Vec3d& p : {Vec3d(1, -1, 0), Vec3d(1, 1, -1), Vec3d(1, 1, 1)}) growing.add(std::ldexp(1, i) * p);
    const Expected<RayTree> one = RayTree::build(coincident.positions, {}),
                            other = RayTree::build(growing.positions, {});
    EXPECT_EQ(one->nearest({Vec3d(0, 0, 1), Vec3d(0, 0, -1)})->face, 0u) << "of equal ones the lowest";
    EXPECT_EQ(one->all({Vec3d(0, 0, 1), Vec3d(0, 0, -1)}).size(), 20'000u);
    EXPECT_EQ(other->all({Vec3d::Zero(), Vec3d::UnitX()}).size(), 240u);
    EXPECT_EQ(other->nearest({Vec3d::Zero(), Vec3d::UnitX()})->t, std::ldexp(1, -120));
}

}  // namespace
}  // namespace tessera
