#include "client/ctl/Answer.h"

#include <fmt/format.h>

namespace tessera {

nlohmann::ordered_json valueJson(const FieldValue& value) {
    const auto numbers = [](const auto& v) -> nlohmann::ordered_json {
        if (v.width == 1) return static_cast<double>(v.values[0]);
        auto list = nlohmann::ordered_json::array();
        for (std::size_t i = 0; i < v.width; ++i) list.push_back(static_cast<double>(v.values[i]));
        return list;
    };
    if (const auto* floats = std::get_if<Floats>(&value)) return numbers(*floats);
    if (const auto* doubles = std::get_if<Doubles>(&value)) return numbers(*doubles);
    if (const auto* number = std::get_if<std::int64_t>(&value)) return *number;
    if (const auto* flag = std::get_if<bool>(&value)) return *flag;
    if (const auto* matrix = std::get_if<Matrix>(&value)) return matrix->values;
    if (const auto* id = std::get_if<ObjectId>(&value)) return *id ? nlohmann::ordered_json(id->value) : nullptr;
    if (const auto* refs = std::get_if<RefList>(&value)) {
        auto list = nlohmann::ordered_json::array();
        for (const ObjectId id : *refs) list.push_back(id.value);
        return list;
    }
    if (const auto* text = std::get_if<std::string>(&value)) return *text;
    const Blob& blob = std::get<Blob>(value);
    if (blob.empty()) return nullptr;
    return {{"blob", toHex(blob.id())}, {"bytes", blob.sizeBytes()}};
}

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
        if (c == 0xc2 && i + 1 < text.size() && (static_cast<unsigned char>(text[i + 1]) & 0xe0) == 0x80) text.replace(i, 2, "?");
    }
    return text;
}

std::string jsonLine(const nlohmann::ordered_json& json) {
    return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace tessera
