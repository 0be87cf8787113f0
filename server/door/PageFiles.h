/// The files of the console's page (server/door/page), which the program holds.
#pragma once

#include <span>
#include <string_view>

namespace tessera {

struct PageFile {
    std::string_view name, text;
};
/// As they stand in that folder, in the order of their names; PageFiles.cmake writes them down.
[[nodiscard]] std::span<const PageFile> pageFiles();

}  // namespace tessera
