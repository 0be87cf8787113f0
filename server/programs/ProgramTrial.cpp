#include "server/programs/ProgramTrial.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

namespace tessera {
namespace {

/// A file in memory that holds it: the child reads when it likes, and nobody waits.
Expected<FileHandle> asFile(const SurfaceProgram& what) {
    FileHandle file(::memfd_create("program", MFD_CLOEXEC));
    const std::string text =
        fmt::format("{} {}\n", what.surface.size(), what.vertex.size()) + what.surface + what.vertex;
    std::size_t done = 0;
    while (file.get() >= 0 && done < text.size()) {
        const ssize_t now = ::write(file.get(), text.data() + done, text.size() - done);
        if (now < 0 && errno == EINTR) continue;
        if (now <= 0) break;
        done += static_cast<std::size_t>(now);
    }
    if (done < text.size() || ::lseek(file.get(), 0, SEEK_SET) != 0)
        return fail(ErrorCode::kFailed, fmt::format("a program cannot be handed on ({})", std::strerror(errno)));
    return file;
}

constexpr std::size_t kMostSaid = 4096;

}  // namespace

Expected<ProgramTrial> ProgramTrial::start(const SurfaceProgram& what, const std::string& program, TimePoint now) {
    Expected<FileHandle> input = asFile(what);
    if (!input) return tl::unexpected(input.error());
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0)
        return fail(ErrorCode::kFailed, fmt::format("pipe: {}", std::strerror(errno)));
    FileHandle readEnd(ends[0]);
    const FileHandle writeEnd(ends[1]);
    ::fcntl(readEnd.get(), F_SETFL, O_NONBLOCK);

    // No file is written there, a cache's neither.
    Expected<ChildProgram> child =
        ChildProgram::start({.path = program.empty() ? pathBesideThisProgram("tessera-try-program") : program,
                             .arguments = {"--parent", std::to_string(::getpid())},
                             .environment = {"MESA_SHADER_CACHE_DISABLE=true"},
                             .files = {{input->get(), 0}, {writeEnd.get(), 1}}});
    if (!child) return fail(child.error().code, "programs of materials cannot be tried: " + child.error().message);
    return ProgramTrial(std::move(*child), std::move(readEnd), now + std::chrono::seconds(kSeconds));
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
    (void)child_.kill();
    return TrialVerdict{SurfaceProgram::kBad, fmt::format("trying it took longer than {} s", kSeconds)};
}

/// The pipe has come to its end.
TrialVerdict ProgramTrial::ended() {
    // It may have closed the pipe alone.
    const int status = child_.kill();
    said_.resize(std::min(said_.size(), kMostSaid));
    // A compiler's words, which quote a stranger's, go to a terminal.
    for (char& c : said_)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
    if (said_ == "good") return {SurfaceProgram::kGood, {}};
    if (said_.starts_with("bad ")) return {SurfaceProgram::kBad, said_.substr(4)};
    if (said_.starts_with("cannot ")) return {SurfaceProgram::kUntried, said_.substr(7)};
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    switch (signal) {
        case SIGXCPU:
            return {SurfaceProgram::kBad,
                    fmt::format("compiling it and drawing a small picture takes more than {} s", kProcessorSeconds)};
        case SIGSEGV:
        case SIGBUS:
        case SIGABRT:
        case SIGFPE:
        case SIGILL:
        case SIGTRAP:
            return {SurfaceProgram::kBad, fmt::format("the compiler crashes on it ({})", ::strsignal(signal))};
        case SIGSYS:
            return {SurfaceProgram::kBad, "it makes the compiler call what is forbidden to it"};
        case SIGKILL:
            return {SurfaceProgram::kBad, "trying it was ended from outside (it needs too much memory or time)"};
        default:
            return {SurfaceProgram::kBad, "trying it ended without a word (it needs too much memory?)"};
    }
}

}  // namespace tessera
