/// Reading files as far as the importer may: ordinary ones, in one folder or below it.
#pragma once

#include <string>

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

/// An ordinary file's bytes; pipes, devices and folders are refused without being read. Messages do not repeat the
/// path.
[[nodiscard]] Expected<Bytes> readOrdinaryFile(const std::string& path, std::size_t maxBytes);

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

private:
    std::string folder_;
    std::size_t maxBytes_;
};

}  // namespace tessera
