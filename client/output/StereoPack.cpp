#include "client/output/StereoPack.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "client/output/OutputTable.h"
#include "common/math/Srgb.h"

namespace tessera {
namespace {

std::size_t bytesOfRow(int widthPx) {
    return 4 * static_cast<std::size_t>(widthPx);
}

/// The value whose light is the mean of two values' lights.
class MeanLight {
public:
    MeanLight() {
        for (std::size_t a = 0; a < 256; ++a) {
            for (std::size_t b = 0; b < 256; ++b) {
                const auto light = [](std::size_t v) { return std::pow(static_cast<double>(v) / 255, kPictureGamma); };
                values_[a][b] = static_cast<std::uint8_t>(
                    std::lround(255 * std::pow(0.5 * (light(a) + light(b)), 1 / kPictureGamma)));
            }
        }
    }
    void mix(const std::uint8_t* a, const std::uint8_t* b, std::uint8_t* out) const {
        for (std::size_t c = 0; c < 3; ++c) out[c] = values_[a[c]][b[c]];
        out[3] = 255;
    }
    static const MeanLight& table() {
        static const MeanLight made;
        return made;
    }

private:
    std::array<std::array<std::uint8_t, 256>, 256> values_{};
};

/// What each value of each channel adds to the three channels of an anaglyph, as three numbers in one: a sum of six of
/// these is all a pixel takes.
class DuboisMix {
public:
    static const DuboisMix& table() {
        static const DuboisMix made;
        return made;
    }
    void mix(const std::uint8_t* left, const std::uint8_t* right, std::uint8_t* out) const {
        std::uint64_t sum = 0;
        for (std::size_t c = 0; c < 3; ++c) sum += parts_[c][left[c]] + parts_[3 + c][right[c]];
        for (std::size_t c = 0; c < 3; ++c) {
            const auto light =
                (static_cast<std::int64_t>(sum >> (kLane * c) & ((1u << kLane) - 1)) - 6 * kBias + 2) >> 2;
            out[c] = values_[static_cast<std::size_t>(std::clamp<std::int64_t>(light, 0, kWhite))];
        }
        out[3] = 255;
    }

private:
    static constexpr unsigned kLane = 21;
    static constexpr std::int64_t kWhite = 65535;
    static constexpr std::int64_t kBias = 65536;  ///< parts count in quarters; none is below -0.25

    DuboisMix() {
        // Rows: red, green, blue of what is shown. Columns: red, green, blue of the left eye, of the right eye.
        constexpr double kMatrix[3][6] = {{0.437, 0.449, 0.164, -0.011, -0.032, -0.007},
                                          {-0.062, -0.062, -0.024, 0.377, 0.761, 0.009},
                                          {-0.048, -0.050, -0.017, -0.026, -0.093, 1.234}};
        for (std::size_t from = 0; from < 6; ++from) {
            for (std::size_t value = 0; value < 256; ++value) {
                const double light = linearOfSrgb(static_cast<double>(value) / 255);
                std::uint64_t packed = 0;
                for (std::size_t to = 0; to < 3; ++to)
                    packed |= static_cast<std::uint64_t>(std::llround(kMatrix[to][from] * light * 4 * kWhite) + kBias)
                              << (kLane * to);
                parts_[from][value] = packed;
            }
        }
        for (std::size_t i = 0; i < values_.size(); ++i) {
            values_[i] = static_cast<std::uint8_t>(std::lround(255 * srgbOfLinear(static_cast<double>(i) / kWhite)));
        }
    }
    std::array<std::array<std::uint64_t, 256>, 6> parts_{};
    std::array<std::uint8_t, kWhite + 1> values_{};
};

void copyRow(const std::uint8_t* from, std::uint8_t* to, int widthPx) {
    std::memcpy(to, from, bytesOfRow(widthPx));
}

}  // namespace

PackedSize packedSize(StereoPacking packing, int widthPx, int heightPx) {
    const bool wide = packing == StereoPacking::kSideBySideFull || packing == StereoPacking::kQuadBuffered;
    return {wide ? 2 * widthPx : widthPx, packing == StereoPacking::kTopBottomFull ? 2 * heightPx : heightPx};
}

bool mixesColours(StereoPacking packing) {
    return packing == StereoPacking::kAnaglyph || packing == StereoPacking::kAnaglyphPlain;
}

void packEyes(StereoPacking packing, const EyePictures& eyes, PixelRows to) {
    const int width = eyes.widthPx, height = eyes.heightPx;
    const std::size_t pitch = bytesOfRow(width);
    const auto rowOf = [&](const std::uint8_t* eye, int y) { return eye + static_cast<std::size_t>(y) * pitch; };
    const auto out = [&](int y) { return to.rgbx + static_cast<std::size_t>(y) * to.pitchBytes; };
    const MeanLight& mean = MeanLight::table();
    const DuboisMix& dubois = DuboisMix::table();
    for (int y = 0; y < height; ++y) {
        const std::uint8_t* const left = rowOf(eyes.left, y);
        const std::uint8_t* const right = rowOf(eyes.right, y);
        switch (packing) {
            case StereoPacking::kNone:
                TESSERA_CHECK(false, "two eyes are packed in some way");
                break;
            case StereoPacking::kSideBySide:
                for (std::size_t x = 0; x < static_cast<std::size_t>(width / 2); ++x) {
                    mean.mix(left + 8 * x, left + 8 * x + 4, out(y) + 4 * x);
                    mean.mix(right + 8 * x, right + 8 * x + 4, out(y) + bytesOfRow(width / 2) + 4 * x);
                }
                break;
            case StereoPacking::kSideBySideFull:
            case StereoPacking::kQuadBuffered:
                copyRow(left, out(y), width);
                copyRow(right, out(y) + pitch, width);
                break;
            case StereoPacking::kTopBottom: {
                if (y % 2 != 0) break;
                const std::uint8_t* const leftNext = rowOf(eyes.left, y + 1);
                const std::uint8_t* const rightNext = rowOf(eyes.right, y + 1);
                for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x) {
                    mean.mix(left + 4 * x, leftNext + 4 * x, out(y / 2) + 4 * x);
                    mean.mix(right + 4 * x, rightNext + 4 * x, out((height + y) / 2) + 4 * x);
                }
                break;
            }
            case StereoPacking::kTopBottomFull:
                copyRow(left, out(y), width);
                copyRow(right, out(height + y), width);
                break;
            case StereoPacking::kAnaglyph:
                for (std::size_t x = 0; x < pitch; x += 4) dubois.mix(left + x, right + x, out(y) + x);
                break;
            case StereoPacking::kAnaglyphPlain:
                for (std::size_t x = 0; x < pitch; x += 4) {
                    std::memcpy(out(y) + x, right + x, 4);
                    out(y)[x] = left[x];
                }
                break;
            case StereoPacking::kRows:
                copyRow(y % 2 == 0 ? left : right, out(y), width);
                break;
            case StereoPacking::kColumns:
            case StereoPacking::kCheckerboard: {
                const std::size_t odd = packing == StereoPacking::kCheckerboard ? static_cast<std::size_t>(y % 2) : 0;
                for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x)
                    std::memcpy(out(y) + 4 * x, ((x + odd) % 2 == 0 ? left : right) + 4 * x, 4);
                break;
            }
        }
    }
}

}  // namespace tessera
