/// What one changed object costs the server's collisions, in a small scene and in a large one:
/// bench_edits [--small N] [--large N] [--objects N] [--edits N] [--row NAME] [--block scene|objects|moving|bodies]
/// [--json FILE].
/// The medians of sceneChanged + step + pickNode, in µs, and of what is between edits.
#include <fmt/format.h>

#include <algorithm>

#include "server/collision/pipeline/ScenePicker.h"
#include "tests/bench/CaseFile.h"
#include "tests/bench/EditScenes.h"

namespace tessera::edits {
namespace {

double medianOf(std::vector<double> times) {
    const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
    std::nth_element(times.begin(), middle, times.end());
    return *middle;
}

/// `only`: one row, of the larger scene alone.
template <typename Kind>
void rows(std::size_t small, std::size_t large, int edits, const std::string& only, const std::string& group,
          bench::CaseFile& file) {
    if (!only.empty()) {
        for (const auto& [name, make] : Kind::edits())
            if (name == only) fmt::print("{:<28}{:>24.1f}\n", name, medianOf(Kind(large).times(make, edits)));
        return;
    }
    Kind few(small), many(large);
    for (const auto& [name, make] : Kind::edits()) {
        (void)few.times(make, edits / 10 + 2);
        (void)many.times(make, edits / 10 + 2);
        const double a = medianOf(few.times(make, edits)), b = medianOf(many.times(make, edits));
        fmt::print("{:<28}{:>12.1f}{:>12.1f}{:>8.2f}\n", name, a, b, b / a);
        file.add(fmt::format("{}: {}", group, name), fmt::format("{} instead of {}", small, large), b, a, "µs");
    }
}

}  // namespace
}  // namespace tessera::edits

int main(int argc, char** argv) {
    std::size_t small = 1'000, large = 100'000, objects = 1'000;
    int edits = 202;
    std::string only, block;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string word = argv[i];
        const auto value = static_cast<std::size_t>(std::atoll(argv[i + 1]));
        if (word == "--small") small = value;
        if (word == "--large") large = value;
        if (word == "--objects") objects = value;
        if (word == "--edits") edits = static_cast<int>(value);
        if (word == "--row") only = argv[i + 1];
        if (word == "--block") block = argv[i + 1];
    }
    tessera::bench::CaseFile file(argc, argv);
    fmt::print("{:<28}{:>12}{:>12}{:>8}\n", "one edit, us", small, large, "ratio");
    const auto wanted = [&](const char* name) { return block.empty() || block == name; };
    if (wanted("scene")) tessera::edits::rows<tessera::edits::Things>(small, large, edits, only, "one edit", file);
    if (wanted("objects")) {
        fmt::print("{:<28}{:>12}{:>12}\n", "each with an interest", objects / 10, objects);
        tessera::edits::rows<tessera::edits::Objects>(objects / 10, objects, edits, only, "each with an interest",
                                                      file);
    }
    if (wanted("moving")) {
        fmt::print("{:<28}{:>12}{:>12}\n", "and all of them move", objects / 10, objects);
        tessera::edits::rows<tessera::edits::MovingObjects>(objects / 10, objects, edits / 5 + 1, only,
                                                            "and all of them move", file);
    }
    if (!wanted("bodies")) return file.write();
    fmt::print("{:<28}{:>12}{:>12}\n", "among free bodies asleep", small, large);
    tessera::edits::rows<tessera::edits::Bodies>(small, large, edits / 5 + 1, only, "among free bodies asleep", file);
    return file.write();
}
