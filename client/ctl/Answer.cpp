#include "client/ctl/Answer.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>
#include <utility>

namespace tessera {

nlohmann::ordered_json jsonOf(const Vec3d& v) {
    return nlohmann::ordered_json::array({v.x(), v.y(), v.z()});
}

std::string readable(double number) {
    std::string whole = fmt::format("{}", number);
    if (whole.size() <= 8 || !std::isfinite(number)) return whole;
    // 1234567.8 is no 1.23457e+06.
    const double size = std::abs(number);
    return size >= 1e6 && size < 1e15 ? fmt::format("{:.0f}", number) : fmt::format("{:.6g}", number);
}

Vec3d withoutNoise(const Vec3d& v) {
    constexpr double kNoise = 1e-9;
    const double least = kNoise * v.cwiseAbs().maxCoeff();
    return v.unaryExpr([&](double x) { return std::abs(x) < least ? 0.0 : x; });
}

std::string textOf(const Vec3d& v) {
    const Vec3d plain = withoutNoise(v);
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", plain.x(), plain.y(), plain.z());
}

std::string numberOf(ObjectId id) {
    return fmt::format("#{}", id.value);
}

namespace {

/// Of an embedding, override, isolate or their ends (U+202A to U+202E, U+2066 to U+2069) its escape; null: it is none.
const char* turnAt(const std::string& text, std::size_t at) {
    static constexpr std::pair<std::string_view, const char*> kTurns[] = {
        {"\u202a", "\\u202a"}, {"\u202b", "\\u202b"}, {"\u202c", "\\u202c"},
        {"\u202d", "\\u202d"}, {"\u202e", "\\u202e"}, {"\u2066", "\\u2066"},
        {"\u2067", "\\u2067"}, {"\u2068", "\\u2068"}, {"\u2069", "\\u2069"}};
    for (const auto& [turn, escape] : kTurns)
        if (text.compare(at, turn.size(), turn) == 0) return escape;
    return nullptr;
}

}  // namespace

std::string withoutControls(std::string text) {
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto c = static_cast<unsigned char>(text[i]);
        if ((c < 0x20 && c != '\n' && c != '\t') || c == 0x7f) text[i] = '?';
        // U+0080 to U+009f: some terminals take them as the beginning of a sequence, too.
        if (c == 0xc2 && i + 1 < text.size() && (static_cast<unsigned char>(text[i + 1]) & 0xe0) == 0x80)
            text.replace(i, 2, "?");
        // What turns the direction of all behind it would make it look like something else: as JSON writes it.
        if (const char* const turn = turnAt(text, i); turn != nullptr) text.replace(i, 3, turn);
    }
    return text;
}

std::string jsonLine(const nlohmann::ordered_json& json) {
    return jsonText(json) + "\n";
}

}  // namespace tessera
