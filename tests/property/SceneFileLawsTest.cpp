/// Any scene is the same when it has been a file, kinds of fields included that no shipped type has.
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include "common/scenefile/SavedReader.h"
#include "common/scenefile/SceneSchema.h"
#include "proto/scene.pb.h"
#include "tests/property/SceneModel.h"
#include "tests/support/SceneStructure.h"

namespace tessera {
namespace {

Aspect randomScene(Random& random) {
    SceneModel model;
    Aspect aspect;
    for (int i = 0; i < 25; ++i) {
        const Expected<void> applied = aspect.apply(model.nextList(random));
        EXPECT_TRUE(applied) << (applied ? "" : applied.error().message);
    }
    return aspect;
}

/// A root of which nothing is said that no root has.
bool rootIsBare(const Aspect& scene) {
    return scene.root().name.empty() && !scene.root().core && scene.root().levels == 0;
}

Expected<Aspect> readBack(const proto::scene::SceneFile& file, const Aspect& scene) {
    std::vector<Blob> blobs;
    for (const std::string& bytes : file.blob()) {
        const ByteSpan content = asBytes(bytes);
        blobs.emplace_back(Bytes(content.begin(), content.end()));
    }
    ChangeListBuilder list;
    const Expected<SavedScene> saved = readSaved(asBytes(file.saved()), blobs, {.firstId = 1000}, list);
    if (!saved) return tl::unexpected(saved.error());
    EXPECT_EQ(saved->notes.size(), rootIsBare(scene) ? 0u : 1u);
    EXPECT_TRUE(saved->later.empty());
    Aspect aspect;
    if (const Expected<void> applied = aspect.apply(list.take()); !applied) return tl::unexpected(applied.error());
    return aspect;
}

void expectSame(const Aspect& scene, const Expected<Aspect>& again) {
    ASSERT_TRUE(again) << again.error().message;
    // A root of which anything is said comes back as a node of its own.
    const ObjectId top = rootIsBare(scene) ? kRootNode : again->root().children.front();
    EXPECT_EQ(structureDifference(scene, *again, kRootNode, top), "");
}

TEST(SceneFileLaw, AnySceneIsTheSameWhenItHasBeenAFile) {
    std::size_t objects = 0;
    for (unsigned seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const Aspect scene = randomScene(random);
        objects += scene.objectCount();
        const Expected<std::string> binary = writeScene(scene, SceneEncoding::kBinary);
        ASSERT_TRUE(binary) << binary.error().message;
        proto::scene::SceneFile file;
        ASSERT_TRUE(file.ParseFromString(*binary));
        expectSame(scene, readBack(file, scene));

        const Expected<std::string> text = writeScene(scene, SceneEncoding::kText);
        ASSERT_TRUE(text) << text.error().message;
        const auto message = SceneSchema::get().newMessage(SceneSchema::get().file());
        ASSERT_TRUE(google::protobuf::TextFormat::ParseFromString(*text, message.get()));
        ASSERT_TRUE(file.ParseFromString(message->SerializeAsString()));
        expectSame(scene, readBack(file, scene));
    }
    EXPECT_GT(objects, 2000u);  // else it has tried nothing
}

TEST(SceneFileLaw, DamagedBytesAreRefusedOrAScene) {
    std::size_t refused = 0;
    for (unsigned seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const Aspect scene = randomScene(random);
        proto::scene::SceneFile whole;
        ASSERT_TRUE(whole.ParseFromString(*writeScene(scene, SceneEncoding::kBinary)));
        for (int i = 0; i < 50; ++i) {
            proto::scene::SceneFile bad = whole;
            std::string& saved = *bad.mutable_saved();
            if (i % 4 == 0)
                saved.resize(below(random, saved.size()));
            else
                for (int flips = 0; flips < i % 4; ++flips)
                    saved[below(random, saved.size())] ^= static_cast<char>(1 << below(random, 8));
            std::vector<Blob> blobs;
            for (const std::string& bytes : bad.blob()) blobs.push_back(Blob::of(std::span<const char>(bytes)));
            ChangeListBuilder list;
            const Expected<SavedScene> read = readSaved(asBytes(saved), blobs, {.firstId = 1000}, list);
            if (!read) {
                ++refused;
                continue;
            }
            // What is not refused is a scene.
            Aspect aspect;
            const Expected<void> applied = aspect.apply(list.take());
            ASSERT_TRUE(applied) << applied.error().message;
        }
    }
    EXPECT_GT(refused, 500u);
}

TEST(SceneFileLaw, TheSchemaNamesEveryFieldOfEveryType) {
    const std::string text = sceneSchemaText();
    for (const TypeInfo& type : allTypes()) {
        EXPECT_NE(text.find(fmt::format("message {} {{", type.name)), std::string::npos) << type.name;
        for (const FieldEntry& field : type.fields)
            EXPECT_NE(text.find(fmt::format(" = {};", field.id.value)), std::string::npos)
                << type.name << " " << field.name;
    }
    EXPECT_NE(text.find("WORD_MINUS_SEVEN = -7;"), std::string::npos);
}

}  // namespace
}  // namespace tessera
