/// The words of a notice: what is wrong with a program, in lines that a wall has room for.
#pragma once

#include <string>
#include <string_view>

#include "common/change/Value.h"

namespace tessera {

/// Lines of about `kColumns` letters: a node's path with the number of a program, or of a material, then the problem,
/// cut at `kMostLines` lines with how much is left out. Whatever the problem holds, the text is UTF-8 without control
/// characters or ones that turn the direction of others.
struct NoticeText {
    static constexpr std::size_t kColumns = 44, kMostLines = 8;
    std::string text;
    std::size_t lines = 0, columns = 0;  ///< of the longest line
    bool operator==(const NoticeText&) const = default;
};
[[nodiscard]] NoticeText noticeText(std::string_view path, ObjectId object, std::string_view problem,
                                    std::string_view type = "SurfaceProgram");

}  // namespace tessera
