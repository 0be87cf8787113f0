/// How a file in another program's format says that this program wrote it. Who reads it knows then that its nodes are
/// all there were: glTF's asset.generator, customLayerData.creator of USD, the first `info` of VRML's WorldInfo.
#pragma once

#include <string_view>

namespace tessera {

inline constexpr std::string_view kWriterName = "Tessera";

/// The name alone, or with a version behind.
[[nodiscard]] inline bool isWrittenByTessera(std::string_view writer) {
    return writer.starts_with(kWriterName) &&
           (writer.size() == kWriterName.size() || writer[kWriterName.size()] == ' ');
}

}  // namespace tessera
