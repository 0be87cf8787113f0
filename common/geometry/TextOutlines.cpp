#include "common/geometry/TextOutlines.h"

#include <fmt/format.h>

#include <bit>
#include <cstdlib>
#include <span>

namespace tessera {
namespace {

static_assert(std::endian::native == std::endian::little, "words of outlines are little-endian");
constexpr std::uint32_t kOutlinesVersion = 1;

/// Words one after the other; 0, and `missing`, beyond the last.
struct WordReader {
    std::span<const std::uint32_t> left;
    bool missing = false, far = false;

    std::uint32_t next() {
        if (left.empty()) {
            missing = true;
            return 0;
        }
        const std::uint32_t word = left.front();
        left = left.subspan(1);
        return word;
    }
    OutlinePoint point() {
        const auto x = static_cast<std::int32_t>(next()), y = static_cast<std::int32_t>(next());
        far = far || x > OutlinePoint::kFarthest || x < -OutlinePoint::kFarthest || y > OutlinePoint::kFarthest ||
              y < -OutlinePoint::kFarthest;
        return {x, y};
    }
    /// How many of what takes at least `words` each; no more than can follow.
    std::uint32_t count(std::size_t words) {
        const std::uint32_t many = next();
        if (many <= left.size() / words) return many;
        missing = true;
        return 0;
    }
};

}  // namespace

Blob TextOutlines::toBlob() const {
    if (letters.empty()) return {};
    std::vector<std::uint32_t> words{kOutlinesVersion, static_cast<std::uint32_t>(shapes.size()),
                                     static_cast<std::uint32_t>(letters.size())};
    const auto add = [&](const OutlinePoint& p) {
        words.insert(words.end(), {static_cast<std::uint32_t>(p.x), static_cast<std::uint32_t>(p.y)});
    };
    for (const LetterShape& shape : shapes) {
        words.push_back(static_cast<std::uint32_t>(shape.size()));
        for (const OutlineContour& contour : shape) {
            add(contour.start);
            words.push_back(static_cast<std::uint32_t>(contour.segments.size()));
            for (const OutlineSegment& segment : contour.segments) {
                words.push_back(segment.degree);
                for (std::uint32_t i = 0; i < segment.degree; ++i) add(segment.points[i]);
            }
        }
    }
    for (const PlacedLetter& letter : letters) {
        words.push_back(letter.shape);
        add(letter.at);
    }
    return Blob::of(std::span<const std::uint32_t>(words));
}

Expected<TextOutlines> TextOutlines::of(const Blob& blob) {
    TextOutlines made;
    if (blob.empty()) return made;
    if (!blob.resident())
        return fail(ErrorCode::kBadInput, "the outlines are not here: their blob has to be fetched first");
    if (blob.sizeBytes() % sizeof(std::uint32_t) != 0)
        return fail(
            ErrorCode::kBadInput,
            fmt::format("the outlines have {} bytes, not a whole number of words of 4 bytes", blob.sizeBytes()));
    WordReader words{.left = blob.as<std::uint32_t>()};
    if (words.next() != kOutlinesVersion) return fail(ErrorCode::kBadInput, "the outlines do not begin with 1");
    const std::uint32_t shapes = words.count(1), letters = words.count(3);
    std::size_t segments = 0;
    for (std::uint32_t s = 0; s < shapes && !words.missing; ++s) {
        LetterShape& shape = made.shapes.emplace_back(words.count(3));
        for (OutlineContour& contour : shape) {
            contour.start = words.point();
            contour.segments.resize(words.count(3));
            segments += contour.segments.size();
            if (segments > kMostSegments)
                return fail(ErrorCode::kLimit, fmt::format("the outlines have more than {} segments", kMostSegments));
            for (OutlineSegment& segment : contour.segments) {
                segment.degree = words.next();
                if (!words.missing && (segment.degree < 1 || segment.degree > 3))
                    return fail(ErrorCode::kBadInput,
                                fmt::format("shape {} has a curve of degree {}: 1 to 3 are known", s, segment.degree));
                for (std::uint32_t i = 0; i < segment.degree; ++i) segment.points[i] = words.point();
            }
        }
    }
    if (letters > kMostLetters)
        return fail(ErrorCode::kLimit, fmt::format("{} letters, at most {} are allowed", letters, kMostLetters));
    for (std::uint32_t l = 0; l < letters && !words.missing; ++l) {
        const std::uint32_t shape = words.next();
        made.letters.push_back({.shape = shape, .at = words.point()});
        if (!words.missing && shape >= made.shapes.size())
            return fail(ErrorCode::kBadInput,
                        fmt::format("letter {} has shape {}, but there are {}", l, shape, made.shapes.size()));
    }
    if (words.missing) return fail(ErrorCode::kBadInput, "the outlines end too early");
    if (!words.left.empty())
        return fail(ErrorCode::kBadInput, fmt::format("the outlines have {} words too many", words.left.size()));
    if (words.far) return fail(ErrorCode::kBadInput, "a point of the outlines is farther away than 4096 em");
    return made;
}

}  // namespace tessera
