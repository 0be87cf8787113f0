/// What a scene costs: a million nodes beside OpenSceneGraph and alone, one change in a large scene beside one in a
/// small scene, idle frames, an idle wall. README.md names the rows.
///
///     bench_scene [--json FILE] [--rows tree,alone,edits,idle,wall] [--only TEXT] [--nodes N] [--walls N,N] [--quick]
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "tests/bench/SceneRows.h"
#include "tests/bench/SceneTreeOurs.h"

namespace tessera::bench {
namespace {

constexpr const char* kUsage =
    "usage: bench_scene [--json FILE] [--rows tree,alone,edits,idle,wall] [--only TEXT] [--nodes N]\n"
    "       [--walls N,N] [--quick]\n";

/// "1000,100000"
std::vector<std::uint64_t> numbers(const std::string& text) {
    std::vector<std::uint64_t> all;
    std::istringstream in(text);
    for (std::string one; std::getline(in, one, ',');) all.push_back(std::strtoull(one.c_str(), nullptr, 10));
    return all;
}

int bench(const std::vector<std::string>& arguments) {
    SceneOptions options;
    options.program = std::filesystem::read_symlink("/proc/self/exe");
    std::string json, wanted = "tree,alone,edits,idle,wall";
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const bool last = i + 1 == arguments.size();
        if (arguments[i] == "--quick") {
            options.quick = true;
        } else if (last) {
            std::fputs(kUsage, stderr);
            return 2;
        } else if (arguments[i] == "--tree-side") {
            return serveOurTree(std::strtoull(arguments[i + 1].c_str(), nullptr, 10));
        } else if (arguments[i] == "--json") {
            json = arguments[++i];
        } else if (arguments[i] == "--rows") {
            wanted = arguments[++i];
        } else if (arguments[i] == "--only") {
            options.only = arguments[++i];
        } else if (arguments[i] == "--walls") {
            options.walls = numbers(arguments[++i]);
        } else if (arguments[i] == "--nodes") {
            options.many = std::max<std::uint64_t>(1000, std::strtoull(arguments[++i].c_str(), nullptr, 10));
        } else {
            std::fputs(kUsage, stderr);
            return 2;
        }
    }
    SceneTable table;
    const struct {
        const char* name;
        void (*rows)(SceneTable&, const SceneOptions&);
    } parts[] = {{"tree", treeRows}, {"alone", aloneRows}, {"edits", editRows}, {"idle", idleRows}, {"wall", wallRows}};
    int ran = 0;
    for (const auto& part : parts) {
        if (("," + wanted + ",").find("," + std::string(part.name) + ",") == std::string::npos) continue;
        part.rows(table, options);
        ++ran;
    }
    if (ran == 0) {
        std::fputs(kUsage, stderr);
        return 2;
    }
    table.summarise();
    if (!json.empty() && !table.writeJson(json)) {
        std::fprintf(stderr, "bench_scene: %s cannot be written\n", json.c_str());
        return 1;
    }
    return table.good() ? 0 : 1;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
    return tessera::bench::bench({argv + 1, argv + argc});
}
