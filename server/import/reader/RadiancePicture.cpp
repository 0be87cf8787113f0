#include "server/import/reader/RadiancePicture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

namespace tessera {
namespace {

tl::unexpected<Error> damaged(std::string_view why) {
    return fail(ErrorCode::kBadInput, fmt::format("a Radiance picture (.hdr) {}", why));
}

/// Bytes one after the other; past the end all are zero, and `ended` is true.
class Source {
public:
    explicit Source(ByteSpan bytes) : bytes_(bytes) {}
    unsigned next() {
        if (at_ < bytes_.size()) return std::to_integer<unsigned>(bytes_[at_++]);
        ended_ = true;
        return 0;
    }
    [[nodiscard]] unsigned peek(std::size_t ahead) const {
        return at_ + ahead < bytes_.size() ? std::to_integer<unsigned>(bytes_[at_ + ahead]) : 0;
    }
    void skip(std::size_t count) { at_ += count; }
    std::string line() {
        std::string text;
        while (at_ < bytes_.size()) {
            const char c = static_cast<char>(bytes_[at_++]);
            if (c == '\n') return text;
            if (c != '\r' && text.size() < 1024) text += c;
        }
        ended_ = true;
        return text;
    }
    [[nodiscard]] bool ended() const { return ended_; }

private:
    ByteSpan bytes_;
    std::size_t at_ = 0;
    bool ended_ = false;
};

/// Each of the four bytes of all pixels after the other, in runs.
bool readNewRow(Source& source, std::byte* row, std::size_t width) {
    for (std::size_t channel = 0; channel < 4; ++channel) {
        for (std::size_t x = 0; x < width;) {
            const unsigned count = source.next();
            const bool run = count > 128;
            const std::size_t length = run ? count - 128 : count;
            if (length == 0 || length > width - x || source.ended()) return false;
            const auto same = static_cast<std::byte>(run ? source.next() : 0);
            for (std::size_t i = 0; i < length; ++i, ++x)
                row[4 * x + channel] = run ? same : static_cast<std::byte>(source.next());
        }
    }
    return !source.ended();
}

/// Pixel after pixel; 1 1 1 n repeats the one before, n times, 256 n times right after such a one, and so on.
bool readOldRow(Source& source, std::byte* row, std::size_t width) {
    unsigned shift = 0;
    for (std::size_t x = 0; x < width;) {
        std::byte pixel[4];
        for (std::byte& byte : pixel) byte = static_cast<std::byte>(source.next());
        if (source.ended()) return false;
        const bool run = pixel[0] == std::byte{1} && pixel[1] == std::byte{1} && pixel[2] == std::byte{1};
        if (!run) {
            std::copy_n(pixel, 4, row + 4 * x++);
            shift = 0;
            continue;
        }
        if (x == 0 || shift > 16) return false;
        const std::size_t length = std::to_integer<std::size_t>(pixel[3]) << shift;
        if (length > width - x) return false;
        for (std::size_t i = 0; i < length; ++i, ++x) std::copy_n(row + 4 * (x - 1), 4, row + 4 * x);
        shift += 8;
    }
    return true;
}

}  // namespace

void rgbeToLinear(const std::byte* rgbe, double* rgb) {
    const int exponent = std::to_integer<int>(rgbe[3]);
    const double factor = exponent == 0 ? 0 : std::ldexp(1.0, exponent - 136);
    for (int i = 0; i < 3; ++i) rgb[i] = factor * std::to_integer<int>(rgbe[i]);
}

void linearToRgbe(const double* rgb, std::byte* rgbe) {
    const double largest = std::max({rgb[0], rgb[1], rgb[2]});
    std::fill_n(rgbe, 4, std::byte{});
    if (!(largest > 1e-38)) return;
    int exponent = 0;
    (void)std::frexp(largest * (256.0 / 255.5), &exponent);  // so that the largest does not round up to 256
    exponent = std::min(exponent, 127);
    for (int i = 0; i < 3; ++i)
        rgbe[i] =
            static_cast<std::byte>(std::clamp(std::lround(std::ldexp(std::max(rgb[i], 0.0), 8 - exponent)), 0L, 255L));
    rgbe[3] = static_cast<std::byte>(exponent + 128);
}

bool isRadiancePicture(ByteSpan bytes) {
    return bytes.size() > 2 && bytes[0] == std::byte{'#'} && bytes[1] == std::byte{'?'};
}

Expected<DecodedImage> decodeRadiance(ByteSpan bytes, const PictureBounds& bounds) {
    if (!isRadiancePicture(bytes)) return damaged("begins with '#?'; this one does not");
    Source source(bytes);
    (void)source.line();
    double exposure = 1;
    for (std::string line = source.line(); !line.empty(); line = source.line()) {
        if (source.ended()) return damaged("ends within its header");
        if (line.starts_with("FORMAT=") && line != "FORMAT=32-bit_rle_rgbe")
            return damaged(fmt::format("of the {} (32-bit_rle_rgbe can be read)", line.substr(0, 60)));
        if (line.starts_with("EXPOSURE=")) exposure *= std::strtod(line.c_str() + 9, nullptr);
    }
    if (!(exposure > 1e-30 && exposure < 1e30)) return damaged("with an exposure that is no number above zero");
    const std::string size = source.line();
    // Digits alone: a number of scanf's may have a sign.
    char heightText[6] = {}, widthText[6] = {};
    int used = 0;
    if (std::sscanf(size.c_str(), "-Y %5[0-9] +X %5[0-9]%n", heightText, widthText, &used) != 2 ||
        static_cast<std::size_t>(used) != size.size())
        return damaged(fmt::format("whose size is '{}': '-Y HEIGHT +X WIDTH' can be read", size.substr(0, 60)));
    const std::size_t width = std::strtoul(widthText, nullptr, 10), height = std::strtoul(heightText, nullptr, 10);
    if (Expected<void> allowed = bounds.allow("a Radiance picture", width, height); !allowed)
        return tl::unexpected(allowed.error());
    // No row of runs is shorter than this: nothing is promised memory for bytes that are not there.
    if (bytes.size() < height * 8 && bytes.size() < height * width * 4) return damaged("that is cut off");
    DecodedImage image{.widthPx = static_cast<int>(width),
                       .heightPx = static_cast<int>(height),
                       .rgba = Bytes(width * height * 4),
                       .encoding = proto::scene::Image::RGBE};
    for (std::size_t y = 0; y < height; ++y) {
        std::byte* row = image.rgba.data() + 4 * width * y;
        const bool isNew = width >= 8 && width < 32768 && source.peek(0) == 2 && source.peek(1) == 2 &&
                           (source.peek(2) << 8 | source.peek(3)) == width;
        if (isNew) source.skip(4);
        if (!(isNew ? readNewRow(source, row, width) : readOldRow(source, row, width)))
            return damaged(fmt::format("that is damaged or cut off in row {} of {}", y, height));
    }
    if (exposure != 1) {
        for (std::size_t i = 0; i < width * height; ++i) {
            double rgb[3];
            rgbeToLinear(&image.rgba[4 * i], rgb);
            for (double& value : rgb) value /= exposure;
            linearToRgbe(rgb, &image.rgba[4 * i]);
        }
    }
    return image;
}

}  // namespace tessera
