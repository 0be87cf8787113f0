/// Binary USD (.usdc, a "crate") → a layer. Written after the published structure of crate files, versions 0.4 to
/// 0.12.
///
/// A crate is a table of contents of six sections. TOKENS has all words, STRINGS says which of them are strings. FIELDS
/// has a name and a value each, FIELDSETS which of them belong together. PATHS is a tree in depth-first order. SPECS
/// has a path, its fields and its kind. Values stand in 8 bytes, or anywhere in the file where those point. No count is
/// believed before there are bytes for it.
#pragma once

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "server/import/reader/usd/UsdLayer.h"

namespace tessera {

[[nodiscard]] bool isUsdCrate(ByteSpan bytes);

/// kBadInput, kLimit, kUnsupported (a version) in words, with the byte where it stands.
[[nodiscard]] Expected<std::shared_ptr<const UsdLayer>> readUsdCrate(ByteSpan bytes, std::string identifier,
                                                                     const UsdLayerLimits& limits = {});

}  // namespace tessera
