// Volumes: what picks and motions meet of them is their surface, as far as clip planes leave it, in every mode.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "common/cores/Volume.h"
#include "common/rays/IntersectAction.h"
#include "server/collision/pipeline/ScenePicker.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {
namespace {

/// A ball of radius 1 about the node's origin, as its field says it: the distance from the middle.
Volume ballField() {
    constexpr std::int64_t kSide = 17;
    std::vector<float> values;
    for (std::int64_t z = 0; z < kSide; ++z)
        for (std::int64_t y = 0; y < kSide; ++y)
            for (std::int64_t x = 0; x < kSide; ++x)
                values.push_back(
                    static_cast<float>(2 - 0.2 * Vec3d(double(x - 8), double(y - 8), double(z - 8)).norm()));
    Volume v;
    v.format = Volume::kFloat;
    v.sizeX = v.sizeY = v.sizeZ = kSide;
    v.voxels = Blob::of(std::span<const float>(values));
    v.origin = Vec3d::Constant(-1.6);
    v.spacing = Vec3d::Constant(0.2);
    v.surfaceValue = 1;
    return v;
}
Blob planesOf(const std::vector<double>& numbers) {
    return numbers.empty() ? Blob() : Blob::of(std::span<const double>(numbers));
}

struct BallOfVoxels : SceneMaker {
    ObjectId core = ObjectId(aspect.nextFreeId());
    ObjectId ball;

    explicit BallOfVoxels(std::int64_t mode) {
        Volume v = ballField();
        v.mode = mode;
        ChangeListBuilder b;
        b.create(core, typeOf<Volume>());
        setAllFields(b, core, Object::of(v));
        apply(b);
        ball = node(node(kRootNode, transform(Vec3d(0, 0, -5))), core);
    }
    void clip(const std::vector<double>& planes) { set<Volume>(core, fieldId<&Volume::clipPlanes>, planesOf(planes)); }
};

// All that a ray meets of the whole surface and that lies within the planes, and nothing else, on scenes that were
// edited as on those seen anew.
TEST(Volumes, ClipPlanesCutWhatRaysMeet) {
    const char* one = std::getenv("TESSERA_SEED");
    const std::uint64_t first = one ? std::strtoull(one, nullptr, 10) : 1, last = one ? first : 40;
    std::size_t met = 0, cutAway = 0;
    for (std::uint64_t seed = first; seed <= last; ++seed) {
        std::mt19937_64 random(seed);
        const auto any = [&](double from, double to) {
            return std::uniform_real_distribution<double>(from, to)(random);
        };
        const BallOfVoxels whole(static_cast<std::int64_t>(seed % 4));
        BallOfVoxels cut(static_cast<std::int64_t>(seed % 4));
        IntersectAction wholeRays, cutRays;
        wholeRays.lookAnew(whole.aspect);
        for (int edit = 0; edit < 3; ++edit) {
            std::vector<double> planes;
            for (std::size_t i = 0, count = random() % 4; i < count; ++i) {
                const Vec3d n = 3 * Vec3d(any(-1, 1), any(-1, 1), any(-1, 1));
                planes.insert(planes.end(), {n.x(), n.y(), n.z(), any(-0.5, 1) * n.norm()});
            }
            cut.clip(planes);
            cutRays.lookAnew(cut.aspect);
            for (int i = 0; i < 60; ++i) {
                const Ray ray{Vec3d(any(-1, 1), any(-1, 1), 0), Vec3d(any(-0.1, 0.1), any(-0.1, 0.1), -1)};
                const std::string again =
                    "TESSERA_SEED=" + std::to_string(seed) + " build/bin/unit_pipeline --gtest_filter=Volumes.*";
                std::vector<Intersection> wanted = wholeRays.all(whole.aspect, ray).value();
                bool atRim = false;
                std::erase_if(wanted, [&](const Intersection& hit) {
                    double beyond = -1e300;
                    for (std::size_t k = 0; k < planes.size(); k += 4) {
                        const Vec3d n(planes[k], planes[k + 1], planes[k + 2]);
                        beyond = std::max(beyond, (n.dot(hit.point - Vec3d(0, 0, -5)) - planes[k + 3]) / n.norm());
                    }
                    atRim = atRim || std::abs(beyond) < 1e-5;
                    cutAway += beyond > 0;
                    return beyond > 0;
                });
                if (atRim) continue;
                const std::vector<Intersection> is = cutRays.all(cut.aspect, ray).value();
                ASSERT_EQ(is.size(), wanted.size()) << again;
                for (std::size_t k = 0; k < is.size(); ++k) ASSERT_NEAR(is[k].t, wanted[k].t, 1e-5) << again;
                met += is.size();
                const auto picked = cut.pipeline.pickNode(cut.aspect, ray);
                ASSERT_EQ(picked.has_value(), !is.empty()) << again;
                if (picked) {
                    ASSERT_NEAR(picked->t, is[0].t, 1e-6) << again;
                }
            }
        }
    }
    if (!one) {
        EXPECT_GT(met, 2000u);
        EXPECT_GT(cutAway, 2000u);
    }
}

// A plate that comes down onto the ball stops at its top; where a plane has cut the top away, at the rim; where nothing
// is left, nowhere.
TEST(Volumes, AMotionStopsAtWhatClipPlanesLeave) {
    for (const std::int64_t mode : {Volume::kCloud, Volume::kMaximum, Volume::kSurface, Volume::kSlices}) {
        BallOfVoxels scene(mode);
        const auto plate = scene.body(kRootNode, shapes::box(Vec3d(4, 0.2, 4)), Vec3d(0, 3, -5));
        scene.interest(plate.node);
        const auto lowered = [&] {
            scene.commit({.transform = plate.transform, .translation = Vec3d(0, 3, -5)});
            scene.frame({{.transform = plate.transform, .translation = Vec3d(0, -3, -5)}});
            return scene.at(plate.transform).translation.y() - 0.1;
        };
        EXPECT_NEAR(lowered(), 1, 0.01) << mode;
        scene.clip({0, 2, 0, 1});
        EXPECT_NEAR(lowered(), 0.5, 1e-3) << mode;
        scene.clip({0, 2, 0, 1, 0.1, 1, 0, -3});
        EXPECT_NEAR(lowered(), -3.1, 1e-9) << mode;
        scene.clip({});
        EXPECT_NEAR(lowered(), 1, 0.01) << mode;
    }
}

}  // namespace
}  // namespace tessera
