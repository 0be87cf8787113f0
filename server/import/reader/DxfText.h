/// Letters of DXF: what its codes stand for, and where they are set.
#pragma once

#include <optional>
#include <string>

#include "proto/scene.pb.h"
#include "server/import/reader/DxfDocument.h"

namespace tessera {

/// `%%d` is °, `%%c` ⌀ as Ø, `%%p` ±, `%%u` and its kind nothing.
[[nodiscard]] std::string dxfPlainText(std::string_view text);
/// An MTEXT's: `\P` ends a line; fonts, colours and heights are left out, stacked numbers are a/b.
[[nodiscard]] std::string dxfParagraphs(std::string_view text);

/// Of one value in a scene (SceneLimits::maxTextBytes).
inline constexpr std::size_t kMostDxfTextBytes = 4096;

struct DxfLetters {
    proto::scene::Text text;  ///< without its material
    Affine3d place = Affine3d::Identity();
    bool sheared = false;  ///< it leans, which is not shown
    bool isCut = false;    ///< it is longer than a Text may be
};

/// Of a TEXT or an ATTRIB. Nothing: it has no letters, or stands nowhere.
[[nodiscard]] std::optional<DxfLetters> dxfLineOfText(const DxfRecord& record, const DxfDocument& document);
/// Of an MTEXT, wrapped about as wide as it says: who wrote it had another font.
[[nodiscard]] std::optional<DxfLetters> dxfTextBlock(const DxfRecord& record, const DxfDocument& document);

}  // namespace tessera
