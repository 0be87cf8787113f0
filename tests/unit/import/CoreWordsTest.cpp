/// Cores that a scene text writes in the words of the table of types.
#include <gtest/gtest.h>

#include "common/cores/Material.h"
#include "common/cores/ParticleEmitter.h"
#include "common/cores/Particles.h"
#include "common/cores/Text.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

Expected<ImportedScene> importCore(const std::string& text) {
    const Scratch scratch;
    return importScene(scratch.write("core.tsct", text), kRootNode, importOptions());
}

std::string coreTrouble(const std::string& text) {
    const Expected<ImportedScene> scene = importCore(text);
    return scene ? "" : scene.error().message;
}

TEST(CoreWords, AreThoseOfTheTableAndTheMaterialIsTheNodes) {
    Expected<ImportedScene> scene = importCore(R"(
        material { name: "drops" base_color { r: 0.5 g: 0.7 b: 1 } }
        node { name: "bare" core { particle_emitter {} } }
        node { name: "fountain" material: "drops" transform { translation { x: 1 } }
          core { particle_emitter { rate: 200 place: PLACE_DISC mode: MODE_LINES acceleration: [0, -9.8, 0]
            begin_color: [1, 0.5, 0.25, 1] playing: false seed: 7 } } })");
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_TRUE(scene->notes.empty()) << scene->notes.front();
    const ImportedAspect aspect(std::move(*scene));
    const auto* emitter = aspect.core<ParticleEmitter>("/fountain/core");
    ASSERT_NE(emitter, nullptr);
    EXPECT_EQ(emitter->rate, 200);
    EXPECT_EQ(emitter->place, ParticleEmitter::kDisc);
    EXPECT_EQ(emitter->mode, ParticleEmitter::kLines);
    EXPECT_EQ(emitter->acceleration, Vec3d(0, -9.8, 0));
    EXPECT_EQ(emitter->beginColor, Vec4f(1, 0.5F, 0.25F, 1));
    EXPECT_FALSE(emitter->playing);
    EXPECT_EQ(emitter->seed, 7);
    EXPECT_EQ(emitter->life, ParticleEmitter().life) << "what is not said is as in a fresh one";
    EXPECT_TRUE(emitter->material);
    const auto* bare = aspect.core<ParticleEmitter>("/bare");
    ASSERT_NE(bare, nullptr);
    EXPECT_FALSE(bare->material);
}

TEST(CoreWords, WhatIsWrongIsNamedWithItsPlace) {
    EXPECT_WORDS(coreTrouble("\nnode { core { particle_emitter { rat: 5 } } }"));
    EXPECT_WORDS(coreTrouble("\n\n  node { core { particle_emitter { rate: 1000 life: 100 } } }"));
    EXPECT_WORDS(coreTrouble("node { core { particle_emitter { rate: -5 } } }"));
    EXPECT_WORDS(coreTrouble("node { core {} }"));
    EXPECT_WORDS(coreTrouble("node { core { particle_emitter { material: 5 } } }"));
}

TEST(CoreWords, ANumberThatIsNoWordIsLeftOutAndNamed) {
    Expected<ImportedScene> scene =
        importCore("\n node { name: \"bare\" core { particle_emitter { place: 7 rate: 5 } } }");
    ASSERT_TRUE(scene) << messageOf(scene);
    ASSERT_EQ(scene->notes.size(), 1u);
    EXPECT_WORDS(scene->notes[0]);
    const ImportedAspect aspect(std::move(*scene));
    EXPECT_EQ(aspect.core<ParticleEmitter>("/bare")->place, ParticleEmitter().place);
}

// A text without letters and a cloud without points are no bytes both.
TEST(CoreWords, KindsThatAreTheSameBytesAreCoresOfTheirOwn) {
    Expected<ImportedScene> scene = importCore(R"(
        node { name: "word" text {} }
        node { name: "cloud" particles {} }
        node { name: "again" particles {} })");
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect(std::move(*scene));
    EXPECT_NE(aspect.core<Text>("/word"), nullptr);
    ASSERT_NE(aspect.core<Particles>("/cloud"), nullptr);
    EXPECT_EQ(aspect.core<Particles>("/again"), aspect.core<Particles>("/cloud")) << "of one kind they are shared";
}

/// One way to write each thing: what has a message has no words here.
TEST(CoreWords, AreOnlyOfTypesWithoutAMessage) {
    EXPECT_WORDS(coreTrouble("node { core { point_light {} } }"));
}

}  // namespace
}  // namespace tessera
