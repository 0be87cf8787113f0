// A panel is carried through a hall whose floor and walls are one mesh, so that it touches that mesh from the start. It
// may go as far as it likes along what it stands on, and never passes anything.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>

#include "common/scene/Action.h"
#include "server/collision/response/Way.h"
#include "tests/property/Seeds.h"
#include "tests/unit/pipeline/SceneMaker.h"
#include "tests/unit/response/FaceOracle.h"

namespace tessera {
namespace {

double uniform(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

/// TESSERA_HUNT: how many times as many tries.
std::size_t hunted(std::size_t few) {
    const char* times = std::getenv("TESSERA_HUNT");
    return times ? few * std::strtoull(times, nullptr, 10) : few;
}

constexpr double kHalf = 5;  ///< the hall is 10 by 10, its walls 3 high and without thickness

/// Two triangles per tile, seen from where u × v points.
void addTiles(shapes::Soup& soup, const Vec3d& corner, const Vec3d& u, const Vec3d& v, int tiles) {
    const std::uint32_t first = static_cast<std::uint32_t>(soup.positions.size() / 3);
    for (int i = 0; i <= tiles; ++i)
        for (int j = 0; j <= tiles; ++j) soup.vertex(corner + i * u / tiles + j * v / tiles);
    const auto at = [&](int i, int j) { return first + static_cast<std::uint32_t>(i * (tiles + 1) + j); };
    for (int i = 0; i < tiles; ++i)
        for (int j = 0; j < tiles; ++j)
            soup.indices.insert(soup.indices.end(),
                                {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1)});
}

shapes::Soup hallOf(int tiles) {
    shapes::Soup soup;
    const double h = kHalf, high = 3;
    addTiles(soup, Vec3d(-h, 0, -h), Vec3d(0, 0, 2 * h), Vec3d(2 * h, 0, 0), tiles);
    addTiles(soup, Vec3d(-h, 0, -h), Vec3d(2 * h, 0, 0), Vec3d(0, high, 0), tiles);
    addTiles(soup, Vec3d(h, 0, h), Vec3d(-2 * h, 0, 0), Vec3d(0, high, 0), tiles);
    addTiles(soup, Vec3d(-h, 0, h), Vec3d(0, 0, -2 * h), Vec3d(0, high, 0), tiles);
    addTiles(soup, Vec3d(h, 0, -h), Vec3d(0, 0, 2 * h), Vec3d(0, high, 0), tiles);
    return soup;
}

const Vec3d kPanel(1, 2, 0.02);

struct Hall : SceneMaker {
    Body hall, panel;

    Hall(std::int64_t response, int tiles) {
        hall = body(kRootNode, hallOf(tiles), Vec3d::Zero());
        panel = body(kRootNode, shapes::box(kPanel), Vec3d(0, 1, 0));
        interest(panel.node, {}, response);
    }
    void put(const Vec3d& where, double yaw) { commit(wish(where, turned(yaw))); }
    static Quatd turned(double yaw) { return Quatd(Eigen::AngleAxisd(yaw, Vec3d::UnitY())); }
    [[nodiscard]] TentativeTransform wish(const Vec3d& where, const Quatd& turn) const {
        return {.transform = panel.transform, .translation = where, .rotation = turn};
    }
    [[nodiscard]] Vec3d place() const { return at(panel.transform).translation; }
    /// No corner is farther out than this from the inside of the hall, sideways or down.
    [[nodiscard]] double out() const {
        const Affine3d world = worldTransform(aspect, panel.shape);
        double most = -1e300;
        for (int corner = 0; corner < 8; ++corner) {
            const Vec3d side((corner & 1) ? 0.5 : -0.5, (corner & 2) ? 0.5 : -0.5, (corner & 4) ? 0.5 : -0.5);
            const Vec3d p = world * kPanel.cwiseProduct(side);
            most = std::max({most, std::abs(p.x()) - kHalf, std::abs(p.z()) - kHalf, -p.y()});
        }
        return most;
    }
};

const double kTolerance = CollisionLimits().stopTolerance * kPanel.norm() * 2;

const std::pair<const char*, std::int64_t> kResponses[] = {{"stop", Interest::kStop},
                                                           {"slide", Interest::kSlide},
                                                           {"rollback", Interest::kRollback},
                                                           {"bounce", Interest::kBounce},
                                                           {"ask", Interest::kAsk}};

/// From within reach of a wall, in any direction that goes through it.
TEST(PanelInTheHall, NeverPassesAWallInOneWish) {
    for (const auto& [name, response] : kResponses) {
        std::size_t passed = 0, tries = hunted(100);
        Random random(1);
        Hall scenes[] = {{response, 1}, {response, 7}};
        for (std::size_t i = 0; i < tries; ++i) {
            Hall& hall = scenes[i % 2];
            // Along the wall it is through it in two centimetres.
            const double off = i % 2 ? 0 : i % 5 ? uniform(random, -0.3, 0.3) : uniform(random, -2, 2);
            const double yaw = 0.5 * std::numbers::pi + off;
            const Vec3d from(uniform(random, 3.9, 4.4), 1, uniform(random, -3, 3));
            hall.put(from, yaw);
            ASSERT_LT(hall.out(), 1e-9);
            const double angle = uniform(random, -0.5, 0.5), length = i % 4 ? 1.5 : std::exp(uniform(random, 0.5, 5));
            const Vec3d to = from + length * Vec3d(std::cos(angle), 0, std::sin(angle));
            hall.frame({hall.wish(to, i % 3 ? Hall::turned(yaw) : Hall::turned(yaw + uniform(random, -1, 1)))});
            passed += hall.out() > kTolerance;
        }
        EXPECT_EQ(passed, 0u) << name << ": of " << tries;
    }
}

TEST(PanelInTheHall, NeverPassesAWallFrameAfterFrame) {
    for (const auto& [name, response] : kResponses) {
        std::size_t passed = 0;
        Random random(2);
        Hall hall(response, 3);
        for (std::size_t i = 0; i < hunted(12); ++i) {
            const bool square = i % 2;
            const double speed = square ? 2 + 0.05 * static_cast<double>(i) : uniform(random, 0.5, 20);
            const double angle = square ? 0 : uniform(random, 0, 7), turn = square ? 0 : uniform(random, -2, 2);
            const Vec3d step = speed / 60 * Vec3d(std::cos(angle), 0, std::sin(angle));
            hall.put(Vec3d(square ? 4 : 0, 1, 0), square ? 0.5 * std::numbers::pi : uniform(random, 0, 7));
            for (int frame = 0; frame < 60; ++frame) {
                const Quatd rotation = hall.at(hall.panel.transform).rotation * Hall::turned(turn / 60);
                hall.frame({hall.wish(hall.place() + step, rotation)});
            }
            passed += hall.out() > kTolerance;
        }
        EXPECT_EQ(passed, 0u) << name;
    }
}

TEST(PanelInTheHall, GoesAnyLengthAlongTheFloorInOneWish) {
    for (const auto& [name, response] : kResponses)
        for (const int tiles : {1, 40}) {
            std::size_t held = 0, tries = hunted(20);
            Random random(3);
            Hall hall(response, tiles);
            for (std::size_t i = 0; i < tries; ++i) {
                const double yaw = uniform(random, 0, 7);
                const Vec3d from(uniform(random, -4, 4), 1, uniform(random, -4, 4)),
                    to(uniform(random, -4, 4), 1, uniform(random, -4, 4));
                hall.put(from, yaw);
                hall.frame({hall.wish(to, i % 2 ? Hall::turned(yaw) : Hall::turned(uniform(random, 0, 7)))});
                held += (hall.place() - to).norm() > 1e-9;
            }
            EXPECT_EQ(held, 0u) << name << ": of " << tries << " over " << tiles << " tiles";
        }
}

/// Several at once, each on the floor and some leaning on each other, with wishes of all lengths. In the order of their
/// ids each goes its way to where it was let, past those that have gone before and those that have not: no pair of
/// faces meets that was apart, unless flush.
TEST(PanelsInTheHall, PassNeitherWallsNorEachOther) {
    std::size_t wishes = 0, stopped = 0, moved = 0;
    forSeeds(hunted(25), [&](Random& random) {
        const auto& [name, response] = kResponses[below(random, 5)];
        SceneMaker scene;
        const auto hall = scene.body(kRootNode, hallOf(1 + static_cast<int>(below(random, 6))), Vec3d::Zero());
        const ObjectId group = scene.node(kRootNode);
        std::vector<SceneMaker::Body> panels;
        std::vector<ObjectId> shapes, others{hall.shape};
        const std::size_t count = 2 + below(random, 4);
        double thinnest = 1, size = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const Vec3d extent(uniform(random, 0.3, 1.2), uniform(random, 0.3, 2),
                               std::exp(uniform(random, std::log(0.002), std::log(0.4))));
            // In a row; every other one against the one before.
            const double x = -4 + 1.7 * static_cast<double>(i);
            panels.push_back(scene.body(group, shapes::box(extent), Vec3d(x, 0.5 * extent.y(), 0),
                                        Hall::turned(uniform(random, 0, 7))));
            CollisionObject object;
            object.node = panels.back().node;
            scene.object(object);
            shapes.push_back(panels.back().shape);
            others.push_back(panels.back().shape);
            thinnest = std::min(thinnest, extent.z());
            size = std::max(size, extent.norm());
        }
        scene.interest(group, {}, response);
        const FaceOracle oracle(scene.aspect, shapes, others);
        const auto poseOf = [&](std::size_t i) {
            const Transform& t = scene.at(panels[i].transform);
            return Pose{t.translation, t.rotation, t.scale};
        };
        const auto meetingsAt = [&](const std::vector<Pose>& poses) {
            std::vector<Affine3d> mine, all{Affine3d::Identity()};
            for (const Pose& pose : poses) mine.push_back(localOf(pose));
            all.insert(all.end(), mine.begin(), mine.end());
            return oracle.meetings(mine, all);
        };
        for (int frame = 0; frame < 5; ++frame) {
            std::vector<Pose> poses;
            std::vector<TentativeTransform> wanted;
            for (std::size_t i = 0; i < count; ++i) {
                poses.push_back(poseOf(i));
                if (oneIn(random, 4)) continue;
                const double length = std::exp(uniform(random, std::log(0.01), std::log(20.0)));
                const double angle = uniform(random, 0, 7);
                wanted.push_back(
                    {.transform = panels[i].transform,
                     .translation = poses[i].translation + length * Vec3d(std::cos(angle), 0, std::sin(angle)),
                     .rotation = oneIn(random, 2) ? poses[i].rotation
                                                  : poses[i].rotation * Hall::turned(uniform(random, -1, 1))});
            }
            wishes += wanted.size();
            FaceOracle::Meetings before = meetingsAt(poses);
            stopped += scene.frame(wanted).stopped.size();
            for (std::size_t i = 0; i < count; ++i) {
                const Way way{poses[i], poseOf(i)};
                const double length = (way.end.translation - way.start.translation).norm() +
                                      size * way.start.rotation.angularDistance(way.end.rotation);
                moved += length > 0.1 * size;
                // Of a slide only the end is known.
                const bool straight = response != Interest::kSlide;
                const int samples = straight ? static_cast<int>(std::clamp(2 * length / thinnest, 4.0, 400.0)) : 1;
                for (int s = 1; s <= samples; ++s) {
                    poses[i] = way.at(static_cast<double>(s) / samples);
                    const auto wrong = FaceOracle::wrong(before, meetingsAt(poses), 1.6e-4 * size, 1e-9);
                    ASSERT_FALSE(wrong) << name << ", frame " << frame << ", panel " << i << ", " << s << " of "
                                        << samples << ": " << *wrong;
                }
            }
        }
    });
    std::printf("%zu wishes, %zu stopped, %zu went somewhere\n", wishes, stopped, moved);
}

}  // namespace
}  // namespace tessera
