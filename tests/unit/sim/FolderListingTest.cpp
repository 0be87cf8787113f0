/// What an application is shown of the server's folders.
#include "server/sim/desk/FolderListing.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

namespace tessera {
namespace {

namespace fs = std::filesystem;

class FolderListing : public testing::Test {
protected:
    FolderListing() {
        std::string name = (fs::temp_directory_path() / "tessera-listing-XXXXXX").string();
        EXPECT_NE(::mkdtemp(name.data()), nullptr);
        path = fs::canonical(name);
        fs::create_directories(path / "models/parts");
        fs::create_directories(path / "assets/inner");
        fs::create_directories(path / "more");
        for (const char* file : {"models/hall.GLB", "models/notes.txt", "models/.hidden.glb", "models/parts/wheel.obj",
                                 "assets/a.ply", "more/a.ply", "more/b.tsct", "outside.glb"})
            std::ofstream(path / file) << "1234";
        where = {.folders = {path / "models"}, .assets = {path / "assets", path / "more"}};
    }
    ~FolderListing() override { fs::remove_all(path); }

    [[nodiscard]] std::vector<std::string> names(const std::string& folder) const {
        const auto page = listFolder({.folder = folder}, where);
        if (!page) return {page.error().message};
        std::vector<std::string> all;
        for (const FolderEntry& entry : page->entries) all.push_back(entry.name);
        return all;
    }
    using Names = std::vector<std::string>;

    fs::path path;
    ReadableFolders where;
};

TEST_F(FolderListing, TellsFilesAndFoldersAndWhatLoads) {
    const auto page = listFolder({.folder = path / "models"}, where);
    ASSERT_TRUE(page) << page.error().message;
    ASSERT_EQ(page->entries.size(), 3u) << "nothing hidden";
    EXPECT_EQ(page->entries[0].name, "hall.GLB");
    EXPECT_EQ(page->entries[0].path, (path / "models/hall.GLB").string());
    EXPECT_EQ(page->entries[0].bytes, 4u);
    EXPECT_TRUE(page->entries[0].loads);
    EXPECT_FALSE(page->entries[1].loads);
    EXPECT_TRUE(page->entries[2].isFolder);
    EXPECT_EQ(names((path / "models/").string()), names((path / "models").string()));
}

TEST_F(FolderListing, TellsTheFoldersThemselvesAndAssetsInTheirOrder) {
    EXPECT_EQ(names(""), (Names{(path / "models").string(), "assets"}));
    const auto assets = listFolder({.folder = "asset://"}, where);
    ASSERT_TRUE(assets);
    ASSERT_EQ(assets->entries.size(), 3u) << "a.ply of the first folder alone";
    EXPECT_EQ(assets->entries[0].path, "asset://a.ply");
    EXPECT_EQ(assets->entries[1].path, "asset://b.tsct");
    EXPECT_TRUE(listFolder({.folder = "asset://inner"}, where));
}

TEST_F(FolderListing, NeverLooksElsewhere) {
    fs::create_directory_symlink(path / "more", path / "models/away");
    fs::create_symlink(path / "outside.glb", path / "models/out.glb");
    fs::create_symlink(path / "models/notes.txt", path / "models/inside.txt");
    fs::create_directory_symlink(path, path / "assets/up");
    EXPECT_EQ(names((path / "models").string()), (Names{"away", "hall.GLB", "inside.txt", "notes.txt", "parts"}))
        << "a link into another folder that may be read, and within, but none out";
    for (const std::string& bad :
         {path.string(), (path / "models/..").string(), std::string("/"), std::string("/etc"), std::string("models"),
          (path / "models").string() + '\0', std::string("asset://.."), std::string("asset:///etc"),
          std::string("asset://up"), (path / "nowhere").string()}) {
        const auto page = listFolder({.folder = bad}, where);
        ASSERT_FALSE(page) << bad;
        EXPECT_TRUE(page.error().code == ErrorCode::kRefused || bad == "asset://up") << page.error().message;
    }
    const auto none = listFolder({.folder = path / "models/none"}, where);
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
    EXPECT_FALSE(listFolder({.folder = path / "models/hall.GLB"}, where));
}

TEST_F(FolderListing, PipesAreNoFiles) {
    ASSERT_EQ(::mkfifo((path / "models/pipe.glb").c_str(), 0600), 0);
    std::ofstream(path / "models/\xFF.glb") << "no UTF-8";
    EXPECT_EQ(names((path / "models").string()), (Names{"hall.GLB", "notes.txt", "parts"}));
}

TEST_F(FolderListing, PagesTellEachOnce) {
    for (int i = 0; i < 100; ++i) std::ofstream(path / "models" / ("m" + std::to_string(i) + ".obj")) << "v";
    FolderWish wish{.folder = path / "models", .pageSize = 7};
    std::vector<std::string> all;
    do {
        const auto page = listFolder(wish, where);
        ASSERT_TRUE(page);
        EXPECT_LE(page->entries.size(), 7u);
        for (const FolderEntry& entry : page->entries) all.push_back(entry.name);
        wish.after = page->next;
    } while (!wish.after.empty());
    EXPECT_EQ(all.size(), 103u);
    EXPECT_TRUE(std::ranges::is_sorted(all));
    EXPECT_EQ(std::set(all.begin(), all.end()).size(), all.size());
}

}  // namespace
}  // namespace tessera
