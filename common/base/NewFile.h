/// A file that takes another one's place at once, or leaves that as it was.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/Error.h"

namespace tessera {

/// Why nothing is written to what is neither a file nor free.
inline constexpr std::string_view kNoFilePlace = "cannot write there: this is a folder, device, pipe or socket";

/// Where a file is to be. A path that a person names is followed through links, as by other programs. A file beside it
/// bears a name that nobody has said, and replaces a link: others may have made that.
struct FilePlace {
    std::string path;            ///< as it was said, or where that leads if it is a link
    std::optional<mode_t> mode;  ///< of the file that is there already: the new one gets the same rights
};
/// kFailed: a folder, device, pipe or socket is there.
[[nodiscard]] Expected<FilePlace> placeOfFile(const std::string& path);
/// No link is followed. `main`: what it lies beside, whose rights it gets.
[[nodiscard]] Expected<FilePlace> placeBeside(const FilePlace& main, const std::string& path);
/// The target of a link, to say what was written; empty: it is no link.
[[nodiscard]] std::string targetOfLink(const std::string& path);

/// A file that is written beside its place, and goes with this object until it has taken the place. It has no name
/// until giveName(): nothing stays of a process that is killed before. Of one that is killed between giveName() and
/// takePlace() `.tessera.PID.N` stays beside the place. It has that name from the beginning where the file system has
/// no files without names, or there is no /proc. Errors (kFailed) name the file as `said`. One thread.
class NewFile {
public:
    [[nodiscard]] static Expected<NewFile> beside(const FilePlace& place, std::string said);
    ~NewFile() { discard(); }
    NewFile(NewFile&& other) noexcept
        : said_(std::move(other.said_)),
          path_(std::move(other.path_)),
          temporary_(std::exchange(other.temporary_, std::string())),
          descriptor_(std::exchange(other.descriptor_, -1)),
          isOnDisk_(other.isOnDisk_) {}
    NewFile& operator=(NewFile&&) = delete;

    [[nodiscard]] Expected<void> write(std::string_view bytes);
    /// Its bytes are on the disk; once more when it gets its name.
    [[nodiscard]] Expected<void> sync();
    /// All but the rename, and with it all that needs room on the disk. Nothing is to be written after it. Of several
    /// files each gets its name before the first takes its place.
    [[nodiscard]] Expected<void> giveName();
    /// Gives it a name first, where it has none.
    [[nodiscard]] Expected<void> takePlace();

private:
    NewFile() = default;
    /// Tries names beside the place until `take` has one; else errno says why.
    template <typename Take>
    bool takeName(Take take);
    bool openNamed();
    [[nodiscard]] Expected<void> linkOrCopy();
    [[nodiscard]] Expected<void> copyOf(int file);
    void discard();

    std::string said_, path_;
    std::string temporary_;  ///< its name beside the place; empty: it has none yet, or none any more
    int descriptor_ = -1;    ///< below 0: closed
    bool isOnDisk_ = false;
};

}  // namespace tessera
