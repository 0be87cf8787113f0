#include "client/replica/HostCheck.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <thread>

#include "client/draw/passes/Renderer.h"
#include "common/base/Clock.h"
#include "common/base/FileHandle.h"
#include "common/base/LowerCase.h"

namespace tessera {

namespace {

constexpr std::size_t kMostSaid = std::size_t{64} << 10;
constexpr std::chrono::seconds kLongestAnswer(10);

struct Said {
    int exitCode = -1;  ///< -1: it was killed, or took too long
    std::string text;   ///< both outputs
};

/// A short program's words.
Expected<Said> listenTo(std::vector<std::string> words) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) return fail(ErrorCode::kFailed, std::strerror(errno));
    const FileHandle out(ends[0]);
    FileHandle in(ends[1]);
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&files, in.get(), STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&files, in.get(), STDERR_FILENO);
    pid_t process = 0;
    const int error = ::posix_spawn(&process, arguments[0], &files, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    if (error != 0) return fail(ErrorCode::kFailed, fmt::format("{}: {}", words[0], std::strerror(error)));
    in = FileHandle();
    Said said;
    const TimePoint deadline = clockNow() + kLongestAnswer;
    for (;;) {
        const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - clockNow()).count();
        pollfd handle{.fd = out.get(), .events = POLLIN, .revents = 0};
        const int ready = left > 0 ? ::poll(&handle, 1, static_cast<int>(left)) : 0;
        if (ready < 0 && errno == EINTR) continue;
        char buffer[4096];
        const ssize_t got = ready > 0 ? ::read(out.get(), buffer, sizeof buffer) : -1;
        if (got <= 0 || said.text.size() > kMostSaid) break;
        said.text.append(buffer, static_cast<std::size_t>(got));
    }
    // Either it has closed its outputs, and ends, or it has had its time.
    if (clockNow() >= deadline || said.text.size() > kMostSaid) ::kill(process, SIGKILL);
    int status = 0;
    while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
    }
    if (WIFEXITED(status)) said.exitCode = WEXITSTATUS(status);
    return said;
}

std::vector<std::string> linesOf(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);)
        if (!line.empty()) lines.push_back(line);
    return lines;
}

void checkSurface(const HostOptions& options, HostCheck& check) {
    const auto surface = makeSurface(options.surface, {.device = options.device});
    if (!surface) return check.lacks.push_back(surface.error().message);
    const auto renderer = Renderer::create(**surface, {.samples = 4});  // which makes it current
    check.facts.push_back("surface " + (*surface)->description());
    if (!renderer) return check.lacks.push_back((*surface)->description() + ": " + renderer.error().message);
    const auto pixels = (*renderer)->pixelProbe();
    if (!pixels) return check.lacks.push_back((*surface)->description() + ": " + pixels.error().message);
    check.facts.push_back(fmt::format("pixels {:016x}", *pixels));
}

/// By what tessera-window says: this process must not load what opens windows.
void checkWindows(const TileWindowsOptions& windows, HostCheck& check) {
    const auto said = listenTo({windows.program, "--monitors"});
    if (!said) return check.lacks.push_back("windows: " + said.error().message);
    const std::vector<std::string> lines = linesOf(said->text);
    constexpr std::string_view kWho = "tessera-window: ";
    if (said->exitCode != 0)
        return check.lacks.push_back(lines.empty() ? "windows: tessera-window --monitors says nothing"
                                     : lines.back().starts_with(kWho) ? "windows: " + lines.back().substr(kWho.size())
                                                                      : "windows: " + lines.back());
    for (const std::string& line : lines) check.facts.push_back("monitor " + line);
    for (const std::string& wanted : windows.monitors) {
        const bool there = std::ranges::any_of(lines, [&](const std::string& line) {
            return line.starts_with(wanted + ": ") ||
                   lowerCase(line).find(lowerCase(": \"" + wanted + "\", ")) != std::string::npos;
        });
        if (!there) check.lacks.push_back(fmt::format("no monitor is called \"{}\"", wanted));
    }
}

}  // namespace

HostCheck checkHost(const HostOptions& options) {
    HostCheck check;
    check.facts.push_back(fmt::format("cores {}", std::max(1u, std::thread::hardware_concurrency())));
    if (options.surface != "none") checkSurface(options, check);
    if (options.window) checkWindows(options.windows, check);
    return check;
}

Expected<void> checkWindows(const TileWindowsOptions& windows) {
    HostCheck check;
    checkWindows(windows, check);
    if (check.lacks.empty()) return {};
    return fail(ErrorCode::kUnsupported, fmt::format("{}", fmt::join(check.lacks, "; ")));
}

}  // namespace tessera
