/// Binary USD (.usdc, a "crate") → a layer. Written after the published structure of crate files, versions 0.4 to 0.12.
///
/// A crate is a table of contents of six sections: TOKENS (all words), STRINGS (which tokens are strings), FIELDS (a
/// name and a value each), FIELDSETS (which fields belong together), PATHS (a tree in depth-first order), SPECS (a
/// path, its fields, its kind). Values stand in 8 bytes, or anywhere in the file where those point. No count is
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
