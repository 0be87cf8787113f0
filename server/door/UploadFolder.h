/// The folder of a server in which files lie that people bring it.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/base/FileHandle.h"
#include "common/base/Turn.h"

namespace tessera {

struct UploadLimits {
    /// Of all files together, those that are on their way too. Of one that takes another's place the larger of the two
    /// counts: both may lie there meanwhile, so that the folder takes twice as much of the disk at most.
    std::uint64_t maxBytes = std::uint64_t{2} << 30;
    std::size_t maxFiles = 1024;
    std::size_t maxLooks = 100'000;  ///< at files and folders, for one count: where more lie, nothing else comes
    /// Of the disk, for whoever else writes there: the journal perhaps.
    static constexpr std::uint64_t kLeftFree = std::uint64_t{64} << 20;
    static constexpr std::size_t kMaxDepth = 4;        ///< SET/textures/wood.png: names on the way to a file
    static constexpr std::size_t kMaxNameBytes = 255;  ///< of one of them
};

/// The names of "SET/hall.gltf". kBadInput: there are too many, or one is no plain name: hidden, "..", too long, no
/// UTF-8, with a control in it (common/base/Controls.h), a slash or a backslash.
[[nodiscard]] Expected<std::vector<std::string>> uploadNames(std::string_view path);

/// Held by one server at a time. Whatever is not whole has no name that anybody sees, and is gone with whoever brought
/// it, or with the next start. No link in the folder is followed. Files stay until somebody removes them: a scene may
/// name them. Each call may take as long as a disk does, and waits for the one before it. Any thread.
class UploadFolder {
public:
    /// Makes the folder, not those above it. kRefused: another server has it; kFailed.
    [[nodiscard]] static Expected<std::shared_ptr<UploadFolder>> open(const std::string& path,
                                                                      UploadLimits limits = {});
    /// One of this process alone, for this user alone, that goes with it. What servers have left that were killed is
    /// removed. In TMPDIR, else /var/tmp: of some systems /tmp is memory.
    [[nodiscard]] static Expected<std::shared_ptr<UploadFolder>> openOwn(UploadLimits limits = {});
    ~UploadFolder();
    UploadFolder(const UploadFolder&) = delete;
    UploadFolder& operator=(const UploadFolder&) = delete;

    [[nodiscard]] const std::string& path() const { return path_; }  ///< whole, without any link
    [[nodiscard]] const UploadLimits& limits() const { return limits_; }

    struct Used {
        std::uint64_t bytes = 0;
        std::size_t files = 0;
    };
    [[nodiscard]] Used used() const;

private:
    struct Coming {
        std::vector<std::string> names;
        std::uint64_t bytes = 0, written = 0;  ///< that were promised, and that are there
    };

public:
    /// A file on its way. Unless `finish` has said that it is there, nothing of it stays.
    class Incoming {
    public:
        ~Incoming();
        Incoming(const Incoming&) = delete;
        Incoming& operator=(const Incoming&) = delete;
        /// kLimit: the disk is full. Nothing is written after an error.
        [[nodiscard]] Expected<void> write(ByteSpan bytes);
        /// Now it has its name, whole and on the disk; what had that name before is gone. Returns its path.
        [[nodiscard]] Expected<std::string> finish();

    private:
        friend class UploadFolder;
        Incoming(std::shared_ptr<UploadFolder> folder, std::list<Coming>::iterator coming, std::string temporary)
            : folder_(std::move(folder)), coming_(coming), temporary_(std::move(temporary)) {}
        std::shared_ptr<UploadFolder> folder_;
        std::list<Coming>::iterator coming_;
        std::string temporary_;
        FileHandle file_;
    };
    /// kLimit: no room for so much beside what is there; kBadInput: see `uploadNames`.
    [[nodiscard]] static Expected<std::shared_ptr<Incoming>> begin(const std::shared_ptr<UploadFolder>& folder,
                                                                   std::string_view path, std::uint64_t bytes);
    /// A file, or a folder with all that is in it, and the folders around it that are empty then. kNotFound.
    [[nodiscard]] Expected<void> remove(std::string_view path);

private:
    UploadFolder(std::string path, FileHandle folder, UploadLimits limits)
        : path_(std::move(path)), folder_(std::move(folder)), limits_(limits) {}
    [[nodiscard]] Used count() const;
    /// Of what has these names, and would go for another one; nothing: there is none, or it is a folder.
    [[nodiscard]] std::optional<std::uint64_t> bytesOf(const std::vector<std::string>& names) const;
    [[nodiscard]] Expected<void> checkRoom(const std::vector<std::string>& names, std::uint64_t bytes) const;

    const std::string path_;
    const FileHandle folder_;  ///< locked
    const UploadLimits limits_;
    bool isOwn_ = false;
    mutable Turn turn_;  ///< what lies there and what comes is counted at one moment
    std::list<Coming> coming_;
    std::uint64_t numbers_ = 0;  ///< of temporary names
};

/// A file without a name in `folder`, or where there is none in the folder for temporary files.
[[nodiscard]] Expected<FileHandle> namelessFile(const std::string& folder);
/// At its end. kLimit: less of the disk would be left, or there is none. Whoever is sent such files may take hours.
[[nodiscard]] Expected<void> writeNameless(const FileHandle& file, ByteSpan bytes,
                                           std::uint64_t leftFree = UploadLimits::kLeftFree);

}  // namespace tessera
