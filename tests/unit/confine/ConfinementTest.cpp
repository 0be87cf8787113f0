/// What each child cannot do, tried from inside its real profile; what it needs; what happens where the kernel cannot.
#include "common/confine/Confinement.h"

#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <fcntl.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <functional>
#include <latch>
#include <thread>

#include "common/base/ChildProgram.h"
#include "tests/unit/Sanitized.h"
#include "tests/unit/TestFolder.h"
#include "tests/unit/confine/Attempts.h"

namespace tessera::test {
namespace {

constexpr int kNotConfined = 99;

/// waitpid's status of a fork that does this and exits with what it returns.
int inFork(const std::function<int()>& what) {
    const pid_t pid = ::fork();
    if (pid == 0) ::_exit(what());
    int status = 0;
    ::waitpid(pid, &status, 0);
    return status;
}

bool isConfined(const ConfinementProfile& profile, const std::string& file) {
    return boundResources(profile, ::getppid()) && boundFurtherTime(std::chrono::seconds(1)) && confine(profile, file);
}

int confined(const ConfinementProfile& profile, const std::string& file, const std::function<int()>& what) {
    return inFork([&] { return isConfined(profile, file) ? what() : kNotConfined; });
}

/// For this process and its children there is no such call from here on.
void takeAway(std::initializer_list<int> calls) {
    ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
    for (const int call : calls) seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), call, 0);
    seccomp_load(filter);
}
void takeSeccompAway() {
    ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    const scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
    seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SYS_seccomp, 0);
    seccomp_rule_add(filter, SCMP_ACT_ERRNO(EINVAL), SYS_prctl, 1, SCMP_A0(SCMP_CMP_EQ, PR_SET_SECCOMP));
    seccomp_load(filter);
}

class Confinement : public testing::TestWithParam<ConfinementProfile> {
protected:
    void SetUp() override {
        std::filesystem::create_directory(folder_ / "own");
        std::ofstream(own()) << "v 0 0 0\n";
        victims_ = {.file = folder_ / "file", .folder = folder_.path()};
        writeVictim();
        victims_.process = ::fork();
        if (victims_.process == 0)
            for (;;) ::pause();
        listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
        sockaddr_in here{};
        here.sin_family = AF_INET;
        here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof here;
        ASSERT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&here), size), 0);
        ASSERT_EQ(::listen(listener_, 64), 0);
        ASSERT_EQ(::getsockname(listener_, reinterpret_cast<sockaddr*>(&here), &size), 0);
        victims_.listener = ntohs(here.sin_port);
    }
    void TearDown() override {
        ::close(listener_);
        ::kill(victims_.process, SIGKILL);
        ::waitpid(victims_.process, nullptr, 0);
    }
    [[nodiscard]] std::string own() const { return folder_ / "own/own.obj"; }
    void writeVictim() const {
        for (const char* name : {"new", "file2", "file3", "file4", "folder", "fifo"})
            std::filesystem::remove(folder_ / name);
        std::ofstream(victims_.file) << "of somebody else\n";
    }
    [[nodiscard]] static bool diedOf(int status, int signal) {
        return WIFSIGNALED(status) && WTERMSIG(status) == signal;
    }

    TestFolder folder_;
    Victims victims_;
    int listener_ = -1;
};

TEST_P(Confinement, LeavesNothingThatHarms) {
    std::vector<Attempt> attempts = forbiddenAttempts();
    if (!GetParam().makesCode) attempts.push_back(makingCode());
    // Shadow memory is terabytes of address space.
    if (kSanitized)
        std::erase_if(attempts,
                      [](const Attempt& attempt) { return attempt.name.ends_with("memory than there may be"); });
    for (const Attempt& attempt : attempts) {
        const int status = confined(GetParam(), own(), [&] { return attempt.succeeds(victims_) ? 1 : 0; });
        ASSERT_FALSE(WIFEXITED(status) && WEXITSTATUS(status) == kNotConfined)
            << "this kernel cannot: " << attempt.name;
        EXPECT_TRUE(WIFEXITED(status) ? WEXITSTATUS(status) == 0 : WTERMSIG(status) == SIGSYS)
            << GetParam().who << " can " << attempt.name << " (" << status << ")";
        std::string content;
        std::getline(std::ifstream(victims_.file), content);
        EXPECT_EQ(content, "of somebody else") << attempt.name;
        writeVictim();
    }
}

/// `ulimit -v`, `ulimit -n` of whoever started the server.
TEST_P(Confinement, LeavesTighterLimitsAsTheyAre) {
    if (kSanitized) GTEST_SKIP() << "shadow memory is terabytes of address space";
    for (const int resource : {RLIMIT_AS, RLIMIT_NOFILE, RLIMIT_CPU}) {
        const auto which = static_cast<decltype(RLIMIT_AS)>(resource);
        const rlim_t tight = resource == RLIMIT_AS       ? GetParam().memoryBytes / 2
                             : resource == RLIMIT_NOFILE ? GetParam().openFiles - 1
                                                         : 1;
        const int status = inFork([&] {
            const rlimit before{tight, tight};
            rlimit after{};
            if (::setrlimit(which, &before) != 0 || !boundResources(GetParam(), ::getppid()) ||
                !boundFurtherTime(std::chrono::seconds(1)))
                return kNotConfined;
            return ::getrlimit(which, &after) == 0 && after.rlim_max <= tight ? 0 : 1;
        });
        EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << resource << ": " << status;
    }
}

TEST_P(Confinement, EndsWhatNeverEnds) {
    const int status = confined(GetParam(), own(), [] {
        for (volatile bool forever = true; forever;) {
        }
        return 0;
    });
    EXPECT_TRUE(diedOf(status, SIGXCPU)) << status;
}

TEST_P(Confinement, OfSeveralThreadsIsRefused) {
    if (kSanitized) GTEST_SKIP() << "a sanitizer may have threads of its own";
    const int status = inFork([&] {
        std::latch over(1);
        const std::jthread other([&] { over.wait(); });
        const bool bounded = boundResources(GetParam(), ::getppid()).has_value();
        const Expected<void> done = confine(GetParam(), own());
        over.count_down();
        return bounded && !done && done.error().message.find("several threads") != std::string::npos ? 0 : 1;
    });
    EXPECT_EQ(status, 0);
}

TEST_P(Confinement, IsRefusedInWordsWhereTheKernelHasNoSeccomp) {
    const int status = inFork([&] {
        takeSeccompAway();
        const bool bounded = boundResources(GetParam(), ::getppid()).has_value();
        const Expected<void> done = confine(GetParam(), own());
        const bool said = !done && done.error().code == ErrorCode::kUnsupported &&
                          done.error().message.find(GetParam().otherwise) != std::string::npos;
        return bounded && said && !missingForConfinement().empty() ? 0 : 1;
    });
    EXPECT_EQ(status, 0);
}

TEST_P(Confinement, WithoutLandlockOpensNoFileOrDoesNotBegin) {
    const int status = inFork([&] {
        takeAway({SYS_landlock_create_ruleset});
        if (missingForConfinement().size() != 1) return 3;
        const bool is = isConfined(GetParam(), own());
        if (GetParam().readsFolder) return is ? 2 : 0;
        if (!is) return kNotConfined;
        return ::open("/etc/passwd", O_RDONLY | O_NONBLOCK) >= 0 || ::open(own().c_str(), O_RDONLY | O_NONBLOCK) >= 0
                   ? 1
                   : 0;
    });
    EXPECT_EQ(status, 0);
}

std::string nameOfCase(const testing::TestParamInfo<ConfinementProfile>& info) {
    const std::string words(info.param.who);
    return words.substr(words.rfind(' ') + 1);
}
INSTANTIATE_TEST_SUITE_P(OfChild, Confinement,
                         testing::Values(kImporterProfile, kFilmDecoderProfile, kProgramTrialProfile), nameOfCase);

/// The attempts are real ones: whoever is not confined succeeds.
class Unconfined : public Confinement {};
INSTANTIATE_TEST_SUITE_P(Anybody, Unconfined, testing::Values(kImporterProfile), nameOfCase);

TEST_P(Unconfined, AttemptsSucceed) {
    std::size_t succeeded = 0;
    std::string failed;
    for (const Attempt& attempt : forbiddenAttempts()) {
        const int status = inFork([&] { return attempt.succeeds(victims_) ? 1 : 0; });
        if (WIFEXITED(status) && WEXITSTATUS(status) == 1)
            ++succeeded;
        else
            failed += attempt.name + "; ";
        writeVictim();
    }
    // A few ask for rights or kernels that not everybody has.
    EXPECT_GE(succeeded, 36u) << failed;
}

TEST(ConfinedImporter, ReadsItsFolderAndNeverWaitsForAPipe) {
    const TestFolder folder;
    std::filesystem::create_directory(folder / "in");
    const std::string own = folder / "in/own.obj", pipe = folder / "in/pipe.mtl";
    std::ofstream(own) << "v 0 0 0\n";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    const int status = confined(kImporterProfile, own, [&] {
        const bool reads = ::open(own.c_str(), O_RDONLY | O_NONBLOCK) >= 0 &&
                           ::open((folder / "in").c_str(), O_RDONLY | O_DIRECTORY) >= 0;
        // Whoever forgets O_NONBLOCK is told so, and waits for nobody.
        return reads && ::open(pipe.c_str(), O_RDONLY) < 0 && ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK) >= 0 ? 0 : 1;
    });
    EXPECT_EQ(status, 0);
}

TEST(ConfinedFilmDecoder, HasTimeAnewForEachPicture) {
    const int status = inFork([] {
        if (!boundResources(kFilmDecoderProfile, ::getppid()) || !confine(kFilmDecoderProfile)) return kNotConfined;
        rlimit before{}, after{};
        renewTime(std::chrono::seconds(5));
        const bool first = ::getrlimit(RLIMIT_CPU, &before) == 0;
        renewTime(std::chrono::seconds(9));
        return first && ::getrlimit(RLIMIT_CPU, &after) == 0 && after.rlim_cur > before.rlim_cur && before.rlim_cur >= 5
                   ? 0
                   : 1;
    });
    EXPECT_EQ(status, 0);
}

/// What tessera-try-program says of a program.
std::string triedByTheRealChild(const std::string& surface) {
    std::array<int, 2> in{}, out{};
    if (::pipe2(in.data(), O_CLOEXEC) != 0 || ::pipe2(out.data(), O_CLOEXEC) != 0) return "no pipe";
    Expected<ChildProgram> child = ChildProgram::start({.path = TESSERA_BIN_DIR "/tessera-try-program",
                                                        .arguments = {"--parent", std::to_string(::getpid())},
                                                        .environment = {"MESA_SHADER_CACHE_DISABLE=true"},
                                                        .files = {{in[0], 0}, {out[1], 1}}});
    const std::string text = std::to_string(surface.size()) + " 0\n" + surface;
    if (!child || ::write(in[1], text.data(), text.size()) != static_cast<ssize_t>(text.size())) return "not started";
    for (const int end : {in[0], in[1], out[1]}) ::close(end);
    std::string said;
    char piece[512];
    for (ssize_t got = 0; (got = ::read(out[0], piece, sizeof piece)) > 0;)
        said.append(piece, static_cast<std::size_t>(got));
    ::close(out[0]);
    const int status = child->reap();
    return WIFSIGNALED(status) ? "died of " + std::to_string(WTERMSIG(status)) : said;
}

TEST(ConfinedProgramTrial, CompilesAndDrawsWithARealProgram) {
    const std::string waves = R"(uniform vec3 tint; uniform float pace;
        float sum(vec3 p) {
            float s = 0.0;
            for (int i = 0; i < 20; ++i) {
                s += sin(p.x * float(i) + pace) * pow(abs(p.z) + 0.1, 1.3);
                if (s > 9.0) break;
            }
            return s;
        }
        void surface(inout Surface s) {
            s.base.rgb = mix(tint, vec3(1.0), smoothstep(0.4, 0.6, fract(sum(nodePosition))));
        })";
    EXPECT_EQ(triedByTheRealChild(waves), "good");
    EXPECT_NE(triedByTheRealChild("void surface(inout Surface s) { s.base = colour; }").find("colour"),
              std::string::npos);
}

TEST(ConfinedProgramTrial, TriesNothingWhereTheKernelHasNoSeccomp) {
    const int status = inFork([] {
        takeSeccompAway();
        const std::string said = triedByTheRealChild("void surface(inout Surface s) { }");
        if (!said.starts_with("cannot this system cannot confine the trial of programs"))
            std::fprintf(stderr, "%s\n", said.c_str());
        return said.starts_with("cannot this system cannot confine the trial of programs") ? 0 : 1;
    });
    EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace tessera::test
