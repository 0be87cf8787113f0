/// Things that reach very far: what of them is near is drawn as if they reached a little less far.
#include <gtest/gtest.h>

#include <random>

#include "common/cores/Particles.h"
#include "tests/support/words/Words.h"
#include "tests/unit/draw/VolumeStage.h"

namespace tessera {
namespace {

class FarVertex : public RendererTest {
protected:
    static Vec3f atLength(const Vec3d& direction, double length) { return (length * direction).cast<float>(); }
    static std::size_t apart(const Picture& a, const Picture& b, int by) {
        std::size_t count = 0;
        for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
            int most = 0;
            for (std::size_t c = 0; c < 3; ++c) most = std::max(most, std::abs(a.rgb[i + c] - b.rgb[i + c]));
            count += most > by;
        }
        return count;
    }
    static bool shows(const Picture& picture) {
        for (std::size_t i = 3; i < picture.rgb.size(); ++i)
            if (std::abs(picture.rgb[i] - picture.rgb[i % 3]) > 40) return true;
        return false;
    }
};

constexpr double kNearEnough = 1e5;  // where pixels do not tell it from any length beyond
constexpr std::array<double, 6> kLengths{1e9, 1e12, 1e15, 1e17, 5e17, 0.99e18};

// Triangles to a far vertex beside a quad that is near, lit or not; lines; a scan's point that lies there.
TEST_F(FarVertex, ReachesFarAndTheRestIsAsItWas) {
    int shown = 0;
    for (const unsigned seed : volumeSeeds(100)) {
        FieldDice dice(seed);
        Vec3d direction = dice.vector(1).normalized();
        const Quatd turn = dice.turn();
        const std::uint32_t kind = dice.below(4);
        const auto sceneOf = [&](double length) {
            const Vec3f far = atLength(direction, length);
            MeshData mesh;
            mesh.positions = {-0.5f, -0.5f, 0,    0.5f, -0.5f,   0,       0.5f,   0.5f,
                              0.2f,  -0.5f, 0.5f, 0,    far.x(), far.y(), far.z()};
            if (kind == 3) {
                mesh.primitive = Primitive::kPoints;
                mesh.pointRadius = 0.2;
            } else if (kind == 2) {
                mesh.primitive = Primitive::kLines;
                mesh.lines = {0, 1, 1, 2, 2, 3, 3, 0, 2, 4, 0, 4};
                mesh.lineWidth = 5;
            } else {
                mesh.indices = {0, 1, 2, 0, 2, 3, 2, 1, 4};
            }
            Material paint = unlit(Vec3f(0.9f, 0.6f, 0.1f));
            if (kind == 1) paint = Material();
            paint.doubleSided = true;
            TestScene scene;
            scene.setEnvironment(Vec3f(0.4f, 0.5f, 0.6f), Vec3f(0.2f, 0.1f, 0.1f), Vec3f(0.02f, 0.02f, 0.1f));
            scene.addDirectionalLight(Vec3d(-0.3, -0.5, -1), Vec3f::Ones(), 0.8f);
            scene.place(scene.add(mesh, scene.add(paint)), {0.1, 0, -0.2}, turn);
            return scene.take();
        };
        const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
        const Picture wanted = draw(sceneOf(kNearEnough), camera);
        shown += shows(wanted);
        for (const double length : kLengths)
            EXPECT_LE(apart(draw(sceneOf(length), camera), wanted, 12), 4u)
                << "reaching " << length << ", kind " << kind << "\nTESSERA_SEED=" << seed
                << " unit_draw --gtest_filter=FarVertex.*";
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_EQ(shown, 100);
    }
}

// Of each kind, larger and larger: drawn, or named; what else is there stays as it was; and tiles are crops of the one
// picture.
TEST_F(FarVertex, TransformsBringThingsFarAndNoneIsLeftOutUnnamed) {
    const Vec3d light(-0.3, -0.5, -1);
    for (int kind = 0; kind < 5; ++kind) {
        std::size_t drawn = 0, named = 0;
        for (const double scale : {1.0, 1e9, 1e12, 1e15, 1e17, 1e19, 1e25, 1e30, 1e38, 1e60, 1e300}) {
            TestScene scene;
            scene.setEnvironment(Vec3f(0.4f, 0.5f, 0.6f), Vec3f(0.2f, 0.1f, 0.1f), Vec3f(0.02f, 0.02f, 0.1f));
            scene.addDirectionalLight(light, Vec3f::Ones(), 0.8f);
            FieldDice dice(7);
            ObjectId core;
            if (kind == 0) core = scene.add(makeSphere(0.5, 9));
            if (kind == 1)
                core = scene.add(MeshData{
                    .positions = {0, 0, 0, 0.3f, 0.2f, 0}, .primitive = Primitive::kPoints, .pointRadius = 0.2});
            const MeshData line{.positions = {-0.5f, 0, 0, 0.5f, 0.2f, 0},
                                .lines = {0, 1},
                                .primitive = Primitive::kLines,
                                .lineWidth = 4};
            if (kind == 2) core = scene.add(line);
            if (kind == 3) {
                Particles particles;
                const std::vector<float> places = {0, 0, 0, 0.3f, 0.2f, 0};
                particles.positions = Blob::of(std::span<const float>(places));
                particles.size = 0.2;
                core = scene.addCore(particles);
            }
            if (kind == 4) core = scene.addCore(someVolume(dice));
            // Behind the eye as it grows, so that what stands before it stays in sight.
            scene.addNode(core, scene.addTransform(Vec3d(0, 0, -0.3 - (scale > 1 ? -4 * scale : 0)), Quatd::Identity(),
                                                   Vec3d::Constant(scale).eval()));
            scene.place(scene.add(makeBox(Vec3d(0.3, 0.3, 0.3))), {0.6, 0.5, 0});
            const Aspect aspect = scene.take();
            const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
            RenderScene all;
            all.update(aspect, nullptr);
            RenderAction action(CullerKind::kNone);
            const DrawList list = action.run(all, camera, whole(camera), nullptr);
            const std::size_t items = list.opaque.size() + list.transparent.size();
            EXPECT_EQ(items + all.undrawn().size(), 2u) << "kind " << kind << ", scale " << scale;
            ++(all.undrawn().empty() ? drawn : named);
            if (!all.undrawn().empty()) {
                EXPECT_WORDS(whyNotDrawn(aspect, *all.undrawn().begin()));
            }
            const Picture one = draw(aspect, camera);
            EXPECT_TRUE(shows(one)) << "kind " << kind << ", scale " << scale;
            for (const PixelRect& tile : {PixelRect{0, 0, 32, 32}, PixelRect{32, 0, 32, 32}, PixelRect{0, 32, 32, 32},
                                          PixelRect{32, 32, 32, 32}}) {
                const auto part = renderer_->draw(aspect, action.run(all, camera, tile, nullptr), camera, tile);
                ASSERT_TRUE(part);
                for (int y = 0; y < tile.height; ++y) {
                    const auto* from =
                        &one.rgb[3 * static_cast<std::size_t>(kSidePx * (kSidePx - tile.y - tile.height + y) + tile.x)];
                    ASSERT_TRUE(std::equal(from, from + 3 * tile.width,
                                           &part->rgb[3 * static_cast<std::size_t>(tile.width * y)]))
                        << "kind " << kind << ", scale " << scale;
                }
            }
        }
        EXPECT_GE(drawn, 4u) << "kind " << kind;
        EXPECT_GE(named, 4u) << "kind " << kind;
    }
}

}  // namespace
}  // namespace tessera
