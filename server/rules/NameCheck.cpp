#include "server/rules/NameCheck.h"

#include <algorithm>
#include <variant>
#include <vector>

#include "common/base/Utf8.h"
#include "common/cores/Node.h"
#include "common/cores/ShippedTypes.h"

namespace tessera {
namespace {

/// Of a whole character.
bool isControl(std::string_view character) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(character[i]); };
    if (character.size() == 1) return byte(0) < 0x20 || byte(0) == 0x7F;
    if (character.size() == 2) return byte(0) == 0xC2 && byte(1) < 0xA0;
    return character == "\u2028" || character == "\u2029";
}

}  // namespace

bool isOneLine(std::string_view text) {
    while (!text.empty()) {
        const std::size_t length = utf8CharacterLength(text);
        if (length == 0 || isControl(text.substr(0, length))) return false;
        text.remove_prefix(length);
    }
    return true;
}

std::string asOneLine(std::string_view text) {
    std::string line;
    while (!text.empty()) {
        const std::size_t length = utf8CharacterLength(text);
        const std::string_view character = text.substr(0, std::max<std::size_t>(length, 1));
        if (length == 0 || isControl(character))
            line += '?';
        else
            line += character;
        text.remove_prefix(character.size());
    }
    return line;
}

Sound checkNames(const ChangeList& list) {
    for (const FieldColumn& column : list.columns) {
        if (column.type != typeOf<Node>()) continue;
        if (column.field == fieldId<&Node::core>) {
            const auto* cores = std::get_if<std::vector<ObjectId>>(&column.values);
            for (std::size_t row = 0; cores != nullptr && row < std::min(cores->size(), column.ids.size()); ++row)
                if (column.ids[row] == kRootNode && (*cores)[row])
                    return tl::unexpected(Fault{kRootNode,
                                                typeOf<Node>(),
                                                {ErrorCode::kRefused,
                                                 "it is the root, which has no core: all places and paths begin there; "
                                                 "give it to a node below it"}});
        }
        if (column.field != fieldId<&Node::name>) continue;
        const auto* names = std::get_if<std::vector<std::string>>(&column.values);
        for (std::size_t row = 0; names != nullptr && row < std::min(names->size(), column.ids.size()); ++row) {
            // Paths begin at the root and leave its name out; a file of a root that has one, or a core, comes back a
            // level deeper.
            if (column.ids[row] == kRootNode && !(*names)[row].empty())
                return tl::unexpected(
                    Fault{kRootNode,
                          typeOf<Node>(),
                          {ErrorCode::kRefused,
                           "it is the root, which has no name: all paths begin there; name a node below it"}});
            // Whoever looks at lists says what is no UTF-8.
            if (isUtf8((*names)[row]) && !isOneLine((*names)[row]))
                return tl::unexpected(
                    Fault{column.ids[row],
                          typeOf<Node>(),
                          {ErrorCode::kBadInput, "its name has a line break or another control character"}});
        }
    }
    return {};
}

}  // namespace tessera
