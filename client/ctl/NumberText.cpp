#include "client/ctl/NumberText.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace tessera {

namespace {

struct ReadNumber {
    bool whole = false;  ///< the text is a number and nothing else
    bool tooLarge = false;
    double value = 0;
};
ReadNumber readWhole(std::string_view text) {
    // std::from_chars knows no plus sign.
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
    ReadNumber read;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), read.value);
    read.tooLarge = error == std::errc::result_out_of_range;
    read.whole = (error == std::errc() || read.tooLarge) && end == text.data() + text.size();
    return read;
}

}  // namespace

std::string numberFault(const std::string& text) {
    const ReadNumber read = readWhole(text);
    if (!read.whole) return fmt::format("\"{}\" is not a number", text);
    if (read.tooLarge) return fmt::format("{} is too large or too small for a number", text);
    if (!std::isfinite(read.value)) return fmt::format("{} is not finite, and a number has to be", text);
    return {};
}

Expected<double> finiteNumber(const std::string& text, std::string_view what) {
    if (const std::string fault = numberFault(text); !fault.empty())
        return fail(ErrorCode::kUsage, fmt::format("{}: {}", what, fault));
    return readWhole(text).value;
}

std::vector<std::string> withPlainNumbers(std::vector<std::string> words) {
    for (std::string& word : words)
        if (word.starts_with("-.") && readWhole(std::string_view(word).substr(0, word.find(','))).whole)
            word.insert(1, "0");
    return words;
}

}  // namespace tessera
