// What is drawn near a place: beside a look at all, after any history.
#include <gtest/gtest.h>

#include <random>

#include "common/scene/Action.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

Box cornersOf(const Triangle& t) {
    Box box;
    for (const Vec3d& corner : t) box.extend(corner);
    return box;
}

Box grown(Box box, double by) {
    box.lower -= Vec3d::Constant(by);
    box.upper += Vec3d::Constant(by);
    return box;
}

/// What is left of a triangle within a box, plane by plane (Sutherland and Hodgman 1974).
bool meets(const Triangle& t, const Box& box) {
    std::vector<Vec3d> polygon(t.begin(), t.end());
    for (int axis = 0; axis < 3; ++axis)
        for (const double side : {1.0, -1.0}) {
            const double limit = side > 0 ? box.upper[axis] : -box.lower[axis];
            std::vector<Vec3d> kept;
            for (std::size_t i = 0; i < polygon.size(); ++i) {
                const Vec3d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
                const double outA = side * a[axis] - limit, outB = side * b[axis] - limit;
                if (outA <= 0) kept.push_back(a);
                if ((outA < 0 && outB > 0) || (outA > 0 && outB < 0))
                    kept.push_back(a + outA / (outA - outB) * (b - a));
            }
            polygon = std::move(kept);
        }
    return !polygon.empty();
}

std::size_t countIn(const std::vector<Triangle>& faces, const Box& box) {
    return static_cast<std::size_t>(
        std::ranges::count_if(faces, [&](const Triangle& t) { return cornersOf(t).overlaps(box); }));
}

TEST(FacesIn, AreThoseThatALookAtAllFinds) {
    const char* given = std::getenv("TESSERA_SEED");
    const unsigned seed = given ? static_cast<unsigned>(std::strtoul(given, nullptr, 10)) : std::random_device{}();
    SCOPED_TRACE(testing::Message() << "TESSERA_SEED=" << seed
                                    << " build/bin/unit_pipeline --gtest_filter=FacesIn.AreThoseThatALookAtAllFinds");
    std::mt19937 random(seed);
    const auto number = [&](double from, double to) { return std::uniform_real_distribution(from, to)(random); };
    std::size_t found = 0, met = 0;
    for (int round = 0; round < 12; ++round) {
        SceneMaker scene;
        const shapes::Soup ball = shapes::sphere(1, 8, 12), sheet = shapes::sheet(2, 3);
        struct Body {
            ObjectId transform, node;
            bool isBall;
        };
        std::vector<Body> bodies;
        const ObjectId ballCore = scene.geometry(ball), sheetCore = scene.geometry(sheet);
        const ObjectId switchCore = scene.switchCore(-1);
        const ObjectId hidden = scene.node(kRootNode, switchCore);
        for (int i = 0; i < 30; ++i) {
            const double size = std::pow(10.0, number(-2, 1));
            // Some stretched, some flat: they are drawn, too.
            const Vec3d scale = i % 5 == 0   ? Vec3d(size, 3 * size, 0.2 * size)
                                : i % 7 == 0 ? Vec3d(size, 0, size)
                                             : Vec3d(Vec3d::Constant(size));
            const Quatd turn = Quatd(number(-1, 1), number(-1, 1), number(-1, 1), number(-1, 1)).normalized();
            const ObjectId transform = scene.transform(Vec3d(number(-9, 9), number(-9, 9), number(-9, 9)), turn, scale);
            const bool isBall = random() % 2 == 0;
            const ObjectId place = scene.node(i % 6 == 5 ? hidden : kRootNode, transform);
            bodies.push_back({transform, scene.node(place, isBall ? ballCore : sheetCore), isBall});
        }
        bool shown = false;
        for (int change = 0; change < 20; ++change) {
            const Body& moved = bodies[random() % bodies.size()];
            if (change % 3 == 0) scene.setChoice(switchCore, (shown = !shown) ? 0 : -1);
            scene.set<Transform>(moved.transform, fieldId<&Transform::translation>,
                                 Vec3d(number(-9, 9), number(-9, 9), number(-9, 9)));
            std::vector<Triangle> all;
            Action look;
            look.onNode([&](const Visit& visit) {
                const auto body = std::ranges::find(bodies, visit.nodeId, &Body::node);
                if (body == bodies.end()) return Descend::kInto;
                const TriangleMesh mesh = (body->isBall ? ball : sheet).mesh();
                for (std::uint32_t face = 0; face < mesh.faceCount(); ++face)
                    all.push_back(transformed(visit.world_T_node, mesh.triangle(face)));
                return Descend::kInto;
            });
            look.run(scene.aspect);
            Box box;
            const Vec3d middle(number(-9, 9), number(-9, 9), number(-9, 9)),
                half = std::pow(10.0, number(-2, 1)) * Vec3d(number(0, 1), number(0, 1), number(0, 1));
            box.lower = middle - half;
            box.upper = middle + half;
            QueryWork work;
            std::vector<Triangle> faces;
            ASSERT_TRUE(scene.pipeline.facesIn(scene.aspect, box, work, faces));
            for (const Triangle& t : all)
                if (meets(t, grown(box, -1e-9))) {
                    ASSERT_TRUE(std::ranges::any_of(faces, [&](const Triangle& f) {
                        return (f[0] - t[0]).norm() + (f[1] - t[1]).norm() + (f[2] - t[2]).norm() < 1e-9;
                    }));
                    ++met;
                }
            ASSERT_LE(faces.size(), countIn(all, grown(box, 1e-9)));
            ASSERT_EQ(countIn(faces, grown(box, 1e-9)), faces.size());
            found += faces.size();
            // Who may look at little is told that it was too much, or all of it.
            QueryWork little{.limit = 1 + random() % 30};
            std::vector<Triangle> some(1);
            const bool enough = scene.pipeline.facesIn(scene.aspect, box, little, some);
            ASSERT_EQ(some.size(), 1 + (enough ? faces.size() : 0));
        }
    }
    EXPECT_GT(found, 1000u);
    EXPECT_GT(met, 500u);
}

TEST(FacesIn, LooksThroughWhatTakesPartInNothing) {
    SceneMaker scene;
    CollisionObject object;
    object.layers = 0;
    const ObjectId core = scene.object(object);
    const ObjectId marks = scene.node(kRootNode, core);
    scene.body(marks, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -2));
    scene.set<CollisionObject>(core, fieldId<&CollisionObject::node>, marks);
    scene.body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0, 0, -5));
    Box box;
    box.extend(Vec3d(-10, -10, -10));
    box.extend(Vec3d(10, 10, 10));
    QueryWork work;
    std::vector<Triangle> faces;
    ASSERT_TRUE(scene.pipeline.facesIn(scene.aspect, box, work, faces));
    EXPECT_EQ(faces.size(), 12u) << "the wall's own marks of contacts are in nobody's way";
}

}  // namespace
}  // namespace tessera
