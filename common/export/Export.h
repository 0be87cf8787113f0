/// Scenes as files that other programs read: one table of formats.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"
#include "common/scene/Aspect.h"

namespace tessera {

struct ExportFormat {
    std::string_view name;
    std::string_view endings;  ///< in lower case, without dots, a blank between
    std::string_view keeps;
    std::string_view lost;
};
[[nodiscard]] std::span<const ExportFormat> exportFormats();
/// ".glb, .gltf, …": of all.
[[nodiscard]] std::string exportEndings();

struct ExportOptions {
    /// The path of a node: it and what is below are written where they stand, and of what is above the places alone.
    /// Empty: all.
    std::string under;
    bool still = false;  ///< as it stands now, without its animations
    /// How far triangles may be off smooth surfaces and curves of letters, in world units; 0: as their own fields say.
    double tolerance = 0;
    /// The largest file, and what a .glb can hold.
    std::uint64_t maxFileBytes = 0xffffffff;
};

/// What a command says to --under "".
inline constexpr const char* kNoUnder = "--under: it has to name a node, as /hall; without it all is written";

struct ExportReport {
    std::vector<std::string> files;  ///< the one asked for last
    std::vector<std::string> notes;  ///< what is lost, ten lines at most and how many more
    std::size_t nodes = 0;
    std::size_t triangles = 0;  ///< as often as nodes and glyphs place them, however the format shares them
    std::uint64_t bytes = 0;    ///< of all files
};

/// Before anything is read or fetched for it: whether `path` names a foreign format, to which the options apply; false:
/// a file of our own (common/scenefile), to which none does. kUsage: neither, or options that do not fit.
[[nodiscard]] Expected<bool> leadsOut(const std::string& path, const ExportOptions& options);

/// Writes what switches show, in the format of the path's ending. Each file takes the place of the one before at once;
/// where one cannot be written, none of those that it belongs to has changed. A file beside it that the save before did
/// not write stays: kRefused, as is a file that nothing would be in. kUsage: no such ending; kNotFound: no
/// such node; kRefused: an array is not here; kLimit: more than a file can hold.
[[nodiscard]] Expected<ExportReport> exportScene(const std::string& path, const Aspect& scene,
                                                 const ExportOptions& options = {});

/// The table for people, no line wider than 80 columns.
[[nodiscard]] std::string exportFormatsText();

}  // namespace tessera
