/// What is uploaded when: several tiles under one budget, and what comes ahead of need. All by counts of bytes.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "client/draw/passes/UploadAhead.h"
#include "client/draw/store/MeshBuffers.h"
#include "tests/unit/draw/RendererStage.h"

namespace tessera {
namespace {

class BudgetTest : public RendererTest {
protected:
    /// A wall of four tiles side by side; a ball of its own, with an image of its own, before each of them, `variant`
    /// of it.
    static Aspect rowOfBalls(int variant, bool images) {
        TestScene scene;
        scene.setDark();
        for (int i = 0; i < 4; ++i) {
            Material material = unlit(Vec3f::Constant(0.5f));
            if (images) {
                std::vector<std::uint8_t> pixels(64 * 64 * 4, static_cast<std::uint8_t>(17 * i + variant));
                material.baseColorImage = scene.addImage(Blob::of(std::span<const std::uint8_t>(pixels)), 64, 64);
            }
            scene.place(scene.add(makeSphere(0.2 + 0.001 * (4 * variant + i), 24), scene.add(material)),
                        {-1.2 + 0.8 * i, 0, 0});
        }
        return scene.take();
    }
    struct Bytes {
        std::uint64_t meshes = 0, images = 0;
    };
    /// One frame: the four tiles.
    Bytes frame(const Aspect& aspect) {
        const ScreenCamera camera = cameraOf(256, 64);
        RenderScene scene;
        scene.update(aspect, nullptr);
        const Bytes before{renderer_->uploadedMeshBytes(), renderer_->uploadedTextureBytes()};
        renderer_->beginFrame();
        for (int tile = 0; tile < 4; ++tile) {
            const PixelRect rect{.x = 64 * tile, .y = 0, .width = 64, .height = 64};
            const DrawList list = RenderAction(CullerKind::kFrustum).run(scene, camera, rect, nullptr);
            EXPECT_EQ(list.opaque.size(), 1u);
            EXPECT_TRUE(renderer_->draw(aspect, list, camera, rect));
        }
        return {renderer_->uploadedMeshBytes() - before.meshes, renderer_->uploadedTextureBytes() - before.images};
    }
    /// Of one ball, of one image.
    Bytes ofOne() {
        restart({.samples = 1});
        const Bytes four = frame(rowOfBalls(0, true));
        return {four.meshes / 4, four.images / 4};
    }
};

TEST_F(BudgetTest, WhatOneFrameNeedsStaysWhereAllOfItFits) {
    const Bytes one = ofOne();
    // Room for the four, and no more than half of another one's.
    restart({.samples = 1, .meshBudgetBytes = one.meshes * 9 / 2, .textureBudgetBytes = one.images * 9 / 2});
    for (int variant = 0; variant < 4; ++variant) {
        const Aspect aspect = rowOfBalls(variant, true);
        (void)frame(aspect);
        // What was drawn before has given way by then, and nothing that the frame needs.
        for (int i = 0; i < 3; ++i) {
            const Bytes again = frame(aspect);
            EXPECT_EQ(again.meshes, 0u) << variant;
            EXPECT_EQ(again.images, 0u) << variant;
        }
    }
}

TEST_F(BudgetTest, FramesThatDrawNothingForgetNothing) {
    const Bytes one = ofOne();
    // Half of what a frame needs.
    restart({.samples = 1, .meshBudgetBytes = 2 * one.meshes, .textureBudgetBytes = 2 * one.images});
    const Aspect aspect = rowOfBalls(0, true);
    const ScreenCamera camera = cameraOf(256, 64);
    RenderScene scene;
    scene.update(aspect, nullptr);
    const DrawList list = RenderAction(CullerKind::kFrustum).run(scene, camera, whole(camera), nullptr);
    const auto pictureAfter = [&](int stillFrames) {
        for (int i = 0; i <= stillFrames; ++i) renderer_->beginFrame();
        EXPECT_TRUE(renderer_->draw(aspect, list, camera, whole(camera)));
        return renderer_->uploadedMeshBytes() + renderer_->uploadedTextureBytes();
    };
    const std::uint64_t first = pictureAfter(0);
    for (const int still : {0, 1, 2, 10, 0}) EXPECT_EQ(pictureAfter(still), first) << still << " frames of rest";
}

TEST_F(BudgetTest, WhatNobodyDrawsAnyMoreGoesAtRest) {
    const Bytes one = ofOne();
    restart({.samples = 1, .meshBudgetBytes = 2 * one.meshes, .textureBudgetBytes = 2 * one.images});
    const ScreenCamera camera = cameraOf(256, 64);
    const auto show = [&](const Aspect& aspect) {
        RenderScene scene;
        scene.update(aspect, nullptr);
        renderer_->beginFrame();
        const DrawList list = RenderAction(CullerKind::kFrustum).run(scene, camera, whole(camera), nullptr);
        EXPECT_TRUE(renderer_->draw(aspect, list, camera, whole(camera)));
    };
    TestScene empty;
    empty.setDark();
    show(rowOfBalls(0, true));
    show(empty.take());
    EXPECT_GT(renderer_->residentBytes(), 2 * (one.meshes + one.images)) << "they might have been needed";
    for (int i = 0; i < 2; ++i) renderer_->beginFrame();
    EXPECT_LE(renderer_->residentBytes(), 2 * (one.meshes + one.images));
}

TEST_F(BudgetTest, TilesInTurnUploadAsLittleAsCanBe) {
    const Bytes one = ofOne();
    for (const std::uint64_t room : {1u, 2u, 3u}) {
        restart({.samples = 1,
                 .meshBudgetBytes = one.meshes * room + one.meshes / 2,
                 .textureBudgetBytes = one.images * room + one.images / 2});
        const Aspect aspect = rowOfBalls(0, true);
        for (int i = 0; i < 4; ++i) (void)frame(aspect);
        // `room` of them are there when a tile begins: it may find its own among them. By last use it never would.
        Bytes sum;
        constexpr int kFrames = 12;
        for (int i = 0; i < kFrames; ++i) {
            const Bytes bytes = frame(aspect);
            sum.meshes += bytes.meshes;
            sum.images += bytes.images;
        }
        EXPECT_LE(sum.meshes, kFrames * (4 - room) * one.meshes + one.meshes) << room;
        EXPECT_LE(sum.images, kFrames * (4 - room) * one.images + one.images) << room;
        EXPECT_GT(sum.meshes, 0u);
    }
}

/// Triangles, lines and points of many sizes all around, some with images, some shared.
Aspect allAround(unsigned seed) {
    std::mt19937 random(seed);
    const auto any = [&](double from, double to) { return std::uniform_real_distribution<double>(from, to)(random); };
    TestScene scene;
    for (int i = 0; i < 40; ++i) {
        Material material;
        material.baseColor = Vec4f(static_cast<float>(any(0, 1)), 0.5f, 0.5f, i % 9 ? 1 : 0.5f);
        if (i % 3 == 0) {
            std::vector<std::uint8_t> pixels(32 * 32 * 4, static_cast<std::uint8_t>(64 + 3 * i));
            material.baseColorImage = scene.addImage(Blob::of(std::span<const std::uint8_t>(pixels)), 32, 32);
        }
        MeshData mesh = makeSphere(0.3 + 0.01 * i, 8 + static_cast<int>(random() % 60));
        if (i % 5 == 1) {
            mesh.primitive = Primitive::kPoints;
            mesh.indices.clear();
            mesh.pointRadius = i % 2 ? 0.02 : 0;
        } else if (i % 5 == 2) {
            const std::array<Vec3d, 2> ends{Vec3d(-0.3, 0, 0), Vec3d(0.3, 0.001 * i, 0)};
            mesh = test::makeLines(ends, 3);
        }
        const ObjectId core = scene.add(mesh, scene.add(material));
        for (int k = 0; k < 3; ++k) scene.place(core, {any(-8, 8), any(-2, 2), any(-8, 12)});
    }
    scene.addDirectionalLight({0.3, -0.6, -0.7}, Vec3f::Ones(), 1.5f);
    return scene.take();
}

// A failing seed: TESSERA_SEED=N build/bin/unit_draw --gtest_filter='BudgetTest.WhatComes*'.
TEST_F(BudgetTest, WhatComesAheadOfNeedIsThereAndChangesNoPicture) {
    const char* one = std::getenv("TESSERA_SEED");
    const unsigned from = one ? static_cast<unsigned>(std::atoi(one)) : 0;
    for (unsigned seed = from; seed < from + (one ? 1 : 6); ++seed) {
        SCOPED_TRACE(seed);
        const Aspect aspect = allAround(seed);
        RenderScene scene;
        scene.update(aspect, nullptr);
        const auto at = [&](double turn) {
            View view;
            view.orientation = Quatd(Eigen::AngleAxisd(turn, Vec3d::UnitY()));
            return cameraOf(160, 120, {0, 0, 2.4}, 3.2, view);
        };
        const auto draw = [&](double turn) {
            const DrawList list = RenderAction(CullerKind::kFrustum).run(scene, at(turn), whole(at(turn)), nullptr);
            return renderer_->draw(aspect, list, at(turn), whole(at(turn))).value();
        };
        const auto uploaded = [&] { return renderer_->uploadedMeshBytes() + renderer_->uploadedTextureBytes(); };
        restart({.samples = 1});
        std::vector<Picture> expected;
        std::vector<std::uint64_t> needed;
        for (const double turn : {0.0, 1.5, 3.0, 4.5}) {
            const std::uint64_t before = uploaded();
            expected.push_back(draw(turn));
            needed.push_back(uploaded() - before);
        }
        EXPECT_GT(needed[1] + needed[2] + needed[3], 100'000u) << "turning around shows nothing new";
        for (const bool interrupted : {false, true}) {
            restart({.samples = 1});
            EXPECT_EQ(draw(0), expected[0]);
            UploadAhead ahead;
            const std::size_t slice = 1000 + 7001 * (seed % 3);
            int steps = 0;
            for (bool more = true; more && steps < 100'000; ++steps) {
                const std::uint64_t before = uploaded();
                more = ahead.step(*renderer_, aspect, scene, at(0).eyeWorld, slice).value();
                // One image, one element more.
                EXPECT_LE(uploaded() - before, slice + 32 * 32 * 4 / 3 * 4 + 1000);
                if (interrupted && steps == 20) {
                    EXPECT_EQ(draw(1.5), expected[1]) << "in the middle of it";
                }
            }
            EXPECT_GT(steps, 20);
            EXPECT_FALSE(ahead.step(*renderer_, aspect, scene, at(0).eyeWorld, slice).value());
            const std::uint64_t before = uploaded();
            EXPECT_EQ(draw(1.5), expected[1]);
            EXPECT_EQ(draw(3.0), expected[2]);
            EXPECT_EQ(draw(4.5), expected[3]);
            EXPECT_EQ(uploaded(), before) << "all was there";
        }
    }
}

TEST_F(BudgetTest, NothingIsThrownOutForWhatComesAhead) {
    const Aspect aspect = allAround(3);
    RenderScene scene;
    scene.update(aspect, nullptr);
    const ScreenCamera camera = cameraOf(160, 120);
    const auto draw = [&] {
        const DrawList list = RenderAction(CullerKind::kFrustum).run(scene, camera, whole(camera), nullptr);
        return renderer_->draw(aspect, list, camera, whole(camera)).value();
    };
    (void)draw();
    const std::size_t needed = renderer_->residentBytes();
    restart({.samples = 1, .meshBudgetBytes = needed + needed / 4, .textureBudgetBytes = needed + needed / 4});
    const Picture expected = draw();
    UploadAhead ahead;
    for (int i = 0; i < 10'000 && ahead.step(*renderer_, aspect, scene, camera.eyeWorld, 10'000).value(); ++i) {
    }
    EXPECT_GT(renderer_->residentBytes(), needed);
    EXPECT_LE(renderer_->residentBytes(), 2 * (needed + needed / 4));
    const std::uint64_t before = renderer_->uploadedMeshBytes() + renderer_->uploadedTextureBytes();
    EXPECT_EQ(draw(), expected);
    EXPECT_EQ(renderer_->uploadedMeshBytes() + renderer_->uploadedTextureBytes(), before);
}

/// So many things of each kind that lies in GL in a way of its own, in a row, from `first` on.
Aspect ofAllKinds(int first, int count) {
    TestScene scene;
    scene.setEnvironment(Vec3f::Constant(0.4f), Vec3f::Constant(0.2f), Vec3f::Zero());
    scene.addDirectionalLight({0.3, -0.6, -0.7}, Vec3f::Ones(), 1.5f);
    Material rough;
    std::vector<std::uint8_t> pixels(32 * 32 * 4, 200);
    for (std::size_t i = 0; i < pixels.size(); i += 12) pixels[i] = 90;
    rough.normalImage = scene.addImage(Blob::of(std::span<const std::uint8_t>(pixels)), 32, 32);
    const ObjectId mapped = scene.add(rough);
    for (int i = first; i < first + count; ++i) {
        const Vec3d at(0.13 * (i % 11) - 0.7, 0.17 * (i % 7) - 0.6, -2.0 - 0.01 * i);
        MeshData ball = makeSphere(0.2 + 0.001 * i, 24);
        scene.place(scene.add(ball), at);
        scene.place(scene.add(ball, mapped), at + Vec3d(0.1, 0.3, -0.3));
        ball.primitive = Primitive::kPoints;
        ball.indices.clear();
        ball.pointRadius = 0.01;
        scene.place(scene.add(ball), at + Vec3d(0.2, 0.2, 0.2));
        const std::array<Vec3d, 2> ends{Vec3d(-0.3, 0.01 * i, 0), Vec3d(0.3, 0, 0)};
        scene.place(scene.add(test::makeLines(ends, 3)), at);
        Glyphs glyphs;
        const std::array<float, 6> places{0, 0.02f * static_cast<float>(i % 9), 0, 0.1f, 0, 0};
        glyphs.positions = Blob::of(std::span<const float>(places));
        glyphs.size = 0.1;
        scene.place(scene.addCore(glyphs), at + Vec3d(-0.2, 0, 0.3));
    }
    return scene.take();
}

// What is allocated counts: buffers do not grow to twice what the budget bears, and give back what is free once a large
// scene is gone. What moves within them by that is drawn as it was.
TEST_F(BudgetTest, BuffersStayNearTheBudgetAndGiveBackWhatIsFree) {
    const ScreenCamera camera = cameraOf(64, 64);
    const Aspect few = ofAllKinds(57, 3), many = ofAllKinds(0, 60);
    const Picture ofFew = draw(few, camera);
    const std::size_t needed = renderer_->residentBytes();
    restart({.samples = 1});
    const Picture ofMany = draw(many, camera);
    const std::size_t large = renderer_->residentBytes(), beside = renderer_->bufferBytes();
    EXPECT_GT(large, 10 * needed);
    const std::size_t budget = beside + large / 2;
    restart({.samples = 1, .memoryBytes = budget});
    for (int round = 0; round < 3; ++round) {
        SCOPED_TRACE(round);
        EXPECT_EQ(draw(many, camera), ofMany);
        EXPECT_GT(renderer_->lastCounts().memoryBytes, budget) << "what one draw needs is there";
        EXPECT_EQ(draw(many, camera), ofMany);
        EXPECT_LE(renderer_->lastCounts().memoryBytes, beside + large / 4 * 5);
        // The frame before is expected again: it gives way in the second one that does without it, and its room after
        // the last frames.
        for (std::size_t i = 0; i < 2 + MeshBuffers::kRecentFrames; ++i) {
            EXPECT_EQ(draw(few, camera), ofFew) << "though it has moved";
        }
        EXPECT_LE(renderer_->lastCounts().memoryBytes, budget + budget / 8);
    }
}

// Meshes may have what images do not need, and the other way round.
TEST_F(BudgetTest, MeshesAndImagesShareOneBudget) {
    const ScreenCamera camera = cameraOf(64, 64);
    const Aspect meshes = ofAllKinds(0, 60);
    TestScene built;
    built.setDark();
    for (int i = 0; i < 60; ++i) {
        Material material = unlit(Vec3f::Constant(0.5f));
        std::vector<std::uint8_t> pixels(128 * 128 * 4, static_cast<std::uint8_t>(4 * i));
        material.baseColorImage = built.addImage(Blob::of(std::span<const std::uint8_t>(pixels)), 128, 128);
        built.place(built.add(makeSheet(0.2, 0.2), built.add(material)), {0.1 * (i % 9) - 0.4, 0.1 * (i / 9), -2});
    }
    const Aspect images = built.take();
    const Picture ofMeshes = draw(meshes, camera);
    const std::size_t inMeshes = renderer_->residentBytes();
    restart({.samples = 1});
    const Picture ofImages = draw(images, camera);
    const std::size_t inImages = renderer_->residentBytes();
    EXPECT_GT(inImages, inMeshes / 2);
    EXPECT_GT(inMeshes, inImages / 2);
    const std::size_t budget = renderer_->bufferBytes() + std::max(inMeshes, inImages) / 4 * 5;
    restart({.samples = 1, .memoryBytes = budget});
    for (int round = 0; round < 3; ++round) {
        SCOPED_TRACE(round);
        for (std::size_t i = 0; i < 2 + MeshBuffers::kRecentFrames; ++i) {
            EXPECT_EQ(draw(meshes, camera), ofMeshes);
        }
        EXPECT_LE(renderer_->lastCounts().memoryBytes, budget + budget / 8);
        const std::uint64_t before = renderer_->uploadedMeshBytes();
        EXPECT_EQ(draw(meshes, camera), ofMeshes);
        EXPECT_EQ(renderer_->uploadedMeshBytes(), before) << "there is room for all of them";
        for (std::size_t i = 0; i < 2 + MeshBuffers::kRecentFrames; ++i) {
            EXPECT_EQ(draw(images, camera), ofImages);
        }
        EXPECT_LE(renderer_->lastCounts().memoryBytes, budget + budget / 8);
        EXPECT_EQ(renderer_->lastCounts().memoryBudget, budget);
    }
}

// Two tiles that each need more than half of the budget, in turn: what is exchanged is what must be, and no buffer is
// copied for it once they are as large as both need.
TEST_F(BudgetTest, TilesInTurnAboveTheBudgetCopyNoBuffers) {
    const ScreenCamera camera = cameraOf(64, 64);
    const Aspect one = ofAllKinds(0, 40), other = ofAllKinds(40, 40);
    const Picture ofOne = draw(one, camera);
    const std::size_t needed = renderer_->residentBytes(), beside = renderer_->bufferBytes();
    const Picture ofOther = draw(other, camera);
    restart({.samples = 1, .memoryBytes = beside + needed / 7 * 10});
    const auto frame = [&] {
        renderer_->beginFrame();
        EXPECT_EQ(draw(one, camera), ofOne);
        EXPECT_EQ(draw(other, camera), ofOther);
    };
    for (int i = 0; i < 6; ++i) frame();
    const std::uint64_t copies = renderer_->lastCounts().bufferCopies, uploaded = renderer_->uploadedMeshBytes();
    for (int i = 0; i < 8; ++i) frame();
    EXPECT_EQ(renderer_->lastCounts().bufferCopies, copies);
    EXPECT_GT(renderer_->uploadedMeshBytes(), uploaded) << "there is room for both of them";
    // Once one of them is gone, so is its room.
    for (std::size_t i = 0; i < 2 + MeshBuffers::kRecentFrames; ++i) {
        renderer_->beginFrame();
        EXPECT_EQ(draw(one, camera), ofOne);
    }
    EXPECT_LE(renderer_->lastCounts().memoryBytes, renderer_->lastCounts().memoryBudget);
}

// Of all that is there, dead images go before meshes that are drawn again.
TEST_F(BudgetTest, WhatNobodyDrawsGoesFirstWhateverItIs) {
    const ScreenCamera camera = cameraOf(64, 64);
    const Aspect one = ofAllKinds(0, 30), other = ofAllKinds(30, 30);
    TestScene built;
    built.setDark();
    for (int i = 0; i < 20; ++i) {
        Material material = unlit(Vec3f::Constant(0.5f));
        std::vector<std::uint8_t> pixels(128 * 128 * 4, static_cast<std::uint8_t>(4 * i));
        material.baseColorImage = built.addImage(Blob::of(std::span<const std::uint8_t>(pixels)), 128, 128);
        built.place(built.add(makeSheet(0.2, 0.2), built.add(material)), {0.1 * (i % 9) - 0.4, 0.1 * (i / 9), -2});
    }
    const Aspect images = built.take();
    (void)draw(images, camera);
    const std::size_t inImages = renderer_->residentBytes();
    restart({.samples = 1});
    (void)draw(one, camera);
    (void)draw(other, camera);
    const std::size_t inMeshes = renderer_->residentBytes();
    EXPECT_GT(inImages, inMeshes / 4);
    restart({.samples = 1, .memoryBytes = renderer_->bufferBytes() + inMeshes / 8 * 11});
    const auto frame = [&](bool withImages) {
        renderer_->beginFrame();
        (void)draw(one, camera);
        (void)draw(other, camera);
        if (withImages) (void)draw(images, camera);
    };
    frame(false);
    frame(true);
    const std::uint64_t uploaded = renderer_->uploadedMeshBytes();
    for (int i = 0; i < 4; ++i) frame(false);
    EXPECT_EQ(renderer_->uploadedMeshBytes(), uploaded);
}

}  // namespace
}  // namespace tessera
