/// PNG through libpng, which reports errors by longjmp: nothing with a destructor may live in the frames it leaves.
#include <png.h>

#include <charconv>
#include <csetjmp>
#include <cstring>

#include "common/image/PngRows.h"

namespace tessera {
namespace {

constexpr int kMaxSidePx = PictureSheet::kMaxSidePx;
constexpr std::size_t kMaxChunkBytes = std::size_t{8} << 20;
constexpr char kFrameKey[] = "frame";

}  // namespace

struct PngFailure {
    char text[128] = "";
};

namespace {

[[noreturn]] void onError(png_structp png, png_const_charp text) {
    auto* failure = static_cast<PngFailure*>(png_get_error_ptr(png));
    std::strncpy(failure->text, text, sizeof failure->text - 1);
    png_longjmp(png, 1);
}
void onWarning(png_structp, png_const_charp) {}

void give(png_structp png, png_bytep data, std::size_t bytes) {
    (*static_cast<const std::function<void(ByteSpan)>*>(png_get_io_ptr(png)))(
        {reinterpret_cast<const std::byte*>(data), bytes});
}
void nothingToFlush(png_structp) {}

void take(png_structp png, png_bytep data, std::size_t bytes) {
    auto* rest = static_cast<ByteSpan*>(png_get_io_ptr(png));
    if (bytes > rest->size()) png_error(png, "the file ends too early");
    std::memcpy(data, rest->data(), bytes);
    *rest = rest->subspan(bytes);
}

bool writeHead(png_structp png, png_infop info, int widthPx, int heightPx, int colorType, char* frameText) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_set_IHDR(png, info, static_cast<png_uint_32>(widthPx), static_cast<png_uint_32>(heightPx), 8, colorType,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_set_compression_level(png, 1);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    if (frameText) {
        png_text text{};
        char key[] = "frame";
        text.compression = PNG_TEXT_COMPRESSION_NONE;
        text.key = key;
        text.text = frameText;
        text.text_length = std::strlen(frameText);
        png_set_text(png, info, &text, 1);
    }
    png_write_info(png, info);
    return true;
}

bool writeRow(png_structp png, const std::uint8_t* row) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_write_row(png, row);
    return true;
}

bool writeEnd(png_structp png, png_infop info) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_write_end(png, info);
    return true;
}

}  // namespace

/// A file under way.
struct PngOut {
    PngOut(int widthPx, int heightPx, int colorType, std::optional<std::uint64_t> frame,
           const std::function<void(ByteSpan)>& where)
        : sink(where) {
        png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &failure, onError, onWarning);
        info = png ? png_create_info_struct(png) : nullptr;
        TESSERA_CHECK(info, "libpng starts");
        png_set_write_fn(png, &sink, give, nothingToFlush);
        // Walls are wider than libpng's own limit of a million.
        png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
        TESSERA_CHECK(widthPx > 0 && heightPx > 0, "a PNG has at least one pixel");
        std::string text = frame ? std::to_string(*frame) : std::string();
        TESSERA_CHECK(writeHead(png, info, widthPx, heightPx, colorType, frame ? text.data() : nullptr), failure.text);
    }
    ~PngOut() { png_destroy_write_struct(&png, &info); }
    PngOut(const PngOut&) = delete;
    PngOut& operator=(const PngOut&) = delete;

    PngFailure failure;
    std::function<void(ByteSpan)> sink;
    png_structp png = nullptr;
    png_infop info = nullptr;
};

namespace {

bool readHeader(png_structp png, png_infop info, png_uint_32* widthPx, png_uint_32* heightPx) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_read_info(png, info);
    *widthPx = png_get_image_width(png, info);
    *heightPx = png_get_image_height(png, info);
    // Rows of an interlaced file are complete only at its end, so that its memory would have to be taken on its word.
    if (png_get_interlace_type(png, info) != PNG_INTERLACE_NONE) png_error(png, "interlaced files are not read");
    png_set_expand(png);
    png_set_strip_16(png);
    png_set_strip_alpha(png);
    png_set_gray_to_rgb(png);
    png_read_update_info(png, info);
    if (png_get_rowbytes(png, info) != std::size_t{*widthPx} * 3) png_error(png, "its pixels cannot be made RGB");
    return true;
}

bool readRow(png_structp png, std::uint8_t* row) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_read_row(png, row, nullptr);
    return true;
}

std::optional<std::uint64_t> frameOf(png_structp png, png_infop info) {
    png_textp texts = nullptr;
    int count = 0;
    png_get_text(png, info, &texts, &count);
    for (int i = 0; i < count; ++i) {
        if (std::strcmp(texts[i].key, kFrameKey) != 0 || !texts[i].text) continue;
        const std::string_view text(texts[i].text, std::strlen(texts[i].text));
        std::uint64_t frame = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), frame);
        if (error == std::errc() && end == text.data() + text.size() && !text.empty()) return frame;
    }
    return std::nullopt;
}

}  // namespace

struct PngRowReader::Impl {
    explicit Impl(ByteSpan bytes) : rest(bytes) {
        png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &failure, onError, onWarning);
        info = png ? png_create_info_struct(png) : nullptr;
        TESSERA_CHECK(info, "libpng starts");
        png_set_user_limits(png, kMaxSidePx, kMaxSidePx);
        png_set_chunk_cache_max(png, 64);
        png_set_chunk_malloc_max(png, kMaxChunkBytes);
        // libpng 1.6 merely warns of a chunk over the limit, and then takes the memory all the same.
        png_set_benign_errors(png, 0);
        png_set_read_fn(png, &rest, take);
    }
    ~Impl() { png_destroy_read_struct(&png, &info, nullptr); }
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    [[nodiscard]] tl::unexpected<Error> fault() const {
        return fail(ErrorCode::kBadInput, std::string("not a readable PNG: ") + failure.text);
    }

    PngFailure failure;
    ByteSpan rest;
    png_structp png = nullptr;
    png_infop info = nullptr;
    png_uint_32 widthPx = 0, heightPx = 0;
};

PngRowReader::PngRowReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
PngRowReader::~PngRowReader() = default;
PngRowReader::PngRowReader(PngRowReader&&) noexcept = default;
PngRowReader& PngRowReader::operator=(PngRowReader&&) noexcept = default;
int PngRowReader::widthPx() const {
    return static_cast<int>(impl_->widthPx);
}
int PngRowReader::heightPx() const {
    return static_cast<int>(impl_->heightPx);
}

Expected<PngRowReader> PngRowReader::open(ByteSpan bytes) {
    auto impl = std::make_unique<Impl>(bytes);
    if (!readHeader(impl->png, impl->info, &impl->widthPx, &impl->heightPx)) return impl->fault();
    return PngRowReader(std::move(impl));
}

Expected<void> PngRowReader::next(std::uint8_t* rgb) {
    if (!readRow(impl_->png, rgb)) return impl_->fault();
    return {};
}

std::optional<std::uint64_t> PngRowReader::frame() const {
    return frameOf(impl_->png, impl_->info);
}

struct PngRowWriter::Impl : PngOut {
    using PngOut::PngOut;
};

PngRowWriter::PngRowWriter(int widthPx, int heightPx, std::optional<std::uint64_t> frame,
                           const std::function<void(ByteSpan)>& sink)
    : impl_(std::make_unique<Impl>(widthPx, heightPx, PNG_COLOR_TYPE_RGB, frame, sink)) {}
PngRowWriter::~PngRowWriter() = default;

void PngRowWriter::row(const std::uint8_t* rgb) {
    TESSERA_CHECK(writeRow(impl_->png, rgb), impl_->failure.text);
}

void PngRowWriter::end() {
    TESSERA_CHECK(writeEnd(impl_->png, impl_->info), impl_->failure.text);
}

Bytes encodePng(const Picture& picture, std::optional<std::uint64_t> frame) {
    Bytes out;
    out.reserve(picture.rgb.size() / 2 + 1024);
    PngRowWriter png(picture.widthPx, picture.heightPx, frame,
                     [&out](ByteSpan bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); });
    const std::size_t stride = static_cast<std::size_t>(picture.widthPx) * 3;
    for (int y = 0; y < picture.heightPx; ++y) png.row(picture.rgb.data() + static_cast<std::size_t>(y) * stride);
    png.end();
    return out;
}

Bytes encodePng(int widthPx, int heightPx, std::span<const std::uint8_t> rgba) {
    const std::size_t pixels = static_cast<std::size_t>(widthPx) * static_cast<std::size_t>(heightPx);
    TESSERA_CHECK(rgba.size() == 4 * pixels, "there are as many pixels as the sides say");
    bool opaque = true;
    for (std::size_t i = 0; opaque && i < pixels; ++i) opaque = rgba[4 * i + 3] == 255;
    Picture picture;
    if (opaque) {
        picture = {.widthPx = widthPx, .heightPx = heightPx, .rgb = std::vector<std::uint8_t>(3 * pixels)};
        dropAlpha(rgba.data(), pixels, picture.rgb.data());
        return encodePng(picture, std::nullopt);
    }
    Bytes out;
    PngOut png(widthPx, heightPx, PNG_COLOR_TYPE_RGB_ALPHA, std::nullopt,
               [&out](ByteSpan bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); });
    for (std::size_t y = 0; y < static_cast<std::size_t>(heightPx); ++y)
        TESSERA_CHECK(writeRow(png.png, rgba.data() + y * 4 * static_cast<std::size_t>(widthPx)), png.failure.text);
    TESSERA_CHECK(writeEnd(png.png, png.info), png.failure.text);
    return out;
}

Expected<DecodedPng> decodePng(ByteSpan bytes) {
    Expected<PngRowReader> png = PngRowReader::open(bytes);
    if (!png) return tl::unexpected(png.error());
    DecodedPng decoded;
    // Memory grows with the rows that are really there, not with what the header claims.
    const std::size_t stride = static_cast<std::size_t>(png->widthPx()) * 3;
    for (std::size_t y = 0; y < static_cast<std::size_t>(png->heightPx()); ++y) {
        decoded.picture.rgb.resize(stride * (y + 1));
        if (const Expected<void> row = png->next(decoded.picture.rgb.data() + stride * y); !row)
            return tl::unexpected(row.error());
    }
    decoded.frame = png->frame();
    decoded.picture.widthPx = png->widthPx();
    decoded.picture.heightPx = png->heightPx();
    return decoded;
}

}  // namespace tessera
