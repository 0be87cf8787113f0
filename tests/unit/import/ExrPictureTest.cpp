// OpenEXR's pictures, as OpenEXR writes them: all that its files may be made of, and what is to come of damaged ones.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineOutputFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfRgbaFile.h>
#include <OpenEXR/ImfTiledOutputPart.h>
#include <OpenEXR/ImfTiledRgbaFile.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "common/cores/Image.h"
#include "server/import/reader/RadiancePicture.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Picture.h"
#include "tests/unit/import/PictureBytes.h"

namespace tessera {
namespace {

constexpr int kWide = 44, kHigh = 22;

/// A file in memory, as the library writes it.
class WrittenBytes : public Imf::OStream {
public:
    WrittenBytes() : OStream("picture") {}
    void write(const char* from, int count) override {
        const std::size_t end = at_ + static_cast<std::size_t>(count);
        bytes.resize(std::max(bytes.size(), end));
        std::copy_n(from, count, bytes.begin() + static_cast<std::ptrdiff_t>(at_));
        at_ = end;
    }
    std::uint64_t tellp() override { return at_; }
    void seekp(std::uint64_t at) override { at_ = at; }

    std::string bytes;

private:
    std::size_t at_ = 0;
};

/// Light from dark to far above white, in steps that RGBE has.
Imf::Rgba pixelAt(int x, int y) {
    return {static_cast<float>(x) / 8, static_cast<float>(y) / 2, 4, 1};
}
std::vector<Imf::Rgba> pixels() {
    std::vector<Imf::Rgba> all;
    for (int y = 0; y < kHigh; ++y)
        for (int x = 0; x < kWide; ++x) all.push_back(pixelAt(x, y));
    return all;
}

std::string lines(Imf::RgbaChannels channels, Imf::Compression compression, Imf::LineOrder order = Imf::INCREASING_Y) {
    const std::vector<Imf::Rgba> all = pixels();
    WrittenBytes stream;
    {
        Imf::Header header(kWide, kHigh, 1, Imath::V2f(0, 0), 1, order, compression);
        Imf::RgbaOutputFile file(stream, header, channels);
        file.setFrameBuffer(all.data(), 1, kWide);
        file.writePixels(kHigh);
    }
    return stream.bytes;
}
std::string tiles(Imf::LevelMode mode, Imf::Compression compression) {
    const std::vector<Imf::Rgba> all = pixels();
    WrittenBytes stream;
    {
        Imf::Header header(kWide, kHigh, 1, Imath::V2f(0, 0), 1, Imf::RANDOM_Y, compression);
        Imf::TiledRgbaOutputFile file(stream, header, Imf::WRITE_RGB, 16, 8, mode, Imf::ROUND_DOWN);
        file.setFrameBuffer(all.data(), 1, kWide);
        for (int y = 0; y < file.numYLevels(); ++y)
            for (int x = 0; x < file.numXLevels(); ++x)
                if (mode == Imf::RIPMAP_LEVELS || x == y)
                    file.writeTiles(0, file.numXTiles(x) - 1, 0, file.numYTiles(y) - 1, x, y);
    }
    return stream.bytes;
}

/// One value for all pixels of each channel.
using ChannelValues = std::map<std::string, float>;
void addChannels(Imf::Header& header, const ChannelValues& values, Imf::PixelType type) {
    for (const auto& [name, value] : values) header.channels().insert(name, Imf::Channel(type));
}
std::string channelFile(const ChannelValues& values, Imf::PixelType type = Imf::FLOAT) {
    WrittenBytes stream;
    {
        Imf::Header header(kWide, kHigh);
        addChannels(header, values, type);
        Imf::OutputFile file(stream, header);
        Imf::FrameBuffer buffer;
        std::vector<std::vector<float>> planes;
        std::vector<std::vector<unsigned>> numbers;
        for (const auto& [name, value] : values) {
            planes.emplace_back(kWide * kHigh, value);
            numbers.emplace_back(kWide * kHigh, static_cast<unsigned>(value));
            char* first = type == Imf::UINT ? reinterpret_cast<char*>(numbers.back().data())
                                            : reinterpret_cast<char*>(planes.back().data());
            buffer.insert(name, Imf::Slice(type, first, 4, std::size_t{4} * kWide));
        }
        file.setFrameBuffer(buffer);
        file.writePixels(kHigh);
    }
    return stream.bytes;
}

/// Depth alone, in lines; then colours, in tiles.
std::string parts() {
    WrittenBytes stream;
    {
        std::vector<Imf::Header> headers(2, Imf::Header(kWide, kHigh));
        headers[0].setName("depth");
        headers[0].setType(Imf::SCANLINEIMAGE);
        headers[0].channels().insert("Z", Imf::Channel(Imf::FLOAT));
        headers[1].setName("colours");
        headers[1].setType(Imf::TILEDIMAGE);
        headers[1].setTileDescription(Imf::TileDescription(16, 4));
        for (const char* name : {"R", "G", "B"}) headers[1].channels().insert(name, Imf::Channel(Imf::HALF));
        Imf::MultiPartOutputFile file(stream, headers.data(), 2);
        std::vector<float> depths(kWide * kHigh, 3);
        Imf::FrameBuffer first;
        first.insert("Z", Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(depths.data()), 4, std::size_t{4} * kWide));
        Imf::OutputPart depth(file, 0);
        depth.setFrameBuffer(first);
        depth.writePixels(kHigh);
        std::vector<Imf::Rgba> all = pixels();
        Imf::FrameBuffer second;
        for (const auto& [name, from] :
             {std::pair("R", &all[0].r), std::pair("G", &all[0].g), std::pair("B", &all[0].b)})
            second.insert(name, Imf::Slice(Imf::HALF, reinterpret_cast<char*>(from), 8, std::size_t{8} * kWide));
        Imf::TiledOutputPart colours(file, 1);
        colours.setFrameBuffer(second);
        colours.writeTiles(0, colours.numXTiles() - 1, 0, colours.numYTiles() - 1);
    }
    return stream.bytes;
}

std::string deep() {
    WrittenBytes stream;
    {
        Imf::Header header(2, 2);
        header.setType(Imf::DEEPSCANLINE);
        header.compression() = Imf::ZIPS_COMPRESSION;
        header.channels().insert("R", Imf::Channel(Imf::FLOAT));
        std::vector<unsigned> counts(4, 1);
        std::vector<float> values(4, 1);
        std::vector<float*> samples;
        for (float& value : values) samples.push_back(&value);
        Imf::DeepScanLineOutputFile file(stream, header);
        Imf::DeepFrameBuffer buffer;
        buffer.insertSampleCountSlice(Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()), 4, 8));
        buffer.insert("R", Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(samples.data()), sizeof(float*),
                                          2 * sizeof(float*), sizeof(float)));
        file.setFrameBuffer(buffer);
        file.writePixels(2);
    }
    return stream.bytes;
}

/// What is stored of `shown` begins at a pixel within it, and ends beyond it.
std::string windowed(const Imath::Box2i& shown, const Imath::Box2i& stored) {
    WrittenBytes stream;
    {
        const std::vector<Imf::Rgba> all = pixels();
        Imf::RgbaOutputFile file(stream, Imf::Header(shown, stored), Imf::WRITE_RGB);
        file.setFrameBuffer(all.data() - stored.min.x - stored.min.y * kWide, 1, kWide);
        file.writePixels(kHigh);
    }
    return stream.bytes;
}

DecodedImage exrIn(const std::string& file) {
    const Expected<DecodedImage> image = pictureIn(file);
    EXPECT_TRUE(image) << (image ? "" : image.error().message);
    return image ? *image : DecodedImage();
}
std::string whyNoExr(const std::string& file) {
    const Expected<DecodedImage> image = pictureIn(file);
    return image ? std::string("decoded") : image.error().message;
}
std::array<double, 3> lightAt(const DecodedImage& image, int x, int y) {
    std::array<double, 3> rgb{};
    rgbeToLinear(&image.rgba[static_cast<std::size_t>(4 * (y * image.widthPx + x))], rgb.data());
    return rgb;
}
/// By how much its worst pixel differs from what was written, of that one's brightest channel.
double worst(const DecodedImage& image) {
    if (image.widthPx != kWide || image.heightPx != kHigh) return HUGE_VAL;
    double most = 0;
    for (int y = 0; y < kHigh; ++y)
        for (int x = 0; x < kWide; ++x) {
            const std::array<double, 3> light = lightAt(image, x, y);
            const Imf::Rgba written = pixelAt(x, y);
            const double rgb[3] = {written.r, written.g, written.b}, largest = *std::max_element(rgb, rgb + 3);
            for (std::size_t c = 0; c < 3; ++c) most = std::max(most, std::abs(light[c] - rgb[c]) / largest);
        }
    return most;
}

constexpr Imf::Compression kAll[] = {
    Imf::NO_COMPRESSION,    Imf::RLE_COMPRESSION, Imf::ZIPS_COMPRESSION, Imf::ZIP_COMPRESSION,  Imf::PIZ_COMPRESSION,
    Imf::PXR24_COMPRESSION, Imf::B44_COMPRESSION, Imf::B44A_COMPRESSION, Imf::DWAA_COMPRESSION, Imf::DWAB_COMPRESSION};
/// Those that lose nothing are as near as RGBE is.
double allowed(Imf::Compression compression) {
    return compression >= Imf::B44_COMPRESSION ? 0.06 : 1.0 / 250;
}

TEST(Exr, OfAllCompressionsIsAsStrongAsItIs) {
    for (const Imf::Compression compression : kAll) {
        EXPECT_LE(worst(exrIn(lines(Imf::WRITE_RGBA, compression))), allowed(compression)) << compression;
        EXPECT_LE(worst(exrIn(lines(Imf::WRITE_RGB, compression, Imf::DECREASING_Y))), allowed(compression))
            << compression;
        for (const Imf::LevelMode mode : {Imf::ONE_LEVEL, Imf::MIPMAP_LEVELS, Imf::RIPMAP_LEVELS})
            EXPECT_LE(worst(exrIn(tiles(mode, compression))), allowed(compression)) << compression << ' ' << mode;
    }
    EXPECT_EQ(exrIn(lines(Imf::WRITE_RGB, Imf::ZIP_COMPRESSION)).encoding, PictureMessage::RGBE);
}

TEST(Exr, OfLightWithoutColoursAndWithColoursOfHalfTheSize) {
    const DecodedImage grey = exrIn(lines(Imf::WRITE_Y, Imf::PIZ_COMPRESSION));
    const std::array<double, 3> light = lightAt(grey, 8, 2);
    EXPECT_EQ(light[0], light[1]);
    EXPECT_EQ(light[0], light[2]);
    // Rec. 709's light of 1, 1 and 4.
    EXPECT_NEAR(light[0], 0.2126 + 0.7152 + 4 * 0.0722, 0.02);
    // Within: the colours of the outermost pixels come from few others.
    const DecodedImage halved = exrIn(lines(Imf::WRITE_YC, Imf::ZIP_COMPRESSION));
    for (int x = 14; x < 24; ++x) {
        const std::array<double, 3> rgb = lightAt(halved, x, 10);
        EXPECT_NEAR(rgb[0], x / 8.0, 0.15) << x;
        EXPECT_NEAR(rgb[1], 5, 0.15) << x;
        EXPECT_NEAR(rgb[2], 4, 0.25) << x;
    }
}

TEST(Exr, OfFloatsAndWholeNumbers) {
    for (const Imf::PixelType type : {Imf::FLOAT, Imf::UINT}) {
        const std::array<double, 3> rgb =
            lightAt(exrIn(channelFile({{"R", 4}, {"G", 200000}, {"B", 100000}}, type)), 3, 3);
        EXPECT_NEAR(rgb[1], 200000, 800) << type;
        EXPECT_NEAR(rgb[2], 100000, 800) << type;
    }
    // Of what is no light nothing comes: less than none, no number, and more than there is.
    const std::array<double, 3> odd = lightAt(exrIn(channelFile({{"R", -1}, {"G", 1}, {"B", std::nanf("")}})), 0, 0);
    EXPECT_EQ(odd, (std::array<double, 3>{0, 1, 0}));
    EXPECT_GT(lightAt(exrIn(channelFile({{"R", HUGE_VALF}})), 0, 0)[0], 1e29);
}

TEST(Exr, ShowsTheLayerThatIsToBeSeen) {
    const auto red = [](const ChannelValues& values) { return lightAt(exrIn(channelFile(values)), 1, 1)[0]; };
    EXPECT_EQ(red({{"A.R", 4}, {"B.R", 8}, {"R", 2}}), 2) << "without a layer";
    EXPECT_EQ(red({{"View.AO.R", 4}, {"View.Combined.R", 8}, {"View.Depth.Z", 1}}), 8) << "of Blender's render";
    EXPECT_EQ(red({{"diffuse.R", 4}, {"specular.R", 8}, {"Z", 1}}), 4) << "the first";
    EXPECT_EQ(red({{"G", 4}}), 0) << "a colour that is not there";
    EXPECT_EQ(red({{"left.Y", 4}, {"Z", 2}}), 4);
    EXPECT_LE(worst(exrIn(parts())), 1.0 / 250) << "the part that has colours";
}

TEST(Exr, ShowsItsDisplayWindow) {
    using Imath::V2i;
    // 30 × 20 are shown, from (5, -5); stored begin at (10, 3), and end beyond.
    const DecodedImage image =
        exrIn(windowed({V2i(5, -5), V2i(34, 14)}, {V2i(10, 3), V2i(10 + kWide - 1, 3 + kHigh - 1)}));
    ASSERT_EQ(image.widthPx, 30);
    ASSERT_EQ(image.heightPx, 20);
    EXPECT_EQ(lightAt(image, 4, 8), (std::array<double, 3>{})) << "nothing is stored";
    EXPECT_EQ(lightAt(image, 5, 7), (std::array<double, 3>{}));
    EXPECT_EQ(lightAt(image, 5, 8), (std::array<double, 3>{0, 0, 4}));
    EXPECT_EQ(lightAt(image, 29, 19)[0], 3);
    EXPECT_EQ(lightAt(image, 29, 19)[1], 5.5);
    // Nothing at all is where it is to be seen.
    const DecodedImage beside = exrIn(windowed({V2i(0, 0), V2i(3, 3)}, {V2i(100, 0), V2i(99 + kWide, kHigh - 1)}));
    EXPECT_EQ(beside.rgba, Bytes(64));
}

/// In the confined child, where nothing begins a thread: around a scene, and on a model.
TEST(Exr, IsAllAroundASceneAndOnAModel) {
    const Scratch scratch;
    const std::string file = lines(Imf::WRITE_RGB, Imf::DWAB_COMPRESSION);
    const Bytes expected = exrIn(file).rgba;
    scratch.write("sky.exr", file);
    const auto shows = [&](const std::string& scene) {
        Expected<ImportedScene> imported = importScene(scene, kRootNode, importOptions());
        ASSERT_TRUE(imported) << messageOf(imported);
        const ImportedAspect aspect(std::move(*imported));
        const std::vector<const Image*> images = allOf<Image>(aspect);
        ASSERT_EQ(images.size(), 1u) << scene;
        EXPECT_EQ(images[0]->encoding, Image::kRgbe);
        EXPECT_EQ(images[0]->widthPx, kWide);
        EXPECT_TRUE(std::ranges::equal(images[0]->pixels.bytes(), expected));
    };
    shows(scratch.write("around.tsct",
                        "image { name: \"sky\" uri: \"sky.exr\" } node { environment { image: \"sky\" } }"));
    scratch.write("paint.mtl", "newmtl paint\nmap_Kd sky.exr\n");
    shows(scratch.write("model.obj",
                        "mtllib paint.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl paint\n"
                        "f 1/1 2/2 3/3\n"));
}

TEST(Exr, WhatIsNotReadIsNamed) {
    EXPECT_WORDS(whyNoExr(deep()));
    EXPECT_WORDS(whyNoExr(channelFile({{"Z", 1}, {"N.X", 1}})));
}

/// Replaces an attribute's numbers.
std::string lying(std::string file, const std::string& name, const std::string& numbers) {
    const std::size_t at = file.find(name + '\0');
    EXPECT_NE(at, std::string::npos);
    const std::size_t type = at + name.size() + 1, data = file.find('\0', type) + 5;
    return file.replace(data, numbers.size(), numbers);
}
std::string boxOf(std::uint64_t toX, std::uint64_t toY) {
    return little(0, 8) + little(toX, 4) + little(toY, 4);
}

TEST(Exr, SizesThatAreNotThereTakeNoMemory) {
    const std::string file = lines(Imf::WRITE_RGB, Imf::ZIP_COMPRESSION),
                      tiled = tiles(Imf::ONE_LEVEL, Imf::ZIP_COMPRESSION);
    for (const std::string& lie :
         {lying(file, "dataWindow", boxOf(32767, 32767)), lying(file, "displayWindow", boxOf(32767, 32767)),
          lying(file, "dataWindow", boxOf(0x7ffffff0, 0x7ffffff0)), lying(file, "displayWindow", boxOf(0x7fffffff, 3)),
          lying(tiled, "tiles", little(0x7fffffff, 4) + little(0x7fffffff, 4)),
          lying(tiled, "tiles", little(1, 8) + "\1"), lying(tiled, "dataWindow", boxOf(32767, 4095)),
          lying(file, "lineOrder", "\7")})
        EXPECT_NE(whyNoExr(lie), "decoded");
    // Of attributes the sizes that they say, and those that their types ask for; the number of chunks.
    const auto withSize = [](std::string picture, const std::string& name, std::uint64_t size) {
        const std::size_t type = picture.find(name + '\0') + name.size() + 1;
        return picture.replace(picture.find('\0', type) + 1, 4, little(size, 4));
    };
    for (const std::string& lie :
         {withSize(file, "channels", 0x7fffffff), withSize(file, "channels", 3), withSize(file, "pixelAspectRatio", 0),
          withSize(parts(), "type", 0x40000000), lying(parts(), "chunkCount", little(0x7ffffff, 4))})
        EXPECT_WORDS(whyNoExr(lie));
}

std::map<std::string, std::string> exrSamples() {
    return {{"lines", lines(Imf::WRITE_RGBA, Imf::ZIP_COMPRESSION)},
            {"dwa", lines(Imf::WRITE_RGB, Imf::DWAA_COMPRESSION)},
            {"half the size", lines(Imf::WRITE_YC, Imf::PIZ_COMPRESSION)},
            {"tiles", tiles(Imf::MIPMAP_LEVELS, Imf::B44_COMPRESSION)},
            {"parts", parts()},
            {"pxr24", lines(Imf::WRITE_RGB, Imf::PXR24_COMPRESSION)}};
}

TEST(Exr, CutOffIsRefused) {
    for (const auto& [name, file] : exrSamples()) {
        // Of tiles the smaller levels stand last, and of parts those that are not shown.
        const std::size_t step = name == "tiles" ? 7 : 1;
        const Bytes whole = exrIn(file).rgba;
        for (std::size_t length = 0; length < file.size(); length += step) {
            const Expected<DecodedImage> image = pictureIn(file.substr(0, length));
            if (image)
                EXPECT_EQ(image->rgba, whole) << name << ", " << length << " of " << file.size();
            else
                EXPECT_FALSE(image.error().message.empty());
        }
    }
}

TEST(Exr, AnyDamageLeadsToAPictureOrAnError) {
    damageEach(exrSamples(), 1700, "Exr.AnyDamage*");
}

}  // namespace
}  // namespace tessera
