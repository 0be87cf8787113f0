// storm: things of all kinds happen to a wall in a child process, until a law is broken or the time is over.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "common/base/FileHandle.h"
#include "tests/support/wall/Storm.h"

namespace {

using namespace tessera;
using namespace tessera::simulation;

constexpr std::size_t kStepsOfAWall = 100;

struct RunOutcome {
    std::optional<Storm::Broken> broken;
    std::vector<std::string> said;
    Storm::Answers answers;
};

/// The limit of a child's processor time: who needs more hangs. The sanitizers are thirty times as slow.
rlim_t mostProcessorSeconds(std::size_t steps) {
    return 300 + 10 * steps;
}

/// Says what becomes of it, line by line: a step in words, the answers until then, and at last what is broken.
void runHere(const StormOptions& options, std::span<const std::uint64_t> steps, int to) {
    const auto say = [to](const std::string& line) { (void)::write(to, line.data(), line.size()); };
    const auto broken = Storm::run(options, steps, [&](std::size_t, const Storm& storm) {
        const auto [granted, refused] = storm.answers();
        say(fmt::format("step {} {} {}\n", granted, refused, storm.said()));
    });
    say(broken ? fmt::format("broken {}\n{}", broken->step, broken->law) : "whole\n");
}

/// In a child of its own: whatever ends it is the step's doing.
RunOutcome run(const StormOptions& options, std::span<const std::uint64_t> steps) {
    std::array<int, 2> ends{};
    if (::pipe(ends.data()) != 0) throw std::runtime_error("pipe");
    std::fflush(stdout);
    const pid_t child = ::fork();
    if (child < 0) throw std::runtime_error("fork");
    if (child == 0) {
        ::close(ends[0]);
        (void)::prctl(PR_SET_PDEATHSIG, SIGKILL);
        const rlim_t most = mostProcessorSeconds(steps.size());
        const rlimit limit{most, most + 10};
        (void)::setrlimit(RLIMIT_CPU, &limit);
        runHere(options, steps, ends[1]);
        std::exit(0);  // NOLINT: the leak checker looks now
    }
    ::close(ends[1]);
    const FileHandle from(ends[0]);
    std::string text;
    std::array<char, 4096> some{};
    for (ssize_t got = 0; (got = ::read(from.get(), some.data(), some.size())) > 0;)
        text.append(some.data(), static_cast<std::size_t>(got));
    int status = 0;
    ::waitpid(child, &status, 0);

    RunOutcome outcome;
    std::istringstream lines(text);
    bool whole = false;
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        std::string kind;
        words >> kind;
        if (kind == "step") {
            words >> outcome.answers.granted >> outcome.answers.refused;
            std::getline(words >> std::ws, outcome.said.emplace_back());
        } else if (kind == "whole") {
            whole = true;
        } else if (kind == "broken") {
            Storm::Broken broken;
            words >> broken.step;
            broken.law.assign(std::istreambuf_iterator<char>(lines), {});
            outcome.broken = std::move(broken);
            break;
        }
    }
    if (outcome.broken || (whole && status == 0)) return outcome;
    const std::string end = WIFSIGNALED(status)
                                ? fmt::format("signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)))
                                : fmt::format("exit code {}", WEXITSTATUS(status));
    outcome.broken = Storm::Broken{outcome.said.size(), "the program is ended by " + end};
    return outcome;
}

void print(const StormOptions& options, const std::vector<std::uint64_t>& steps) {
    const RunOutcome outcome = run(options, steps);
    for (std::size_t i = 0; i < outcome.said.size(); ++i)
        fmt::print("step {} ({}): {}\n", i, steps[i], outcome.said[i]);
    fmt::print("law broken: {}\n",
               outcome.broken ? fmt::format("step {}: {}", outcome.broken->step, outcome.broken->law) : "none");
    fmt::print("repeat: storm --scene {} --seed {}{}{} --steps {}\n", options.scene, options.seed,
               options.draws ? "" : " --no-pictures", options.still ? " --still" : "", fmt::join(steps, ","));
}

int usage() {
    fmt::print(
        stderr,
        "usage: storm [--seconds S] [--seed N] [--scene FILE] [--still] [--no-pictures] [--steps A,B,…]\n"
        "Walls of {} steps each, seed after seed, for S seconds (60). A list of steps that breaks a law is made "
        "shorter, and printed\nwith the command that repeats it; exit code 1. --steps: this list alone. --still: "
        "in FILE nothing moves by itself,\nnothing is asked for that does, and at the end all is undone.\n",
        kStepsOfAWall);
    return 2;
}

}  // namespace

int main(int count, char** values) {
    StormOptions options;
    std::string scene;
    std::uint64_t seconds = 60;
    std::vector<std::uint64_t> steps;
    const auto number = [](const char* text, std::uint64_t& into) {
        const auto [end, error] = std::from_chars(text, text + std::strlen(text), into);
        return error == std::errc() && *end == 0;
    };
    for (int i = 1; i < count; ++i) {
        const std::string word = values[i];
        if (word == "--no-pictures" || word == "--still") {
            (word == "--still" ? options.still : options.draws) = word == "--still";
            continue;
        }
        if (i + 1 == count) return usage();
        const char* const value = values[++i];
        if (word == "--seconds" ? number(value, seconds) : word == "--seed" ? number(value, options.seed) : false)
            continue;
        if (word == "--scene") {
            scene = value;
        } else if (word == "--steps") {
            std::istringstream list(value);
            for (std::string each; std::getline(list, each, ',');)
                if (!number(each.c_str(), steps.emplace_back())) return usage();
        } else {
            return usage();
        }
    }
    if (!scene.empty() && !std::filesystem::exists(scene)) {
        fmt::print(stderr, "storm: {}: there is no such file\n", scene);
        return 3;
    }
    auto next = [&, seed = options.seed]() mutable {
        StormOptions chosen = options;
        chosen.scene = scene;
        if (scene.empty()) chosen = Storm::optionsOf(seed, options.draws);
        chosen.seed = seed++;
        return chosen;
    };
    if (!steps.empty()) {
        print(next(), steps);
        return 0;
    }
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(seconds);
    std::size_t done = 0, walls = 0;
    std::uint64_t granted = 0, refused = 0;
    for (; std::chrono::steady_clock::now() < end; ++walls) {
        const StormOptions chosen = next();
        steps = Storm::stepsOf(chosen.seed, kStepsOfAWall);
        const RunOutcome outcome = run(chosen, steps);
        granted += outcome.answers.granted;
        refused += outcome.answers.refused;
        done += outcome.said.size();
        if (!outcome.broken) continue;
        fmt::print("seed {}: step {}: {}\n", chosen.seed, outcome.broken->step, outcome.broken->law);
        std::fflush(stdout);
        const auto runner = [&chosen](std::span<const std::uint64_t> list) { return run(chosen, list).broken; };
        print(chosen, Storm::shortened(steps, runner, std::chrono::minutes(3)));
        return 1;
    }
    fmt::print("storm: {} walls from seed {} on, {} steps, no law broken; {} requests granted, {} refused\n", walls,
               options.seed, done, granted, refused);
}
