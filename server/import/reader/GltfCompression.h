/// Compressed parts of glTF files, made plain before anything else reads them: buffer views of EXT_meshopt_compression
/// (and of KHR_meshopt_compression, in what both share), primitives of KHR_draco_mesh_compression.
#pragma once

#include <tiny_gltf.h>

#include <optional>
#include <string>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

/// The name of the view that stands in for what Draco fills.
inline constexpr const char* kStandIn = "tessera: of what is compressed";

/// The file, JSON or GLB, in which buffers of compressed views have a byte of their own, and accessors that Draco fills
/// a view, `kStandIn`: they need none in a file, and tinygltf takes that for a fault. Nothing: there are none, and the
/// file is good as it is.
[[nodiscard]] std::optional<Bytes> withStandIns(ByteSpan file);

/// Decodes into buffers that it appends, where views and accessors then lie. kBadInput names the view; kLimit: more
/// than `mostBytes` in all, or more elements than so few bytes can hold.
[[nodiscard]] Expected<void> expandMeshopt(tinygltf::Model& model, std::size_t mostBytes);

/// The same of primitives. One that cannot be decoded is shown as its uncompressed twin, where the file has that: why
/// is said in `notes`. What it decodes takes the place of what the file says else.
[[nodiscard]] Expected<void> expandDraco(tinygltf::Model& model, std::size_t mostBytes,
                                         std::vector<std::string>& notes);

}  // namespace tessera
