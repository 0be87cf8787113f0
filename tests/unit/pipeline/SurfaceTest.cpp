// Bodies whose triangles are derived from control points.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "server/collision/pipeline/ScenePicker.h"
#include "tests/unit/drawable/ControlCube.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

struct SurfaceAndBox : SceneMaker {
    ObjectId surface = ObjectId(aspect.nextFreeId());
    ObjectId node_;
    Body box;

    SurfaceAndBox(const SubdivisionSurface& fields, std::int64_t kind, std::int64_t response) {
        ChangeListBuilder b;
        b.create(surface, typeOf<SubdivisionSurface>());
        for (const FieldEntry& field : findType(SubdivisionSurface::kType)->fields)
            b.set(surface, typeOf<SubdivisionSurface>(), field.id, field.read(&fields));
        apply(b);
        node_ = node(kRootNode, surface);
        CollisionObject object;
        object.node = node_;
        object.kind = kind;
        this->object(object);
        box = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0.2, 1.2, 0.1));
        Interest interest;
        interest.object = box.node;
        interest.against = node_;
        interest.response = response;
        interest.mode = Interest::kDynamic;
        this->interest(interest);
        frame();
    }
    void move(std::uint64_t first, std::span<const float> floats) {
        ChangeListBuilder b;
        b.setRange(surface, typeOf<SubdivisionSurface>(), fieldId<&SubdivisionSurface::points>, first * sizeof(float),
                   Blob::of(floats));
        ChangeList list = b.take();
        ASSERT_TRUE(resolveRanges(aspect, list));
        ASSERT_TRUE(aspect.apply(list));
        pipeline.sceneChanged(aspect, &list);
    }
};

TEST(Surfaces, ThatDeformAreMetAsByAPipelineThatSeesThemForTheFirstTime) {
    const char* one = std::getenv("TESSERA_SEED");
    const std::uint64_t first = one ? std::strtoull(one, nullptr, 10) : 1, last = one ? first : 12;
    std::size_t touching = 0;
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        SCOPED_TRACE(::testing::Message()
                     << "TESSERA_SEED=" << seed << " build/bin/unit_pipeline --gtest_filter=Surfaces.*");
        std::mt19937_64 random(seed);
        SubdivisionSurface fields = test::controlGrid(2 + static_cast<std::uint32_t>(random() % 3));
        fields.level = 1 + static_cast<std::int64_t>(random() % 2);
        SurfaceAndBox scene(fields, seed % 2 ? CollisionObject::kDeforming : CollisionObject::kRigid,
                            Interest::kReport);
        for (int step = 0; step < 10; ++step) {
            const std::size_t floats = scene.aspect.get<SubdivisionSurface>(scene.surface)->points.sizeBytes() / 4,
                              at = random() % floats;
            std::vector<float> moved(1 + random() % std::min<std::size_t>(6, floats - at));
            for (float& x : moved) x = static_cast<float>(static_cast<double>(random() % 3000) / 1000 - 1.5);
            scene.move(at, moved);
            const StepResult result = scene.frame();
            CollisionPipeline fresh;
            fresh.sceneChanged(scene.aspect, nullptr);
            const StepResult expected = fresh.step(scene.aspect, {}, {});
            ASSERT_EQ(result.contacts.size(), expected.contacts.size());
            touching += result.contacts.empty() ? 0 : 1;
            for (std::size_t i = 0; i < result.contacts.size(); ++i) {
                ASSERT_EQ(result.contacts[i].faceA, expected.contacts[i].faceA);
                ASSERT_EQ(result.contacts[i].faceB, expected.contacts[i].faceB);
                ASSERT_EQ(result.contacts[i].point, expected.contacts[i].point);
            }
            for (int ray = 0; ray < 20; ++ray) {
                const Ray along{Vec3d(double(random() % 200) / 100 - 1, 5, double(random() % 200) / 100 - 1),
                                -Vec3d::UnitY()};
                const auto hit = scene.pipeline.pickNode(scene.aspect, along),
                           known = fresh.pickNode(scene.aspect, along);
                ASSERT_EQ(hit.has_value(), known.has_value());
                if (hit) {
                    ASSERT_EQ(hit->t, known->t);
                    ASSERT_EQ(hit->face, known->face);
                }
            }
        }
    }
    if (!one) {
        EXPECT_GT(touching, 30u);
    }
}

/// Points that rise into a body within a frame are told with the time of it, as a Geometry's vertices are.
TEST(Surfaces, ThatRiseIntoABodyAreToldWithTheTime) {
    SubdivisionSurface cube = test::controlGrid(1);
    cube.scheme = SubdivisionSurface::kBilinear;
    SurfaceAndBox scene(cube, CollisionObject::kDeforming, Interest::kReport);
    scene.commit({.transform = scene.box.transform, .translation = Vec3d(0, 3, 0)});  // its underside at 2.5
    scene.frame();
    const Blob points = scene.aspect.get<SubdivisionSurface>(scene.surface)->points;
    std::vector<float> raised(points.as<float>().begin(), points.as<float>().end());
    for (std::size_t i = 1; i < raised.size(); i += 3)
        if (raised[i] > 0) raised[i] = 3;
    scene.move(0, raised);
    const StepResult result = scene.frame();
    ASSERT_EQ(result.events.size(), 1u);
    EXPECT_EQ(result.events.front().phase, Phase::kBegan);
    // From 1 to 3: it passes 2.5 after three quarters.
    EXPECT_NEAR(result.events.front().firstTime, 0.75, 1e-3);
}

}  // namespace
}  // namespace tessera
