/// Files beside the one that was asked for: pictures, materials, buffers. Their names begin with its whole name, ending
/// included, so no two files share one; and its head lists them, so the next save knows which are its own.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/export/Formats.h"

namespace tessera {

/// Of the file at `path`. One thread.
class Companions {
public:
    explicit Companions(std::string path) : path_(std::move(path)) {}

    /// "chair.usda.0.png" for the suffix "0.png". What other formats' texts may not hold is '_'.
    [[nodiscard]] std::string name(std::string_view suffix) const;
    /// The same, and from now on it is listed and written.
    std::string add(std::string_view suffix, std::vector<ByteSlice> parts, LeavingFiles& files);
    /// The next picture.
    std::string addPicture(Bytes png, LeavingFiles& files);
    /// What the head of the file has to hold, on one line, in any comment or string.
    [[nodiscard]] std::string mark() const;
    /// Paths of those that the file at the path lists now; none where it is not of this program, or not there.
    [[nodiscard]] std::set<std::string> known() const;

private:
    [[nodiscard]] std::string pathOf(std::string_view suffix) const;

    std::string path_, suffixes_;
    std::size_t pictures_ = 0;
};

}  // namespace tessera
