/// First pictures of animations made of PNG pictures, as PNG files of their own.
#pragma once

#include <optional>

#include "server/import/reader/ImageDecoder.h"

namespace tessera {

/// "MNG (Multiple-image Network Graphics) Format", version 1.0: its first PNG picture, a file of its own. Where that
/// stands on the animation's canvas is not regarded. Refused by name: JPEG in MNG (JNG).
[[nodiscard]] bool isMng(ByteSpan bytes);
[[nodiscard]] Expected<Bytes> firstPngOfMng(ByteSpan bytes);

/// "Portable Network Graphics (PNG) Specification (Third Edition)", chapter 11.3.6: a PNG file may hold an animation
/// that its picture, which other programs show, is no frame of.
struct PngFrame {
    Bytes png;  ///< the frame, a file of its own
    std::uint64_t leftPx = 0, topPx = 0, canvasWidthPx = 0, canvasHeightPx = 0;
};
/// The first frame of such an animation. None: the file's own picture is to be shown.
[[nodiscard]] std::optional<PngFrame> firstFrameOfPng(ByteSpan bytes);
/// `picture`, the frame's, where it stands; clear around it. kBadInput: it lies outside.
[[nodiscard]] Expected<DecodedImage> onCanvas(const PngFrame& frame, const DecodedImage& picture);

}  // namespace tessera
