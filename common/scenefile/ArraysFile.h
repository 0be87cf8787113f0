/// The large arrays of a saved text, in one file beside it.
///
/// "TSARRAY1", how many they are, for each its bytes and their hash (two numbers), the hash of all before; then the
/// bytes, one array behind the other. Numbers have eight bytes, little-endian.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Blob.h"

namespace tessera {

/// Which save it is of: the hash of its head, and so of all that it holds. 16 hexadecimal digits.
struct ArraysHead {
    std::string bytes;
    std::string id;
    std::uint64_t total = 0;  ///< of the whole file
};
[[nodiscard]] ArraysHead arraysHead(std::span<const Blob> arrays);

/// "hall.3f2a91c07b5ed012.arrays" for "/scenes/hall.tsct". Stands in quotes as it is: UTF-8, no quotes, backslashes and
/// control characters.
[[nodiscard]] std::string arraysNameFor(const std::string& textPath, std::string_view id);
/// Whether that is such a name, and nothing but a name.
[[nodiscard]] bool isArraysName(std::string_view name);

/// As much of a file as is searched for the arrays that it names: 64 KiB. Nothing: it cannot be read, or is no ordinary
/// file. Waits for no pipe, follows no link.
[[nodiscard]] std::optional<std::string> headOfText(const std::string& path);

/// Checks everything. kBadInput: it is damaged, none of these files, or of another save than `id` names; messages do
/// not name the file.
[[nodiscard]] Expected<std::vector<Bytes>> readArrays(ByteSpan file, std::string_view id);

}  // namespace tessera
