/// The answers of tessera-collide as lines: JSON for programs, words for people.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "server/collision/pairwise/PairTable.h"

namespace tessera {

enum class AnswerFormat { kText, kJson };

/// `all` names this many pairs; the count is of all of them.
inline constexpr std::size_t kPairsNamed = 16;

// One line each, without its end. Numbers have 17 significant digits in JSON and do not depend on the locale. An answer
// that is not complete says so (`"complete":false`); so does one of covers and of distance fields (`"error"`: as
// coverError, or Distance::error, if above 0).
[[nodiscard]] std::string answerLine(Touch touch, AnswerFormat format, double error = 0);
[[nodiscard]] std::string answerLine(const PairTouch& pairs, AnswerFormat format, double error = 0);
[[nodiscard]] std::string answerLine(const Distance& distance, AnswerFormat format, double error = 0);
[[nodiscard]] std::string answerLine(const Impact& impact, AnswerFormat format, double error = 0);
/// `error`: as PairDepth::error; none: it is not known.
[[nodiscard]] std::string answerLine(const PairDepth& depth, std::optional<double> error, AnswerFormat format);

/// With --realignment: what was tested, and how tight it was.
struct RealignedBoxes {
    std::uint64_t tests = 0;  ///< of a box against the sixteen of a node
    PlacedVolumes placed;     ///< B's boxes, as they were tested
};

struct QueryTimes {
    double buildUs = 0;                           ///< of both shapes
    std::vector<double> queryUs;                  ///< in the order asked
    std::array<std::size_t, 2> faces{}, bytes{};  ///< of A and B after all queries: of a cover its balls
    unsigned threads = 1;
    std::string_view instructionSet;
    std::optional<RealignedBoxes> boxes;
};
[[nodiscard]] std::string timeLine(const QueryTimes& times, AnswerFormat format);

}  // namespace tessera
