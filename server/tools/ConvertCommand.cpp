#include "server/tools/ConvertCommand.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "common/base/Version.h"
#include "common/cores/Inline.h"
#include "common/cores/Movie.h"
#include "common/cores/ProxyGroup.h"
#include "common/options/Options.h"
#include "common/scenefile/SceneFile.h"
#include "server/tools/SceneImport.h"
#include "server/tools/WallFormats.h"

namespace tessera {
namespace {

bool makesWall(const ConvertArguments& arguments) {
    return arguments.out.ends_with(".wall");
}

Expected<void> convertWall(const ConvertArguments& arguments) {
    const Expected<ForeignWall> made = readForeignWall(arguments.in);
    if (!made) return tl::unexpected(made.error());
    for (const std::string& note : made->notes) fmt::print(stderr, "tessera-convert: note: {}\n", note);
    if (auto saved = saveForeignWall(*made, arguments.out); !saved) return saved;
    std::size_t tiles = 0;
    for (const WallHost& host : made->wall.hosts) tiles += host.tiles.size();
    fmt::print("{}: {} screens, {} tiles, {} hosts\n", arguments.out, made->wall.screens.size(), tiles,
               made->wall.hosts.size());
    return {};
}

Expected<OptimiseOptions> optimiseOptionsOf(const std::vector<std::string>& steps) {
    OptimiseOptions options;
    if (steps.empty()) return options;
    const std::pair<std::string_view, bool OptimiseOptions::*> known[] = {{"share", &OptimiseOptions::share},
                                                                          {"merge", &OptimiseOptions::merge},
                                                                          {"flatten", &OptimiseOptions::flatten},
                                                                          {"order", &OptimiseOptions::order},
                                                                          {"levels", &OptimiseOptions::levels}};
    for (const auto& [name, step] : known) options.*step = false;
    for (const std::string& step : steps) {
        const auto found = std::ranges::find(known, step, [](const auto& one) { return one.first; });
        if (found == std::end(known))
            return fail(ErrorCode::kUsage,
                        fmt::format("--steps: '{}' is no step; there are share, merge, flatten, order, levels", step));
        options.*(found->second) = true;
    }
    return options;
}

void sayCounts(const OptimiseCounts& c) {
    fmt::print("nodes {} to {}, objects {} to {}\n", c.nodesBefore, c.nodesAfter, c.objectsBefore, c.objectsAfter);
    if (c.shared > 0) fmt::print("{} objects were equal to others\n", c.shared);
    if (c.merged > 0) fmt::print("{} meshes that stand still became {}\n", c.merged, c.mergedInto);
    if (c.flattened > 0) fmt::print("{} chains of transforms became one each\n", c.flattened);
    if (c.ordered > 0) fmt::print("{} meshes in another order, {} vertices less\n", c.ordered, c.verticesJoined);
    if (c.levelled > 0) fmt::print("{} meshes have {} coarser ones\n", c.levelled, c.levels);
}

/// What it goes on needing is read where the scene is shown.
void noteNamedFiles(const Aspect& scene) {
    for (const ObjectId id : scene.ids()) {
        const Object object = scene.find(id);
        const auto* content = object.as<Inline>();
        const auto* proxy = object.as<ProxyGroup>();
        const auto* movie = object.as<Movie>();
        if (const std::string* named = content ? &content->file
                                       : proxy ? &proxy->file
                                       : movie ? &movie->file
                                               : nullptr;
            named && !named->empty())
            fmt::print(stderr, "tessera-convert: note: it goes on naming {}, which is read where the scene is shown\n",
                       *named);
    }
}

Expected<void> writeForOthers(const std::string& path, const FileScene& file, const ExportOptions& options) {
    const Expected<ExportReport> report = exportScene(path, file.scene, options);
    if (!report) return tl::unexpected(report.error());
    for (const std::string& note : report->notes) fmt::print(stderr, "tessera-convert: note: {}: {}\n", path, note);
    fmt::print("{}: {} nodes, {} triangles where they stand, {} bytes\n", path, report->nodes, report->triangles,
               report->bytes);
    for (std::size_t i = 0; i + 1 < report->files.size(); ++i) fmt::print("{}: beside it\n", report->files[i]);
    return {};
}

}  // namespace

Expected<std::variant<ConvertArguments, ConvertHelp>> parseConvertArguments(const std::vector<std::string>& words) {
    ConvertArguments out;
    Options commandLine("tessera-convert",
                        "Reads a scene or model and writes it as a scene of Tessera's: OUT holds\n"
                        "every object as it is, arrays and images included. A text's large arrays\n"
                        "lie beside it in OUT.….arrays: the two belong together. Else OUT needs\n"
                        "no file but those that it names itself: films, and scenes of Inline and\n"
                        "ProxyGroup.\n"
                        "Files for other programs have what they can hold of what is shown; notes\n"
                        "say what is lost: " +
                            exportEndings() +
                            ".\n"
                            "Of a wall of another program it makes a .wall, with what is beside it:\n" +
                            wallFormatList() + ".",
                        versionText("tessera-convert"));
    commandLine.option("IN", out.in, "A .tsct, .tsc, .gltf, .glb, .obj, …;\nor a wall").required();
    commandLine
        .option("OUT", out.out, "FILE.tsc (binary) or FILE.tsct (text);\nFILE.glb, … for other programs; FILE.wall")
        .required();
    commandLine.option("--assets", out.assets, "Folders for asset://NAME").typeName("DIR");
    commandLine
        .option("--variant", out.variants,
                "Of USD: prim P shows variant N of its set S, as\n/Chair:color=red; may be repeated")
        .typeName("P:S=N")
        .oneEach();
    commandLine
        .option("--import-memory", out.importMemoryMib,
                "What reading one file may take at least;\nlarge ones may take more by themselves")
        .typeName("MIB")
        .range(256, 1'000'000);
    commandLine.flag("--allow-unconfined-import", out.allowUnconfined,
                     "Import even where the child cannot\nbe confined");
    bool optimise = false;
    std::vector<std::string> steps, keep;
    commandLine.flag("--optimise", optimise,
                     "Less to carry, the same to look at: equal\nobjects shared, chains of transforms that\nstand "
                     "still flattened, meshes in an order\nthat draws faster");
    commandLine
        .option("--steps", steps,
                "These steps of it alone: share, flatten,\norder; merge (meshes of one material) and\nlevels (coarser "
                "ones for far away) are done\nonly where they are named")
        .typeName("STEP,…")
        .delimiter(',');
    commandLine.option("--keep", keep, "Nodes that stay as they are, with what is\nbelow them; may be repeated")
        .typeName("PATH")
        .oneEach();
    ExportOptions leaves;
    const Option under =
        commandLine
            .option(
                "--under", leaves.under,
                "For other programs: this node and what is\nbelow it alone, where it stands; of those\nabove it the "
                "places")
            .typeName("PATH");
    commandLine.flag("--still", leaves.still, "For other programs: without animations");
    commandLine
        .option("--tolerance", leaves.tolerance,
                "For other programs: how far triangles may\nbe off smooth surfaces and letters; 0: as\nthe scene says")
        .typeName("METRES")
        .number();
    const Expected<std::optional<std::string>> instead = commandLine.read(words);
    if (!instead) return fail(instead.error().code, instead.error().message + "; see --help");
    if (*instead) return ConvertHelp{**instead};
    if (namesForeignWall(out.in) && !makesWall(out))
        return fail(ErrorCode::kUsage, "a wall becomes a .wall, and nothing else; see --help");
    if (!optimise && (!steps.empty() || !keep.empty()))
        return fail(ErrorCode::kUsage, "--steps and --keep say how to --optimise; see --help");
    if (optimise) {
        Expected<OptimiseOptions> options = optimiseOptionsOf(steps);
        if (!options) return tl::unexpected(options.error());
        out.optimise = std::move(*options);
        out.optimise->keep = std::move(keep);
    }
    if (makesWall(out)) {
        if (optimise) return fail(ErrorCode::kUsage, "a wall is no scene: there is nothing to --optimise");
        return out;
    }
    if (under.given() && leaves.under.empty()) return fail(ErrorCode::kUsage, kNoUnder);
    // Before a long import, not after it.
    const Expected<bool> foreign = leadsOut(out.out, leaves);
    if (!foreign) return tl::unexpected(foreign.error());
    if (*foreign) out.leaves = std::move(leaves);
    return out;
}

int runConvert(const std::vector<std::string>& words) {
    const auto parsed = parseConvertArguments(words);
    const Expected<void> done = [&]() -> Expected<void> {
        if (!parsed) return tl::unexpected(parsed.error());
        if (const auto* help = std::get_if<ConvertHelp>(&*parsed)) {
            fmt::print("{}", help->text);
            return {};
        }
        const auto& arguments = std::get<ConvertArguments>(*parsed);
        if (makesWall(arguments)) return convertWall(arguments);
        ImportOptions import{.assetFolders = arguments.assets, .allowUnconfined = arguments.allowUnconfined};
        import.variants = arguments.variants;
        if (arguments.importMemoryMib > 0) import.maxMemoryBytes = arguments.importMemoryMib << 20;
        Expected<FileScene> file = importAsScene(arguments.in, import);
        if (!file) return tl::unexpected(file.error());
        // What is written would have lost it for good.
        if (!file->imported.faults.empty()) return fail(ErrorCode::kBadInput, file->imported.faults.front());
        for (const std::string& note : file->imported.notes) fmt::print(stderr, "tessera-convert: note: {}\n", note);
        if (!arguments.leaves) noteNamedFiles(file->scene);
        OptimiseCounts counts{.nodesAfter = file->imported.nodes,
                              .objectsAfter = file->imported.nodes + file->imported.cores};
        if (arguments.optimise) {
            if (!file->imported.later.empty())
                return fail(ErrorCode::kRefused, arguments.in +
                                                     ": a newer version saved more in it than this one knows, which "
                                                     "may name what would go; it can be converted, not optimised");
            const Expected<OptimiseCounts> optimised = optimiseScene(file->scene, *arguments.optimise);
            if (!optimised) return failWith(arguments.in, optimised.error());
            sayCounts(*optimised);
            counts = *optimised;
        }
        if (arguments.leaves) return writeForOthers(arguments.out, *file, *arguments.leaves);
        std::string arrays;
        if (Expected<void> saved = saveScene(arguments.out, file->scene, file->imported.later, &arrays); !saved)
            return saved;
        fmt::print("{}: {} nodes, {} other objects, {} triangles\n", arguments.out, counts.nodesAfter,
                   counts.objectsAfter - counts.nodesAfter, file->imported.triangles);
        if (!arrays.empty()) fmt::print("{}: its arrays; the two belong together\n", arrays);
        return {};
    }();
    if (done) return 0;
    fmt::print(stderr, "tessera-convert: {}\n", done.error().message);
    return exitCode(done.error().code);
}

}  // namespace tessera
