/// Lines: as wide as they are told, with square ends, wherever they begin.
#include <gtest/gtest.h>

#include <array>
#include <random>

#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

using test::makeLines;

/// Pixels of the picture from the middle, y up; what is behind the eye is cut off at the near plane.
struct OnScreen {
    Vec2d from, to;
    bool any = false;
};
OnScreen projected(const ScreenCamera& camera, Vec3d a, Vec3d b) {
    const Mat4d clip_T_world = camera.clip_T_eye * camera.eye_T_world.matrix();
    Vec4d p = clip_T_world * a.homogeneous(), q = clip_T_world * b.homogeneous();
    const double beyondP = p.z() + p.w(), beyondQ = q.z() + q.w();
    if (beyondP < 0 && beyondQ < 0) return {};
    const Vec4d cut = p + (q - p) * (beyondP / (beyondP - beyondQ));
    if (beyondP < 0) p = cut;
    if (beyondQ < 0) q = cut;
    const double half = kSidePx / 2.0;
    return {half * p.head<2>() / p.w(), half * q.head<2>() / q.w(), true};
}

/// How far a place lies outside the strip; negative within.
double outside(const OnScreen& line, double width, const Vec2d& at) {
    Vec2d along = line.to - line.from;
    const double size = along.norm();
    along = size > 1e-6 ? Vec2d(along / size) : Vec2d(1, 0);
    const Vec2d aside(-along.y(), along.x());
    const Vec2d off = at - line.from;
    const double beside = std::abs(off.dot(aside)) - width / 2;
    const double beyond = std::max(-off.dot(along), off.dot(along) - size) - width / 2;
    return std::max(beside, beyond);
}

class LineTest : public RendererTest {
protected:
    Picture drawn(const Vec3d& a, const Vec3d& b, float width, const Material& material) {
        TestScene scene;
        scene.setDark();
        const std::array<Vec3d, 2> ends{a, b};
        scene.place(scene.add(makeLines(ends, width), scene.add(material)), Vec3d::Zero());
        return draw(scene);
    }
    static Material green() {
        Material material;
        material.baseColor = Vec4f(0, 0.5f, 0, 1);
        return material;
    }
};

TEST_F(LineTest, CoverJustTheStripWhereverTheyBegin) {
    std::mt19937 random(3);
    const auto any = [&](double from, double to) { return std::uniform_real_distribution<double>(from, to)(random); };
    const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
    int covered = 0, crossed = 0;
    for (int i = 0; i < 300; ++i) {
        Vec3d a(any(-2, 2), any(-2, 2), any(-4, 3)), b(any(-2, 2), any(-2, 2), any(-4, 3));
        if (i % 5 == 0) b = a + 0.01 * b;
        if (i % 7 == 0) b.x() = a.x();  // upright
        const auto width = static_cast<float>(i % 3 == 0 ? 1.0 : any(0.5, 20));
        const OnScreen line = projected(camera, a, b);
        crossed += (a.z() > 2.3) != (b.z() > 2.3);
        const Picture picture = drawn(a, b, width, green());
        for (int y = 0; y < kSidePx; ++y)
            for (int x = 0; x < kSidePx; ++x) {
                const Vec2d at(x + 0.5 - kSidePx / 2, kSidePx / 2 - y - 0.5);
                const double off = line.any ? outside(line, width, at) : 1;
                // Corners are snapped to 1/256 of a pixel; far outside the picture rounding grows.
                const double far = line.any ? 1e-5 * (line.from.norm() + line.to.norm()) : 0;
                if (std::abs(off) < 0.02 + far) continue;
                const bool is = pixel(picture, x, y).g > 0;
                ASSERT_EQ(is, off < 0) << "line " << i << ", pixel " << x << ' ' << y << ", " << off << " px outside";
                covered += is;
            }
    }
    EXPECT_GT(covered, 10'000);
    EXPECT_GT(crossed, 30);
}

TEST_F(LineTest, HaveTheirBaseColourInAnyLight) {
    for (const float lamp : {0.0f, 2.0f}) {
        TestScene scene;
        scene.setEnvironment(Vec3f::Constant(lamp), Vec3f::Constant(lamp), Vec3f::Zero());
        scene.addDirectionalLight(-Vec3d::UnitZ(), Vec3f::Ones(), lamp);
        const std::array<Vec3d, 2> ends{Vec3d(-1, 0, 0), Vec3d(1, 0, 0)};
        MeshData lines = makeLines(ends, 6);
        lines.colors = {255, 255, 255, 255, 255, 0, 255, 255};
        Material white;
        white.baseColor = Vec4f::Ones();
        white.metallic = 1;
        scene.place(scene.add(lines, scene.add(white)), Vec3d::Zero());
        const Picture picture = draw(scene);
        EXPECT_NEAR(pixel(picture, 14, 32).r, 255, 1);
        EXPECT_GT(pixel(picture, 14, 32).g, pixel(picture, 32, 32).g);
        EXPECT_GT(pixel(picture, 32, 32).g, pixel(picture, 50, 32).g);
    }
}

TEST_F(LineTest, HideAndAreHiddenByDepthAndAreNodes) {
    TestScene scene;
    scene.setDark();
    const std::array<Vec3d, 2> front{Vec3d(-1, 0, -0.5), Vec3d(1, 0, -0.5)}, back{Vec3d(0, -1, -1), Vec3d(0, 1, -1)};
    const ObjectId first = scene.place(scene.add(makeLines(front, 8), scene.add(green())), Vec3d::Zero());
    const ObjectId second = scene.place(scene.add(makeLines(back, 8), scene.add(green())), Vec3d::Zero());
    const ObjectId sheet = scene.place(scene.add(makeSheet(0.4, 0.4), scene.add(green())), {-0.5, 0, -0.3});
    const Aspect aspect = scene.take();
    const ScreenCamera camera = cameraOf(kSidePx, kSidePx);
    const auto ids = renderer_->drawNodeIds(aspect, listOf(aspect, camera), camera, whole(camera));
    ASSERT_TRUE(ids);
    const auto at = [&](int x, int y) { return (*ids)[static_cast<std::size_t>(y * kSidePx + x)]; };
    EXPECT_EQ(at(32, 32), first.value);
    EXPECT_EQ(at(32, 22), second.value);
    EXPECT_EQ(at(24, 32), sheet.value);
}

TEST_F(LineTest, AreRefusedWhereTheyAreNone) {
    MeshArrays arrays = makeLines(std::array<Vec3d, 2>{Vec3d(0, 0, 0), Vec3d(1, 0, 0)}, 1).toArrays();
    EXPECT_TRUE(checkMesh(arrays));
    const std::vector<std::uint32_t> wrong{0, 2}, odd{0, 1, 0}, triangle{0, 1, 1};
    arrays.lines = Blob::of(std::span<const std::uint32_t>(wrong));
    EXPECT_EQ(checkMesh(arrays).error().message, "line 0 names vertex 2, but there are 2 vertices");
    arrays.lines = Blob::of(std::span<const std::uint32_t>(odd));
    EXPECT_FALSE(checkMesh(arrays));
    arrays.lines = {};
    arrays.indices = Blob::of(std::span<const std::uint32_t>(triangle));
    EXPECT_EQ(checkMesh(arrays).error().message, "lines have no triangle indices: leave the array out");
    arrays.kind = MeshKind::kTriangles;
    EXPECT_TRUE(checkMesh(arrays));
    arrays.lines = Blob::of(std::span<const std::uint32_t>(wrong));
    EXPECT_FALSE(checkMesh(arrays));
}

}  // namespace
}  // namespace tessera
