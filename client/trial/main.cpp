// tessera-try-program: compiles a person's program and draws with it, in a process of its own. Started by the server,
// not by people.
//
// stdin: "SURFACE VERTEX\n", two numbers of bytes, then so many. stdout: "good", or "bad " and what is wrong.
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <exception>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "client/trial/ProgramTry.h"
#include "common/confine/Confinement.h"
#include "common/cores/SurfaceParts.h"

namespace tessera {
namespace {

constexpr std::string_view kUsage =
    "tessera-try-program: compiles a material's program and draws with it, confined;\n"
    "started by tessera-server, not by people. Reads the program from stdin.\n"
    "\n"
    "  --parent PID      ends when this process does\n"
    "  --help, --version\n";

void say(std::string_view text) {
    while (!text.empty()) {
        const ssize_t done = ::write(STDOUT_FILENO, text.data(), text.size());
        if (done < 0 && errno == EINTR) continue;
        if (done <= 0) ::_exit(1);
        text.remove_prefix(static_cast<std::size_t>(done));
    }
}

std::optional<SurfaceProgram> readProgram() {
    constexpr std::size_t kMost = std::size_t{4} << 20;
    std::string all(kMost, '\0');
    std::size_t have = 0;
    while (have < kMost) {
        const ssize_t got = ::read(STDIN_FILENO, all.data() + have, kMost - have);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) break;
        have += static_cast<std::size_t>(got);
    }
    all.resize(have);
    std::size_t surface = 0, vertex = 0;
    const char* const end = all.data() + all.size();
    const auto first = std::from_chars(all.data(), end, surface);
    if (first.ec != std::errc() || first.ptr == end || *first.ptr != ' ') return std::nullopt;
    const auto second = std::from_chars(first.ptr + 1, end, vertex);
    if (second.ec != std::errc() || second.ptr == end || *second.ptr != '\n') return std::nullopt;
    const auto at = static_cast<std::size_t>(second.ptr + 1 - all.data());
    if (surface > have || vertex > have || at + surface + vertex != have) return std::nullopt;
    return SurfaceProgram{
        .surface = all.substr(at, surface), .vertex = all.substr(at + surface, vertex), .problem = {}};
}

int run(pid_t parent) {
    constexpr std::chrono::seconds kTime{2};
    const auto cannot = [](const Error& error) {
        say("cannot " + error.message);
        return 0;
    };
    if (auto bounded = boundResources(kProgramTrialProfile, parent); !bounded) return cannot(bounded.error());
    const std::optional<SurfaceProgram> program = readProgram();
    if (!program) return cannot({ErrorCode::kBadInput, "what was asked is no program"});
    auto attempt = ProgramTry::create();
    if (!attempt) return cannot(attempt.error());
    if (auto bounded = boundFurtherTime(kTime); !bounded) return cannot(bounded.error());
    if (auto confined = confine(kProgramTrialProfile); !confined) return cannot(confined.error());
    const std::string problem = (*attempt)->problemOf(*program);
    say(problem.empty() ? "good" : "bad " + problem);
    // What is left would be given back to a driver that has just read anybody's text.
    ::_exit(0);
}

}  // namespace
}  // namespace tessera

int main(int count, char** values) {
    using namespace tessera;
    const std::span<char*> arguments(values + 1, values + count);
    const std::string_view first = arguments.empty() ? "" : arguments.front();
    if (first == "--help") {
        std::fwrite(kUsage.data(), 1, kUsage.size(), stdout);
        return 0;
    }
    if (first == "--version") {
        std::puts("tessera-try-program " TESSERA_VERSION);
        return 0;
    }
    pid_t parent = 0;
    if (!arguments.empty()) {
        const std::string_view number = arguments.size() == 2 ? arguments[1] : "";
        const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), parent);
        if (first != "--parent" || error != std::errc() || end != number.data() + number.size()) {
            std::fwrite(kUsage.data(), 1, kUsage.size(), stderr);
            return 2;
        }
    }
    try {
        return run(parent);
    } catch (const std::exception& exception) {
        say(std::string("bad it needs more memory than there may be (") + exception.what() + ")");
        return 0;
    }
}
