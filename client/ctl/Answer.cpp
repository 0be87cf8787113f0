#include "client/ctl/Answer.h"

#include <fmt/format.h>

#include <cmath>

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

std::string withoutControls(std::string text) {
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto c = static_cast<unsigned char>(text[i]);
        if ((c < 0x20 && c != '\n' && c != '\t') || c == 0x7f) text[i] = '?';
        // U+0080 to U+009f: some terminals take them as the beginning of a sequence, too.
        if (c == 0xc2 && i + 1 < text.size() && (static_cast<unsigned char>(text[i + 1]) & 0xe0) == 0x80)
            text.replace(i, 2, "?");
    }
    return text;
}

std::string jsonLine(const nlohmann::ordered_json& json) {
    return jsonText(json) + "\n";
}

}  // namespace tessera
