/// The folder in which files lie that people bring: names, bounds, what stays and what does not.
#include "server/door/UploadFolder.h"

#include <gtest/gtest.h>

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/property/Seeds.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

class UploadFolders : public testing::Test {
protected:
    UploadFolders() : path_(fs::temp_directory_path() / "tessera-upload-XXXXXX") {
        std::string name = path_.string();
        EXPECT_NE(::mkdtemp(name.data()), nullptr);
        path_ = fs::canonical(name);
        open();
    }
    ~UploadFolders() override { fs::remove_all(path_); }

    void open(UploadLimits limits = {.maxBytes = 1000, .maxFiles = 3}) {
        folder.reset();
        auto opened = UploadFolder::open(path_ / "in", limits);
        ASSERT_TRUE(opened) << opened.error().message;
        folder = std::move(*opened);
    }
    static ByteSpan bytesOf(const std::string& text) {
        return {reinterpret_cast<const std::byte*>(text.data()), text.size()};
    }
    Expected<std::string> bring(const std::string& name, const std::string& text) {
        const auto file = UploadFolder::begin(folder, name, text.size());
        if (!file) return tl::unexpected(file.error());
        if (const auto written = (*file)->write(bytesOf(text)); !written) return tl::unexpected(written.error());
        return (*file)->finish();
    }
    static std::string textOf(const fs::path& path) {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    [[nodiscard]] std::size_t filesThere() const {
        return static_cast<std::size_t>(std::distance(fs::recursive_directory_iterator(path_ / "in"), {}));
    }

    fs::path path_;
    std::shared_ptr<UploadFolder> folder;
};

TEST(UploadNames, ArePlainOnes) {
    for (const char* good :
         {"hall.gltf", "SET/hall.gltf", "set/textures/wood.png", "世界 مرحبا 👋.glb", "a b", "-rf", "<img src=x>"})
        EXPECT_TRUE(uploadNames(good)) << good;
    const std::string longest(255, 'x'), longer(256, 'x');
    EXPECT_TRUE(uploadNames(longest));
    for (const std::string& bad : {std::string(),
                                   std::string("/"),
                                   std::string("/etc/passwd"),
                                   std::string("a/"),
                                   std::string("a//b"),
                                   std::string(".."),
                                   std::string("a/../b"),
                                   std::string("."),
                                   std::string(".hidden"),
                                   std::string("a/.git/config"),
                                   std::string("a\\b"),
                                   std::string("a\nb"),
                                   std::string("a\0b", 3),
                                   std::string("a\x7f"),
                                   std::string("a\xC2\x85"),
                                   std::string("a\xE2\x80\xAE"
                                               "b"),
                                   std::string("a\xEF\xBB\xBF"),
                                   std::string("\xFF"),
                                   std::string("\xC0\xAE\xC0\xAE"),
                                   longer,
                                   std::string("a/b/c/d/e")})
        EXPECT_FALSE(uploadNames(bad)) << bad;
}

TEST_F(UploadFolders, AFileIsThereWholeOrNotAtAll) {
    const auto path = bring("set/hall.gltf", "whole");
    ASSERT_TRUE(path) << path.error().message;
    EXPECT_EQ(*path, (path_ / "in/set/hall.gltf").string());
    EXPECT_EQ(textOf(*path), "whole");
    {
        const auto file = UploadFolder::begin(folder, "other/half.gltf", 10);
        ASSERT_TRUE(file);
        ASSERT_TRUE((*file)->write(bytesOf("half")));
        EXPECT_FALSE(fs::exists(path_ / "in/other")) << "nobody sees it yet";
        EXPECT_EQ(folder->used().bytes, 15u) << "its place is taken";
        EXPECT_FALSE((*file)->finish()) << "less has come than was said";
    }
    EXPECT_EQ(filesThere(), 2u) << "the set and its file";
    EXPECT_EQ(folder->used().bytes, 5u);
    const auto more = UploadFolder::begin(folder, "more", 2);
    EXPECT_FALSE((*more)->write(bytesOf("more")));
}

TEST_F(UploadFolders, AnotherOfTheSameNameTakesItsPlace) {
    ASSERT_TRUE(bring("a", "first"));
    const auto path = bring("a", "second");
    ASSERT_TRUE(path);
    EXPECT_EQ(textOf(*path), "second");
    ASSERT_TRUE(bring("set/a", "third"));
    EXPECT_FALSE(bring("set", "a file where a folder is"));
    EXPECT_FALSE(bring("a/b", "a folder where a file is"));
    EXPECT_EQ(folder->used().files, 2u);
}

TEST_F(UploadFolders, TogetherTheyHaveBounds) {
    const auto coming = UploadFolder::begin(folder, "a", 600);
    ASSERT_TRUE(coming);
    const auto more = UploadFolder::begin(folder, "b", 401);
    ASSERT_FALSE(more);
    EXPECT_EQ(more.error().code, ErrorCode::kLimit);
    EXPECT_FALSE(UploadFolder::begin(folder, "b", 1001));
    EXPECT_FALSE(UploadFolder::begin(folder, "b", ~std::uint64_t{0}));
    ASSERT_TRUE(bring("b", "b"));
    ASSERT_TRUE(bring("c", "c"));
    const auto fourth = bring("d", "d");
    ASSERT_FALSE(fourth);
    EXPECT_WORDS(fourth.error().message);
    ASSERT_TRUE(folder->remove("b"));
    EXPECT_TRUE(bring("d", "d"));
}

TEST_F(UploadFolders, OfTwoOfOneNameTheLargerCounts) {
    const std::string most(1000, 'x');
    ASSERT_TRUE(bring("a", most));
    ASSERT_TRUE(bring("a", most)) << "in its own place there is room";
    EXPECT_EQ(folder->used().bytes, 1000u);
    {
        const auto small = UploadFolder::begin(folder, "a", 1);
        ASSERT_TRUE(small);
        EXPECT_EQ(folder->used().bytes, 1000u) << "either may stay";
        EXPECT_EQ(folder->used().files, 1u);
        EXPECT_FALSE(UploadFolder::begin(folder, "b", 1));
        EXPECT_FALSE(UploadFolder::begin(folder, "a", 1)) << "one alone has its place";
        ASSERT_TRUE(folder->remove("a"));
        EXPECT_EQ(folder->used().bytes, 1u);
        const auto other = UploadFolder::begin(folder, "a", 999);
        ASSERT_TRUE(other);
        EXPECT_EQ(folder->used().bytes, 1000u);
    }
    EXPECT_EQ(folder->used().files, 0u);
    for (const char* name : {"a", "b", "c"}) ASSERT_TRUE(bring(name, name));
    EXPECT_TRUE(bring("b", "more")) << "it is no fourth";
    EXPECT_FALSE(bring("d", "d"));
}

/// Whatever is brought, stops, goes and comes at once: never more than the bound, once all has come or gone.
TEST_F(UploadFolders, WhateverHappensTheyStayWithinTheirBounds) {
    forSeeds(50, [&](Random& random) {
        fs::remove_all(path_ / "in");
        open({.maxBytes = 20, .maxFiles = 3});
        struct OnItsWay {
            std::shared_ptr<UploadFolder::Incoming> file;
            std::string text;
        };
        std::vector<OnItsWay> coming;
        for (int i = 0; i < 40; ++i) {
            const std::string name(1, static_cast<char>('a' + below(random, 4)));
            const std::size_t what = below(random, 4);
            if (what < 2) {
                const std::string text(1 + below(random, 20), 'x');
                if (auto file = UploadFolder::begin(folder, name, text.size())) coming.push_back({*file, text});
            } else if (what == 2) {
                (void)folder->remove(name);
            } else if (!coming.empty()) {
                const auto one = coming.begin() + static_cast<std::ptrdiff_t>(below(random, coming.size()));
                if (below(random, 3) > 0) {
                    ASSERT_TRUE(one->file->write(bytesOf(one->text)));
                    ASSERT_TRUE(one->file->finish());
                }
                coming.erase(one);
            }
            std::uint64_t bytes = 0;
            std::size_t files = 0;
            for (const auto& entry : fs::directory_iterator(path_ / "in")) {
                if (entry.path().filename().string().starts_with('.')) continue;
                bytes += entry.file_size();
                ++files;
            }
            ASSERT_LE(bytes, 20u);
            ASSERT_LE(files, 3u);
            ASSERT_LE(folder->used().bytes, 20u);
            ASSERT_LE(folder->used().files, 3u);
            ASSERT_GE(folder->used().bytes, bytes);
        }
    });
}

/// Nothing of them is written here.
TEST_F(UploadFolders, WhatIsPromisedOfTheDiskIsNotPromisedTwice) {
    open({.maxBytes = std::uint64_t{1} << 60});
    const std::uint64_t free = fs::space(path_).available;
    if (free < std::uint64_t{1} << 30) GTEST_SKIP() << "the disk is nearly full";
    const auto first = UploadFolder::begin(folder, "a", free / 10 * 6);
    ASSERT_TRUE(first) << first.error().message;
    const auto second = UploadFolder::begin(folder, "b", free / 10 * 6);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::kLimit);
    EXPECT_NE(second.error().message.find("the server's disk has room for"), std::string::npos);
}

TEST_F(UploadFolders, FilesWithoutANameLeaveRoomToo) {
    const FileHandle file = namelessFile(folder->path()).value();
    const Bytes bytes(1000);
    struct stat info {};
    const Expected<void> refused = writeNameless(file, bytes, std::uint64_t{1} << 60);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kLimit);
    ASSERT_TRUE(writeNameless(file, bytes, 0));
    ASSERT_EQ(::fstat(file.get(), &info), 0);
    EXPECT_EQ(info.st_size, 1000);
}

TEST_F(UploadFolders, NoLinkIsFollowed) {
    fs::create_directory(path_ / "outside");
    std::ofstream(path_ / "outside/file") << "theirs";
    fs::create_directory_symlink(path_ / "outside", path_ / "in/set");
    fs::create_symlink(path_ / "outside/file", path_ / "in/link");
    EXPECT_FALSE(bring("set/file", "ours"));
    EXPECT_FALSE(folder->remove("set/file"));
    ASSERT_TRUE(bring("link", "ours"));
    EXPECT_EQ(textOf(path_ / "outside/file"), "theirs");
    EXPECT_FALSE(fs::is_symlink(path_ / "in/link"));
    ASSERT_TRUE(folder->remove("set")) << "the link itself";
    EXPECT_TRUE(fs::exists(path_ / "outside/file"));
}

TEST_F(UploadFolders, SetsAreRemovedWithAllThatIsInThem) {
    ASSERT_TRUE(bring("set/textures/wood.png", "wood"));
    ASSERT_TRUE(bring("set/hall.gltf", "hall"));
    ASSERT_TRUE(folder->remove("set"));
    EXPECT_EQ(filesThere(), 0u);
    const auto none = folder->remove("set");
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
    EXPECT_FALSE(folder->remove(".."));
}

TEST_F(UploadFolders, ASetGoesWithItsLastFile) {
    ASSERT_TRUE(bring("set/textures/wood.png", "wood"));
    ASSERT_TRUE(bring("set/hall.gltf", "hall"));
    ASSERT_TRUE(folder->remove("set/textures/wood.png"));
    EXPECT_FALSE(fs::exists(path_ / "in/set/textures"));
    EXPECT_TRUE(fs::exists(path_ / "in/set/hall.gltf"));
    ASSERT_TRUE(folder->remove("set/hall.gltf"));
    EXPECT_EQ(filesThere(), 0u);
    EXPECT_TRUE(bring("set/hall.gltf", "hall"));
}

TEST_F(UploadFolders, WhereTooMuchLiesToBeCountedNothingElseComes) {
    open({.maxLooks = 2000});
    for (int i = 0; i < 1999; ++i) fs::create_directory(path_ / "in" / std::to_string(i));
    EXPECT_TRUE(folder->remove("0"));
    ASSERT_TRUE(bring("a", "a")) << "folders are no files";
    for (int i = 2000; i < 2010; ++i) fs::create_directory(path_ / "in" / std::to_string(i));
    const auto more = bring("more", "m");
    ASSERT_FALSE(more);
    EXPECT_EQ(more.error().code, ErrorCode::kLimit);
}

TEST_F(UploadFolders, OneServerHasItAndFindsWhatAnotherHasLeft) {
    ASSERT_TRUE(bring("a", "stays"));
    const auto second = UploadFolder::open(path_ / "in");
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::kRefused);
    std::ofstream(path_ / "in/.incoming-7") << "of a server that was killed";
    open();
    EXPECT_EQ(filesThere(), 1u);
    EXPECT_EQ(folder->used().bytes, 5u);
}

TEST_F(UploadFolders, AFolderOfARunGoesWithIt) {
    ::setenv("TMPDIR", path_.c_str(), 1);
    auto own = UploadFolder::openOwn();
    ASSERT_TRUE(own) << own.error().message;
    const std::string path = (*own)->path();
    EXPECT_EQ(fs::path(path).parent_path(), path_);
    struct stat info {};
    ASSERT_EQ(::stat(path.c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777u, 0700u);
    fs::create_directory(path_ / "tessera-uploads-killed");
    std::ofstream(path_ / "tessera-uploads-killed/a") << "left over";
    auto other = UploadFolder::openOwn();
    ::unsetenv("TMPDIR");
    ASSERT_TRUE(other);
    EXPECT_FALSE(fs::exists(path_ / "tessera-uploads-killed"));
    EXPECT_TRUE(fs::exists(path)) << "its server runs";
    own->reset();
    EXPECT_FALSE(fs::exists(path));
}

}  // namespace
}  // namespace tessera
