/// Things that reach very far: what of them is near is drawn as if they reached a little less far.
#include <gtest/gtest.h>

#include <random>

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
constexpr std::array<double, 9> kLengths{1e9, 1e12, 1e15, 1e18, 1e19, 1e20, 1e25, 1e29, 9e29};

// Triangles to a far vertex beside a quad that is near, lit; lines; a scan's point that lies there.
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
            mesh.positions = {-0.5f, -0.5f, 0, 0.5f, -0.5f, 0, 0.5f, 0.5f, 0.2f, -0.5f, 0.5f, 0, far.x(), far.y(), far.z()};
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
            ASSERT_LE(apart(draw(sceneOf(length), camera), wanted, 12), 4u)
                << "reaching " << length << ", kind " << kind << "\nTESSERA_SEED=" << seed << " unit_draw --gtest_filter=FarVertex.*";
    }
    if (!std::getenv("TESSERA_SEED")) {
        EXPECT_EQ(shown, 100);
    }
}

}  // namespace
}  // namespace tessera
