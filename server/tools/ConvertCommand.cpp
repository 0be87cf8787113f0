#include "server/tools/ConvertCommand.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "common/base/Version.h"
#include "common/scenefile/SceneFile.h"
#include "server/tools/SceneImport.h"
#include "server/tools/mpcdi/MpcdiWall.h"

namespace tessera {
namespace {

bool isMpcdi(const std::string& path) {
    return path.ends_with(".mpcdi") || path.ends_with(".MPCDI");
}

Expected<void> convertMpcdi(const ConvertArguments& arguments) {
    const auto file = readMpcdi(arguments.in);
    if (!file) return tl::unexpected(file.error());
    const auto made = wallOfMpcdi(*file);
    if (!made) return failWith(arguments.in, made.error());
    for (const std::string& note : made->notes) fmt::print(stderr, "tessera-convert: note: {}\n", note);
    if (auto saved = saveMpcdiWall(*made, arguments.out); !saved) return saved;
    fmt::print("{}: {} projectors\n", arguments.out, made->wall.hosts.size());
    return {};
}

}  // namespace

Expected<std::variant<ConvertArguments, ConvertHelp>> parseConvertArguments(const std::vector<std::string>& words) {
    ConvertArguments out;
    CLI::App app(
        "Reads a scene or model and writes it as a scene of Tessera's: OUT holds\n"
        "every object as it is, arrays and images included, and needs no other file.\n"
        "Of a .mpcdi it makes a .wall, with warp meshes and blend pictures beside it.",
        "tessera-convert");
    app.get_formatter()->column_width(30);
    app.set_version_flag("--version", versionText("tessera-convert"));
    app.add_option("IN", out.in, "A .tsct, .tsc, .gltf, .glb, .obj, …; .mpcdi")->required();
    app.add_option("OUT", out.out, "FILE.tsc (binary) or FILE.tsct (text);\nFILE.wall")->required();
    app.add_option("--assets", out.assets, "Folders for asset://NAME")->type_name("DIR");
    app.add_flag("--allow-unconfined-import", out.allowUnconfined, "Import even where the child cannot\nbe confined");
    try {
        std::vector<std::string> reversed(words.rbegin(), words.rend());  // as CLI11 wants them
        app.parse(std::move(reversed));
    } catch (const CLI::CallForHelp&) {
        return ConvertHelp{app.help()};
    } catch (const CLI::CallForVersion&) {
        return ConvertHelp{versionText("tessera-convert") + "\n"};
    } catch (const CLI::ParseError& wrong) {
        return fail(ErrorCode::kUsage, fmt::format("{}; see --help", wrong.what()));
    }
    if (isMpcdi(out.in) != out.out.ends_with(".wall"))
        return fail(ErrorCode::kUsage, "a .wall is made of a .mpcdi, and of nothing else; see --help");
    if (isMpcdi(out.in)) return out;
    // Before a long import, not after it.
    if (const Expected<SceneEncoding> encoding = sceneEncodingOf(out.out); !encoding) return tl::unexpected(encoding.error());
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
        if (isMpcdi(arguments.in)) return convertMpcdi(arguments);
        const Expected<FileScene> file =
            importAsScene(arguments.in, {.assetFolders = arguments.assets, .allowUnconfined = arguments.allowUnconfined});
        if (!file) return tl::unexpected(file.error());
        for (const std::string& note : file->imported.notes) fmt::print(stderr, "tessera-convert: note: {}\n", note);
        if (Expected<void> saved = saveScene(arguments.out, file->scene, file->imported.later); !saved) return saved;
        fmt::print("{}: {} nodes, {} other objects, {} triangles\n", arguments.out, file->imported.nodes,
                   file->imported.cores, file->imported.triangles);
        return {};
    }();
    if (done) return 0;
    fmt::print(stderr, "tessera-convert: {}\n", done.error().message);
    return exitCode(done.error().code);
}

}  // namespace tessera
