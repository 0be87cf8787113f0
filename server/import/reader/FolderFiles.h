/// Reading files as far as the importer may: ordinary ones, in one folder or below it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

/// An ordinary file's bytes; pipes, devices and folders are refused without being read. Messages do not repeat the
/// path.
[[nodiscard]] Expected<Bytes> readOrdinaryFile(const std::string& path, std::size_t maxBytes);

/// Paths of the files that this process has read or looked for, in order of their names; no more than so many.
inline constexpr std::size_t kMostFilesLookedFor = 4096;
[[nodiscard]] std::vector<std::string> filesLookedFor();
/// One more of them.
void isLookedFor(const std::string& path);

/// The folder of one imported file. Landlock guards it in the kernel; this gives the clear message, and guards an
/// unconfined importer.
class FolderFiles {
public:
    /// `folder`: absolute, without symbolic links.
    explicit FolderFiles(std::string folder, std::size_t maxBytes) : folder_(std::move(folder)), maxBytes_(maxBytes) {}

    /// The real path of `name` (absolute, or relative to the folder), links followed; refused outside of the folder.
    [[nodiscard]] Expected<std::string> resolve(const std::string& name) const;
    [[nodiscard]] Expected<Bytes> read(const std::string& name) const;
    [[nodiscard]] const std::string& folder() const { return folder_; }

    struct Found {
        std::string path;  ///< real
        std::string note;  ///< where it is, if not where `name` says; else empty
    };
    /// As resolve; what is not there is looked for as tools of other systems name it: `C:\\maps\\Wood.PNG`,
    /// `..\\wood.png`. Of the files in the folder and below with the name's last part, in whatever case, the one whose
    /// folders agree with it the farthest from the end; of those the nearest to the folder, then the first by name.
    /// Looks at 20,000 names and six folders deep at most; the error is resolve's.
    [[nodiscard]] Expected<Found> find(const std::string& name) const;
    [[nodiscard]] Expected<Bytes> readFound(const Found& found) const;

private:
    std::string folder_;
    std::size_t maxBytes_;
    mutable std::multimap<std::string, std::string>
        names_;  ///< by the last part in lower case: paths below the folder. One thread.
    mutable bool listed_ = false;
};

}  // namespace tessera
