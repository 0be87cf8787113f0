/// Colours of DXF: numbers of AutoCAD's palette (ACI), and true ones.
#pragma once

#include <cstdint>

#include "common/math/Types.h"
#include "server/import/reader/DxfGroups.h"

namespace tessera {

/// 1 to 255: of the palette. From kTrue on: 0xRRGGBB above it.
struct DxfColor {
    static constexpr std::uint32_t kByBlock = 0, kByLayer = 256, kTrue = 1U << 24;
    std::uint32_t value = kByLayer;

    /// What the record says; a negative number of a layer, which is off, is its colour all the same.
    [[nodiscard]] static DxfColor of(const DxfRecord& record, DxfColor otherwise);
    bool operator==(const DxfColor&) const = default;
    auto operator<=>(const DxfColor&) const = default;

    /// 0xRRGGBB, sRGB. Number 7 is white or black, whichever is not the paper: here a light grey.
    [[nodiscard]] std::uint32_t rgb() const;
    [[nodiscard]] Vec3f linear() const;
    /// "red", "colour 42", "#ff8800".
    [[nodiscard]] std::string name() const;
};

/// 0xRRGGBB of the number, 0 to 255, as AutoCAD shows it on black.
[[nodiscard]] std::uint32_t dxfPaletteColor(std::uint32_t number);

}  // namespace tessera
