/// All requests, answers and notices as data: what their descriptions say, for those who print it or speak other
/// languages.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/request/Members.h"

namespace tessera {

struct MemberText {
    int number = 0;  ///< of a field of the head; 0: it is a part, or stands in a record
    std::string name;
    /// "bool", "uint64", "fixed64", "double", "text", "word", "Vector" (x, y, z), "Rotation" (w, x, y, z), "bytes"; of
    /// records "Place" (u, v), too, and "reserved"; or the name of a value with members.
    std::string type;
    std::string unit = {}, bounds = {}, help = {};
    std::optional<double> least = {}, greatest = {}, orElse = {};  ///< of `bounds`, for programs
    std::string when = {};                                         ///< only said then; empty: always
    std::vector<std::string_view> words = {};                      ///< of a word: its numbers are 0 and up
    bool optional = false, many = false;
    bool isPart = false, isRest = false;
    Holds holds = Holds::kBytes;
    std::size_t bytes = 0;                 ///< in a record; of a record
    std::size_t count = 1;                 ///< of a row in a record: how many there are, of `bytes` together
    std::vector<MemberText> members = {};  ///< of a value, and of a record
};

struct RequestText {
    RequestInfo info;
    std::string_view answer;
    std::vector<MemberText> members;
};
struct ToldText {
    ToldInfo info;
    std::vector<MemberText> members;
};

/// By their numbers. Made once.
[[nodiscard]] std::span<const RequestText> allRequests();
[[nodiscard]] std::span<const ToldText> allAnswers();
[[nodiscard]] std::span<const ToldText> allNotices();

/// "nothing", "scene", "view"
[[nodiscard]] std::string_view nameOf(Changes changes);

}  // namespace tessera
