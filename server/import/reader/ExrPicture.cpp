// The C++ interface, not OpenEXRCore's: that of 3.1 does not read DWAA and DWAB. Both come in the same package.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfRgbaFile.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "server/import/reader/ExrHeader.h"
#include "server/import/reader/PictureFormats.h"
#include "server/import/reader/RadiancePicture.h"

namespace tessera {
namespace {

/// Lines are decoded where they are asked for: readers have one thread, and the child may not begin others.
constexpr int kNoThreads = 0;
/// DWAB keeps a number for 64 pixels, and deflate makes a byte of 1032: nothing says more pixels with a byte.
constexpr std::uint64_t kMostExrPixelsPerByte = std::uint64_t{1} << 16;
/// Of what the library takes to unpack lines or tiles.
constexpr std::uint64_t kMostExrUnpacked = std::uint64_t{1} << 29;

tl::unexpected<Error> badExr(std::string_view why) {
    return fail(ErrorCode::kBadInput, fmt::format("an OpenEXR picture {}", why));
}

/// A file in memory, as the library reads it. Whoever reads beyond its end is told by an exception.
class ExrBytes : public Imf::IStream {
public:
    explicit ExrBytes(ByteSpan bytes) : IStream("picture"), bytes_(bytes) {}
    bool read(char* to, int count) override {
        const auto wanted = static_cast<std::size_t>(std::max(count, 0));
        if (at_ > bytes_.size() || wanted > bytes_.size() - at_) throw std::runtime_error("it is cut off");
        std::memcpy(to, bytes_.data() + at_, wanted);
        at_ += wanted;
        return at_ < bytes_.size();
    }
    std::uint64_t tellg() override { return at_; }
    void seekg(std::uint64_t at) override { at_ = at; }

private:
    ByteSpan bytes_;
    std::uint64_t at_ = 0;
};

/// The channels of a part that are its colours: those without a layer, or those of its first one that has some.
struct Colours {
    std::string layer;  ///< with its dot; empty: none
    enum class Kind { kRgb, kGrey, kLuminanceChroma } kind = Kind::kRgb;
};

std::optional<Colours> coloursOf(const Imf::ChannelList& channels) {
    std::vector<std::string> layers = {""};
    for (auto channel = channels.begin(); channel != channels.end(); ++channel) {
        const std::string_view name = channel.name();
        const std::size_t dot = name.rfind('.');
        if (dot != std::string_view::npos) layers.emplace_back(name.substr(0, dot + 1));
    }
    // Renderers put many beside what is to be seen. The last part of its name is this one's.
    std::stable_partition(layers.begin(), layers.end(), [](const std::string& layer) {
        return layer.empty() || layer == "Combined." || layer.ends_with(".Combined.");
    });
    for (const std::string& layer : layers) {
        const auto has = [&](const char* name) { return channels.findChannel(layer + name) != nullptr; };
        if (has("R") || has("G") || has("B")) return Colours{layer, Colours::Kind::kRgb};
        if (has("Y"))
            return Colours{layer, has("RY") && has("BY") ? Colours::Kind::kLuminanceChroma : Colours::Kind::kGrey};
    }
    return std::nullopt;
}

/// A part's two windows: what is stored, and what is to be seen. Their corners are pixels of them.
struct Windows {
    Imath::Box2i stored, shown;
    [[nodiscard]] static std::uint64_t width(const Imath::Box2i& box) {
        return static_cast<std::uint64_t>(std::int64_t{box.max.x} - box.min.x + 1);
    }
    [[nodiscard]] static std::uint64_t height(const Imath::Box2i& box) {
        return static_cast<std::uint64_t>(std::int64_t{box.max.y} - box.min.y + 1);
    }
};

unsigned linesAtOnce(Imf::Compression compression) {
    switch (compression) {
        case Imf::NO_COMPRESSION:
        case Imf::RLE_COMPRESSION:
        case Imf::ZIPS_COMPRESSION:
            return 1;
        case Imf::ZIP_COMPRESSION:
        case Imf::PXR24_COMPRESSION:
            return 16;
        case Imf::DWAB_COMPRESSION:
            return 256;
        default:
            return 32;
    }
}

/// Before any memory is taken for pixels.
Expected<void> checkSizes(const Imf::Header& header, std::size_t fileBytes, const PictureBounds& bounds) {
    for (const Imath::Box2i& box : {header.dataWindow(), header.displayWindow()}) {
        const std::uint64_t width = Windows::width(box), height = Windows::height(box);
        if (Expected<void> allowed = bounds.allow("an OpenEXR picture", width, height); !allowed) return allowed;
        if (width * height > kMostExrPixelsPerByte * fileBytes)
            return badExr(fmt::format("of {} × {} pixels in {} bytes", width, height, fileBytes));
    }
    std::uint64_t pixelBytes = 0;
    for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel)
        pixelBytes += channel.channel().type == Imf::HALF ? 2 : 4;
    std::uint64_t unpacked = Windows::width(header.dataWindow()) * pixelBytes * linesAtOnce(header.compression());
    if (header.hasTileDescription()) {
        const Imf::TileDescription& tiles = header.tileDescription();
        // All tiles of a row are kept, for the lines within them.
        const std::uint64_t width = std::max<std::uint64_t>(tiles.xSize, Windows::width(header.dataWindow()));
        if (std::max(tiles.xSize, tiles.ySize) > kMaxPictureSide) return badExr("whose tiles are too large");
        unpacked = width * tiles.ySize * pixelBytes;
    }
    if (unpacked > kMostExrUnpacked) return badExr("whose lines or tiles are too large");
    return {};
}

void toRgbe(double red, double green, double blue, std::byte* rgbe) {
    double rgb[3] = {red, green, blue};
    for (double& value : rgb) value = value > 0 ? std::min(value, 1e30) : 0;  // not of what is no number
    linearToRgbe(rgb, rgbe);
}

/// What is stored of a picture row by row, by `readRow(y)` and `at(x)`, where it is to be seen. Black where nothing is
/// stored.
template <typename ReadRow, typename PutPixel>
DecodedImage shownOf(const Windows& windows, const ReadRow& readRow, const PutPixel& put) {
    const auto width = static_cast<std::size_t>(Windows::width(windows.shown)),
               height = static_cast<std::size_t>(Windows::height(windows.shown));
    DecodedImage image{.widthPx = static_cast<int>(width),
                       .heightPx = static_cast<int>(height),
                       .rgba = Bytes(4 * width * height),
                       .encoding = proto::scene::Image::RGBE};
    const Imath::Box2i &shown = windows.shown, &stored = windows.stored;
    const int fromX = std::max(shown.min.x, stored.min.x), toX = std::min(shown.max.x, stored.max.x);
    for (int y = std::max(shown.min.y, stored.min.y); y <= std::min(shown.max.y, stored.max.y); ++y) {
        readRow(y);
        std::byte* row = image.rgba.data() + 4 * width * static_cast<std::size_t>(y - shown.min.y);
        for (int x = fromX; x <= toX; ++x)
            put(static_cast<std::size_t>(x - stored.min.x), row + 4 * static_cast<std::size_t>(x - shown.min.x));
    }
    return image;
}

DecodedImage decodeRgb(Imf::MultiPartInputFile& file, int number, const Colours& colours, const Windows& windows) {
    Imf::InputPart part(file, number);
    const auto width = static_cast<std::size_t>(Windows::width(windows.stored));
    const bool grey = colours.kind == Colours::Kind::kGrey;
    // Rows come one after the other into the same place.
    std::vector<float> row(width * 3);
    Imf::FrameBuffer buffer;
    for (std::size_t c = 0; c < (grey ? 1u : 3u); ++c) {
        const char* name = grey ? "Y" : c == 0 ? "R" : c == 1 ? "G" : "B";
        char* first = reinterpret_cast<char*>(row.data() + c * width);
        // The library adds x times 4: it wants to know where column 0 would be.
        buffer.insert(colours.layer + name,
                      Imf::Slice(Imf::FLOAT, first - std::ptrdiff_t{4} * windows.stored.min.x, sizeof(float), 0));
    }
    part.setFrameBuffer(buffer);
    return shownOf(
        windows, [&](int y) { part.readPixels(y); },
        [&](std::size_t x, std::byte* rgbe) {
            const float* at = row.data() + x;
            toRgbe(at[0], at[grey ? 0 : width], at[grey ? 0 : 2 * width], rgbe);
        });
}

/// Colours of half the size beside light of the whole, which the library makes to pixels.
DecodedImage decodeLuminanceChroma(ByteSpan bytes, const Colours& colours, const Windows& windows) {
    ExrBytes stream(bytes);
    const std::string layer = colours.layer.substr(0, colours.layer.empty() ? 0 : colours.layer.size() - 1);
    Imf::RgbaInputFile file(stream, layer, kNoThreads);
    std::vector<Imf::Rgba> row(static_cast<std::size_t>(Windows::width(windows.stored)));
    file.setFrameBuffer(row.data() - windows.stored.min.x, 1, 0);
    return shownOf(
        windows, [&](int y) { file.readPixels(y); },
        [&](std::size_t x, std::byte* rgbe) { toRgbe(row[x].r, row[x].g, row[x].b, rgbe); });
}

Expected<DecodedImage> decodeParts(ByteSpan bytes, const PictureBounds& bounds) {
    ExrBytes stream(bytes);
    // What a file without its table of lines has is not looked for.
    Imf::MultiPartInputFile file(stream, kNoThreads, false);
    bool deep = false;
    std::string names;
    for (int number = 0; number < file.parts(); ++number) {
        const Imf::Header& header = file.header(number);
        if (header.hasType() && Imf::isDeepData(header.type())) {
            deep = true;
            continue;
        }
        const std::optional<Colours> colours = coloursOf(header.channels());
        // The library makes colours of these in the first part alone.
        if (!colours || (colours->kind == Colours::Kind::kLuminanceChroma && number > 0)) {
            for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel)
                if (names.size() < 80) names += fmt::format("{}{}", names.empty() ? "" : ", ", channel.name());
            continue;
        }
        if (Expected<void> sound = checkSizes(header, bytes.size(), bounds); !sound)
            return tl::unexpected(sound.error());
        const Windows windows{header.dataWindow(), header.displayWindow()};
        if (colours->kind == Colours::Kind::kLuminanceChroma) return decodeLuminanceChroma(bytes, *colours, windows);
        return decodeRgb(file, number, *colours, windows);
    }
    if (deep && names.empty())
        return badExr("of deep pixels, which is not read: save it flat, as programs that composite pictures do");
    return badExr(fmt::format("without colours (R, G, B or Y): it has {}", names.empty() ? "none" : names));
}

}  // namespace

bool isExr(ByteSpan bytes) {
    return bytes.size() >= 4 && std::memcmp(bytes.data(), "\x76\x2f\x31\x01", 4) == 0;
}

Expected<DecodedImage> decodeExr(ByteSpan bytes, const PictureBounds& bounds) {
    if (!hasSoundExrHeaders(bytes)) return badExr("whose header is cut off or damaged");
    // The library has this for all files: they are the same for all here.
    Imf::Header::setMaxImageSize(kMaxPictureSide, kMaxPictureSide);
    Imf::Header::setMaxTileSize(kMaxPictureSide, kMaxPictureSide);
    try {
        return decodeParts(bytes, bounds);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kLimit, "an OpenEXR picture that needs more memory than there is");
    } catch (const std::exception& exception) {
        return badExr(fmt::format("that is damaged: {}", exception.what()));
    }
}

}  // namespace tessera
