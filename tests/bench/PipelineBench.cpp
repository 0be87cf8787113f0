/// The frame of our collision pipeline beside the loops that users of Bullet and FCL write:
/// bench_pipeline [--rows GROUP,…] [--quick] [--passes N] [--plant FOLDER] [--parts FILE] [--sse41] [--json FILE].
///
/// One thread where nothing else is said. Contenders take turns pass by pass; a row summarises, over the frames, the
/// least time of each frame. "step" is CollisionPipeline::step alone; "with commit" also what the frame loop does
/// besides: pack what was accepted into a change list, apply it to the scene, tell the pipeline.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>

#include "tests/bench/OlderProcessor.h"
#include "tests/bench/PipelineRows.h"
#include "tests/support/Models.h"

namespace {

const std::vector<std::string> kGroups{"convex",     "plant",   "rest", "touch",      "interests",
                                       "deform",     "threads", "pour", "pour-large", "pour-1000",
                                       "pour-10000", "sleep",   "pairs"};

[[noreturn]] void stop(const std::string& why) {
    std::fprintf(stderr, "bench_pipeline: %s\n", why.c_str());
    std::exit(2);
}

void choose(tessera::PipelineOptions& options, std::string groups) {
    groups += ',';
    for (std::size_t comma; (comma = groups.find(',')) != groups.npos; groups.erase(0, comma + 1)) {
        const std::string group = groups.substr(0, comma);
        if (std::find(kGroups.begin(), kGroups.end(), group) == kGroups.end())
            stop(fmt::format("no rows '{}'; there are {}", group, fmt::join(kGroups, ", ")));
        options.only.insert(group);
    }
}

}  // namespace

int main(int argc, char** argv) {
    tessera::PipelineOptions options;
    options.plant = (tessera::testDataFolder() / "plant").string();
    options.parts = "/usr/share/assimp/models/glTF2/2CylinderEngine-glTF-Binary/2CylinderEngine.glb";
    std::string json;
    std::vector<std::string> words(argv + 1, argv + argc);
    for (std::size_t at = 0; at < words.size(); ++at) {
        const std::string& word = words[at];
        if (word == "--sse41") continue;
        if (word == "--quick") {
            options.quick = true;
            options.passes = 1;
            continue;
        }
        if (at + 1 == words.size()) stop(word + " is no option, or needs another word");
        const std::string& value = words[++at];
        if (word == "--json")
            json = value;
        else if (word == "--rows")
            choose(options, value);
        else if (word == "--plant")
            options.plant = value;
        else if (word == "--parts")
            options.parts = value;
        else if (word == "--passes")
            options.passes = std::max(1, std::atoi(value.c_str()));
        else
            stop(fmt::format(
                "unknown option '{}'; options: --rows {}, --quick, --passes N, --plant FOLDER, --parts FILE, "
                "--sse41, --json FILE",
                word, fmt::join(kGroups, ",")));
    }
    std::map<std::string, std::vector<double>> older;
    if (std::erase(words, "--sse41") > 0) older = tessera::ratiosOfOlderProcessor(words);
    tessera::CollisionTable table(std::move(older));
    tessera::convexRows(options, table);
    if (options.wants("plant") || options.wants("threads")) tessera::plantRows(options, table);
    if (options.wants("rest")) tessera::restRows(options, table);
    if (options.wants("touch")) tessera::touchRows(options, table);
    if (options.wants("interests")) tessera::interestRows(options, table);
    if (options.wants("deform")) tessera::deformRows(options, table);
    tessera::pourRows(options, table);
    for (const char* const scene : {"pour-1000", "pour-10000"})
        if (options.wants(scene)) tessera::fileRows(scene, options, table);
    if (options.wants("sleep")) tessera::sleepRows(options, table);
    if (options.wants("pairs")) tessera::pairRows(options, table);
    if (!json.empty() && !table.writeJson(json)) {
        std::fprintf(stderr, "bench_pipeline: %s cannot be written\n", json.c_str());
        return 1;
    }
    return table.good() ? 0 : 1;
}
