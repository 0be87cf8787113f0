/// One source file as the architecture test sees it: its includes, and its code without comments and texts.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tessera::architecture {

struct Include {
    std::string path;
    bool quoted = false;  ///< "path" rather than <path>
    int line = 0;
};

struct SourceFile {
    std::string path;    ///< from the root, with slashes
    std::string folder;  ///< of that path
    int lines = 0;
    std::vector<Include> includes;
    /// The code with comments, character and string literals blanked; line breaks stay where they were.
    std::string code;
};

/// The text with comments blanked and, if asked for, the insides of literals too.
[[nodiscard]] std::string withoutComments(const std::string& text, bool blankLiterals);
[[nodiscard]] SourceFile readSource(const std::filesystem::path& root, const std::string& path);
/// From the root, in their order: of the files below `folders` those that end in one of `endings`.
[[nodiscard]] std::vector<std::string> pathsBelow(const std::filesystem::path& root,
                                                  const std::vector<std::string>& folders,
                                                  const std::vector<std::string>& endings);
/// All .h and .cpp files below `folders`, in the order of their paths.
[[nodiscard]] std::vector<SourceFile> readTree(const std::filesystem::path& root,
                                               const std::vector<std::string>& folders);

}  // namespace tessera::architecture
