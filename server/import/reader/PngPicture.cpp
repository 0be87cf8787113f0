// PNG by libpng, row by row: what is larger than wanted is halved while it is read, and of data that go on behind the
// last row (a bomb may) nothing is unpacked.
#include <fmt/format.h>
#include <png.h>

#include <cstring>

#include "server/import/reader/HalvedRows.h"
#include "server/import/reader/PictureFormats.h"

namespace tessera {
namespace {

tl::unexpected<Error> badPng(std::string_view why) {
    return fail(ErrorCode::kBadInput, fmt::format("a PNG picture {}", why));
}

[[noreturn]] void onPngError(png_structp png, png_const_charp) {
    png_longjmp(png, 1);
}
void onPngWarning(png_structp, png_const_charp) {}

/// What libpng has not asked for yet.
struct PngRest {
    ByteSpan bytes;
    std::size_t most = ~std::size_t{};  ///< that it still gets
    bool isPastMost = false;
};
void givePng(png_structp png, png_bytep to, std::size_t count) {
    auto* rest = static_cast<PngRest*>(png_get_io_ptr(png));
    rest->isPastMost = count > rest->most;
    if (rest->isPastMost || count > rest->bytes.size()) png_error(png, "");
    std::memcpy(to, rest->bytes.data(), count);
    rest->bytes = rest->bytes.subspan(count);
    rest->most -= count;
}

class PngIn {
public:
    explicit PngIn(ByteSpan bytes) : rest_{bytes} {
        png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, onPngError, onPngWarning);
        info_ = png_ != nullptr ? png_create_info_struct(png_) : nullptr;
    }
    PngIn(const PngIn&) = delete;
    PngIn& operator=(const PngIn&) = delete;
    ~PngIn() { png_destroy_read_struct(&png_, &info_, nullptr); }

    // Errors come by longjmp: nothing in these has a destructor.

    /// The size, before anything is unpacked.
    [[nodiscard]] bool readHead() {
        if (info_ == nullptr || setjmp(png_jmpbuf(png_))) return false;
        png_set_read_fn(png_, &rest_, givePng);
        // Who has pixels has them, whatever sums say of them; and of no text or profile more is unpacked than them.
        png_set_crc_action(png_, PNG_CRC_QUIET_USE, PNG_CRC_QUIET_USE);
        png_set_option(png_, PNG_IGNORE_ADLER32, PNG_OPTION_ON);
        png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
        png_set_benign_errors(png_, 1);
        png_set_user_limits(png_, 0x7fffffff, 0x7fffffff);
        png_read_info(png_, info_);
        return true;
    }
    /// Rows become four bytes a pixel.
    [[nodiscard]] bool start() {
        if (setjmp(png_jmpbuf(png_))) return false;
        png_set_expand(png_);
        png_set_strip_16(png_);
        png_set_gray_to_rgb(png_);
        png_set_add_alpha(png_, 0xff, PNG_FILLER_AFTER);
        passes_ = png_set_interlace_handling(png_);
        png_read_update_info(png_, info_);
        return png_get_rowbytes(png_, info_) == std::size_t{4} * width();
    }
    [[nodiscard]] bool readRow(std::byte* to) {
        if (setjmp(png_jmpbuf(png_))) return false;
        png_read_row(png_, reinterpret_cast<png_bytep>(to), nullptr);
        return true;
    }
    /// With the last row libpng unpacks all that is behind it, too: a row needs no more bytes than these, and is there
    /// when it has had them.
    [[nodiscard]] bool readLastRow(std::byte* to) {
        constexpr std::size_t kBeyond = std::size_t{1} << 16;
        rest_.most = kBeyond + std::size_t{16} * width();
        return readRow(to) || rest_.isPastMost;
    }
    [[nodiscard]] std::uint32_t width() const { return png_get_image_width(png_, info_); }
    [[nodiscard]] std::uint32_t height() const { return png_get_image_height(png_, info_); }
    [[nodiscard]] bool isWide() const { return png_get_bit_depth(png_, info_) == 16; }
    [[nodiscard]] int passes() const { return passes_; }

private:
    PngRest rest_;
    png_structp png_ = nullptr;
    png_infop info_ = nullptr;
    int passes_ = 1;
};

}  // namespace

bool isPng(ByteSpan bytes) {
    return bytes.size() >= 8 && asText(bytes.first(8)) == std::string_view("\x89PNG\r\n\x1a\n", 8);
}

Expected<DecodedImage> decodePng(ByteSpan bytes, const PictureBounds& bounds) {
    PngIn png(bytes);
    if (!png.readHead()) return badPng("whose header is cut off or damaged");
    const std::size_t width = png.width(), height = png.height();
    if (Expected<void> allowed = bounds.allow("a PNG picture", width, height, png.isWide() ? 3 : 1); !allowed)
        return tl::unexpected(allowed.error());
    // Eight pixels a byte, of which deflate packs 1032 into one.
    constexpr std::size_t kMostPixelsPerByte = 8256, kFew = std::size_t{1} << 16;
    if (width * height > kFew + bytes.size() * kMostPixelsPerByte)
        return badPng(fmt::format("of {} × {} pixels in {} bytes", width, height, bytes.size()));
    // Of what is interlaced all rows are needed until the last is there.
    if (!png.start()) return badPng("that is damaged");
    const bool isWhole = png.passes() > 1;
    const int halvings = isWhole ? 0 : halvingsOf(width, height, bounds.maxSidePx);
    DecodedImage image{.widthPx = static_cast<int>(halvedSide(width, halvings)),
                       .heightPx = static_cast<int>(halvedSide(height, halvings))};
    image.rgba.resize(4 * static_cast<std::size_t>(image.widthPx) * static_cast<std::size_t>(image.heightPx));
    image.halved = halvings > 0;
    HalvedRows halved(width, height, halvings, false, image.rgba.data());
    Bytes row(4 * width);
    for (int pass = 0; pass < png.passes(); ++pass)
        for (std::size_t y = 0; y < height; ++y) {
            std::byte* const to = isWhole ? image.rgba.data() + 4 * width * y : row.data();
            const bool isLast = pass + 1 == png.passes() && y + 1 == height;
            if (!(isLast ? png.readLastRow(to) : png.readRow(to)))
                return badPng(fmt::format("that is cut off or damaged in row {} of {}", y, height));
            if (!isWhole) halved.add(row.data());
        }
    return image;
}

}  // namespace tessera
