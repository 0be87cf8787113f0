/// What an application may have the server read.
#include <gtest/gtest.h>

#include <fstream>

#include "server/import/AssetFolders.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

class ReadableFiles : public testing::Test {
protected:
    ReadableFiles() {
        std::string pattern = testing::TempDir() + "tessera-test-XXXXXX";
        folder_ = fs::canonical(::mkdtemp(pattern.data()));
        for (const char* name : {"models/parts", "models-of-others", "assets"}) fs::create_directories(folder_ / name);
        for (const char* name :
             {"models/a.obj", "models/parts/b.obj", "models-of-others/c.obj", "assets/d.obj", "e.obj"})
            std::ofstream(folder_ / name) << "v 0 0 0\n";
        fs::create_symlink(folder_ / "e.obj", folder_ / "models" / "out.obj");
        fs::create_symlink(folder_ / "models-of-others", folder_ / "models" / "others");
        fs::create_symlink(folder_ / "models", folder_ / "way-in");
        where_ = {.folders = {(folder_ / "models").string()}, .assets = {(folder_ / "assets").string()}};
    }
    ~ReadableFiles() override { fs::remove_all(folder_); }
    Expected<std::string> ask(const std::string& name) const { return readableFile((folder_ / name).string(), where_); }

    fs::path folder_;
    ReadableFolders where_;
};

TEST_F(ReadableFiles, LieBelowAFolderThatIsAllowedOrAreAssets) {
    EXPECT_EQ(ask("models/a.obj").value(), (folder_ / "models/a.obj").string());
    EXPECT_EQ(ask("models/parts/../parts/b.obj").value(), (folder_ / "models/parts/b.obj").string());
    EXPECT_EQ(ask("way-in/a.obj").value(), (folder_ / "models/a.obj").string()) << "as it is, not as it is called";
    EXPECT_EQ(ask("assets/d.obj").value(), (folder_ / "assets/d.obj").string());
    EXPECT_EQ(readableFile("asset://crate.glb", {}).value(), "asset://crate.glb")
        << "looked for among the assets alone";
    EXPECT_TRUE(ask("models/nothing.obj")) << "that it is not there says whoever reads it";
    where_.folders = {(folder_ / "way-in").string()};
    EXPECT_TRUE(ask("models/a.obj")) << "the folder may be named by a link";
}

TEST_F(ReadableFiles, AreNoOthersWhateverTheWay) {
    for (const char* name :
         {"e.obj", "models/out.obj", "models/others/c.obj", "models/../e.obj", "models/nothing/../../e.obj",
          "models-of-others/c.obj", "models", "nothing.obj", "nothing/at/all.obj", "assets/../e.obj"}) {
        const Expected<std::string> refused = ask(name);
        ASSERT_FALSE(refused) << name << ": " << *refused;
        EXPECT_EQ(refused.error().code, ErrorCode::kRefused);
        EXPECT_WORDS(refused.error().message);
    }
    for (const std::string& name : {std::string(), std::string("e.obj"), std::string("a\0b", 3), std::string(".")})
        EXPECT_FALSE(readableFile(name, where_)) << name;
    EXPECT_EQ(ask("e.obj").error().message.find("may read assets alone"), std::string::npos);
    where_.folders.clear();
    EXPECT_WORDS(ask("models/a.obj").error().message);
}

TEST(Assets, AreLoadedByTheirNameAlone) {
    if (!std::filesystem::exists(kEngine)) GTEST_SKIP() << "models are missing (Debian package assimp-testmodels)";
    const std::string name = std::filesystem::path(kEngine).lexically_relative(kDebianModels).string();
    const Expected<ImportedScene> scene = importScene("asset://" + name, kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_GT(scene->triangles, 10'000u);
    for (const char* wrong : {"asset://none.glb", "asset://../passwd"})
        EXPECT_FALSE(importScene(wrong, kRootNode, importOptions())) << wrong;
}

TEST(SceneTexts, ThatAreNoUtf8NameThePlace) {
    const Scratch scratch;
    const auto refusal = [&](const std::string& text) {
        return messageOf(importScene(scratch.write("odd.tsct", text), kRootNode, importOptions()));
    };
    const std::string path = scratch.path("odd.tsct");
    EXPECT_EQ(refusal("node {\n  name: \"Caf\xE9\" }"), path + ":2:3: this name is no UTF-8");
    EXPECT_EQ(refusal("node {\n  node { name: \"\\377\" } }"), path + ":2:10: this name is no UTF-8");
    EXPECT_EQ(refusal("image { name: \"i\"\n face: [\"a\", \"\xC0\x80\"] }"), path + ":1:1: this face is no UTF-8");
    EXPECT_EQ(
        refusal(
            "saved { root: 1 object { number: 1 child: 2 node {} }\n object { number: 2 node { name: \"\xFF\" } } }"),
        path + ":2:28: this name is no UTF-8");
    // Where nobody reads it as letters it may stand.
    EXPECT_EQ(refusal("# Caf\xE9\nnode { application_data { key: \"a\" data: \"\xE9\" } }"), "(imported)");
}

TEST(SceneTexts, MayBeginWithAByteOrderMark) {
    const Scratch scratch;
    const Expected<ImportedScene> scene =
        importScene(scratch.write("marked.tsct", "\xEF\xBB\xBFnode { name: \"a\" }"), kRootNode, importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->nodes, 1u);
}

}  // namespace
}  // namespace tessera
