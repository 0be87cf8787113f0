/// The files of an import: each read once, and which imports which.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/import/LoadedFile.h"
#include "server/import/SceneDraft.h"

namespace tessera {

/// Not thread-safe. What it hands out stays as long as it does.
class ImportedFiles {
public:
    explicit ImportedFiles(SceneDraft& draft) : draft_(draft) {}

    /// One that somebody asked for, by its path or as `asset://NAME`.
    Expected<LoadedFile*> open(const std::string& path);
    /// The one that an `import` of a file names.
    Expected<LoadedFile*> imported(const LoadedFile& file, const proto::scene::Import& import);

    /// While what a file holds is counted or placed. Files within each other, the outermost first.
    class Within {
    public:
        Within(ImportedFiles& files, const LoadedFile& file) : files_(files) { files_.underWay_.push_back(file.path); }
        ~Within() { files_.underWay_.pop_back(); }
        Within(const Within&) = delete;
        Within& operator=(const Within&) = delete;

    private:
        ImportedFiles& files_;
    };
    [[nodiscard]] std::span<const std::string> underWay() const { return underWay_; }

    /// Of a radius that somebody asked for, where none of the files has points.
    void noteNoPoints();

private:
    Expected<LoadedFile*> load(const std::string& canonicalPath, const std::string& label);

    SceneDraft& draft_;
    std::map<std::string, std::unique_ptr<LoadedFile>> files_;  ///< by canonical path
    std::map<std::string, Error> failed_;                       ///< so are those that could not be read
    std::vector<std::string> asked_;                            ///< as they were named
    std::vector<std::string> underWay_;
};

}  // namespace tessera
