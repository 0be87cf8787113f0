/// A renderer for tests that look at single pixels.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "client/draw/passes/Renderer.h"
#include "client/render/order/RenderAction.h"
#include "tests/golden/TestScene.h"
#include "tests/support/surface/PooledSurface.h"
#include "tests/unit/draw/ExpectedColor.h"

namespace tessera {

using test::cameraOf;
using test::makeSheet;
using test::TestScene;

inline constexpr int kSidePx = 64;

struct Rgb {
    int r = 0, g = 0, b = 0;
};
inline std::ostream& operator<<(std::ostream& out, const Rgb& c) {
    return out << c.r << ' ' << c.g << ' ' << c.b;
}

inline Rgb pixel(const Picture& picture, int x, int y) {
    const std::size_t at = 3 * static_cast<std::size_t>(y * picture.widthPx + x);
    return {picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]};
}
inline Rgb center(const Picture& picture) {
    return pixel(picture, picture.widthPx / 2, picture.heightPx / 2);
}

inline Rgb expectedOf(const Vec3f& linear) {
    const Vec3f c = test::encodedColor(linear);
    const auto byte = [](float v) { return static_cast<int>(std::lround(255.0f * v)); };
    return {byte(c.x()), byte(c.y()), byte(c.z())};
}

/// The shaders approximate: one step of 255 is allowed.
inline void expectNear(const Rgb& actual, const Rgb& expected) {
    EXPECT_NEAR(actual.r, expected.r, 1) << actual;
    EXPECT_NEAR(actual.g, expected.g, 1) << actual;
    EXPECT_NEAR(actual.b, expected.b, 1) << actual;
}

class RendererTest : public testing::Test {
protected:
    void SetUp() override { restart({.samples = 1}); }
    void restart(RendererOptions options) {
        renderer_.reset();
        surface_.reset();
        surface_ = test::pooledSurface();
        auto renderer = Renderer::create(*surface_, options);
        ASSERT_TRUE(renderer) << renderer.error().message;
        renderer_ = std::move(*renderer);
    }
    DrawList listOf(const Aspect& aspect, const ScreenCamera& camera) {
        RenderScene scene;
        scene.update(aspect, nullptr);
        RenderAction action(CullerKind::kNone);
        return action.run(scene, camera, whole(camera), nullptr);
    }
    static PixelRect whole(const ScreenCamera& camera) {
        return {.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height};
    }
    Picture draw(const Aspect& aspect, const ScreenCamera& camera) {
        auto picture = renderer_->draw(aspect, listOf(aspect, camera), camera, whole(camera));
        EXPECT_TRUE(picture) << picture.error().message;
        return picture ? *picture : Picture::filled(camera.pixels.width, camera.pixels.height, 0, 0, 0);
    }
    Picture draw(TestScene& scene) { return draw(scene.take(), cameraOf(kSidePx, kSidePx)); }

    std::unique_ptr<Surface> surface_;
    std::unique_ptr<Renderer> renderer_;
};

inline Material unlit(const Vec3f& emissive) {
    Material material;
    material.baseColor = Vec4f(0, 0, 0, 1);
    material.emissive = emissive;
    return material;
}

}  // namespace tessera
