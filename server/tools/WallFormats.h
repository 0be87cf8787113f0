/// The descriptions of walls that other programs have, and which this one reads. A further one is a reader in `walls/`
/// and a row in the .cpp.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "server/tools/walls/ForeignWall.h"

namespace tessera {

struct WallFormat {
    std::string_view program;  ///< whose it is: "ParaView"
    std::string_view ending;   ///< of its files: ".pvx"
    bool wallsAlone;           ///< no other files end so
    bool (*knows)(std::string_view beginning);
    Expected<ForeignWall> (*read)(const std::string& path, std::string_view text);
};
[[nodiscard]] std::span<const WallFormat> wallFormats();

/// "SGCT .json, ParaView .pvx, …"; at most 80 columns.
[[nodiscard]] std::string wallFormatList();
/// Whether a file with such a name can be nothing but a wall of another program.
[[nodiscard]] bool namesForeignWall(std::string_view path);
/// Chosen by what the file holds; where that says nothing, by its ending. kNotFound: no such file; kBadInput: which
/// formats there are, or what is wrong, and where.
[[nodiscard]] Expected<ForeignWall> readForeignWall(const std::string& path);

}  // namespace tessera
