/// The pairwise stage of collision beside its peers: bench_collision [--pair A B [--poses FILE]] [--quick] [--count N]
/// [--passes N] [--rows GROUP,…] [--save-poses FOLDER] [--json FILE].
///
/// Single thread where nothing else is said. Without --poses the models are normalised and posed as
/// shared/design/collision.md says (section 7); with it they are taken as they are.
#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <fstream>
#include <functional>

#include "server/collision/mesh/InstructionSet.h"
#include "server/collision/query/DistanceQuery.h"
#include "server/tools/PoseFile.h"
#include "tests/bench/CollisionRows.h"
#include "tests/support/Models.h"
#include "tests/support/PoseGenerator.h"

namespace tessera {
namespace {

struct Arguments {
    std::string json, poses, saveTo;
    std::vector<std::pair<std::string, std::string>> pairs;
    std::size_t count = 1000;
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

const std::vector<std::string> kGroups{"any", "all", "contacts", "distance", "toi", "volumes", "realignment", "tree", "threads"};

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
        if (word == "--json") out.json = next();
        else if (word == "--pair") {
            const std::string a = next();
            out.pairs.emplace_back(a, next());
        } else if (word == "--poses") out.poses = next();
        else if (word == "--save-poses") out.saveTo = next();
        else if (word == "--count") out.count = static_cast<std::size_t>(number());
        else if (word == "--passes") out.options.passes = number();
        else if (word == "--quick") out.count = 100, out.options.passes = 2;
        else if (word == "--rows") {
            std::string groups = next() + ",";
            for (std::size_t comma; (comma = groups.find(',')) != groups.npos; groups.erase(0, comma + 1)) {
                const std::string group = groups.substr(0, comma);
                if (std::find(kGroups.begin(), kGroups.end(), group) == kGroups.end())
                    stop(2, fmt::format("no rows '{}'; there are {}", group, fmt::join(kGroups, ", ")));
                out.options.only.insert(group);
            }
        } else stop(2, fmt::format("unknown option '{}'; options: --pair A B, --poses FILE, --quick, --count N, --passes N, "
                                   "--rows {}, --save-poses FOLDER, --json FILE", word, fmt::join(kGroups, ",")));
    }
    if (!out.poses.empty() && out.pairs.size() != 1) stop(2, "--poses goes with one --pair A B");
    return out;
}

std::string nameOf(const std::filesystem::path& a, const std::filesystem::path& b, const BenchPair& pair) {
    return fmt::format("{} ({}) x {} ({})", a.stem().string(), pair.a.faceCount(), b.stem().string(),
                       pair.b.faceCount());
}

void saveLines(const std::filesystem::path& file, const std::vector<std::string>& lines) {
    std::ofstream out(file);
    for (const std::string& line : lines) out << line << "\n";
    if (!out) stop(1, file.string() + ": it cannot be written");
}

std::string textOf(const Pose& p) {
    return fmt::format("{:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}", p.translation.x(), p.translation.y(),
                       p.translation.z(), p.rotation.w(), p.rotation.x(), p.rotation.y(), p.rotation.z());
}

BenchPair generated(const std::string& fileA, const std::string& fileB, const Arguments& arguments) {
    BenchPair pair;
    pair.a = normalised(orStop(loadModel(fileA)));
    pair.b = normalised(orStop(loadModel(fileB)));
    pair.name = nameOf(fileA, fileB, pair);
    const TriangleTree a(pair.a), b(pair.b);
    std::vector<std::string> poseLines, motionLines;
    const bool touch = arguments.options.only.empty() || arguments.options.only != std::set<std::string>{"toi"};
    if (touch)
        for (const TestPose& pose : makePoses(ownOracle(a, b), arguments.count, 1)) {
            if (pose.closeness == Closeness::kNear) pair.near.push_back(pair.poses.size());
            pair.poses.push_back(pose.a_T_b.matrix());
            poseLines.push_back(textOf(pose.a_T_b));
        }
    if (arguments.options.wants("toi") || arguments.options.wants("distance"))
        pair.motions = makeMotions(ownOracle(a, b), std::max<std::size_t>(arguments.count / 5, 20), 2);
    for (const BodyMotion& m : pair.motions) motionLines.push_back(textOf(m.start) + " " + textOf(m.end));
    if (!arguments.saveTo.empty()) {
        const std::string stem = std::filesystem::path(fileA).stem().string() + "-" + std::filesystem::path(fileB).stem().string();
        saveLines(std::filesystem::path(arguments.saveTo) / (stem + ".poses"), poseLines);
        saveLines(std::filesystem::path(arguments.saveTo) / (stem + ".motions"), motionLines);
    }
    return pair;
}

/// The models and poses as the files have them. Lines of 14 numbers are motions, and their starts are poses too.
BenchPair fromPoseFile(const std::string& fileA, const std::string& fileB, const Arguments& arguments) {
    BenchPair pair;
    pair.a = orStop(loadModel(fileA));
    pair.b = orStop(loadModel(fileB));
    pair.name = nameOf(fileA, fileB, pair);
    const TriangleTree a(pair.a), b(pair.b);
    const double nearly = 0.01 * pair.a.bounds().size().norm();
    for (const PoseLine& line : orStop(readPoses(arguments.poses))) {
        const Affine3d a_T_b = line.start.matrix();
        QueryWork work;
        const Distance distance = distanceBetween(a, b, a_T_b, work, {.upperBound = nearly});
        if (distance.distance > 0 && !distance.farther) pair.near.push_back(pair.poses.size());
        pair.poses.push_back(a_T_b);
        if (line.end) pair.motions.push_back({line.start, *line.end});
    }
    if (pair.poses.empty()) stop(3, arguments.poses + ": there is no pose in it");
    return pair;
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
        arguments.pairs = {{data / "scan/stanford_bun_zipper.ply", data / "scan/stanford_bun_zipper.ply"},
                           {data / "plant/EZ_Control_valve.obj", data / "plant/Painted_gray.obj"}};
    }
    fmt::print("Instruction set {}. Mean, median and p99 over poses of the least of {} passes, one thread.\n",
               name(instructionSet()), arguments.options.passes);
    CollisionTable table;
    for (const auto& [a, b] : arguments.pairs)
        measure(arguments.poses.empty() ? generated(a, b, arguments) : fromPoseFile(a, b, arguments), arguments.options,
                table);
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
