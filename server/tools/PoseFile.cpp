#include "server/tools/PoseFile.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>

namespace tessera {

namespace {

constexpr std::size_t kPerPose = 7, kPerRay = 6;
constexpr std::string_view kBlank = " \t\r\v\f";

Expected<double> parseNumber(std::string_view word) {
    // from_chars knows no plus sign.
    const std::string_view digits = word.size() > 1 && word[0] == '+' && word[1] != '-' ? word.substr(1) : word;
    double value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error == std::errc::result_out_of_range)
        return fail(ErrorCode::kBadInput, fmt::format("'{}' is beyond the range of double", word));
    if (error != std::errc() || end != digits.data() + digits.size())
        return fail(ErrorCode::kBadInput, fmt::format("'{}' is not a number", word));
    if (!std::isfinite(value)) return fail(ErrorCode::kBadInput, fmt::format("'{}' is not finite", word));
    return value;
}

Expected<Pose> poseOf(const double* n, std::string_view which) {
    Pose pose;
    pose.translation = {n[0], n[1], n[2]};
    if (pose.translation.cwiseAbs().maxCoeff() > kMaxPoseTranslation)
        return fail(ErrorCode::kBadInput,
                    fmt::format("the translation{} is larger than {:g}", which, kMaxPoseTranslation));
    // Scaled first, so that the squares of very large and very small parts stay in range.
    Vec4d wxyz(n[3], n[4], n[5], n[6]);
    const double largest = wxyz.cwiseAbs().maxCoeff();
    if (!(largest > 0)) return fail(ErrorCode::kBadInput, fmt::format("the quaternion{} has no length", which));
    wxyz /= largest;
    pose.rotation = Quatd(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized();
    return pose;
}

/// Of a line; the first of them, and how many there are.
struct LineNumbers {
    std::array<double, 2 * kPerPose> numbers{};
    std::size_t count = 0;
};
Expected<LineNumbers> numbersOf(std::string_view text) {
    LineNumbers out;
    auto& [numbers, count] = out;
    text = text.substr(0, text.find('#'));
    for (auto at = text.find_first_not_of(kBlank); at != text.npos; at = text.find_first_not_of(kBlank)) {
        text.remove_prefix(at);
        const std::string_view word = text.substr(0, text.find_first_of(kBlank));
        text.remove_prefix(word.size());
        const Expected<double> value = parseNumber(word);
        if (!value) return tl::unexpected(value.error());
        if (count < numbers.size()) numbers[count] = *value;
        ++count;
    }
    return out;
}

Expected<std::optional<PoseLine>> parsePose(std::string_view text, std::size_t line) {
    const Expected<LineNumbers> parsed = numbersOf(text);
    if (!parsed) return tl::unexpected(parsed.error());
    const auto& [numbers, count] = *parsed;
    if (count == 0) return std::nullopt;
    if (count != kPerPose && count != 2 * kPerPose)
        return fail(ErrorCode::kBadInput,
                    fmt::format("{} number{}; a pose has 7 (tx ty tz qw qx qy qz), a motion 14 (start and end)", count,
                                count == 1 ? "" : "s"));
    const bool motion = count == 2 * kPerPose;
    PoseLine out;
    out.line = line;
    const Expected<Pose> start = poseOf(numbers.data(), motion ? " at the start" : "");
    if (!start) return tl::unexpected(start.error());
    out.start = *start;
    if (motion) {
        const Expected<Pose> end = poseOf(numbers.data() + kPerPose, " at the end");
        if (!end) return tl::unexpected(end.error());
        out.end = *end;
    }
    return out;
}

Expected<std::optional<RayLine>> parseRay(std::string_view text, std::size_t line) {
    const Expected<LineNumbers> parsed = numbersOf(text);
    if (!parsed) return tl::unexpected(parsed.error());
    const auto& [n, count] = *parsed;
    if (count == 0) return std::nullopt;
    if (count != kPerRay)
        return fail(ErrorCode::kBadInput,
                    fmt::format("{} number{}; a ray has 6: ox oy oz dx dy dz", count, count == 1 ? "" : "s"));
    RayLine out{.ray = {.origin = {n[0], n[1], n[2]}, .direction = {n[3], n[4], n[5]}}, .line = line};
    if (out.ray.direction.isZero(0)) return fail(ErrorCode::kBadInput, "the ray has no direction");
    return out;
}

/// Each line by `parse`, which gives nothing for one that says nothing.
template <typename Line, typename Parse>
Expected<std::vector<Line>> parseLines(std::string_view text, std::string_view file, const Parse& parse) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    std::vector<Line> lines;
    for (std::size_t line = 1; !text.empty(); ++line) {
        const std::string_view content = text.substr(0, text.find('\n'));
        text.remove_prefix(std::min(content.size() + 1, text.size()));
        const Expected<std::optional<Line>> parsed = parse(content, line);
        if (!parsed) return failWith(fmt::format("{}:{}", file, line), parsed.error());
        if (*parsed) lines.push_back(**parsed);
    }
    return lines;
}

Expected<std::string> readText(const std::string& path) {
    std::error_code error;
    if (std::filesystem::is_directory(path, error))
        return fail(ErrorCode::kBadInput, path + ": it is a folder, not a pose file");
    std::ifstream in(path, std::ios::binary);
    if (!in) return fail(ErrorCode::kNotFound, path + ": it cannot be opened");
    constexpr std::size_t kMost = std::size_t{1} << 30;
    std::string text;
    std::array<char, 1 << 16> chunk{};
    while (in.read(chunk.data(), chunk.size()) || in.gcount() > 0) {
        text.append(chunk.data(), static_cast<std::size_t>(in.gcount()));
        if (text.size() > kMost) return fail(ErrorCode::kLimit, path + ": it is larger than 1 GiB");
    }
    if (in.bad()) return fail(ErrorCode::kBadInput, path + ": it cannot be read");
    return text;
}

}  // namespace

Expected<std::vector<PoseLine>> parsePoses(std::string_view text, std::string_view file) {
    return parseLines<PoseLine>(text, file, parsePose);
}

Expected<std::vector<RayLine>> parseRays(std::string_view text, std::string_view file) {
    return parseLines<RayLine>(text, file, parseRay);
}

Expected<std::vector<PoseLine>> readPoses(const std::string& path) {
    const Expected<std::string> text = readText(path);
    if (!text) return tl::unexpected(text.error());
    return parsePoses(*text, path);
}

Expected<std::vector<RayLine>> readRays(const std::string& path) {
    const Expected<std::string> text = readText(path);
    if (!text) return tl::unexpected(text.error());
    return parseRays(*text, path);
}

}  // namespace tessera
