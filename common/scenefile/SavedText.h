/// What a text saved, as people read and write it: nodes inside of each other, names in place of numbers. Turned into
/// the form that binary files have, so that SavedReader checks it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

/// `saved { … }` of a text, nested. Its flat form (`object { number: … }`), which texts of newer versions keep, is
/// protobuf's own and none of this.
struct SavedPart {
    std::size_t begin = 0, end = 0;  ///< in bytes, the word and the last brace included
    int line = 0, column = 0;        ///< from 0
};
/// Nothing: there is none. kBadInput: there are two. Errors begin with "line:column: ".
[[nodiscard]] Expected<std::optional<SavedPart>> findSavedPart(std::string_view text);

/// The NAME in `saved { arrays { file: "NAME" … } … }`, of which `head` is the beginning; the rest may be missing.
/// Empty: there is none, or it is no plain name.
[[nodiscard]] std::string arraysNamedIn(std::string_view head);

struct SavedTextOptions {
    /// The bytes of a file that lies beside the text; messages name it.
    std::function<Expected<Bytes>(const std::string& name)> beside;
    std::size_t firstArray = 1;  ///< the number of the first array that this text has
};
struct SavedText {
    std::string saved;          ///< bytes of a message Saved
    std::vector<Bytes> arrays;  ///< those that it names, from `firstArray` on
    std::vector<std::string> notes;
};
/// The text may come from anybody. Errors begin with "line:column: ".
[[nodiscard]] Expected<SavedText> readSavedText(std::string_view text, const SavedPart& part,
                                                const SavedTextOptions& options);

}  // namespace tessera
