// What of a scene is nearest to a place: beside a look at every triangle.
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "common/scene/Action.h"
#include "server/collision/pipeline/ScenePicker.h"
#include "tests/unit/pipeline/SceneMaker.h"
#include "tests/unit/query/NearestOracle.h"

namespace tessera {
namespace {

/// Answered apart from the scene, as by another thread.
std::optional<NearestSurface> nearestAside(SceneMaker& scene, const Vec3d& place, ObjectId below) {
    for (int round = 0; round < 64; ++round) {
        std::optional<AsideNearest> question = scene.pipeline.nearestAside(scene.aspect, place, below);
        if (!question) break;
        question->answer();
        EXPECT_FALSE(question->exhausted);
        scene.pipeline.putShapes(question->made);
        if (!question->again) return question->found;
    }
    ADD_FAILURE() << "not answered";
    return std::nullopt;
}

/// Both ways, that must say the very same.
std::optional<NearestSurface> nearestIn(SceneMaker& scene, const Vec3d& place, ObjectId below = kRootNode) {
    const std::optional<NearestSurface> aside = nearestAside(scene, place, below);
    std::optional<NearestSurface> told = scene.pipeline.nearestSurface(scene.aspect, place, below);
    EXPECT_EQ(aside.has_value(), told.has_value());
    if (!aside || !told) return told;
    EXPECT_EQ(aside->node, told->node);
    EXPECT_EQ(aside->face, told->face);
    EXPECT_EQ(aside->point, told->point);
    EXPECT_EQ(aside->distance, told->distance);
    EXPECT_EQ(aside->error, told->error);
    EXPECT_EQ(aside->details.normal, told->details.normal);
    return told;
}

/// All that is visible at or below a node, face by face.
class LookAtAll {
public:
    struct Found {
        long double distance = std::numeric_limits<long double>::infinity();
        std::vector<ObjectId> nodes;  ///< that are as near, but for rounding
    };
    explicit LookAtAll(std::map<ObjectId, const shapes::Soup*> cores) : cores_(std::move(cores)) {}

    [[nodiscard]] Found nearest(const Aspect& aspect, ObjectId below, const Vec3d& place) const {
        std::vector<std::pair<ObjectId, long double>> distances;
        Action look;
        look.onNode([&](const Visit& visit) {
            bool isBelow = false;
            for (ObjectId id = visit.nodeId; id; id = aspect.get<Node>(id)->parent) isBelow = isBelow || id == below;
            const auto core = cores_.find(aspect.get<Node>(visit.nodeId)->core);
            if (!isBelow || core == cores_.end()) return Descend::kInto;
            const TriangleMesh mesh = core->second->mesh();
            for (std::uint32_t face = 0; face < mesh.faceCount(); ++face)
                distances.emplace_back(
                    visit.nodeId, nearest::distanceTo(transformed(visit.world_T_node, mesh.triangle(face)), place));
            return Descend::kInto;
        });
        look.run(aspect);
        Found found;
        for (const auto& [node, distance] : distances) found.distance = std::min(found.distance, distance);
        for (const auto& [node, distance] : distances)
            if (distance <= found.distance + 1e-9L) found.nodes.push_back(node);
        return found;
    }

private:
    std::map<ObjectId, const shapes::Soup*> cores_;
};

TEST(NearestSurface, IsWhatALookAtAllFindsAfterAnyHistory) {
    const char* given = std::getenv("TESSERA_SEED");
    const unsigned seed = given ? static_cast<unsigned>(std::strtoul(given, nullptr, 10)) : std::random_device{}();
    SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed
                                    << " build/bin/unit_pipeline --gtest_filter=NearestSurface.Is*");
    std::mt19937 random(seed);
    const auto number = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
    const auto somewhere = [&](double reach) {
        return Vec3d(number(-reach, reach), number(-reach, reach), number(-reach, reach));
    };
    std::size_t found = 0, none = 0;
    for (int round = 0; round < 8; ++round) {
        SceneMaker scene;
        const shapes::Soup ball = shapes::sphere(1, 8, 12), sheet = shapes::sheet(2, 3),
                           needle = shapes::box({9, 1e-7, 1e-9});
        std::map<ObjectId, const shapes::Soup*> cores;
        std::vector<ObjectId> coreIds;
        for (const shapes::Soup* soup : {&ball, &sheet, &needle}) {
            coreIds.push_back(scene.geometry(*soup));
            cores[coreIds.back()] = soup;
        }
        const LookAtAll truth(cores);
        const ObjectId switchCore = scene.switchCore(-1);
        const ObjectId hidden = scene.node(kRootNode, switchCore);
        std::vector<ObjectId> groups{kRootNode, hidden, scene.node(kRootNode)}, transforms;
        for (int i = 0; i < 40; ++i) {
            const double size = std::pow(10.0, number(-2, 1));
            // Some stretched, some flat: they are seen, too.
            const Vec3d scale = i % 5 == 0   ? Vec3d(size, 3 * size, 0.2 * size)
                                : i % 7 == 0 ? Vec3d(size, 0, size)
                                             : Vec3d(Vec3d::Constant(size));
            const Quatd turn = Quatd(number(-1, 1), number(-1, 1), number(-1, 1), number(-1, 1)).normalized();
            transforms.push_back(scene.transform(somewhere(9), turn, scale));
            const ObjectId place = scene.node(groups[random() % groups.size()], transforms.back());
            scene.node(place, coreIds[random() % coreIds.size()]);
            if (i % 4 == 0) groups.push_back(place);
        }
        bool shown = false;
        for (int change = 0; change < 25; ++change) {
            if (change % 3 == 0) scene.setChoice(switchCore, (shown = !shown) ? Switch::kAll : Switch::kNone);
            scene.set<Transform>(transforms[random() % transforms.size()], fieldId<&Transform::translation>,
                                 somewhere(9));
            const ObjectId below = change == 4 ? hidden : groups[random() % groups.size()];  // hidden at that time
            const Vec3d place = somewhere(change % 5 == 4 ? 1e5 : 12);
            const LookAtAll::Found expected = truth.nearest(scene.aspect, below, place);
            const std::optional<NearestSurface> told = nearestIn(scene, place, below);
            ASSERT_EQ(told.has_value(), !expected.nodes.empty());
            if (!told) {
                ++none;
                continue;
            }
            ++found;
            const double away = double(expected.distance);
            ASSERT_NEAR(told->distance, away, 1e-13 * (1 + place.norm() + away));
            ASSERT_NEAR((told->point - place).norm(), told->distance, 1e-13 * (1 + place.norm() + away));
            ASSERT_EQ(told->error, 0);
            ASSERT_TRUE(std::ranges::count(expected.nodes, told->node));
        }
    }
    EXPECT_GT(found, 100u);
    EXPECT_GT(none, 0u) << "something hidden was asked for, too";
}

TEST(NearestSurface, IsToldWithItsFaceAndItsNormal) {
    SceneMaker scene;
    const auto near = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -2));
    scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -5));
    const auto told = nearestIn(scene, Vec3d(0.1, 0.2, 3));
    ASSERT_TRUE(told);
    EXPECT_EQ(told->node, near.shape);
    EXPECT_DOUBLE_EQ(told->distance, 4.5);
    EXPECT_TRUE(told->point.isApprox(Vec3d(0.1, 0.2, -1.5)));
    EXPECT_TRUE(told->details.normal.isApprox(Vec3d::UnitZ()));
    const auto hit = scene.pipeline.pickNode(scene.aspect, {Vec3d(0.1, 0.2, 3), -Vec3d::UnitZ()});
    ASSERT_TRUE(hit);
    EXPECT_EQ(told->face, hit->face);
}

TEST(NearestSurface, OfEqualDistancesIsTheFirstInTheDocument) {
    SceneMaker scene;
    const ObjectId first = scene.node(kRootNode), second = scene.node(kRootNode);
    const auto later = scene.body(second, shapes::box(Vec3d::Ones()), Vec3d(2, 0, 0));
    const auto sooner = scene.body(first, shapes::box(Vec3d::Ones()), Vec3d(-2, 0, 0));
    EXPECT_EQ(nearestIn(scene, Vec3d::Zero())->node, sooner.shape);
    EXPECT_EQ(nearestIn(scene, Vec3d::Zero(), second)->node, later.shape);
    EXPECT_EQ(nearestIn(scene, Vec3d::Zero(), later.shape)->node, later.shape) << "the node itself counts";
}

TEST(NearestSurface, IsNothingWhereNothingIsSeen) {
    SceneMaker scene;
    const auto body = scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d::Zero());
    const ObjectId empty = scene.node(kRootNode);
    EXPECT_TRUE(nearestIn(scene, Vec3d::Zero()));
    EXPECT_FALSE(nearestIn(scene, Vec3d::Zero(), empty)) << "an empty node";
    EXPECT_FALSE(nearestIn(scene, Vec3d::Zero(), ObjectId{987654})) << "a node that is not there";
    EXPECT_FALSE(nearestIn(scene, Vec3d(0, 1e60, 0)));
    EXPECT_FALSE(nearestIn(scene, Vec3d(0, std::nan(""), 0)));
    EXPECT_TRUE(nearestIn(scene, Vec3d(0, 1e40, 0)));
    scene.set<Transform>(body.transform, fieldId<&Transform::translation>, Vec3d(0, 1e70, 0));
    EXPECT_FALSE(nearestIn(scene, Vec3d::Zero())) << "beyond all measure";
    CollisionObject marks;
    marks.layers = 0;
    const ObjectId core = scene.object(marks);
    const ObjectId node = scene.node(kRootNode, core);
    scene.body(node, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -2));
    EXPECT_TRUE(nearestIn(scene, Vec3d::Zero()));
    scene.set<CollisionObject>(core, fieldId<&CollisionObject::node>, node);
    EXPECT_FALSE(nearestIn(scene, Vec3d::Zero())) << "picks look through the wall's own marks";
}

TEST(NearestSurface, PointsAreBallsToTheErrorThatIsTold) {
    SceneMaker scene;
    const std::vector<float> places = {0, 0, 0, 3, 0, 0, 0, 5, 0};
    const ObjectId points = scene.geometry({places, {}});
    scene.node(scene.node(kRootNode, scene.transform(Vec3d(0, 0, -5), Quatd::Identity(), Vec3d::Constant(2))), points);
    scene.set<Geometry>(points, fieldId<&Geometry::primitive>, Geometry::kPoints);
    scene.set<Geometry>(points, fieldId<&Geometry::pointRadius>, 0.5);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> u(-20, 20);
    for (int i = 0; i < 100; ++i) {
        const Vec3d place(u(random), u(random), u(random));
        double truth = std::numeric_limits<double>::infinity();
        for (std::size_t p = 0; p < places.size(); p += 3)
            truth = std::min(truth,
                             (2 * Vec3d(places[p], places[p + 1], places[p + 2]) + Vec3d(0, 0, -5) - place).norm() - 1);
        const auto told = nearestIn(scene, place);
        ASSERT_TRUE(told);
        if (truth < 0) continue;
        EXPECT_GT(told->error, 0.4);
        EXPECT_LT(told->error, 0.43);
        EXPECT_NEAR(told->distance, truth, told->error);
    }
}

TEST(NearestSurface, OfManyFewAreLookedAtAndNoMoreThanAllowed) {
    SceneMaker scene;
    const ObjectId core = scene.geometry(shapes::sphere(0.3, 8, 12));
    for (int i = 0; i < 1000; ++i)
        scene.node(scene.node(kRootNode, scene.transform(Vec3d(i % 10, i / 10 % 10, i / 100))), core);
    const Vec3d place(4.5, 5.5, 6.6);
    PickPatience any;
    const auto told = scene.pipeline.nearestSurface(scene.aspect, place, kRootNode, &any);
    ASSERT_TRUE(told);
    EXPECT_LT(any.work.boxTests + any.work.triangleTests, 1000u);
    PickPatience little{.work = {.limit = 20}};
    EXPECT_FALSE(scene.pipeline.nearestSurface(scene.aspect, place, kRootNode, &little));
    EXPECT_TRUE(little.over());
    PickPatience enough{.work = {.limit = any.work.boxTests + any.work.triangleTests + 1}};
    const auto again = scene.pipeline.nearestSurface(scene.aspect, place, kRootNode, &enough);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->distance, told->distance);
    EXPECT_EQ(again->node, told->node);
}

}  // namespace
}  // namespace tessera
