/// A renderer, parts of pictures, and what can be said of them.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "client/draw/passes/Renderer.h"
#include "client/render/order/RenderAction.h"
#include "tests/support/surface/PooledSurface.h"

namespace tessera::test {

struct Stage {
    explicit Stage(int samples)
        : surface(pooledSurface()), renderer(Renderer::create(*surface, {.samples = samples}).value()) {}
    std::unique_ptr<Surface> surface;
    std::unique_ptr<Renderer> renderer;
};

inline Picture drawPart(Stage& stage, const Aspect& aspect, const RenderScene& scene, CullerKind culler,
                        const ScreenCamera& camera, const PixelRect& rect) {
    RenderAction action(culler);
    const auto list = action.run(scene, camera, rect, &stage.renderer->visibility(), nullptr);
    EXPECT_TRUE(list) << list.error().message;
    auto picture = stage.renderer->draw(aspect, list ? *list : DrawList(), camera, rect);
    EXPECT_TRUE(picture) << picture.error().message;
    return picture ? *picture : Picture::filled(rect.width, rect.height, 255, 0, 255);
}

/// The part of a picture that a rectangle with its origin at the lower left names.
inline Picture cropOf(const Picture& whole, const PixelRect& rect) {
    Picture part = Picture::filled(rect.width, rect.height, 0, 0, 0);
    paste(part, whole, -rect.x, -(whole.heightPx - rect.y - rect.height));
    return part;
}

/// How many pixels differ; a plain comparison would print megabytes.
inline std::size_t differingPixels(const Picture& a, const Picture& b) {
    if (a.widthPx != b.widthPx || a.heightPx != b.heightPx) return ~std::size_t{0};
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.rgb.size(); i += 3)
        count += a.rgb[i] != b.rgb[i] || a.rgb[i + 1] != b.rgb[i + 1] || a.rgb[i + 2] != b.rgb[i + 2];
    return count;
}

struct Look {
    double mean = 0, spread = 0;
};
inline Look lookOf(const Picture& picture) {
    Look look;
    for (const std::uint8_t v : picture.rgb) look.mean += v;
    look.mean /= static_cast<double>(picture.rgb.size());
    for (const std::uint8_t v : picture.rgb) look.spread += (v - look.mean) * (v - look.mean);
    look.spread = std::sqrt(look.spread / static_cast<double>(picture.rgb.size()));
    return look;
}

}  // namespace tessera::test
