/// Which files are read, by whom, and what of them arrives: the one table of formats.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tessera {

struct FormatRow {
    std::string_view name;
    std::string_view endings;  ///< in lower case, without dots, a blank between; of pictures, which are told apart by
                               ///< their bytes, the usual ones
    std::string_view reader;   ///< what reads it
    std::string_view arrives;
    std::string_view lost;                        ///< what does not arrive; a note at load, or the refusal, names it
    bool isPicture = false;                       ///< of materials: no file that can be loaded by itself
    std::string_view program = "tessera-import";  ///< the child that reads it
};

/// Scenes and models first, then pictures.
[[nodiscard]] std::span<const FormatRow> formatTable();
/// Of all models, in lower case, without dots, in alphabetical order.
[[nodiscard]] std::vector<std::string_view> modelEndings();
/// `extension`: in lower case, without its dot. What a file holds is looked at by the importer alone.
[[nodiscard]] bool isModelEnding(std::string_view extension);
/// The name of the child program that reads files with this ending; of unknown ones the one that looks into them.
[[nodiscard]] std::string_view readingProgram(std::string_view extension);

/// The table for people, no line wider than 80 columns: as FORMATS.md has it.
[[nodiscard]] std::string formatsText();

}  // namespace tessera
