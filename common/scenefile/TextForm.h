/// What writer and reader of a saved text agree upon (README.md has the form). Internal to this folder.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/scene/FieldTable.h"
#include "common/scene/Text.h"

namespace tessera::textform {

// Words that stand for no type and no field.
inline constexpr std::string_view kSaved = "saved", kRoot = "root", kUnplaced = "unplaced", kArrays = "arrays",
                                  kArray = "array", kId = "id", kCore = "core", kNode = "node", kFile = "file";
/// How the root is referred to.
inline constexpr std::string_view kRootName = "/";

/// "point_light": how objects of a type begin.
[[nodiscard]] inline std::string wordOf(const TypeInfo& type) {
    return snakeCase(type.name).substr(1);
}

/// "PING_PONG" for "ping-pong": a word of an enumeration in the schema.
[[nodiscard]] inline std::string enumWord(std::string_view word) {
    std::string upper(word);
    for (char& c : upper) c = c == '-' ? '_' : static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
    return upper;
}
/// "RESPONSE_": how the words of a field begin there.
[[nodiscard]] inline std::string enumHead(std::string_view field) {
    return enumWord(field) + "_";
}

/// What the elements of an array are, where the table says so.
struct Elements {
    enum class Kind : std::uint8_t { kNone, kFloat, kDouble, kUint8, kUint16, kUint32 } kind = Kind::kNone;
    std::size_t each = 0;         ///< numbers that belong together
    std::size_t numberBytes = 0;  ///< of each number
};
[[nodiscard]] inline Elements elementsOf(const FieldInfo& field) {
    using Kind = Elements::Kind;
    if (field.numbersEach > 0)
        return field.doubles ? Elements{Kind::kDouble, field.numbersEach, 8}
                             : Elements{Kind::kFloat, field.numbersEach, 4};
    if (field.integersEach == 0) return {};
    const Kind kind = field.integerBytes == 1   ? Kind::kUint8
                      : field.integerBytes == 2 ? Kind::kUint16
                      : field.integerBytes == 4 ? Kind::kUint32
                                                : Kind::kNone;
    return {kind, field.integersEach, field.integerBytes};
}

/// `take` with a number of the elements' type; `otherwise`: they are bytes.
template <typename Result, typename Take>
[[nodiscard]] Result withNumber(Elements::Kind kind, const Take& take, Result otherwise) {
    switch (kind) {
        case Elements::Kind::kFloat:
            return take(float{});
        case Elements::Kind::kDouble:
            return take(double{});
        case Elements::Kind::kUint8:
            return take(std::uint8_t{});
        case Elements::Kind::kUint16:
            return take(std::uint16_t{});
        case Elements::Kind::kUint32:
            return take(std::uint32_t{});
        case Elements::Kind::kNone:
            break;
    }
    return otherwise;
}

}  // namespace tessera::textform
