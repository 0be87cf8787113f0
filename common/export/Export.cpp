#include "common/export/Export.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

#include "common/base/FileHandle.h"
#include "common/base/LowerCase.h"
#include "common/base/NewFile.h"
#include "common/export/Companions.h"
#include "common/export/Formats.h"
#include "common/export/LeavingMeshes.h"
#include "common/scenefile/SceneFile.h"

namespace tessera {
namespace {

struct Writer {
    ExportFormat format;
    Expected<LeavingFiles> (*write)(const LeavingScene&);
};

constexpr std::string_view kGltfKeeps =
    "hierarchy, names, places, shared meshes, materials (factors, images, their places; "
    "KHR_materials_unlit, _emissive_strength, _ior, _specular, _clearcoat, _transmission), lights, cameras, "
    "animations of places and weights, skins, morph targets, lines, points, colours of vertices, glyphs "
    "(EXT_mesh_gpu_instancing)";
constexpr std::string_view kGltfLost =
    "what switches hide, levels of detail but the finest, surroundings, images in blocks or with a wide range of "
    "light, layers and programs of materials, collisions, how often and how fast animations play and which are paused; "
    "smooth surfaces, letters and volumes are triangles";

constexpr Writer kWriters[] = {
    {{.name = "glTF 2.0, one file", .endings = "glb", .keeps = kGltfKeeps, .lost = kGltfLost}, writeGlb},
    {{.name = "glTF 2.0, text and a .bin", .endings = "gltf", .keeps = kGltfKeeps, .lost = kGltfLost}, writeGltf},
    {{.name = "USD in text, with pictures",
      .endings = "usda",
      .keeps = "hierarchy, names (as displayName where USD allows no such), places, shared meshes (in full wherever "
               "they stand, beyond 16 MiB of repeats as references), subdivision surfaces as they are, materials "
               "(UsdPreviewSurface) with their images and these images' places, lights and which cast shadows, "
               "cameras, animations of places as time samples (speeds and ways back are in their times), lines, "
               "points, colours of vertices, glyphs "
               "(PointInstancer)",
      .lost = "what switches hide, levels of detail but the finest, skins and morph targets (as they stand), "
              "transmission, tints of reflections, ranges and falloffs of lights, widths of lines, opacities of "
              "vertices, how images are filtered, surroundings, which animations play once or are paused, their names, "
              "lengths of animations but the longest, splines (which are straight lines), all else that glTF loses "
              "except speeds"},
     writeUsda},
    {{.name = "VRML 2.0, with pictures",
      .endings = "wrl",
      .keeps = "hierarchy, names (in a WorldInfo where VRML allows no such), places, shared meshes by DEF and USE, "
               "materials as Phong's with images of colour (a material's own colour is in its picture), lights as "
               "strong as 1, viewpoints, animations of places as interpolators, with a TimeSensor for each "
               "animation (its length, speed, pause, whether it loops), lines, points, colours of "
               "vertices, glyphs as triangles",
      .lost = "what switches hide, levels of detail but the finest, skins and morph targets (as they stand), other "
              "images and where these lie, metal and roughness, opacities of vertices, which lights cast shadows, "
              "surroundings, splines (which are straight lines)"},
     writeVrml},
    {{.name = "Wavefront OBJ, with .mtl and pictures",
      .endings = "obj",
      .keeps = "objects by their nodes' names, triangles, lines and points in world coordinates, normals, texture "
               "coordinates, colours of vertices, materials with their images of colour, glow, normals, metal and "
               "roughness",
      .lost =
          "hierarchy, sharing, lights, cameras, animations, opacities of vertices, what images do beyond their edges"},
     writeObj},
    {{.name = "PLY, binary",
      .endings = "ply",
      .keeps = "triangles in world coordinates with normals and colours (the material's times the vertex's); of what "
               "has no triangles points",
      .lost = "nodes, names, images, lines, all but places and colours"},
     writePly},
    {{.name = "STL, binary",
      .endings = "stl",
      .keeps = "triangles in world coordinates",
      .lost = "nodes, names, looks, lines, points"},
     writeStl},
    {{.name = "CSV, the tree as a table",
      .endings = "csv",
      .keeps = "a line for each node: path, type, place and size in the world, triangles, look",
      .lost = "all else"},
     writeCsv},
};

std::string endingOf(std::string_view path) {
    const std::size_t slash = path.rfind('/');
    const std::string_view name = slash == std::string_view::npos ? path : path.substr(slash + 1);
    const std::size_t dot = name.rfind('.');
    return dot == std::string_view::npos ? std::string() : lowerCase(name.substr(dot + 1));
}

const Writer* writerFor(std::string_view path) {
    const std::string ending = endingOf(path);
    for (const Writer& writer : kWriters) {
        std::istringstream endings{std::string(writer.format.endings)};
        for (std::string one; endings >> one;)
            if (one == ending) return &writer;
    }
    return nullptr;
}

/// Saves into one folder wait for each other while it is held, so that files which belong together stay together. Where
/// a file system has no locks nobody waits.
FileHandle lockOfFolder(const std::string& path) {
    const std::string folder = std::filesystem::path(path).parent_path().string();
    FileHandle handle(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    while (handle.get() >= 0 && ::flock(handle.get(), LOCK_EX) != 0 && errno == EINTR) {
    }
    return handle;
}

/// All are beside before the first takes its place. Those of the save before that nothing names any more go. Messages
/// call the file at `own` by the path that was asked for.
Expected<std::uint64_t> put(const std::string& path, const FilePlace& own, const std::vector<LeavingFile>& files) {
    std::uint64_t bytes = 0;
    const FileHandle lock = lockOfFolder(own.path);
    std::set<std::string> known = Companions(own.path).known();
    for (const LeavingFile& file : files) {
        if (known.erase(file.path) > 0 || file.path == own.path) continue;
        std::error_code unknown;
        if (std::filesystem::exists(std::filesystem::symlink_status(file.path, unknown)))
            return fail(ErrorCode::kRefused,
                        fmt::format("{}: this file is there, and {} would need its place; it was not written with it: "
                                    "move it away, or choose another name",
                                    file.path, path));
    }
    std::vector<NewFile> made;
    for (const LeavingFile& file : files) {
        const bool isOwn = file.path == own.path;
        const Expected<FilePlace> place = isOwn ? own : placeBeside(own, file.path);
        if (!place) return tl::unexpected(place.error());
        Expected<NewFile> beside = NewFile::beside(*place, isOwn ? path : file.path);
        if (!beside) return tl::unexpected(beside.error());
        for (const ByteSlice& part : file.parts) {
            if (Expected<void> written = beside->write(asText(part.bytes())); !written)
                return tl::unexpected(written.error());
            bytes += part.size();
        }
        made.push_back(std::move(*beside));
    }
    for (NewFile& file : made)
        if (Expected<void> named = file.giveName(); !named) return tl::unexpected(named.error());
    for (NewFile& file : made)
        if (Expected<void> placed = file.takePlace(); !placed) return tl::unexpected(placed.error());
    std::error_code gone;
    for (const std::string& leftover : known)
        if (std::filesystem::is_regular_file(std::filesystem::symlink_status(leftover, gone)))
            std::filesystem::remove(leftover, gone);
    return bytes;
}

/// Words in lines of 80 columns behind a heading of ten.
void append(std::string& text, std::string_view heading, std::string_view words) {
    constexpr std::size_t kColumns = 80, kIndent = 12;
    std::string line = fmt::format("  {:<10}", heading);
    std::istringstream all{std::string(words)};
    bool first = true;
    for (std::string word; all >> word; first = false) {
        if (!first && line.size() + 1 + word.size() > kColumns) {
            text += line + '\n';
            line = std::string(kIndent, ' ');
        } else if (!first) {
            line += ' ';
        }
        line += word;
    }
    text += line + '\n';
}

}  // namespace

Expected<void> checkFileBytes(std::uint64_t bytes, const ExportOptions& options) {
    if (bytes <= options.maxFileBytes) return {};
    return fail(ErrorCode::kLimit, fmt::format("it would have {} bytes, and at most {} can be written: write parts of "
                                               "it (--under NODE)",
                                               bytes, options.maxFileBytes));
}

std::span<const ExportFormat> exportFormats() {
    static const std::vector<ExportFormat> formats = [] {
        std::vector<ExportFormat> all;
        for (const Writer& writer : kWriters) all.push_back(writer.format);
        return all;
    }();
    return formats;
}

std::string exportEndings() {
    std::string all;
    for (const ExportFormat& format : exportFormats()) {
        std::istringstream endings{std::string(format.endings)};
        for (std::string one; endings >> one;) all += (all.empty() ? "." : ", .") + one;
    }
    return all;
}

Expected<bool> leadsOut(const std::string& path, const ExportOptions& options) {
    if (!std::isfinite(options.tolerance) || options.tolerance < 0)
        return fail(ErrorCode::kUsage, "--tolerance: it has to be a number of metres from 0");
    if (writerFor(path)) return true;
    if (!sceneEncodingOf(path))
        return fail(ErrorCode::kUsage,
                    fmt::format("{}: a scene is written as .tsct (text) or .tsc (binary), for other programs as {}",
                                path, exportEndings()));
    if (!options.under.empty() || options.still || options.tolerance > 0)
        return fail(ErrorCode::kUsage, fmt::format("{}: --under, --still and --tolerance are for files of other "
                                                   "programs; a scene is saved whole",
                                                   path));
    return false;
}

std::string exportFormatsText() {
    std::string text;
    for (const ExportFormat& format : exportFormats()) {
        if (!text.empty()) text += '\n';
        text += std::string(format.name) + '\n';
        std::string endings;
        std::istringstream all{std::string(format.endings)};
        for (std::string one; all >> one;) endings += (endings.empty() ? "." : " .") + one;
        append(text, "endings", endings);
        append(text, "keeps", format.keeps);
        append(text, "loses", format.lost);
    }
    return text;
}

Expected<ExportReport> exportScene(const std::string& path, const Aspect& scene, const ExportOptions& options) {
    const Writer* writer = writerFor(path);
    if (!writer)
        return fail(ErrorCode::kUsage,
                    fmt::format("{}: no format for other programs ends so; there are {}", path, exportEndings()));
    ExportNotes notes;
    const Expected<Selection> selection = selectNodes(scene, options.under, notes);
    if (!selection) return tl::unexpected(selection.error());
    if (options.tolerance > 0 && std::ranges::none_of(selection->nodes, isSmooth, &SelectedNode::core))
        notes.add("the tolerance counts for nothing: there are no smooth surfaces and no letters");
    // Before anybody looks into what is there: it may be a pipe. Through a link all goes to where the file really lies:
    // programs look for companions there.
    const Expected<FilePlace> own = placeOfFile(path);
    if (!own) return tl::unexpected(own.error());
    const Expected<LeavingFiles> files =
        writer->write({.scene = scene, .selection = *selection, .options = options, .path = own->path, .notes = notes});
    if (!files) return failWith(path, files.error());
    if (files->nodes == 0) {
        const std::vector<std::string> lost = notes.lines(scene);
        return fail(ErrorCode::kRefused,
                    fmt::format("{}: nothing of the scene can be written as {}: nothing is written{}{}", path,
                                writer->format.name, lost.empty() ? "" : "; ", fmt::join(lost, "; ")));
    }
    const Expected<std::uint64_t> bytes = put(path, *own, files->files);
    if (!bytes) return tl::unexpected(bytes.error());
    ExportReport report{.files = {},
                        .notes = notes.lines(scene),
                        .nodes = files->nodes,
                        .triangles = files->triangles,
                        .bytes = *bytes};
    for (const LeavingFile& file : files->files) report.files.push_back(file.path == own->path ? path : file.path);
    return report;
}

}  // namespace tessera
