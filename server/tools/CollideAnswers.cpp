#include "server/tools/CollideAnswers.h"

#include <fmt/format.h>

#include <algorithm>

namespace tessera {

namespace {

std::string json(double x) {
    return fmt::format("{:.17g}", x);
}
std::string json(const Vec3d& v) {
    return fmt::format("[{:.17g},{:.17g},{:.17g}]", v.x(), v.y(), v.z());
}
/// A solid as a whole has no face to name.
std::string faceName(std::uint32_t face, const char* whole) {
    return face == kWhole ? whole : fmt::format("{}", face);
}
std::string json(const FacePair& p) {
    if (p.a == kWhole && p.b == kWhole) return "null";
    return fmt::format("[{},{}]", faceName(p.a, "null"), faceName(p.b, "null"));
}
std::string text(const FacePair& p) {
    return faceName(p.a, "whole") + "/" + faceName(p.b, "whole");
}
std::string text(const Vec3d& v) {
    return fmt::format("({:.9g} {:.9g} {:.9g})", v.x(), v.y(), v.z());
}
/// What holds of the answer as a whole.
std::string reservations(bool complete, double error, AnswerFormat format) {
    const bool asJson = format == AnswerFormat::kJson;
    std::string out;
    if (error > 0) out += asJson ? fmt::format(R"(,"error":{})", json(error)) : fmt::format("; error {:.3g}", error);
    if (!complete) out += asJson ? R"(,"complete":false)" : "; gave up before it was sure";
    return out;
}

}  // namespace

std::string answerLine(Touch touch, AnswerFormat format, double error) {
    // Whoever must be safe takes an unknown for a yes.
    const bool hit = touch != Touch::kNo;
    const std::string rest = reservations(touch != Touch::kUnknown, error, format);
    if (format == AnswerFormat::kJson) return fmt::format(R"({{"hit":{}{}}})", hit, rest);
    return fmt::format("{}{}", hit ? "touch" : "do not touch", rest);
}

std::string answerLine(const PairTouch& pairs, AnswerFormat format, double error) {
    const bool asJson = format == AnswerFormat::kJson;
    std::string named;
    for (std::size_t i = 0; i < std::min(pairs.faces.size(), kPairsNamed); ++i)
        named += asJson ? (i > 0 ? "," : "") + json(pairs.faces[i]) : " " + text(pairs.faces[i]);
    const std::string rest = reservations(pairs.complete, error, format);
    if (asJson)
        return fmt::format(R"({{"hit":{},"pairs":{},"first":[{}]{}}})", pairs.count > 0 || !pairs.complete, pairs.count,
                           named, rest);
    if (pairs.count == 0) return fmt::format("no pair of triangles meets{}", rest);
    if (pairs.faces.empty()) return "they meet as wholes" + rest;
    return fmt::format("{} pair{} of triangles meet{}:{}{}{}", pairs.count, pairs.count == 1 ? "" : "s",
                       pairs.count == 1 ? "s" : "", named, pairs.count > kPairsNamed ? " …" : "", rest);
}

std::string answerLine(const PairDepth& depth, std::optional<double> error, AnswerFormat format) {
    if (format == AnswerFormat::kJson)
        return fmt::format(R"({{"depth":{},"normal":{},"error":{}}})", depth.depth ? json(*depth.depth) : "null",
                           json(depth.normal), error ? json(*error) : "null");
    if (!depth.depth) return "no depth: a surface that encloses nothing, or nothing but a touch";
    const std::string rest = reservations(true, error.value_or(0), format);
    if (*depth.depth == 0) return "depth 0" + rest;
    return fmt::format("depth {:.9g}, B out along {}{}", *depth.depth, text(depth.normal), rest);
}

std::string answerLine(const Distance& distance, AnswerFormat format, double error) {
    const std::string rest = reservations(distance.complete, error, format);
    if (format == AnswerFormat::kJson)
        return fmt::format(R"({{"distance":{},"faces":{},"points":[{},{}]{}}})", json(distance.distance),
                           json(distance.faces), json(distance.onA), json(distance.onB), rest);
    const std::string faces =
        distance.faces == FacePair{kWhole, kWhole} ? "" : fmt::format(" faces {},", text(distance.faces));
    return fmt::format("distance {:.9g},{} from {} to {}{}", distance.distance, faces, text(distance.onA),
                       text(distance.onB), rest);
}

std::string answerLine(const Impact& impact, AnswerFormat format, double error) {
    const std::string rest = reservations(impact.complete, error, format);
    if (!impact.hit && impact.complete)
        return format == AnswerFormat::kJson ? fmt::format(R"({{"hit":false{}}})", rest)
                                             : "they do not touch on the way" + rest;
    if (!impact.hit)
        return format == AnswerFormat::kJson ? fmt::format(R"({{"hit":false,"t":{}{}}})", json(impact.t), rest)
                                             : fmt::format("they do not touch up to t = {:.9g}{}", impact.t, rest);
    if (format == AnswerFormat::kJson)
        return fmt::format(R"({{"hit":true,"t":{},"distance":{},"faces":{},"point":{},"normal":{}{}}})", json(impact.t),
                           json(impact.distance), json(impact.faces), json(impact.point), json(impact.normal), rest);
    return fmt::format("touch at t = {:.9g}, distance {:.3g}, faces {}, point {}, normal {}{}", impact.t,
                       impact.distance, text(impact.faces), text(impact.point), text(impact.normal), rest);
}

std::string timeLine(const QueryTimes& times, AnswerFormat format) {
    std::vector<double> sorted = times.queryUs;
    std::sort(sorted.begin(), sorted.end());
    double mean = 0;
    for (const double t : sorted) mean += t / static_cast<double>(sorted.size());
    const auto at = [&](double share) {
        if (sorted.empty()) return 0.0;
        return sorted[std::min(sorted.size() - 1,
                               static_cast<std::size_t>(share * static_cast<double>(sorted.size())))];
    };
    std::string boxes;
    if (times.boxes) {
        const auto& [tests, placed] = *times.boxes;
        const double volume = placed.count > 0 ? placed.volume / static_cast<double>(placed.count) : 0;
        boxes = format == AnswerFormat::kJson
                    ? fmt::format(R"(,"boxes_tested":{},"box_volume":{})", tests, json(volume))
                    : fmt::format("; {} boxes tested, B's of mean volume {:.6g}", tests, volume);
    }
    if (format == AnswerFormat::kJson)
        return fmt::format(
            R"({{"build_us":{},"mean_us":{},"median_us":{},"p99_us":{},"threads":{},"instruction_set":"{}",)"
            R"("faces":[{},{}],"bytes":[{},{}]{}}})",
            json(times.buildUs), json(mean), json(at(0.5)), json(at(0.99)), times.threads, times.instructionSet,
            times.faces[0], times.faces[1], times.bytes[0], times.bytes[1], boxes);
    return fmt::format(
        "build {:.0f} µs; query mean {:.2f} µs, median {:.2f} µs, p99 {:.2f} µs; {} thread{}; {}; faces {} and {}, "
        "{:.2f} "
        "and {:.2f} MB{}",
        times.buildUs, mean, at(0.5), at(0.99), times.threads, times.threads == 1 ? "" : "s", times.instructionSet,
        times.faces[0], times.faces[1], 1e-6 * static_cast<double>(times.bytes[0]),
        1e-6 * static_cast<double>(times.bytes[1]), boxes);
}

}  // namespace tessera
