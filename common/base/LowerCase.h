/// Words whose capitals make no difference: endings of files, names of monitors.
#pragma once

#include <string>
#include <string_view>

namespace tessera {

/// A to Z become a to z, whatever the locale; all other bytes stay.
[[nodiscard]] inline std::string lowerCase(std::string_view text) {
    std::string lower(text);
    for (char& c : lower)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return lower;
}

}  // namespace tessera
