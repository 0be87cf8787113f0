#include "client/ctl/Answer.h"

#include <fmt/format.h>

namespace tessera {

nlohmann::ordered_json jsonOf(const Vec3d& v) {
    return nlohmann::ordered_json::array({v.x(), v.y(), v.z()});
}

std::string textOf(const Vec3d& v) {
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x(), v.y(), v.z());
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
