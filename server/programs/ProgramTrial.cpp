#include "server/programs/ProgramTrial.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>
#include <vector>

namespace tessera {
namespace {

std::string besideThisProgram() {
    std::array<char, 4096> self{};
    const ssize_t length = ::readlink("/proc/self/exe", self.data(), self.size() - 1);
    const std::string path(self.data(), length > 0 ? static_cast<std::size_t>(length) : 0);
    return path.substr(0, path.rfind('/') + 1) + "tessera-try-program";
}

/// A file in memory that holds it: the child reads when it likes, and nobody waits.
Expected<FileHandle> asFile(const SurfaceProgram& what) {
    FileHandle file(::memfd_create("program", MFD_CLOEXEC));
    const std::string text = fmt::format("{} {}\n", what.surface.size(), what.vertex.size()) + what.surface + what.vertex;
    std::size_t done = 0;
    while (file.get() >= 0 && done < text.size()) {
        const ssize_t now = ::write(file.get(), text.data() + done, text.size() - done);
        if (now < 0 && errno == EINTR) continue;
        if (now <= 0) break;
        done += static_cast<std::size_t>(now);
    }
    if (done < text.size() || ::lseek(file.get(), 0, SEEK_SET) != 0) return fail(ErrorCode::kFailed, fmt::format("a program cannot be handed on ({})", std::strerror(errno)));
    return file;
}

constexpr std::size_t kMostSaid = 4096;

}  // namespace

Expected<ProgramTrial> ProgramTrial::start(const SurfaceProgram& what, const std::string& program, TimePoint now) {
    Expected<FileHandle> input = asFile(what);
    if (!input) return tl::unexpected(input.error());
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return fail(ErrorCode::kFailed, fmt::format("pipe: {}", std::strerror(errno)));
    FileHandle readEnd(ends[0]);
    const FileHandle writeEnd(ends[1]);
    ::fcntl(readEnd.get(), F_SETFL, O_NONBLOCK);

    const std::string path = program.empty() ? besideThisProgram() : program;
    std::vector<std::string> arguments = {path, "--parent", std::to_string(::getpid())};
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    // A clean environment: no variable steers a library, no file is written.
    std::array<std::string, 2> variables = {"LC_ALL=C", "MESA_SHADER_CACHE_DISABLE=true"};
    std::array<char*, 3> environment = {variables[0].data(), variables[1].data(), nullptr};

    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_adddup2(&files, input->get(), 0);
    posix_spawn_file_actions_adddup2(&files, writeEnd.get(), 1);
    posix_spawn_file_actions_addopen(&files, 2, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addclosefrom_np(&files, 3);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    // An own process group: Ctrl-C at a terminal reaches the parent, which then ends this child.
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    pid_t pid = -1;
    const int failure = ::posix_spawn(&pid, path.c_str(), &files, &attributes, argv.data(), environment.data());
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
    if (failure != 0)
        return fail(ErrorCode::kFailed, fmt::format("programs of materials cannot be tried: '{}' cannot be started ({}); it belongs beside the running program", path, std::strerror(failure)));
    return ProgramTrial(pid, std::move(readEnd), now + std::chrono::seconds(kSeconds));
}

ProgramTrial::ProgramTrial(ProgramTrial&& other) noexcept
    : child_(std::exchange(other.child_, -1)), output_(std::move(other.output_)), deadline_(other.deadline_), said_(std::move(other.said_)) {}

ProgramTrial::~ProgramTrial() {
    if (child_ <= 0) return;
    ::kill(child_, SIGKILL);
    (void)reap();
}

int ProgramTrial::reap() {
    int status = 0;
    while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) {
    }
    child_ = -1;
    return status;
}

std::optional<TrialVerdict> ProgramTrial::poll(TimePoint now, Duration patience) {
    pollfd waiting{output_.get(), POLLIN, 0};
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(patience).count();
    if (::poll(&waiting, 1, static_cast<int>(ms)) > 0) {
        for (std::array<char, 512> piece;;) {
            const ssize_t got = ::read(output_.get(), piece.data(), piece.size());
            if (got < 0 && errno == EINTR) continue;
            if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) break;
            if (got <= 0) return ended();
            if (said_.size() < kMostSaid) said_.append(piece.data(), static_cast<std::size_t>(got));
        }
    }
    if (now < deadline_) return std::nullopt;
    ::kill(child_, SIGKILL);
    (void)reap();
    return TrialVerdict{SurfaceProgram::kBad, fmt::format("trying it took longer than {} s", kSeconds)};
}

/// The pipe has come to its end.
TrialVerdict ProgramTrial::ended() {
    // It may have closed the pipe alone.
    ::kill(child_, SIGKILL);
    const int status = reap();
    said_.resize(std::min(said_.size(), kMostSaid));
    // A compiler's words, which quote a stranger's, go to a terminal.
    for (char& c : said_)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
    if (said_ == "good") return {SurfaceProgram::kGood, {}};
    if (said_.starts_with("bad ")) return {SurfaceProgram::kBad, said_.substr(4)};
    if (said_.starts_with("cannot ")) return {SurfaceProgram::kUntried, said_.substr(7)};
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    switch (signal) {
        case SIGXCPU: return {SurfaceProgram::kBad, fmt::format("compiling it and drawing a small picture takes more than {} s", kProcessorSeconds)};
        case SIGSEGV:
        case SIGBUS:
        case SIGABRT:
        case SIGFPE:
        case SIGILL:
        case SIGTRAP: return {SurfaceProgram::kBad, fmt::format("the compiler crashes on it ({})", ::strsignal(signal))};
        case SIGSYS: return {SurfaceProgram::kBad, "it makes the compiler call what is forbidden to it"};
        case SIGKILL: return {SurfaceProgram::kBad, "trying it was ended from outside (it needs too much memory or time)"};
        default: return {SurfaceProgram::kBad, "trying it ended without a word (it needs too much memory?)"};
    }
}

}  // namespace tessera
