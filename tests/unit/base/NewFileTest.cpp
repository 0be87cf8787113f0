/// Files that take another one's place at once.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "common/base/NewFile.h"
#include "tests/support/words/Words.h"
#include "tests/unit/base/ForbiddenCalls.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

class NewFileTest : public testing::Test {
protected:
    NewFileTest() {
        std::string name = (fs::temp_directory_path() / "tessera-test-XXXXXX").string();
        EXPECT_NE(::mkdtemp(name.data()), nullptr);
        folder_ = name;
    }
    ~NewFileTest() override { fs::remove_all(folder_); }

    [[nodiscard]] std::string path(const std::string& name) const { return (folder_ / name).string(); }
    [[nodiscard]] std::set<std::string> names() const {
        std::set<std::string> all;
        for (const auto& entry : fs::directory_iterator(folder_)) all.insert(entry.path().filename().string());
        return all;
    }
    static std::string contentOf(const std::string& path) {
        std::ifstream file(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    static mode_t rightsOf(const std::string& path) {
        struct stat info {};
        EXPECT_EQ(::stat(path.c_str(), &info), 0);
        return info.st_mode & 07777;
    }
    /// Empty: it went well; else why not.
    static std::string put(const std::string& path, const std::string& content) {
        const Expected<FilePlace> place = placeOfFile(path);
        if (!place) return place.error().message;
        Expected<NewFile> file = NewFile::beside(*place, path);
        if (!file) return file.error().message;
        Expected<void> done = file->write(content);
        if (done) done = file->sync();
        if (done) done = file->takePlace();
        return done ? std::string() : done.error().message;
    }
    [[nodiscard]] bool hasNameless() const {
        const int fd = ::open(folder_.c_str(), O_WRONLY | O_TMPFILE | O_CLOEXEC, 0600);
        if (fd >= 0) ::close(fd);
        return fd >= 0;
    }

private:
    fs::path folder_;
};

TEST_F(NewFileTest, OfAProcessThatIsKilledNothingStays) {
    if (!hasNameless()) GTEST_SKIP() << "this file system has no files without names";
    const std::string kept = path("scene.glb");
    std::ofstream(kept) << "before";
    for (const int signal : {SIGKILL, SIGTERM, SIGINT}) {
        const int status = elsewhere([&] {
            std::signal(signal, SIG_DFL);
            Expected<NewFile> file = NewFile::beside({.path = kept, .mode = {}}, kept);
            if (file && file->write("half of it")) ::raise(signal);
        });
        EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == signal);
        EXPECT_EQ(names(), std::set<std::string>{"scene.glb"});
        EXPECT_EQ(contentOf(kept), "before");
    }
}

TEST_F(NewFileTest, NewOnesGetTheRightsThatTheMaskLeavesAndOthersThoseThatWereThere) {
    const mode_t before = ::umask(027);
    EXPECT_EQ(put(path("new"), "one"), "");
    ::umask(before);
    EXPECT_EQ(rightsOf(path("new")), 0640u);
    ASSERT_EQ(::chmod(path("new").c_str(), 0444), 0);
    EXPECT_EQ(put(path("new"), "two"), "");
    EXPECT_EQ(rightsOf(path("new")), 0444u);
    EXPECT_EQ(contentOf(path("new")), "two");
    EXPECT_EQ(names(), std::set<std::string>{"new"});
}

/// A default list of access: all may read and write. The kernel then makes files as if there were no mask.
std::string listForAll() {
    const auto entry = [](char tag) { return std::string{tag, 0, 6, 0, -1, -1, -1, -1}; };  // 6: read and write
    return std::string{2, 0, 0, 0} + entry(0x01) + entry(0x04) + entry(0x20);               // owner, group, others
}

TEST_F(NewFileTest, WhereTheKernelForgetsTheMaskItCountsNevertheless) {
    if (!hasNameless()) GTEST_SKIP() << "this file system has no files without names";
    const std::string list = listForAll();
    if (::setxattr(path("").c_str(), "system.posix_acl_default", list.data(), list.size(), 0) != 0)
        GTEST_SKIP() << "this file system has no access control lists";
    const mode_t before = ::umask(027);
    EXPECT_EQ(put(path("listed"), "one"), "");
    // To a process that cannot see the list the kernel seems to forget the mask.
    const int status = elsewhere([&] {
        forbid(SYS_getxattr, ENODATA);
        if (!put(path("masked"), "one").empty()) ::_exit(1);
    });
    ::umask(before);
    EXPECT_EQ(rightsOf(path("listed")), 0666u) << "in a folder with a list that counts";
    ASSERT_TRUE(WIFEXITED(status));
    if (WEXITSTATUS(status) == kCannotForbid) GTEST_SKIP() << "this kernel has no seccomp";
    EXPECT_EQ(WEXITSTATUS(status), 0);
    EXPECT_EQ(rightsOf(path("masked")), 0640u);
}

TEST_F(NewFileTest, WhereItIsToBeOnTheDiskItIsSyncedWithItsName) {
    if (!hasNameless()) GTEST_SKIP() << "this file system has no files without names";
    std::ofstream(path("file")) << "before";
    const int status = elsewhere([&] {
        Expected<NewFile> file = NewFile::beside({.path = path("file"), .mode = {}}, "file");
        if (!file || !file->write("after") || !file->sync()) ::_exit(1);
        forbid(SYS_fdatasync, EIO);
        const Expected<void> placed = file->takePlace();
        if (placed || placed.error().message != "file: cannot write: Input/output error") ::_exit(2);
        { const NewFile gone = std::move(*file); }
    });
    ASSERT_TRUE(WIFEXITED(status));
    if (WEXITSTATUS(status) == kCannotForbid) GTEST_SKIP() << "this kernel has no seccomp";
    EXPECT_EQ(WEXITSTATUS(status), 0);
    EXPECT_EQ(contentOf(path("file")), "before");
    EXPECT_EQ(names(), std::set<std::string>{"file"});
}

TEST_F(NewFileTest, OneThatIsGivenUpLeavesWhatWasThere) {
    std::ofstream(path("kept")) << "before";
    {
        Expected<NewFile> file = NewFile::beside({.path = path("kept"), .mode = {}}, "kept");
        ASSERT_TRUE(file);
        ASSERT_TRUE(file->write("half of it"));
        NewFile moved = std::move(*file);
        ASSERT_TRUE(moved.sync());
    }
    EXPECT_EQ(names(), std::set<std::string>{"kept"});
    EXPECT_EQ(contentOf(path("kept")), "before");
}

TEST_F(NewFileTest, NamesOfOthersBesideItStay) {
    std::set<std::string> all{"a"};
    // Some of the next names, whichever these are; a hundred in a row would leave none.
    for (int i = 0; i < 3000; i += 2) {
        all.insert(".tessera." + std::to_string(::getpid()) + "." + std::to_string(i));
        std::ofstream(path(".tessera." + std::to_string(::getpid()) + "." + std::to_string(i))) << "theirs";
    }
    EXPECT_EQ(put(path("a"), "ours"), "");
    EXPECT_EQ(put(path("a"), "ours"), "");
    EXPECT_EQ(contentOf(path("a")), "ours");
    EXPECT_EQ(names(), all);
}

TEST_F(NewFileTest, ManyHaveNamesBeforeTheFirstTakesItsPlace) {
    std::ofstream(path("0")) << "before";
    std::vector<NewFile> files;
    std::set<std::string> all;
    for (int i = 0; i < 250; ++i) {
        all.insert(std::to_string(i));
        Expected<NewFile> file = NewFile::beside({.path = path(std::to_string(i)), .mode = {}}, "file");
        ASSERT_TRUE(file);
        ASSERT_TRUE(file->write("after"));
        files.push_back(std::move(*file));
    }
    for (NewFile& file : files) ASSERT_TRUE(file.giveName());
    EXPECT_EQ(names().size(), 251u);
    EXPECT_EQ(contentOf(path("0")), "before");
    for (NewFile& file : files) ASSERT_TRUE(file.takePlace());
    EXPECT_EQ(names(), all);
    EXPECT_EQ(contentOf(path("0")), "after");
    {
        Expected<NewFile> file = NewFile::beside({.path = path("0"), .mode = {}}, "file");
        ASSERT_TRUE(file && file->giveName());
        EXPECT_EQ(names().size(), 251u);
    }
    EXPECT_EQ(names(), all) << "one that has a name and is given up goes, too";
}

TEST_F(NewFileTest, ItsNameMayBeAsLongAsTheFileSystemHasThem) {
    const std::string longest(255, 'n');
    EXPECT_EQ(put(path(longest), "content"), "");
    EXPECT_EQ(contentOf(path(longest)), "content");
    EXPECT_EQ(names(), std::set<std::string>{longest});
    const Expected<NewFile> tooLong = NewFile::beside({.path = path(longest + 'n'), .mode = {}}, "it");
    ASSERT_FALSE(tooLong) << "the rename would be too late";
    EXPECT_EQ(tooLong.error().message, "it: cannot write there: File name too long");
}

/// File systems of networks have files without names, and some of these no links.
TEST_F(NewFileTest, WhereNothingCanBeLinkedItIsCopied) {
    if (!hasNameless()) GTEST_SKIP() << "this file system has no files without names";
    std::ofstream(path("file")) << "before";
    ASSERT_EQ(::chmod(path("file").c_str(), 0604), 0);
    const std::string content(3'000'000, 'x');
    const int status = elsewhere([&] {
        forbid(SYS_linkat, EPERM);
        if (!put(path("file"), content).empty()) ::_exit(1);
    });
    ASSERT_TRUE(WIFEXITED(status));
    if (WEXITSTATUS(status) == kCannotForbid) GTEST_SKIP() << "this kernel has no seccomp";
    EXPECT_EQ(WEXITSTATUS(status), 0);
    EXPECT_EQ(contentOf(path("file")), content);
    EXPECT_EQ(rightsOf(path("file")), 0604u);
    EXPECT_EQ(names(), std::set<std::string>{"file"});
}

TEST_F(NewFileTest, AFolderThatIsLockedOrGoneIsNamed) {
    EXPECT_WORDS(put(path("none/file"), "x"));
    ASSERT_EQ(::chmod(path("").c_str(), 0555), 0);
    // No folder is locked for root, who is another user meanwhile.
    constexpr ::uid_t kNobody = 65534;
    const ::uid_t user = ::geteuid();
    if (user == 0) {
        ASSERT_EQ(::seteuid(kNobody), 0);
    }
    const std::string said = put(path("file"), "x");
    ASSERT_EQ(::seteuid(user), 0);
    ASSERT_EQ(::chmod(path("").c_str(), 0700), 0);
    EXPECT_WORDS(said);
}

}  // namespace
}  // namespace tessera
