/// The rules of the architecture. Each returns its findings; none means that the rule holds.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/architecture/Layers.h"
#include "tests/architecture/SourceFile.h"

namespace tessera::architecture {

struct Finding {
    std::string file;
    int line = 0;
    std::string rule;
};
using Findings = std::vector<Finding>;

/// Every include of our own headers is written from the root, exists, and is allowed by layers.txt; every folder with
/// code has a line there.
[[nodiscard]] Findings checkIncludes(const std::filesystem::path& root, const std::vector<SourceFile>& files,
                                     const Layers& layers);
/// Third-party headers are included by their owners only, and none is without an owner.
[[nodiscard]] Findings checkThirdParty(const std::vector<SourceFile>& files, const Layers& layers);
/// No file includes itself, over however many others; no module may.
[[nodiscard]] Findings checkAcyclic(const std::vector<SourceFile>& files, const Layers& layers);
/// server and client know nothing of each other, whatever layers.txt says; common knows neither.
[[nodiscard]] Findings checkSides(const std::vector<SourceFile>& files, const Layers& layers);
/// Words (locks above all) that only their owners may use.
[[nodiscard]] Findings checkWords(const std::vector<SourceFile>& files, const Layers& layers);
/// Each of `folders`, and each folder with code, has a README.md of at most one screen.
[[nodiscard]] Findings checkReadmes(const std::filesystem::path& root, const std::vector<SourceFile>& files,
                                    const std::vector<std::string>& folders);
[[nodiscard]] Findings checkLengths(const std::vector<SourceFile>& files, int mostLines);
/// No line has more characters (of UTF-8, not bytes), comments and texts included.
[[nodiscard]] Findings checkColumns(const std::filesystem::path& root, const std::vector<std::string>& paths,
                                    int mostColumns);
/// No header of `folder`, but those in `known`, is included, directly or not, by .cpp files with more than `percent` of
/// all their lines: so much, about, is compiled again for a change of it.
[[nodiscard]] Findings checkReach(const std::vector<SourceFile>& files, const std::string& folder,
                                  const std::vector<std::string>& known, double percent);
/// No two files define a class of one name in one namespace, unnamed ones apart: in a program that holds both the
/// linker takes one of their inline functions for both, and no compiler says so.
[[nodiscard]] Findings checkNamesAreUnique(const std::vector<SourceFile>& files);
/// Each line of layers.txt is about something that is there, and each include that it allows is made somewhere: what
/// nobody needs is not allowed in advance.
[[nodiscard]] Findings checkLayersAreUsed(const std::vector<SourceFile>& files, const Layers& layers);

/// One line per finding: `file:line: rule`.
[[nodiscard]] std::string report(const Findings& findings);

}  // namespace tessera::architecture
