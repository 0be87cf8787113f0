/// Surfaces: what there is, what is refused, and that those on EGL's software draw what OSMesa draws. Each test is a
/// process of its own (ctest), so that a library that one test loads does not meet that of another.
#include <gtest/gtest.h>

#include "client/draw/passes/Renderer.h"
#include "client/draw/surface/Surface.h"
#include "tests/support/words/Words.h"

namespace tessera::test {
namespace {

bool says(const Error& error, std::string_view words) {
    return error.message.find(words) != std::string::npos;
}

TEST(Surface, OtherNamesAreRefusedAndThoseThatThereAreAreSaid) {
    for (const char* name : {"", "vulkan", "OSMESA", "egl ", "none"}) {
        const auto surface = makeSurface(name);
        ASSERT_FALSE(surface) << name;
        EXPECT_EQ(surface.error().code, ErrorCode::kUnsupported);
        EXPECT_WORDS(surface.error().message);
    }
}

TEST(Surface, OsmesaHasNoDevices) {
    const auto surface = makeSurface("osmesa", {.device = 0});
    ASSERT_FALSE(surface);
    EXPECT_EQ(surface.error().code, ErrorCode::kUsage);
    EXPECT_WORDS(surface.error().message);
}

TEST(Surface, ADeviceThatIsNotThereIsRefusedAndTheOthersAreNamed) {
    for (const int device : {63, 1'000'000, -2}) {
        const auto surface = makeSurface("egl", {.device = device});
        ASSERT_FALSE(surface) << device;
        EXPECT_EQ(surface.error().code, ErrorCode::kUnsupported);
        EXPECT_TRUE(says(surface.error(), "0: ")) << surface.error().message;
        EXPECT_TRUE(says(surface.error(), std::to_string(device))) << surface.error().message;
    }
}

TEST(Surface, TheFirstDeviceOfEglGivesOpenGlAndIsNamed) {
    const auto surface = makeSurface("egl", {.device = 0});
    ASSERT_TRUE(surface) << surface.error().message;
    EXPECT_TRUE((*surface)->description().starts_with("EGL on device 0 (")) << (*surface)->description();
    ASSERT_TRUE((*surface)->makeCurrent());
    EXPECT_EQ((*surface)->description().find("not current"), std::string::npos) << (*surface)->description();
}

TEST(Surface, SeveralOnOneDeviceDrawAndEndIndependently) {
    auto first = makeSurface("egl").value();
    std::uint64_t alone = 0;
    {
        auto second = makeSurface("egl").value();
        const auto mine = Renderer::create(*first, {}).value();
        {
            const auto other = Renderer::create(*second, {}).value();
            alone = mine->pixelProbe().value();
            EXPECT_EQ(alone, other->pixelProbe().value());
        }
        second.reset();
        EXPECT_EQ(alone, mine->pixelProbe().value());
    }
    ASSERT_TRUE(first->makeCurrent());
    EXPECT_EQ(alone, Renderer::create(*first, {}).value()->pixelProbe().value());
}

}  // namespace
}  // namespace tessera::test
