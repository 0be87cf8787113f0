#include "server/tools/CheckCommand.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/base/Version.h"
#include "common/codec/WallCodec.h"
#include "common/export/Export.h"
#include "common/options/Options.h"
#include "common/scenefile/SceneFile.h"
#include "common/wall/WallNotes.h"
#include "server/import/FormatTable.h"
#include "server/panel/PanelInScene.h"
#include "server/tools/MachineCheck.h"
#include "server/tools/SceneImport.h"
#include "server/tools/WallFormats.h"

namespace tessera {

namespace {

/// One object per format, as other reports have one per file.
std::string formatsJson() {
    std::string text;
    const auto listOf = [](std::string_view left) {
        std::vector<std::string_view> endings;
        while (!left.empty()) {
            endings.push_back(left.substr(0, left.find(' ')));
            left.remove_prefix(std::min(endings.back().size() + 1, left.size()));
        }
        return endings;
    };
    for (const FormatRow& row : formatTable()) {
        const nlohmann::ordered_json json = {{"format", row.name},   {"endings", listOf(row.endings)},
                                             {"reader", row.reader}, {"arrives", row.arrives},
                                             {"does_not", row.lost}, {"picture", row.isPicture}};
        text += json.dump() + "\n";
    }
    for (const ExportFormat& format : exportFormats()) {
        const nlohmann::ordered_json json = {{"written", format.name},
                                             {"endings", listOf(format.endings)},
                                             {"keeps", format.keeps},
                                             {"loses", format.lost}};
        text += json.dump() + "\n";
    }
    return text;
}

}  // namespace

Expected<std::variant<CheckArguments, CheckText>> parseCheckArguments(const std::vector<std::string>& words) {
    CheckArguments out;
    bool schema = false, formats = false;
    Options options("tessera-check",
                    "Says what is wrong with walls, panels and scenes, with line and column where\n"
                    "they are text: FILE:LINE:COLUMN: what. Exits 0 where all are good, else as the\n"
                    "first that is not: 3 for a bad or missing file.",
                    versionText("tessera-check"));
    options.option("FILE", out.files, "Walls (.wall), panels (.panel), scenes and models");
    options.option("--assets", out.assets, "A folder for asset://NAME; may be repeated").typeName("DIR").oneEach();
    options.option("--scene", out.scene, "Panels are to have their nodes and fields in it").typeName("S");
    options.flag("--machine", out.machine,
                 "Says what this machine lacks for a wall, with\nthe cure; exits 1 where no wall would run");
    options.flag("--json", out.json, "One JSON object per file, or thing of the machine");
    options.flag("--schema", schema, "Prints scene.proto: scene files for\nprotobuf in other languages");
    options.flag(
        "--formats", formats,
        "Prints the tables of formats: what of each\narrives, and what does not; what each that is\nwritten keeps");
    options
        .option("--variant", out.variants,
                "Of USD: prim P shows variant N of its set S, as\n/Chair:color=red; may be repeated")
        .typeName("P:S=N")
        .oneEach();
    options
        .option("--import-memory", out.importMemoryMib,
                "What reading one file may take at least;\nlarge ones may take more by themselves")
        .typeName("MIB")
        .range(256, 1'000'000);
    options.flag("--allow-unconfined-import", out.allowUnconfined, "Import even where the child cannot\nbe confined");
    const Expected<std::optional<std::string>> instead = options.read(words);
    if (!instead) return fail(instead.error().code, instead.error().message + "; see --help");
    if (*instead) return CheckText{**instead};
    if (schema) return CheckText{sceneSchemaText()};
    if (out.machine && out.files.empty()) return out;
    if (out.machine) return fail(ErrorCode::kUsage, "--machine looks at this machine, and takes no FILE; see --help");
    if (formats)
        return CheckText{out.json ? formatsJson()
                                  : formatsText() +
                                        "\nFor other programs (tessera-convert IN OUT, tessera-ctl save FILE)\n\n" +
                                        exportFormatsText()};
    if (out.files.empty()) return fail(ErrorCode::kUsage, "name a FILE; see --help");
    return out;
}

namespace {

/// Of a panel by itself, or in a scene: what is wrong, a line each; empty: nothing.
Expected<std::string> faultsOf(const Panel& panel, const std::string& path, const CheckArguments& arguments) {
    if (arguments.scene.empty()) return std::string();
    const Expected<FileScene> scene = importAsScene(
        arguments.scene, {.assetFolders = arguments.assets, .allowUnconfined = arguments.allowUnconfined});
    if (!scene) return tl::unexpected(scene.error());
    std::string faults;
    const PanelInScene there(panel, scene->scene);
    for (const std::string& fault : there.faults())
        faults += fmt::format("{}{}: {}", faults.empty() ? "" : "\n", path, fault);
    return faults;
}

}  // namespace

CheckResult checkFile(const std::string& path, const CheckArguments& arguments) {
    CheckResult result{.file = path};
    const auto bad = [&](const Error& error) {
        result.what = error.message;
        result.exitCode = exitCode(error.code);
        return result;
    };
    if (path.ends_with(".wall")) {
        const Expected<Wall> wall = loadWall(path);
        if (!wall) return bad(wall.error());
        std::size_t tiles = 0;
        for (const auto& host : wall->hosts) tiles += host.tiles.size();
        result.what =
            fmt::format("a wall of {} screens, {} tiles, {} hosts", wall->screens.size(), tiles, wall->hosts.size());
        result.notes = wallNotes(*wall);
        return result;
    }
    if (path.ends_with(".panel")) {
        const Expected<std::string> text = readPanelFile(path);
        if (!text) return bad(text.error());
        const Expected<Panel> panel = parsePanel(*text, path);
        if (!panel) return bad(panel.error());
        const Expected<std::string> faults = faultsOf(*panel, path, arguments);
        if (!faults) return bad(faults.error());
        if (!faults->empty()) return bad({ErrorCode::kBadInput, *faults});
        result.what = fmt::format("a panel of {} controls", panel->controls.size());
        return result;
    }
    // Of endings that others use too only what a wall holds: the rest may be a scene.
    if (namesForeignWall(path) || path.ends_with(".json") || path.ends_with(".xml")) {
        const Expected<ForeignWall> made = readForeignWall(path);
        if (made) {
            result.what = fmt::format("a wall of another program, {} screens; tessera-convert makes a .wall of it",
                                      made->wall.screens.size());
            result.notes = made->notes;
            return result;
        }
        if (namesForeignWall(path)) return bad(made.error());
    }
    ImportOptions import{.assetFolders = arguments.assets, .allowUnconfined = arguments.allowUnconfined};
    import.variants = arguments.variants;
    if (arguments.importMemoryMib > 0) import.maxMemoryBytes = arguments.importMemoryMib << 20;
    const Expected<FileScene> file = importAsScene(path, import);
    if (!file) return bad(file.error());
    std::vector<std::string> faults = file->imported.faults;
    faults.insert(faults.end(), file->imported.mended.begin(), file->imported.mended.end());
    for (const std::string& note : file->imported.notes)
        if (std::ranges::find(faults, note) == faults.end()) result.notes.push_back(note);
    if (!faults.empty()) return bad({ErrorCode::kBadInput, fmt::format("{}", fmt::join(faults, "\n"))});
    result.what = fmt::format("a scene of {} nodes, {} other objects, {} triangles", file->imported.nodes,
                              file->imported.cores, file->imported.triangles);
    return result;
}

namespace {

int checkThisMachine(bool json) {
    if (!json) fmt::print("{}\n", versionText("tessera-check"));
    const std::vector<MachineFinding> findings = checkMachine();
    for (const MachineFinding& finding : findings) fmt::print("{}\n", lineOf(finding, json));
    const auto lacking = std::ranges::count(findings, MachineFinding::State::kLacks, &MachineFinding::state);
    if (!json && lacking == 0) fmt::print("a wall can run here\n");
    return lacking == 0 ? 0 : exitCode(ErrorCode::kFailed);
}

}  // namespace

int runCheck(const std::vector<std::string>& words) {
    const auto parsed = parseCheckArguments(words);
    if (!parsed) {
        fmt::print(stderr, "tessera-check: {}\n", parsed.error().message);
        return exitCode(parsed.error().code);
    }
    if (const auto* text = std::get_if<CheckText>(&*parsed)) {
        fmt::print("{}", text->text);
        return 0;
    }
    const auto& arguments = std::get<CheckArguments>(*parsed);
    if (arguments.machine) return checkThisMachine(arguments.json);
    int code = 0;
    for (const std::string& path : arguments.files) {
        const CheckResult result = checkFile(path, arguments);
        if (code == 0) code = result.exitCode;
        if (arguments.json) {
            const nlohmann::ordered_json json = {
                {"file", path}, {"good", result.exitCode == 0}, {"what", result.what}, {"notes", result.notes}};
            fmt::print("{}\n", json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
            continue;
        }
        for (const std::string& note : result.notes)
            fmt::print("{}{}\n", note.starts_with(path) ? "" : path + ": ", note + " (note)");
        // What is wrong is the answer: it goes where answers go, as compilers' messages are read by editors.
        fmt::print("{}{}\n", result.what.starts_with(path) ? "" : path + ": ", result.what);
    }
    return code;
}

}  // namespace tessera
