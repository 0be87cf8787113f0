/// From a tile's picture to one eye's picture of an output, pixel by pixel, from a table made once: which four pixels
/// of the tile it takes (bilinear), how much of their light it keeps, and the colours that the projector needs for
/// that.
///
/// Light and signals: a picture's value c (0 to 1) stands for the light c^2.2. A projector makes signal^gamma of its
/// white's light, and `black` beside it. So signal = (share · (scale · gain · c^2.2 + lift) / (1 - black))^(1/gamma),
/// where `scale` keeps room for the lift at white. A pixel that keeps all its light of a picture without gain, with
/// gamma 2.2, has the picture's value in every bit.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "common/image/Picture.h"
#include "common/output/BlendRamp.h"
#include "common/wall/Output.h"

namespace tessera {

/// The light that a picture's value stands for: value ^ this.
inline constexpr double kPictureGamma = 2.2;

class OutputTable {
public:
    struct Options {
        int fromWidthPx = 0, fromHeightPx = 0;  ///< of the tile's picture
        int widthPx = 0, heightPx = 0;          ///< of the output's
        const WarpMesh* warp = nullptr;         ///< null: the picture fills the output
        /// Share of light at a place of the tile's picture (pixels from its upper left corner, centres at half ones)
        /// and of the output (0 to 1 from there); null: all.
        std::function<double(double x, double y, double outU, double outV)> share;
        /// Which part of the tile, 0 to 8, for the lift of black; null: 4.
        std::function<int(double x, double y)> part;
        BlackLift lift;
        double black = 0;
        ChannelValues gain{1, 1, 1}, gamma{kPictureGamma, kPictureGamma, kPictureGamma};
        bool flipX = false, flipY = false;
    };
    explicit OutputTable(const Options& options);

    /// `from`: a whole picture without gaps between rows, four bytes a pixel. Writes each pixel of `to`; the fourth
    /// bytes mean nothing. Thread-safe.
    void draw(const std::uint8_t* from, PixelRows to) const;

    /// Bytes that the table takes.
    [[nodiscard]] std::size_t size() const {
        return places_.size() * sizeof(Place) + paints_.size() * sizeof(Paint) + spans_.size() * sizeof(Span);
    }

private:
    /// Where an output's pixel looks: the upper left of four pixels, and the weights of all four, which add up to 256.
    /// One that takes a single pixel names that.
    struct Place {
        std::uint32_t at = 0;
        std::uint8_t weight[4] = {};
    };
    struct Paint {
        std::uint16_t share[3] = {};  ///< of kAll: of the signal of each channel
        std::uint16_t part = 4;
    };
    /// While the table is made.
    struct Entry {
        std::uint32_t at = 0;
        std::uint16_t right = 0, down = 0;  ///< of 256: how far towards the others
        Paint paint;
        bool shown = false;
    };
    static constexpr std::uint16_t kAll = 32768;
    /// Pixels of a row that are made alike.
    struct Span {
        enum Kind : std::uint8_t { kBlack, kCopied, kSampled, kColoured, kFull } kind = kBlack;
        int y = 0, begin = 0, end = 0;
    };
    /// `hasColumns`: the tile has more than one.
    template <bool hasColumns>
    void drawSpans(const std::uint8_t* from, PixelRows to) const;
    [[nodiscard]] Span::Kind kindOf(const Entry& entry) const;
    void makeColours(const Options& options);
    [[nodiscard]] std::vector<Entry> entriesOf(const Options& options) const;
    void makeSpans(const std::vector<Entry>& entries);

    int widthPx_, heightPx_;
    std::uint32_t stepRight_, stepDown_;  ///< to the neighbours; 0 where there is none
    std::vector<Span> spans_;
    std::vector<Place>
        places_;  ///< of the pixels of spans that are not black, in their order; of copied ones the first
    std::vector<Paint> paints_;  ///< of coloured and full ones
    /// The signal of a value at full light, of 65280, by part and channel.
    struct Colours {
        std::uint16_t signal[3][256];
    };
    std::vector<Colours> colours_;
    bool sameColours_ = false;  ///< a value's signal is the value, in each part
};

}  // namespace tessera
