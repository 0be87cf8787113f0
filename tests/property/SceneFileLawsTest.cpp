/// Any scene is the same when it has been a file, kinds of fields included that no shipped type has.
#include <gtest/gtest.h>

#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "common/base/Utf8.h"
#include "common/scenefile/ArraysFile.h"
#include "common/scenefile/SavedReader.h"
#include "common/scenefile/SavedText.h"
#include "common/scenefile/TextForm.h"
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

std::string contentOf(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

/// Of one test, which others may run beside, and gone with it.
class Folder {
public:
    Folder() : path_(testing::TempDir() + "scene-file-law-XXXXXX") {
        if (::mkdtemp(path_.data()) == nullptr) std::abort();
        path_ += '/';
    }
    ~Folder() { std::filesystem::remove_all(path_); }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    [[nodiscard]] std::string operator/(std::string_view name) const { return path_ + std::string(name); }

private:
    std::string path_;
};

/// As the reader of files does it.
Expected<proto::scene::SceneFile> readText(const std::string& text, const Folder& folder) {
    const Expected<std::optional<SavedPart>> part = findSavedPart(text);
    if (!part || !*part) return fail(ErrorCode::kBadInput, "no part of it was saved");
    Expected<SavedText> saved = readSavedText(text, **part, {.beside = [&](const std::string& name) -> Expected<Bytes> {
                                                  const std::string content = contentOf(folder / name);
                                                  const ByteSpan bytes = asBytes(content);
                                                  return Bytes(bytes.begin(), bytes.end());
                                              }});
    if (!saved) return tl::unexpected(saved.error());
    EXPECT_TRUE(saved->notes.empty()) << saved->notes.front();
    proto::scene::SceneFile file;
    file.set_saved(std::move(saved->saved));
    for (const Bytes& array : saved->arrays) file.add_blob(std::string(asText(array)));
    return file;
}

void expectSame(const Aspect& scene, const Expected<Aspect>& again) {
    ASSERT_TRUE(again) << again.error().message;
    // A root of which anything is said comes back as a node of its own.
    const ObjectId top = rootIsBare(scene) ? kRootNode : again->root().children.front();
    EXPECT_EQ(structureDifference(scene, *again, kRootNode, top), "");
}

/// Whatever a system takes as a name: quotes, backslashes, ends of lines, Latin-1, what is not seen, too long, hidden.
const std::vector<std::string>& fileNames() {
    static const std::vector<std::string> names = {"law.tsct",
                                                   "q\"x.tsct",
                                                   "b\\x.tsct",
                                                   "b\\.tsct",
                                                   "line\nbreak.tsct",
                                                   "lat\xe9.tsct",
                                                   "del\x7f\x1b.tsct",
                                                   "a # { '.tsct",
                                                   ".tsct",
                                                   "grüße\u202e.tsct",
                                                   std::string(230, 'x') + ".tsct",
                                                   "\xff.tsct"};
    return names;
}

TEST(SceneFileLaw, AnySceneIsTheSameWhenItHasBeenAFile) {
    const Folder folder;
    std::size_t objects = 0, withArrays = 0;
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
        const Expected<proto::scene::SceneFile> nested = readText(*text, folder);
        ASSERT_TRUE(nested) << nested.error().message << "\n" << *text;
        const Expected<Aspect> again = readBack(*nested, scene);
        expectSame(scene, again);
        EXPECT_TRUE(!rootIsBare(scene) || *writeScene(*again, SceneEncoding::kBinary) == *binary);
        const std::string path = folder / "law.tsct";
        std::string arrays;
        ASSERT_TRUE(saveScene(path, scene, {}, &arrays));
        const Expected<proto::scene::SceneFile> beside = readText(contentOf(path), folder);
        ASSERT_TRUE(beside) << beside.error().message << "\n" << *text;
        expectSame(scene, readBack(*beside, scene));
        withArrays += arrays.empty() ? 0 : 1;
    }
    EXPECT_GT(objects, 2000u);  // else it has tried nothing
    EXPECT_GT(withArrays, 3u);  // most have a few bytes each, which stand in place
}

TEST(SceneFileLaw, ATextAndItsArraysBelongTogetherWhateverTheFileIsCalled) {
    std::size_t withArrays = 0;
    for (unsigned seed = 0; seed < 40; ++seed) {
        Random random(seed);
        const Aspect scene = randomScene(random);
        const Folder folder;
        for (const std::string& name : fileNames()) {
            SCOPED_TRACE(fmt::format("{}: {}", seed, name));
            std::string arrays;
            const Expected<void> saved = saveScene(folder / name, scene, {}, &arrays);
            ASSERT_TRUE(saved) << saved.error().message;
            const std::string text = contentOf(folder / name);
            const Expected<proto::scene::SceneFile> again = readText(text, folder);
            ASSERT_TRUE(again) << again.error().message << "\n" << text;
            expectSame(scene, readBack(*again, scene));
            EXPECT_TRUE(isUtf8(text));
            if (arrays.empty()) continue;
            ++withArrays;
            EXPECT_EQ(folder / arraysNamedIn(text), arrays);
            // The next save knows them as its own.
            ASSERT_TRUE(saveScene(folder / name, Aspect()));
            EXPECT_FALSE(std::filesystem::exists(arrays));
        }
        if (withArrays > 2 * fileNames().size()) break;
    }
    EXPECT_GT(withArrays, fileNames().size());
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

TEST(SceneFileLaw, DamagedTextsAreRefusedWithTheirPlaceOrAScene) {
    std::size_t refused = 0;
    for (unsigned seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const std::string whole = *writeScene(randomScene(random), SceneEncoding::kText);
        const std::size_t begin = whole.find("saved {");
        for (int i = 0; i < 50; ++i) {
            std::string bad = whole;
            const std::size_t at = begin + 7 + below(random, bad.size() - begin - 7);
            if (i % 5 == 0) {
                bad.resize(at);
            } else if (i % 5 == 1) {
                // A line once more, or not at all.
                const std::size_t from = bad.rfind('\n', at), to = bad.find('\n', at);
                if (to == std::string::npos) continue;
                if (i % 2)
                    bad.insert(to, bad.substr(from, to - from));
                else
                    bad.erase(from, to - from);
            } else {
                for (int flips = 0; flips < i % 5; ++flips)
                    bad[begin + 7 + below(random, bad.size() - begin - 7)] ^= static_cast<char>(1 << below(random, 7));
            }
            const Expected<std::optional<SavedPart>> part = findSavedPart(bad);
            if (!part || !*part) continue;
            const Expected<SavedText> saved = readSavedText(bad, **part, {});
            if (!saved) {
                ++refused;
                EXPECT_NE(saved.error().message.find(':'), std::string::npos);
                EXPECT_TRUE(std::isdigit(static_cast<unsigned char>(saved.error().message[0])))
                    << saved.error().message;
                continue;
            }
            std::vector<Blob> blobs;
            for (const Bytes& array : saved->arrays) blobs.emplace_back(array);
            ChangeListBuilder list;
            const Expected<SavedScene> read = readSaved(asBytes(saved->saved), blobs, {.firstId = 1000}, list);
            if (!read) continue;
            Aspect aspect;
            const Expected<void> applied = aspect.apply(list.take());
            ASSERT_TRUE(applied) << applied.error().message;
        }
    }
    EXPECT_GT(refused, 500u);
}

TEST(SceneFileLaw, NoTypeOrFieldIsCalledAsAWordOfTheText) {
    for (const TypeInfo& type : allTypes()) {
        const std::string word = textform::wordOf(type);
        for (const std::string_view reserved :
             {textform::kSaved, textform::kRoot, textform::kUnplaced, textform::kArrays, textform::kArray,
              textform::kId, textform::kCore, std::string_view("object")})
            EXPECT_NE(word, reserved);
        EXPECT_FALSE(word.starts_with("later")) << "a flat text begins so";
        for (const FieldEntry& field : type.fields) EXPECT_NE(snakeCase(field.name), textform::kId) << type.name;
        for (const FieldEntry& field : findType(typeOf<Node>())->fields) EXPECT_NE(snakeCase(field.name), word);
        EXPECT_LE(type.fields.size(), 64u) << "the reader's bits of what is there twice";
    }
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
