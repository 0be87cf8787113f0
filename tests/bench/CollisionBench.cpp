/// The pairwise stage of collision beside its peers: bench_collision [--pair A B [--poses FILE] | --held-back]
/// [--quick]
/// [--count N] [--seed N] [--passes N] [--rows GROUP,…] [--sse41] [--save-poses FOLDER] [--json FILE].
///
/// --held-back: on models and seeds that no threshold was chosen by. --sse41: with a column of what the ratios are with
/// the instructions that Debian's peers were built for, from a run of its own before this one.
///
/// Single thread where nothing else is said. Without --poses the models are normalised and posed as
/// shared/design/collision.md says (section 7); with it they are taken as they are.
#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <functional>

#include "server/collision/mesh/InstructionSet.h"
#include "tests/bench/CollisionPairs.h"
#include "tests/bench/CollisionRows.h"
#include "tests/bench/OlderProcessor.h"
#include "tests/support/Models.h"

namespace tessera {
namespace {

struct Arguments {
    std::string json, poses, saveTo;
    std::vector<ModelFiles> pairs;
    std::size_t count = 1000;
    std::uint64_t seed = 1;
    bool older = false;
    BenchOptions options;
};

[[noreturn]] void stop(int code, const std::string& why) {
    std::fprintf(stderr, "bench_collision: %s\n", why.c_str());
    std::exit(code);
}

template <typename T>
T orStop(Expected<T> value) {
    if (!value) stop(exitCode(value.error().code), value.error().message);
    return std::move(*value);
}

const std::vector<std::string> kGroups{"any",     "all",         "contacts", "distance", "toi",
                                       "volumes", "realignment", "tree",     "threads"};

Arguments parse(int argc, char** argv) {
    Arguments out;
    const std::vector<std::string> words(argv + 1, argv + argc);
    std::size_t at = 0;
    const auto next = [&] {
        if (++at >= words.size()) stop(2, words[at - 1] + " needs another word");
        return words[at];
    };
    const auto number = [&] {
        const std::string word = next();
        int value = 0;
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
        if (error != std::errc() || end != word.data() + word.size() || value < 1)
            stop(2, fmt::format("'{}' is not a count", word));
        return value;
    };
    for (; at < words.size(); ++at) {
        const std::string& word = words[at];
        if (word == "--json")
            out.json = next();
        else if (word == "--sse41")
            out.older = true;
        else if (word == "--held-back")
            out.pairs = heldBackPairs(), out.seed = 1000;
        else if (word == "--seed")
            out.seed = static_cast<std::uint64_t>(number());
        else if (word == "--pair") {
            const std::string a = next();
            out.pairs.emplace_back(a, next());
        } else if (word == "--poses")
            out.poses = next();
        else if (word == "--save-poses")
            out.saveTo = next();
        else if (word == "--count")
            out.count = static_cast<std::size_t>(number());
        else if (word == "--passes")
            out.options.passes = number();
        else if (word == "--quick")
            out.count = 100, out.options.passes = 2;
        else if (word == "--rows") {
            std::string groups = next() + ",";
            for (std::size_t comma; (comma = groups.find(',')) != groups.npos; groups.erase(0, comma + 1)) {
                const std::string group = groups.substr(0, comma);
                if (std::find(kGroups.begin(), kGroups.end(), group) == kGroups.end())
                    stop(2, fmt::format("no rows '{}'; there are {}", group, fmt::join(kGroups, ", ")));
                out.options.only.insert(group);
            }
        } else
            stop(2, fmt::format("unknown option '{}'; options: --pair A B, --poses FILE, --held-back, --quick, --count "
                                "N, --seed N, "
                                "--passes N, --sse41, --rows {}, --save-poses FOLDER, --json FILE",
                                word, fmt::join(kGroups, ",")));
    }
    if (!out.poses.empty() && out.pairs.size() != 1) stop(2, "--poses goes with one --pair A B");
    return out;
}

void measure(const BenchPair& pair, const BenchOptions& options, CollisionTable& table) {
    const FclPairs fcl(pair.a, pair.b);
    touchRows(pair, fcl, options, table);
    if (options.wants("contacts")) contactRows(pair, fcl, options, table);
    if (options.wants("distance")) distanceRows(pair, fcl, options, table);
    if (options.wants("toi")) impactRows(pair, fcl, options, table);
    if (options.wants("volumes")) volumeRows(pair, options, table);
    if (options.only.count("realignment") > 0) realignmentRows(pair, options, table);
    if (options.wants("tree")) treeRows(pair, options, table);
    if (options.wants("threads")) threadRows(pair, options, table);
}

int bench(int argc, char** argv) {
    Arguments arguments = parse(argc, argv);
    if (arguments.pairs.empty()) {
        const std::filesystem::path data = testDataFolder();
        if (!std::filesystem::exists(data))
            stop(3, fmt::format("no models at {}; set TESSERA_TEST_DATA, or name some: --pair A B", data.string()));
        arguments.pairs = standardPairs();
    }
    const auto pairOf = [&](const ModelFiles& files) {
        if (!arguments.poses.empty()) return orStop(pairFromPoseFile(files, arguments.poses));
        const bool motions = arguments.options.wants("toi") || arguments.options.wants("distance");
        return orStop(
            posedPair(files, {.poses = arguments.options.only == std::set<std::string>{"toi"} ? 0 : arguments.count,
                              .motions = motions ? std::max<std::size_t>(arguments.count / 5, 20) : 0,
                              .seed = arguments.seed,
                              .saveTo = arguments.saveTo}));
    };
    std::map<std::string, std::vector<double>> older;
    if (arguments.older) {
        std::vector<std::string> words(argv + 1, argv + argc);
        std::erase(words, "--sse41");
        older = ratiosOfOlderProcessor(std::move(words));
    }
    fmt::print("Instruction set {}. Mean, median and p99 over poses of the least of {} passes, one thread.\n",
               name(instructionSet()), arguments.options.passes);
    CollisionTable table(std::move(older));
    for (const ModelFiles& files : arguments.pairs) measure(pairOf(files), arguments.options, table);
    fmt::print("\nThe rows of neighbours: ./deploy/run-bench neighbours\n");
    if (!arguments.json.empty() && !table.writeJson(arguments.json)) stop(1, arguments.json + ": it cannot be written");
    if (table.good()) return 0;
    stop(1, "answers differ, see above");
}

}  // namespace
}  // namespace tessera

int main(int argc, char** argv) {
    return tessera::bench(argc, argv);
}
