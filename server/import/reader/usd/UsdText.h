/// Text of USD (.usda) → a layer. Written after the published grammar of usda 1.0.
#pragma once

#include "common/base/Error.h"
#include "server/import/reader/usd/UsdLayer.h"

namespace tessera {

/// Whether it begins as text of USD does.
[[nodiscard]] bool isUsdText(std::string_view text);

/// kBadInput "line:column: what is wrong", kLimit alike. Relative paths are absolute in the layer.
[[nodiscard]] Expected<std::shared_ptr<const UsdLayer>> parseUsdText(std::string_view text, std::string identifier,
                                                                     const UsdLayerLimits& limits = {});

/// `path` as somebody at `prim`, an absolute path, means it: "../B.x" at "/A/C" is "/A/B.x". Nothing: it leads out.
[[nodiscard]] std::string absoluteUsdPath(std::string_view path, std::string_view prim);

}  // namespace tessera
