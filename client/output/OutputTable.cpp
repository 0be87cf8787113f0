#include "client/output/OutputTable.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/output/MeshLook.h"

namespace tessera {
namespace {

// In these forms both compilers make of each shuffle one instruction of SSE2.
using ByteLanes = std::uint8_t __attribute__((vector_size(16)));
using WordLanes = std::uint16_t __attribute__((vector_size(16)));
using LongLanes = std::uint64_t __attribute__((vector_size(16)));

/// The lower eight bytes as numbers of sixteen bits; the upper ones.
WordLanes lowerHalf(ByteLanes bytes) {
    return reinterpret_cast<WordLanes>(
        __builtin_shufflevector(bytes, ByteLanes{}, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23));
}
WordLanes upperHalf(ByteLanes bytes) {
    return reinterpret_cast<WordLanes>(
        __builtin_shufflevector(bytes, ByteLanes{}, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31));
}

std::uint32_t pixelAt(const std::uint8_t* from, std::size_t at) {
    std::uint32_t pixel = 0;
    std::memcpy(&pixel, from + 4 * at, 4);
    return pixel;
}
/// Two beside each other.
std::uint64_t pairAt(const std::uint8_t* from, std::size_t at) {
    std::uint64_t pixels = 0;
    std::memcpy(&pixels, from + 4 * at, 8);
    return pixels;
}

/// Of upper left and right, lower left and right. Weights add up to 256: no sum leaves its sixteen bits, and equal
/// pixels stay.
std::uint32_t mixed(std::uint64_t upper, std::uint64_t lower, const std::uint8_t* weight) {
    std::uint32_t word = 0;
    std::memcpy(&word, weight, 4);
    const auto once = reinterpret_cast<ByteLanes>(LongLanes{word, 0});
    const auto twice = reinterpret_cast<WordLanes>(
        __builtin_shufflevector(once, once, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23));
    const auto weights = reinterpret_cast<ByteLanes>(
        __builtin_shufflevector(twice, twice, 0, 8, 1, 9, 2, 10, 3, 11));  // each four times
    const auto pixels = reinterpret_cast<ByteLanes>(LongLanes{upper, lower});
    const WordLanes sum = lowerHalf(pixels) * lowerHalf(weights) + upperHalf(pixels) * upperHalf(weights);
    std::uint64_t both =
        reinterpret_cast<LongLanes>((sum + __builtin_shufflevector(sum, sum, 4, 5, 6, 7, 0, 1, 2, 3) + 128) >> 8)[0];
    both |= both >> 8;
    return static_cast<std::uint32_t>((both & 0xffff) | (both >> 16 & 0xffff0000));
}

std::uint8_t byteOf(std::uint32_t signal, std::uint32_t share) {
    return static_cast<std::uint8_t>((signal * share + (1u << 22)) >> 23);
}

}  // namespace

OutputTable::OutputTable(const Options& options)
    : widthPx_(options.widthPx),
      heightPx_(options.heightPx),
      stepRight_(options.fromWidthPx > 1 ? 1 : 0),
      stepDown_(options.fromHeightPx > 1 ? static_cast<std::uint32_t>(options.fromWidthPx) : 0) {
    TESSERA_CHECK(options.fromWidthPx > 0 && options.fromHeightPx > 0 && widthPx_ > 0 && heightPx_ > 0,
                  "an output has pixels");
    makeColours(options);
    makeSpans(entriesOf(options));
}

void OutputTable::makeColours(const Options& options) {
    const double scale = 1 - options.lift.largestBlack - options.lift.most;
    colours_.resize(9);
    sameColours_ = true;
    for (std::size_t part = 0; part < 9; ++part) {
        for (std::size_t c = 0; c < 3; ++c) {
            for (std::size_t value = 0; value < 256; ++value) {
                const double light = options.gain[c] * std::pow(static_cast<double>(value) / 255, kPictureGamma);
                const double wanted = (scale * light + options.lift.added[part]) / (1 - options.black);
                const double signal = 65280 * std::pow(std::clamp(wanted, 0.0, 1.0), 1 / options.gamma[c]);
                colours_[part].signal[c][value] = static_cast<std::uint16_t>(std::lround(signal));
                sameColours_ = sameColours_ && colours_[part].signal[c][value] == 256 * value;
            }
        }
    }
}

std::vector<OutputTable::Entry> OutputTable::entriesOf(const Options& options) const {
    std::vector<Entry> entries(static_cast<std::size_t>(widthPx_) * static_cast<std::size_t>(heightPx_));
    // A mesh that fills the picture meets its edges; what is left over by rounding is no place outside.
    constexpr double kOutside = 1e-6;
    const auto see = [&](int x, int y, const Look& look) {
        const int atX = options.flipX ? widthPx_ - 1 - x : x, atY = options.flipY ? heightPx_ - 1 - y : y;
        Entry& entry =
            entries[static_cast<std::size_t>(atY) * static_cast<std::size_t>(widthPx_) + static_cast<std::size_t>(atX)];
        entry = {};
        if (!(look.u >= -kOutside && look.u <= 1 + kOutside && look.v >= -kOutside && look.v <= 1 + kOutside)) return;
        const double px = look.u * options.fromWidthPx, py = look.v * options.fromHeightPx;
        // In 256ths between centres.
        const auto place = [](double centre, int size) {
            return std::clamp<std::int64_t>(std::llround(256 * (centre - 0.5)), 0, 256 * std::int64_t{size - 1});
        };
        const std::int64_t sx = place(px, options.fromWidthPx), sy = place(py, options.fromHeightPx);
        const std::int64_t firstX = std::min<std::int64_t>(sx >> 8, std::max(0, options.fromWidthPx - 2)),
                           firstY = std::min<std::int64_t>(sy >> 8, std::max(0, options.fromHeightPx - 2));
        entry.at = static_cast<std::uint32_t>(firstY * options.fromWidthPx + firstX);
        entry.right = static_cast<std::uint16_t>(sx - 256 * firstX);
        entry.down = static_cast<std::uint16_t>(sy - 256 * firstY);
        entry.shown = true;
        if (options.part) entry.paint.part = static_cast<std::uint16_t>(options.part(px, py));
        double share = look.intensity;
        if (options.share) share *= options.share(px, py, (x + 0.5) / widthPx_, (y + 0.5) / heightPx_);
        for (std::size_t c = 0; c < 3; ++c)
            entry.paint.share[c] = static_cast<std::uint16_t>(
                share >= 1 ? kAll : std::lround(kAll * std::pow(std::max(0.0, share), 1 / options.gamma[c])));
    };
    if (options.warp) {
        lookThrough(*options.warp, widthPx_, heightPx_, see);
        return entries;
    }
    for (int y = 0; y < heightPx_; ++y)
        for (int x = 0; x < widthPx_; ++x) see(x, y, Look{(x + 0.5) / widthPx_, (y + 0.5) / heightPx_, 1});
    return entries;
}

OutputTable::Span::Kind OutputTable::kindOf(const Entry& entry) const {
    const auto all = [&](std::uint16_t wanted) {
        return std::ranges::all_of(entry.paint.share, [wanted](std::uint16_t share) { return share == wanted; });
    };
    if (!entry.shown || all(0)) return Span::kBlack;
    // Where there is one column or row, its neighbour is itself.
    const bool still = (entry.right % 256 == 0 || stepRight_ == 0) && (entry.down % 256 == 0 || stepDown_ == 0);
    if (sameColours_ && all(kAll)) return still ? Span::kCopied : Span::kSampled;
    return still ? Span::kColoured : Span::kFull;
}

/// What no span reads is dropped: an output that is blended at its edges has a table of its edges.
void OutputTable::makeSpans(const std::vector<Entry>& entries) {
    for (int y = 0; y < heightPx_; ++y) {
        const Entry* const row = entries.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(widthPx_);
        const auto pixel = [&](const Entry& e) {
            return e.at + (e.right == 256 ? stepRight_ : 0) + (e.down == 256 ? stepDown_ : 0);
        };
        for (int x = 0; x < widthPx_;) {
            const Span::Kind kind = kindOf(row[x]);
            int end = x + 1;
            while (end < widthPx_ && kindOf(row[end]) == kind &&
                   (kind != Span::kCopied || pixel(row[end]) == pixel(row[end - 1]) + 1))
                ++end;
            spans_.push_back({kind, y, x, end});
            const int places = kind == Span::kBlack ? x : kind == Span::kCopied ? x + 1 : end;
            for (int i = x; i < places; ++i) {
                const Entry& e = row[i];
                if (kind == Span::kCopied || kind == Span::kColoured) {
                    places_.push_back({.at = pixel(e), .weight = {}});
                } else {
                    // One of the four may take all but 256 - 255: none does, or the pixel were a still one.
                    const int right = stepRight_ == 0 ? 0 : e.right, down = stepDown_ == 0 ? 0 : e.down;
                    const int both = (right * down + 128) >> 8;
                    const int weight[4] = {256 - right - down + both, right - both, down - both, both};
                    Place place{.at = e.at, .weight = {}};
                    for (std::size_t w = 0; w < 4; ++w)
                        place.weight[w] = static_cast<std::uint8_t>(std::min(weight[w], 255));
                    places_.push_back(place);
                }
                if (kind == Span::kColoured || kind == Span::kFull) paints_.push_back(e.paint);
            }
            x = end;
        }
    }
    places_.shrink_to_fit();
    paints_.shrink_to_fit();
}

void OutputTable::draw(const std::uint8_t* from, PixelRows to) const {
    return stepRight_ == 1 ? drawSpans<true>(from, to) : drawSpans<false>(from, to);
}

template <bool hasColumns>
void OutputTable::drawSpans(const std::uint8_t* from, PixelRows to) const {
    const Place* place = places_.data();
    const Paint* paint = paints_.data();
    const auto sampled = [from, stepDown = stepDown_](const Place& p) {
        if constexpr (hasColumns) return mixed(pairAt(from, p.at), pairAt(from, p.at + stepDown), p.weight);
        return mixed(pixelAt(from, p.at), pixelAt(from, p.at + stepDown), p.weight);
    };
    const auto colour = [&](std::uint32_t pixel, std::uint8_t* out) {
        const Colours& colours = colours_[paint->part];
        std::uint32_t made = 0xff000000;
        for (std::size_t c = 0; c < 3; ++c)
            made |= std::uint32_t{byteOf(colours.signal[c][pixel >> (8 * c) & 0xff], paint->share[c])} << (8 * c);
        std::memcpy(out, &made, 4);
        ++paint;
    };
    for (const Span& span : spans_) {
        std::uint8_t* out =
            to.rgbx + static_cast<std::size_t>(span.y) * to.pitchBytes + 4 * static_cast<std::size_t>(span.begin);
        const std::size_t count = static_cast<std::size_t>(span.end - span.begin);
        switch (span.kind) {
            case Span::kBlack:
                std::memset(out, 0, 4 * count);
                break;
            case Span::kCopied:
                std::memcpy(out, from + 4 * std::size_t{place->at}, 4 * count);
                ++place;
                break;
            case Span::kSampled:
                for (std::size_t i = 0; i < count; ++i, ++place, out += 4) {
                    const std::uint32_t pixel = sampled(*place);
                    std::memcpy(out, &pixel, 4);
                }
                break;
            case Span::kColoured:
                for (std::size_t i = 0; i < count; ++i, ++place, out += 4) colour(pixelAt(from, place->at), out);
                break;
            case Span::kFull:
                for (std::size_t i = 0; i < count; ++i, ++place, out += 4) colour(sampled(*place), out);
                break;
        }
    }
}

}  // namespace tessera
