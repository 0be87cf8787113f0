// What the child gives away before it reads. Each test forks, confines the fork, and tries.

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include <functional>

#include "common/confine/Confinement.h"
#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/ReadScene.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

/// The wait status of a confined fork that runs `attempt` and exits with what it returns.
int confined(const std::string& file, const std::function<int()>& attempt,
             std::chrono::seconds cpu = std::chrono::seconds(10)) {
    const pid_t pid = ::fork();
    if (pid == 0) {
        if (!boundResources(kImporterProfile, ::getppid()) || !boundProcessorTime({.given = cpu}) ||
            !confine(kImporterProfile, file))
            ::_exit(99);
        ::_exit(attempt());
    }
    int status = 0;
    ::waitpid(pid, &status, 0);
    return status;
}

class Confined : public testing::Test {
protected:
    [[nodiscard]] std::string own() const { return scratch_.path("in/own.obj"); }
    void SetUp() override {
        scratch_.write("in/own.obj", "v 0 0 0\n");
        scratch_.write("outside.txt", "secret");
        std::filesystem::create_symlink(scratch_.path("outside.txt"), scratch_.path("in/link.txt"));
    }
    Scratch scratch_;
};

TEST_F(Confined, ReadsItsOwnFolderAndNothingElse) {
    const std::string outside = scratch_.path("outside.txt"), link = scratch_.path("in/link.txt"), own = this->own();
    const int status = confined(own, [&] {
        const auto opens = [](const std::string& path) { return ::open(path.c_str(), O_RDONLY | O_NONBLOCK) >= 0; };
        return (opens(own) ? 0 : 1) | (opens(outside) ? 2 : 0) | (opens(link) ? 4 : 0) |
               (opens("/etc/passwd") ? 8 : 0) | (opens(own + "/../../outside.txt") ? 16 : 0) |
               (opens("/proc/self/maps") ? 32 : 0);
    });
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(Confined, HasMoreProcessorTimeForEachMebibyteThatItReads) {
    const std::string small = own(), large = scratch_.path("in/large.bin"), hole = scratch_.path("in/hole.bin");
    std::ofstream(large).put('x');
    std::filesystem::resize_file(large, (std::uintmax_t{5} << 20) + 17);
    std::ofstream(hole).put('x');
    std::filesystem::resize_file(hole, std::uintmax_t{300} << 20);
    const pid_t pid = ::fork();
    if (pid == 0) {
        const auto limit = [] {
            rlimit now{};
            return ::getrlimit(RLIMIT_CPU, &now) == 0 ? now : rlimit{};
        };
        using std::chrono::seconds;
        const bool bounded = boundResources(kImporterProfile, ::getppid()) &&
                             boundProcessorTime({.given = seconds(10), .perMebibyte = seconds(2), .most = seconds(90)});
        if (!bounded || !confine(kImporterProfile, small)) ::_exit(99);
        const rlim_t base = kSanitized ? 30 : 10;
        bool good = readOrdinaryFile(small, 1 << 30).has_value() && limit().rlim_cur == base;
        good = good && readOrdinaryFile(large, 1 << 30) && limit().rlim_cur == base + 10;
        good = good && readOrdinaryFile(large, 1 << 30) && limit().rlim_cur == base + 20;
        good = good && readOrdinaryFile(hole, 1 << 30) && limit().rlim_cur == 90 && limit().rlim_max == 92;
        ::_exit(good ? 0 : 1);
    }
    int status = 0;
    ::waitpid(pid, &status, 0);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(Confined, CannotRaiseItsLimits) {
    const int status = confined(own(), [] {
        const rlimit more{RLIM_INFINITY, RLIM_INFINITY};
        rlimit now{};
        if (::getrlimit(RLIMIT_CPU, &now) != 0) return 4;
        const rlimit longer{now.rlim_cur, now.rlim_max + 1};
        return (::setrlimit(RLIMIT_CPU, &more) == 0 ? 1 : 0) | (::setrlimit(RLIMIT_FSIZE, &more) == 0 ? 2 : 0) |
               (::setrlimit(RLIMIT_CPU, &longer) == 0 ? 8 : 0);
    });
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(Confined, AssimpItselfCannotOpenWhatABufferUriNames) {
    // assimp 5.2.5's own glTF reader follows the URI; ours refuses by name, the kernel by path.
    const std::string gltf = scratch_.write(
        "in/up.gltf", R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
      "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
      "bufferViews":[{"buffer":0,"byteLength":36}],
      "buffers":[{"uri":"../../../../../../etc/passwd","byteLength":36}]})");
    const int status = confined(gltf, [&] { return readWithAssimp(gltf, {}) ? 1 : 0; });
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(Confined, WhereTheKernelCannotNothingIsReadUnlessToldOtherwise) {
    const std::string model = scratch_.write("in/model.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const pid_t pid = ::fork();
    if (pid == 0) {
        // From here on, for this process and its children, there is no Landlock.
        ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
        const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
        seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SYS_landlock_create_ruleset, 0);
        seccomp_load(filter);
        ImportOptions options = importOptions();
        const Expected<ImportedScene> refused = importScene(model, kRootNode, options);
        options.allowUnconfined = true;
        const Expected<ImportedScene> allowed = importScene(model, kRootNode, options);
        const bool clear = !refused && refused.error().code == ErrorCode::kUnsupported &&
                           refused.error().message.find(
                               "this system cannot confine the importer, so the file was not read: "
                               "Landlock: this kernel does not have it") != std::string::npos &&
                           refused.error().message.find("--allow-unconfined-import") != std::string::npos;
        if (!clear) std::fprintf(stderr, "%s\n", messageOf(refused).c_str());
        if (!allowed) std::fprintf(stderr, "%s\n", messageOf(allowed).c_str());
        ::_exit((clear ? 0 : 1) | (allowed ? 0 : 2));
    }
    int status = 0;
    ::waitpid(pid, &status, 0);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(Confined, DiesWithItsParent) {
    const pid_t nobody = 1;
    const pid_t pid = ::fork();
    if (pid == 0) ::_exit(boundResources(kImporterProfile, nobody + 999'999) ? 0 : 7);
    int status = 0;
    ::waitpid(pid, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), 7) << "it must not go on under a stranger";
}

}  // namespace
}  // namespace tessera
