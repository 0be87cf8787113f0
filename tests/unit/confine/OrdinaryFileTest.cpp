/// Files that others name: opened, or refused, whatever is swapped meanwhile.
#include "common/confine/OrdinaryFile.h"

#include <gtest/gtest.h>

#include <fcntl.h>
#include <seccomp.h>
#include <sys/inotify.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <fstream>
#include <functional>
#include <thread>

#include "tests/unit/TestFolder.h"

namespace tessera::test {
namespace {

namespace fs = std::filesystem;

std::string contentOf(const OrdinaryFile& file) {
    std::string content(file.bytes, '\0');
    return ::read(file.handle.get(), content.data(), content.size()) == static_cast<ssize_t>(content.size()) ? content
                                                                                                             : "(cut)";
}

class OrdinaryFiles : public testing::Test {
protected:
    void SetUp() override {
        root_ = fs::canonical(folder_.path()).string();
        for (const char* name : {"in/sub", "out/sub"}) fs::create_directories(root_ + "/" + name);
        std::ofstream(root_ + "/in/sub/a.txt") << "inside";
        std::ofstream(root_ + "/out/sub/a.txt") << "secret";
        fs::create_directory_symlink(root_ + "/out/sub", root_ + "/in/link");
        fs::create_symlink("../out/sub/a.txt", root_ + "/in/file-link.txt");
        EXPECT_EQ(::mkfifo((root_ + "/in/pipe").c_str(), 0600), 0);
    }
    [[nodiscard]] static ErrorCode codeOf(const std::string& path) {
        const Expected<OrdinaryFile> file = openOrdinaryFile(path);
        return file ? ErrorCode::kFailed : file.error().code;  // which none of them says
    }
    /// All that there is to say of single paths.
    [[nodiscard]] std::string faults() const {
        std::string faults;
        const auto expect = [&](bool good, const std::string& what) { faults += good ? "" : what + "; "; };
        const Expected<OrdinaryFile> file = openOrdinaryFile(root_ + "/in/sub/a.txt");
        expect(file && contentOf(*file) == "inside", "a plain file");
        for (const char* name : {"/in/link/a.txt", "/in/file-link.txt"})
            expect(codeOf(root_ + name) == ErrorCode::kRefused, name);
        for (const char* name : {"/in/../out/sub/a.txt", "/in/./sub/a.txt", "/in//sub/a.txt", "/in/sub/", "/.."})
            expect(codeOf(root_ + name) == ErrorCode::kRefused, name);
        for (const std::string& path :
             {std::string(), std::string("/"), std::string("a.txt"), std::string("/etc/passwd\0x", 13)})
            expect(codeOf(path) == ErrorCode::kRefused, path);
        for (const char* name : {"/in/none", "/none/a.txt", "/in/sub/a.txt/b"})
            expect(codeOf(root_ + name) == ErrorCode::kNotFound, name);
        expect(codeOf(root_ + "/in/sub") == ErrorCode::kBadInput, "a folder");
        expect(codeOf(root_ + "/in/pipe") == ErrorCode::kBadInput, "a pipe");
        expect(codeOf("/dev/null") == ErrorCode::kBadInput, "a device");
        expect(openPlace(root_ + "/in/sub").has_value(), "the place of a folder");
        expect(!openPlace(root_ + "/in/link") && !openPlace(root_ + "/in/link/sub"), "the place of a link");
        return faults;
    }
    /// Of many opens while a folder and a link to another one change places all the time, how many led to the other's
    /// file; how many found the right one.
    [[nodiscard]] std::pair<int, int> ledAstray() const {
        std::atomic<bool> stop = false;
        std::thread swapping([&] {
            const std::string a = root_ + "/in/sub", b = root_ + "/in/link";
            while (!stop) ::syscall(SYS_renameat2, AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), 2u /* RENAME_EXCHANGE */);
        });
        int astray = 0, right = 0;
        for (int i = 0; i < 20'000; ++i)
            if (const Expected<OrdinaryFile> file = openOrdinaryFile(root_ + "/in/sub/a.txt"))
                ++(contentOf(*file) == "inside" ? right : astray);
        stop = true;
        swapping.join();
        return {astray, right};
    }
    /// In a process where there is no openat2.
    static int withoutOpenat2(const std::function<bool()>& good) {
        const pid_t pid = ::fork();
        if (pid == 0) {
            ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
            const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
            seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SYS_openat2, 0);
            ::_exit(seccomp_load(filter) == 0 && ::syscall(SYS_openat2, 0, nullptr, nullptr, 0) < 0 &&
                            errno == ENOSYS && good()
                        ? 0
                        : 1);
        }
        int status = 0;
        ::waitpid(pid, &status, 0);
        return status;
    }
    TestFolder folder_;
    std::string root_;
};

// To open a device can rewind a tape, and to open a pipe lets go whoever waits to write to it.
TEST_F(OrdinaryFiles, WhatIsNoOrdinaryFileIsNotEvenOpened) {
    const int watch = ::inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    ASSERT_GE(watch, 0);
    const FileHandle closes(watch);
    ASSERT_GE(::inotify_add_watch(watch, (root_ + "/in/pipe").c_str(), IN_OPEN), 0);
    EXPECT_EQ(codeOf(root_ + "/in/pipe"), ErrorCode::kBadInput);
    std::array<char, 4096> events{};
    EXPECT_LT(::read(watch, events.data(), events.size()), 0) << "it was opened";
    // Or nothing would be seen.
    const FileHandle opened(::open((root_ + "/in/pipe").c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
    EXPECT_GT(::read(watch, events.data(), events.size()), 0);
}

TEST_F(OrdinaryFiles, AreOpenedByWholePathsWithoutLinksAlone) {
    EXPECT_EQ(faults(), "");
}

TEST_F(OrdinaryFiles, AreOpenedAlikeWithoutOpenat2) {
    EXPECT_EQ(withoutOpenat2([&] {
                  const std::string wrong = faults();
                  if (!wrong.empty()) std::fprintf(stderr, "%s\n", wrong.c_str());
                  return wrong.empty();
              }),
              0);
}

TEST_F(OrdinaryFiles, AreNeverOthersWhateverIsSwapped) {
    const auto [astray, right] = ledAstray();
    EXPECT_EQ(astray, 0);
    EXPECT_GT(right, 0);
    EXPECT_EQ(withoutOpenat2([&] { return ledAstray().first == 0; }), 0);
}

}  // namespace
}  // namespace tessera::test
