/// Letters as closed curves, and the triangles that they are around: what `Text::outlines` holds.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/base/Blob.h"
#include "common/base/Error.h"

namespace tessera {

/// Of 1/65536 em, +X the way that lines run, +Y up.
struct OutlinePoint {
    static constexpr std::int32_t kPerEm = 65536;
    static constexpr std::int32_t kFarthest = 1 << 28;  ///< either way: 4096 em
    std::int32_t x = 0, y = 0;
    bool operator==(const OutlinePoint&) const = default;
};

/// On from where the one before ends: a line (degree 1), or a Bézier curve of degree 2 or 3. The last of `degree`
/// points is its end.
struct OutlineSegment {
    std::uint32_t degree = 1;
    std::array<OutlinePoint, 3> points;
    bool operator==(const OutlineSegment&) const = default;
};

/// Closed: a line leads from the last end to the start where they differ.
struct OutlineContour {
    OutlinePoint start;
    std::vector<OutlineSegment> segments;
    bool operator==(const OutlineContour&) const = default;
};

/// Solid where its contours wind around a place, either way (non-zero winding).
using LetterShape = std::vector<OutlineContour>;

struct PlacedLetter {
    std::uint32_t shape = 0;
    OutlinePoint at;  ///< of the shape's origin
    bool operator==(const PlacedLetter&) const = default;
};

/// Each shape once, and where it stands. As a blob of 32-bit words, little-endian: 1, shapes, letters; of each shape
/// its contours, of each contour x, y of its start and its segments, of each segment its degree and x, y of its points;
/// of each letter shape, x, y.
struct TextOutlines {
    static constexpr std::size_t kMostLetters = 65536, kMostSegments = 1'000'000;
    std::vector<LetterShape> shapes;
    std::vector<PlacedLetter> letters;
    bool operator==(const TextOutlines&) const = default;

    /// Empty where there is no letter.
    [[nodiscard]] Blob toBlob() const;
    /// Refused in words: numbers out of their bounds, words that are missing or too many.
    [[nodiscard]] static Expected<TextOutlines> of(const Blob& blob);
};

/// A letter cut into triangles, as it is seen from +Z. The curves are replaced by chords.
struct LetterTriangles {
    std::vector<OutlinePoint> vertices;
    std::vector<std::uint32_t> triangles;  ///< three vertices each, counter-clockwise
    /// The rims that the triangles have, as vertices one after the other, what is solid on their left.
    std::vector<std::vector<std::uint32_t>> rims;
};

/// Chords are within `tolerance` (of 1/65536 em, at least 1) of the curves, and half a unit that vertices are rounded
/// by. Contours count where the winding number of the others at them says that something begins or ends there; a hole
/// is cut out of the smallest contour around it. Contours that cross others are filled each by itself. kLimit:
/// kMostCorners, or what kMostClipSteps of Primitives.h allow.
[[nodiscard]] Expected<LetterTriangles> trianglesOf(const LetterShape& shape, double tolerance);

}  // namespace tessera
