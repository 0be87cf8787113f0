/// Files that take another one's place at once.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <set>

#include "common/base/NewFile.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

class NewFileTest : public testing::Test {
protected:
    NewFileTest() {
        std::string name = (fs::temp_directory_path() / "new-file-XXXXXX").string();
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
    /// The status with which another process ends that does this.
    template <typename Work>
    static int elsewhere(Work work) {
        const pid_t child = ::fork();
        if (child == 0) {
            work();
            ::_exit(0);
        }
        int status = -1;
        EXPECT_EQ(::waitpid(child, &status, 0), child);
        return status;
    }
    [[nodiscard]] bool hasNameless() const {
        const int fd = ::open(folder_.c_str(), O_WRONLY | O_TMPFILE | O_CLOEXEC, 0600);
        if (fd >= 0) ::close(fd);
        return fd >= 0;
    }

private:
    fs::path folder_;
};

/// In this process from now on a call fails.
void forbid(unsigned call, unsigned error) {
    sock_filter steps[] = {
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 1),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | error),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
    };
    const sock_fprog program{.len = static_cast<unsigned short>(std::size(steps)), .filter = steps};
    if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 || ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) != 0)
        ::_exit(77);
}

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
    std::ofstream(path("a") + "." + std::to_string(::getpid()) + ".0") << "theirs";
    EXPECT_EQ(put(path("a"), "ours"), "");
    EXPECT_EQ(contentOf(path("a")), "ours");
    EXPECT_EQ(contentOf(path("a") + "." + std::to_string(::getpid()) + ".0"), "theirs");
    EXPECT_EQ(names().size(), 2u);
}

/// File systems of networks have files without names, and some of these no links.
TEST_F(NewFileTest, WhereNothingCanBeLinkedItIsCopied) {
    std::ofstream(path("file")) << "before";
    ASSERT_EQ(::chmod(path("file").c_str(), 0604), 0);
    const std::string content(3'000'000, 'x');
    const int status = elsewhere([&] {
        forbid(SYS_linkat, EPERM);
        if (!put(path("file"), content).empty()) ::_exit(1);
    });
    ASSERT_TRUE(WIFEXITED(status));
    if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "this kernel has no seccomp";
    EXPECT_EQ(WEXITSTATUS(status), 0);
    EXPECT_EQ(contentOf(path("file")), content);
    EXPECT_EQ(rightsOf(path("file")), 0604u);
    EXPECT_EQ(names(), std::set<std::string>{"file"});
}

TEST_F(NewFileTest, AFolderThatIsLockedOrGoneIsNamed) {
    EXPECT_NE(put(path("none/file"), "x").find("none/file: cannot write there: No such file"), std::string::npos);
    if (::geteuid() == 0) return;
    ASSERT_EQ(::chmod(path("").c_str(), 0500), 0);
    EXPECT_NE(put(path("file"), "x").find("cannot write there: Permission denied"), std::string::npos);
    ASSERT_EQ(::chmod(path("").c_str(), 0700), 0);
}

}  // namespace
}  // namespace tessera
