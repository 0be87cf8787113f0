// Maps of lights' views: which stay, and for how long.
#include "client/draw/passes/ShadowMaps.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

class ShadowMapsTest : public testing::Test {
protected:
    void SetUp() override {
        surface_ = makeSurface("osmesa").value();
        ASSERT_TRUE(surface_->makeCurrent());
        gl_ = std::make_unique<GlState>(GlFunctions::load(*surface_).value());
        TestScene scene;
        scene.addDirectionalLight({0.1, -1, -0.2}, Vec3f::Ones(), 1, true);
        for (int i = 0; i < 20; ++i) scene.place(scene.add(makeBox({1, 1, 1})), {40.0 * i, 0, -5});
        aspect_ = scene.take();
        scene_.update(aspect_, nullptr);
    }
    /// A frame seen from there: how many maps had to be drawn.
    int frame(ShadowMaps& maps, double x) {
        View view;
        view.position = Vec3d(x, 0, 0);
        const ScreenCamera camera = cameraOf(kSidePx, kSidePx, Vec3d(0, 0, 2), 2, view);
        scene_.beginFrame();
        maps.beginFrame();
        const DrawList list =
            action_.run(scene_, camera, {.x = 0, .y = 0, .width = kSidePx, .height = kSidePx}, nullptr);
        EXPECT_TRUE(maps.begin(list.casters));
        int drawn = 0;
        for (std::size_t i = 0; i < maps.views(); ++i) {
            const ShadowMaps::Update update = maps.update(i);
            if (!update.any) continue;
            ++drawn;
            maps.setDrawn(i, update);
        }
        return drawn;
    }
    void nobody(ShadowMaps& maps) {
        maps.beginFrame();
        EXPECT_TRUE(maps.begin(nullptr));
    }

    std::unique_ptr<Surface> surface_;
    std::unique_ptr<GlState> gl_;
    Aspect aspect_;
    RenderScene scene_;
    RenderAction action_{CullerKind::kFrustum};
};

TEST_F(ShadowMapsTest, WhoComesBackFindsThemWhileThereIsRoom) {
    ShadowMaps maps(*gl_, std::size_t{1} << 29);
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
    ShadowMaps maps(*gl_, std::size_t{1} << 29);
    static_cast<void>(frame(maps, 0));
    const std::size_t few = maps.bytes();
    EXPECT_GE(few, 2 * ShadowMaps::kLayerBytes);
    for (int x = 1; x < 8; ++x) static_cast<void>(frame(maps, 80 * x));
    EXPECT_GT(maps.bytes(), few);
    EXPECT_LE(maps.bytes(), std::size_t{1} << 28);
    for (std::uint64_t i = 0; i < 2 * ShadowMaps::kKeptFrames; ++i) EXPECT_EQ(frame(maps, 560), 0);
    EXPECT_EQ(maps.bytes(), few);
    // Lights that are gone.
    for (std::uint64_t i = 0; i < 2 * ShadowMaps::kKeptFrames; ++i) nobody(maps);
    EXPECT_EQ(maps.bytes(), 0u);
    EXPECT_GT(frame(maps, 560), 1);
}

}  // namespace
}  // namespace tessera
