/// What comes up while somebody else's description of a wall is read: sentences for people, and the first thing that
/// cannot be used.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

/// Of any text file that describes a wall.
inline constexpr std::size_t kMostWallFileBytes = std::size_t{4} << 20;

/// A number that fills the whole word: finite, with a + in front if it likes.
[[nodiscard]] std::optional<double> numberOfWord(std::string_view word);

/// After the first refusal readers may go on: what they find is not looked at any more. Not thread-safe.
class WallReading {
public:
    explicit WallReading(std::string path) : path_(std::move(path)) {}

    /// A sentence about what is not carried over, or was guessed. Each once; at most kMostNotes of them.
    void note(std::string sentence);
    /// `place`: "nodes[1].windows[0]", "ScreenConfig Screen 2". `what` says what is wrong there, and what to do.
    void refuse(std::string_view place, std::string_view what);

    [[nodiscard]] bool sound() const { return !fault_; }
    [[nodiscard]] const std::optional<Error>& fault() const { return fault_; }
    [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

    /// The number that a word says, within bounds; else a refusal, and 0.
    [[nodiscard]] double number(std::string_view place, std::string_view word, double least, double most);

private:
    static constexpr std::size_t kMostNotes = 64;
    std::string path_;
    std::vector<std::string> notes_;
    std::optional<Error> fault_;
};

}  // namespace tessera
