// storm: things of all kinds happen to a wall in this process, until a law is broken or the time is over.
#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "tests/support/wall/Storm.h"

namespace {

using namespace tessera;
using namespace tessera::simulation;

constexpr std::size_t kStepsOfAWall = 100;

void print(const StormOptions& options, const std::vector<std::uint64_t>& steps) {
    std::vector<std::string> said;
    const auto broken = Storm::run(options, steps, &said);
    for (std::size_t i = 0; i < said.size(); ++i) fmt::print("step {} ({}): {}\n", i, steps[i], said[i]);
    fmt::print("law broken: {}\n", broken ? broken->law : "none");
    fmt::print("repeat: storm --scene {} --seed {}{} --steps {}\n", options.scene, options.seed,
               options.draws ? "" : " --no-pictures", fmt::join(steps, ","));
}

int usage() {
    fmt::print(stderr,
               "usage: storm [--seconds S] [--seed N] [--scene FILE] [--no-pictures] [--steps A,B,…]\n"
               "Walls of {} steps each, seed after seed, for S seconds (60). A list of steps that breaks a law is made "
               "shorter, and printed\nwith the command that repeats it; exit code 1. --steps: this list alone.\n",
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
        if (word == "--no-pictures") {
            options.draws = false;
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
    options.scene = scene.empty() ? Storm::sceneOf(options.seed) : scene;
    if (!std::filesystem::exists(options.scene)) {
        fmt::print(stderr, "storm: {}: there is no such file\n", options.scene);
        return 3;
    }
    if (!steps.empty()) {
        print(options, steps);
        return 0;
    }
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(seconds);
    std::size_t done = 0;
    std::uint64_t granted = 0, refused = 0;
    for (; std::chrono::steady_clock::now() < end; ++options.seed) {
        options.scene = scene.empty() ? Storm::sceneOf(options.seed) : scene;
        steps = Storm::stepsOf(options.seed, kStepsOfAWall);
        Storm::Answers answers;
        const auto broken = Storm::run(options, steps, nullptr, &answers);
        granted += answers.granted;
        refused += answers.refused;
        done += broken ? broken->step : steps.size();
        if (!broken) continue;
        fmt::print("seed {}: step {}: {}\n", options.seed, broken->step, broken->law);
        std::fflush(stdout);
        print(options, Storm::shortened(options, steps, std::chrono::minutes(3)));
        return 1;
    }
    fmt::print("storm: {} steps, up to seed {}, no law broken; {} requests granted, {} refused\n", done,
               options.seed - 1, granted, refused);
}
