/// The whole pipeline against brute force, in scenes nobody thought of.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "common/scene/Action.h"
#include "tests/unit/collision/BruteForce.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

/// Bodies in nested frames, some watching everything, some only part of it.
struct RandomScene : SceneMaker {
    std::mt19937 random;
    std::vector<ObjectId> transforms;
    std::vector<ObjectId> shapesOfObject, shapesOfOthers;

    explicit RandomScene(unsigned seed, std::int64_t response) : random(seed) {
        const ObjectId object = frameNode(kRootNode), others = frameNode(kRootNode);
        const ObjectId deeper = frameNode(others);
        for (int i = 0; i < 3; ++i) shapesOfObject.push_back(randomBody(object));
        for (int i = 0; i < 6; ++i) shapesOfOthers.push_back(randomBody(i % 2 ? others : deeper));
        interest(object, others, response);
    }

    double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
    Vec3d vector(double reach) { return {uniform(-reach, reach), uniform(-reach, reach), uniform(-reach, reach)}; }
    Quatd rotation() {
        std::normal_distribution<double> n;
        return Quatd(n(random), n(random), n(random), n(random)).normalized();
    }
    ObjectId frameNode(ObjectId parent) {
        transforms.push_back(
            transform(vector(1), rotation(), Vec3d(uniform(0.5, 1.5), uniform(0.5, 1.5), -uniform(0.5, 1.5))));
        return node(parent, transforms.back());
    }
    ObjectId randomBody(ObjectId parent) {
        const shapes::Soup soup = uniform(0, 1) < 0.5
                                      ? shapes::box(Vec3d(uniform(0.2, 1), uniform(0.2, 1), uniform(0.2, 1)))
                                      : shapes::sphere(uniform(0.2, 0.6), 6, 9);
        const Body made = body(parent, soup, vector(1.5), rotation());
        transforms.push_back(made.transform);
        return made.shape;
    }
    std::vector<TentativeTransform> wishes(double reach) {
        std::vector<TentativeTransform> out;
        for (const ObjectId id : transforms) {
            if (uniform(0, 1) < 0.4) continue;
            const Transform& now = at(id);
            out.push_back({.transform = id,
                           .translation = now.translation + vector(reach),
                           .rotation = now.rotation.slerp(uniform(0, 0.4), rotation()),
                           .scale = now.scale * uniform(0.9, 1.1)});
        }
        std::shuffle(out.begin(), out.end(), random);
        return out;
    }

    struct Meeting {
        ObjectId a, b;
        std::uint32_t faceA, faceB;
        auto operator<=>(const Meeting&) const = default;
    };
    /// All pairs, all faces, straight from the committed scene.
    std::vector<Meeting> truth() {
        std::vector<Meeting> out;
        for (const ObjectId a : shapesOfObject)
            for (const ObjectId b : shapesOfOthers) {
                const Affine3d a_T_b = worldTransform(aspect, a).inverse() * worldTransform(aspect, b);
                for (const FacePair& f : bruteForce(mesh(a), mesh(b), a_T_b)) out.push_back({a, b, f.a, f.b});
            }
        std::sort(out.begin(), out.end());
        return out;
    }
    TriangleMesh mesh(ObjectId nodeId) {
        const Geometry& g = *aspect.coreOf<Geometry>(*aspect.get<Node>(nodeId));
        return *TriangleMesh::make(g.positions.as<float>(), g.indices.as<std::uint32_t>());
    }
};

std::vector<RandomScene::Meeting> meetings(const StepResult& result) {
    std::vector<RandomScene::Meeting> out;
    for (const Contact& c : result.contacts) out.push_back({c.objectA, c.objectB, c.faceA, c.faceB});
    return out;
}

TEST(RandomScenes, ReportedContactsAreThoseOfBruteForce) {
    std::size_t contacts = 0;
    for (unsigned seed = 0; seed < 12; ++seed) {
        RandomScene scene(seed, Interest::kReport);
        for (int frame = 0; frame < 8; ++frame) {
            const StepResult result = scene.frame(scene.wishes(0.4));
            EXPECT_TRUE(result.stopped.empty());
            const auto truth = scene.truth();
            ASSERT_LT(truth.size(), 1000u);
            ASSERT_EQ(meetings(result), truth) << seed << ' ' << frame;
            contacts += truth.size();
        }
    }
    EXPECT_GT(contacts, 300u);
}

TEST(RandomScenes, NothingThatWasApartEverMeets) {
    std::size_t stops = 0, moves = 0;
    for (unsigned seed = 100; seed < 112; ++seed) {
        RandomScene scene(seed, Interest::kStop);
        const auto pairsOf = [](const std::vector<RandomScene::Meeting>& all) {
            std::set<std::pair<ObjectId, ObjectId>> pairs;
            for (const auto& m : all) pairs.emplace(m.a, m.b);
            return pairs;
        };
        auto before = pairsOf(scene.truth());
        for (int frame = 0; frame < 10; ++frame) {
            const StepResult result = scene.frame(scene.wishes(frame % 3 == 2 ? 5.0 : 0.5));
            stops += result.stopped.size();
            moves += result.accepted.size();
            const auto now = pairsOf(scene.truth());
            EXPECT_TRUE(std::includes(before.begin(), before.end(), now.begin(), now.end())) << seed << ' ' << frame;
            if (result.counters.notLookedAt > 0) {
                EXPECT_FALSE(result.stopped.empty());
            }
            before = now;
        }
    }
    EXPECT_GT(stops, 40u);
    EXPECT_GT(moves, 3 * stops);
}

TEST(RandomScenes, TheOrderOfWishesDoesNotMatter) {
    for (unsigned seed = 200; seed < 206; ++seed) {
        RandomScene one(seed, Interest::kStop), two(seed, Interest::kStop);
        std::mt19937 shuffle(seed);
        for (int frame = 0; frame < 6; ++frame) {
            std::vector<TentativeTransform> wishes = one.wishes(1.0);
            const StepResult a = one.frame(wishes);
            std::shuffle(wishes.begin(), wishes.end(), shuffle);
            const StepResult b = two.frame(wishes);
            ASSERT_EQ(a.stopped, b.stopped);
            ASSERT_EQ(a.accepted.size(), b.accepted.size());
            for (std::size_t i = 0; i < a.accepted.size(); ++i) {
                ASSERT_EQ(a.accepted[i].transform, b.accepted[i].transform);
                ASSERT_EQ(a.accepted[i].translation, b.accepted[i].translation);
                ASSERT_EQ(a.accepted[i].rotation.coeffs(), b.accepted[i].rotation.coeffs());
                ASSERT_EQ(a.accepted[i].scale, b.accepted[i].scale);
            }
            ASSERT_EQ(meetings(a), meetings(b));
            ASSERT_EQ(a.counters.triangleTests, b.counters.triangleTests);
            ASSERT_EQ(a.counters.boxTests, b.counters.boxTests);
            ASSERT_EQ(a.counters.pairsTested, b.counters.pairsTested);
            ASSERT_EQ(one.aspect.stateHash(), two.aspect.stateHash());
        }
    }
}

/// A ground of heights over a grid, and three things above it that interests of every kind ask about.
struct Ground : SceneMaker {
    std::vector<Body> things;

    explicit Ground(std::int64_t shape) {
        std::mt19937_64 random(5);
        shapes::Soup soup;
        constexpr std::uint32_t kLines = 25;
        for (std::uint32_t row = 0; row < kLines; ++row)
            for (std::uint32_t column = 0; column < kLines; ++column)
                soup.vertex(
                    Vec3d(0.5 * column - 6, std::uniform_real_distribution<double>(-0.4, 0.4)(random), 0.5 * row - 6));
        for (std::uint32_t row = 0; row + 1 < kLines; ++row)
            for (std::uint32_t column = 0; column + 1 < kLines; ++column) {
                const std::uint32_t at = row * kLines + column;
                soup.indices.insert(soup.indices.end(),
                                    {at, at + kLines, at + 1, at + 1, at + kLines, at + kLines + 1});
            }
        const Body ground = body(kRootNode, soup, Vec3d::Zero());
        CollisionObject object;
        object.node = ground.node;
        object.kind = CollisionObject::kStatic;
        object.shape = shape;
        this->object(object);
        for (int i = 0; i < 3; ++i) {
            things.push_back(body(kRootNode, shapes::sphere(0.6, 8, 12), Vec3d(3.0 * i - 3, 1, 0)));
            object.node = things.back().node;
            object.kind = CollisionObject::kRigid;
            object.shape = i == 2 ? CollisionObject::kHull : CollisionObject::kTriangles;
            this->object(object);
            Interest fields;
            fields.object = things.back().node;
            fields.against = ground.node;
            fields.response = Interest::kReport;
            fields.mode = i == 0 ? Interest::kDynamic : Interest::kPseudoDynamic;
            interest(fields);
            fields.mode = Interest::kDistance;
            fields.threshold = 2;
            interest(fields);
        }
    }
};

TEST(RandomScenes, AHeightFieldIsTheSameGroundAsItsTriangles) {
    Ground fields(CollisionObject::kHeightField), triangles(CollisionObject::kTriangles);
    std::mt19937_64 random(6);
    const auto number = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    std::size_t contacts = 0, distances = 0;
    for (int frame = 0; frame < 60; ++frame) {
        std::vector<TentativeTransform> wishes;
        for (std::size_t i = 0; i < 3; ++i)
            wishes.push_back({.transform = fields.things[i].transform,
                              .translation = Vec3d(number(-5, 5), number(-0.5, 2.5), number(-5, 5)),
                              .rotation = Quatd(number(-1, 1), number(-1, 1), number(-1, 1), 1).normalized()});
        const StepResult found = fields.frame(wishes), truth = triangles.frame(wishes);
        ASSERT_EQ(found.contacts.size(), truth.contacts.size()) << frame;
        for (std::size_t i = 0; i < truth.contacts.size(); ++i) {
            const Contact &x = found.contacts[i], &y = truth.contacts[i];
            ASSERT_EQ(std::tie(x.objectA, x.objectB, x.faceA, x.faceB),
                      std::tie(y.objectA, y.objectB, y.faceA, y.faceB));
            ASSERT_EQ(x.point, y.point);
            ASSERT_EQ(x.normal, y.normal);
        }
        ASSERT_EQ(found.distances.all().size(), truth.distances.all().size());
        for (std::size_t i = 0; i < truth.distances.all().size(); ++i)
            ASSERT_NEAR(found.distances.all()[i].distance, truth.distances.all()[i].distance, 1e-12);
        ASSERT_EQ(found.events.all().size(), truth.events.all().size());
        for (std::size_t i = 0; i < truth.events.all().size(); ++i)
            ASSERT_NEAR(found.events.all()[i].firstTime, truth.events.all()[i].firstTime, 1e-2);
        contacts += truth.contacts.size();
        distances += truth.distances.all().size();
    }
    EXPECT_GT(contacts, 500u);
    EXPECT_GT(distances, 50u);
}

}  // namespace
}  // namespace tessera
