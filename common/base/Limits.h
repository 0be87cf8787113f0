/// How large a scene may be, and what follows from that for whoever passes it on: what one lets in, the next must not
/// refuse. Modules have these as their defaults; those that cannot (the scene's own) are compared while compiling.
#pragma once

#include <cstddef>

namespace tessera::limits {

// ---- of a scene (common/scene: SceneLimits)
inline constexpr std::size_t kMaxObjects = 4'000'000;
inline constexpr std::size_t kMaxTextBytes = 4096;  ///< one text value
/// Of one type, inherited ones counted; no type has as many (unit_codec).
inline constexpr std::size_t kMaxFieldsOfType = 40;

// ---- of the list that makes a whole scene from nothing (common/codec: ChangeLimits)
/// Each object is created, placed, and each of its fields is set.
inline constexpr std::size_t kMaxListChanges = kMaxObjects * (2 + kMaxFieldsOfType);
/// An object takes some hundred bytes of it; many long texts are refused as blobs are.
inline constexpr std::size_t kMaxListBytes = std::size_t{4} << 30;
static_assert(kMaxListBytes / kMaxObjects >= 1024);

// ---- of what joins are fetched as (common/session: ClientSessionConfig)
/// A large snapshot is a blob.
inline constexpr std::size_t kMaxBlobBytes = kMaxListBytes;

// ---- of scene files (server/import: SceneFileLimits, ImportOptions)
/// A node as authors write it has a name, a pose and a core: some eight fields.
inline constexpr std::size_t kMaxFileElements = 8 * kMaxObjects;
/// Below that many a file may consist of nothing else; above, they must not be most of its bytes, or a small file would
/// become a large tree.
inline constexpr std::size_t kFreeFileElements = 8'000'000;
inline constexpr std::size_t kBytesPerFileElement = 4;

}  // namespace tessera::limits
