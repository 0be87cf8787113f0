// Maps of lights' views: which stay, for how long, and with what in them.
#include "client/draw/passes/ShadowMaps.h"

#include <map>

#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

constexpr std::size_t kMuch = std::size_t{1} << 29;

Aspect sunnyRow() {
    TestScene scene;
    scene.addDirectionalLight({0.1, -1, -0.2}, Vec3f::Ones(), 1, true);
    for (int i = 0; i < 20; ++i) scene.place(scene.add(makeBox({1, 1, 1})), {40.0 * i, 0, -5});
    return scene.take();
}

ScreenCamera cameraAt(double x) {
    View view;
    view.position = Vec3d(x, 0, 0);
    return cameraOf(kSidePx, kSidePx, Vec3d(0, 0, 2), 2, view);
}

class ShadowMapsTest : public testing::Test {
protected:
    void SetUp() override {
        surface_ = makeSurface("osmesa").value();
        ASSERT_TRUE(surface_->makeCurrent());
        gl_ = std::make_unique<GlState>(GlFunctions::load(*surface_).value());
        scene_.update(aspect_, nullptr);
    }
    void begin(ShadowMaps& maps, double x) {
        scene_.beginFrame();
        maps.beginFrame();
        const DrawList list =
            action_.run(scene_, cameraAt(x), {.x = 0, .y = 0, .width = kSidePx, .height = kSidePx}, nullptr);
        EXPECT_TRUE(maps.begin(list.casters));
    }
    /// A frame seen from there: how many maps had to be drawn. Each gets a depth of its own, which is looked for where
    /// it needs none.
    int frame(ShadowMaps& maps, double x) {
        begin(maps, x);
        int drawn = 0;
        for (std::size_t i = 0; i < maps.views(); ++i) {
            const ShadowMaps::Update update = maps.update(i);
            const PixelRect& place = maps.place(i);
            float& depth = depths_[maps.view(i).kin];
            maps.attach(i, false);
            if (update.any) {
                ++drawn;
                depth = static_cast<float>(++drawn_) / 4096;
                gl_->Enable(GL_SCISSOR_TEST);
                gl_->Scissor(place.x, place.y, place.width, place.height);
                gl_->ClearNamedFramebufferfv(maps.framebuffer(), GL_DEPTH, 0, &depth);
                maps.setDrawn(i, update);
            }
            float found = -1;
            gl_->BindFramebuffer(GL_FRAMEBUFFER, maps.framebuffer());
            gl_->ReadPixels(place.x + place.width / 2, place.y + place.height / 2, 1, 1, GL_DEPTH_COMPONENT, GL_FLOAT,
                            &found);
            EXPECT_EQ(found, depth) << "at " << x << (update.any ? ", drawn" : ", found again");
        }
        EXPECT_TRUE(gl_->check("drawing maps"));
        return drawn;
    }
    void nobody(ShadowMaps& maps) {
        maps.beginFrame();
        EXPECT_TRUE(maps.begin(nullptr));
    }

    std::unique_ptr<Surface> surface_;
    std::unique_ptr<GlState> gl_;
    Aspect aspect_ = sunnyRow();
    RenderScene scene_;
    RenderAction action_{CullerKind::kFrustum};
    std::map<std::uint64_t, float> depths_;  ///< by kin
    int drawn_ = 0;
};

TEST_F(ShadowMapsTest, WhoComesBackFindsThemWhileThereIsRoom) {
    ShadowMaps maps(*gl_, kMuch);
    EXPECT_GT(frame(maps, 0), 1);
    EXPECT_GT(frame(maps, 400), 0) << "the finer ones";
    for (int i = 0; i < 5; ++i) EXPECT_EQ(frame(maps, 400), 0);
    EXPECT_EQ(frame(maps, 0), 0);
    EXPECT_EQ(frame(maps, 400), 0);
    // Where there is none the same ones serve both places.
    ShadowMaps few(*gl_, 4 * ShadowMaps::kLayerBytes);
    static_cast<void>(frame(few, 0));
    static_cast<void>(frame(few, 400));
    for (int i = 0; i < 5; ++i) EXPECT_EQ(frame(few, 400), 0);
    EXPECT_GT(frame(few, 0), 0);
    EXPECT_LE(few.bytes(), 4 * ShadowMaps::kLayerBytes);
}

TEST_F(ShadowMapsTest, MemoryOfWhatNobodyAsksForGoes) {
    ShadowMaps maps(*gl_, kMuch);
    static_cast<void>(frame(maps, 0));
    const std::size_t few = maps.bytes();
    EXPECT_GE(few, 2 * ShadowMaps::kLayerBytes);
    for (int x = 1; x < 8; ++x) static_cast<void>(frame(maps, 80 * x));
    EXPECT_GT(maps.bytes(), few);
    EXPECT_LE(maps.bytes(), kMuch / 2);
    for (std::uint64_t i = 0; i < 2 * ShadowMaps::kKeptFrames; ++i) EXPECT_EQ(frame(maps, 560), 0);
    EXPECT_EQ(maps.bytes(), few);
    // Lights that are gone.
    for (std::uint64_t i = 0; i < 2 * ShadowMaps::kKeptFrames; ++i) nobody(maps);
    EXPECT_EQ(maps.bytes(), 0u);
    EXPECT_GT(frame(maps, 560), 1);
}

TEST_F(ShadowMapsTest, MapsOfNobodyTakeWhatTheyMay) {
    ShadowMaps maps(*gl_, kMuch);
    static_cast<void>(frame(maps, 0));
    const std::size_t few = maps.bytes();
    maps.setSpare(few + 2 * ShadowMaps::kLayerBytes);
    // Of the frame before nothing is taken.
    for (int x = 1; x < 8; ++x)
        for (int i = 0; i < 3; ++i) static_cast<void>(frame(maps, 80 * x));
    EXPECT_LE(maps.bytes(), few + 2 * ShadowMaps::kLayerBytes);
    EXPECT_EQ(frame(maps, 480), 0) << "some do stay";
    for (int i = 0; i < 3; ++i) static_cast<void>(frame(maps, 560));
    EXPECT_GT(frame(maps, 80), 0);
    // What there was room for goes when others need it, and soon.
    maps.setSpare(0);
    for (std::uint64_t i = 0; i < 2 * ShadowMaps::kKeptAbove; ++i) static_cast<void>(frame(maps, 80));
    EXPECT_EQ(maps.bytes(), few);
    EXPECT_EQ(frame(maps, 80), 0);
}

TEST_F(ShadowMapsTest, WhatIsForgottenWhileItIsDrawnIsDrawnAgain) {
    ShadowMaps maps(*gl_, kMuch);
    begin(maps, 0);
    ASSERT_GT(maps.views(), 1u);
    const ShadowMaps::Update first = maps.update(0);
    maps.setDrawn(0, first);
    const ShadowMaps::Update second = maps.update(1);
    ASSERT_TRUE(first.any && second.any);
    maps.forget();
    maps.setDrawn(1, second);
    EXPECT_TRUE(maps.update(0).any);
    EXPECT_TRUE(maps.update(1).any);
}

// A renderer says what is left for them.
TEST(ShadowMapsOfARenderer, GiveWayToTheLimitOfGlsMemory) {
    const Aspect aspect = sunnyRow();
    RenderScene scene;
    scene.update(aspect, nullptr);
    std::array<std::size_t, 2> bytes{};
    for (const bool little : {false, true}) {
        const auto surface = makeSurface("osmesa").value();
        const auto renderer =
            Renderer::create(*surface, {.samples = 1, .memoryBytes = little ? std::size_t{1} << 20 : 2 * kMuch})
                .value();
        RenderAction action(CullerKind::kFrustum);
        std::size_t first = 0;
        for (int i = 0; i < 16; ++i) {
            const ScreenCamera camera = cameraAt(80 * (i / 2));
            const PixelRect rect{.x = 0, .y = 0, .width = kSidePx, .height = kSidePx};
            scene.beginFrame();
            renderer->beginFrame();
            ASSERT_TRUE(renderer->draw(aspect, action.run(scene, camera, rect, nullptr), camera, rect));
            if (i == 0) first = renderer->bufferBytes();
        }
        bytes[little] = renderer->bufferBytes() - first;
    }
    EXPECT_GE(bytes[0], 6 * ShadowMaps::kLayerBytes);
    EXPECT_LE(bytes[1], 3 * ShadowMaps::kLayerBytes) << "those of one frame and of the one before";
}

}  // namespace
}  // namespace tessera
