#include "common/scene/Text.h"

#include <cctype>

#include "common/base/Utf8.h"

namespace tessera {

std::string toUtf8(std::string_view text, std::size_t maxBytes) {
    std::string clean;
    while (!text.empty()) {
        const std::size_t length = utf8CharacterLength(text);
        const std::string_view character = length == 0 ? std::string_view("\xEF\xBF\xBD") : text.substr(0, length);
        if (clean.size() + character.size() > maxBytes) break;
        clean.append(character);
        text.remove_prefix(length == 0 ? 1 : length);
    }
    return clean;
}

std::string snakeCase(std::string_view camel) {
    std::string snake;
    for (const char c : camel) {
        if (std::isupper(static_cast<unsigned char>(c))) snake += '_';
        snake += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    return snake;
}

}  // namespace tessera
