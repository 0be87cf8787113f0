// Blocks of ETC and ASTC beside the decoders of others, over random ones: any bytes are a block.
#include <GL/osmesa.h>
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "common/base/Hash.h"
#include "server/import/reader/TexelLayout.h"
#include "server/import/reader/blocks/AstcBlock.h"
#include "server/import/reader/blocks/EtcBlock.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

/// A picture of blocks, so many across and down.
constexpr unsigned kAcross = 64, kDown = 48, kBlocks = kAcross * kDown;

/// Random ones; some of one colour, and half of kinds that there are: of random bits most blocks are reserved.
std::vector<std::byte> astcBlocks(unsigned seed) {
    constexpr std::uint64_t kPlainModes[] = {0, 1, 4, 5, 6, 8, 9, 10, 12, 13};  // of endpoints, without HDR's
    std::mt19937 random(seed);
    std::vector<std::byte> blocks;
    for (unsigned i = 0; i < kBlocks; ++i) {
        std::uint64_t words[2] = {};
        for (std::uint64_t& word : words) {
            word = random();
            word = word << 32 | random();
        }
        std::uint64_t& low = words[0];
        // Of any grid, and of four columns: the smallest blocks have no room for more.
        const std::uint64_t mode = random() % 4 ? (random() & 0x673) | 1 : random() % 2048;
        const std::uint64_t plain = kPlainModes[random() % 10];
        if (i % 8 == 0)
            low = (low & ~std::uint64_t{0xfff}) | 0xdfc;
        else if (i % 16 == 1)
            low = 0xfffffffffffffdfc;
        else if (i % 4 == 2)
            low = low >> 17 << 17 | plain << 13 | mode;
        else if (i % 4 == 3)
            low = low >> 29 << 29 | plain << 25 | (low >> 13 & 0x3ff) << 13 | (1 + random() % 3) << 11 | mode;
        const auto* bytes = reinterpret_cast<const std::byte*>(words);
        blocks.insert(blocks.end(), bytes, bytes + 16);
    }
    return blocks;
}

/// A size's blocks as they are decoded, and which these are: of sRGB all, of others those that are shown. (Where one is
/// not, astcenc's magenta is a little darker then.)
struct Decoded {
    Bytes rgba;
    std::vector<unsigned> blocks;
};
Decoded decodedOf(const std::vector<std::byte>& blocks, unsigned width, unsigned height, bool srgb) {
    const AstcDecoder decoder(width, height, srgb ? AstcDecoder::Colours::kSrgb : AstcDecoder::Colours::kLinear);
    Decoded decoded;
    Bytes texels(std::size_t{4} * width * height);
    for (unsigned i = 0; i < kBlocks; ++i) {
        const AstcDecoder::Kind kind = decoder.decode(&blocks[std::size_t{16} * i], texels.data());
        if (!srgb && kind != AstcDecoder::Kind::kShown) continue;
        decoded.rgba.insert(decoded.rgba.end(), texels.begin(), texels.end());
        decoded.blocks.push_back(i);
    }
    return decoded;
}

/// The same blocks as astcenc shows them, by way of files: its KTX begins with 64 bytes and the size.
Bytes byAstcenc(const std::string& program, const std::vector<std::byte>& blocks, const Decoded& which, unsigned width,
                unsigned height, bool srgb) {
    const Scratch scratch;
    std::string file("\x13\xab\xa1\x5c", 4);
    for (const unsigned side : {width, height, 1u}) file += static_cast<char>(side);
    for (const unsigned side : {kAcross * width, kDown * height, 1u})
        for (int shift = 0; shift < 24; shift += 8) file += static_cast<char>(side >> shift & 255);
    const std::string from = scratch.write("blocks.astc", file + std::string(asText(blocks))),
                      to = scratch.path("t.ktx");
    const std::string command = program + (srgb ? " -ds " : " -dl ") + from + " " + to + " -silent";
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    std::ifstream in(to, std::ios::binary);
    const std::string all((std::istreambuf_iterator<char>(in)), {});
    Bytes rgba;
    EXPECT_EQ(all.size(), 68 + std::size_t{4} * kBlocks * width * height);
    if (all.size() < 68 + std::size_t{4} * kBlocks * width * height) return rgba;
    for (const unsigned block : which.blocks)
        for (unsigned y = 0; y < height; ++y) {
            const std::size_t row = block / kAcross * height + y, column = std::size_t{block} % kAcross * width;
            const ByteSpan part = asBytes(all).subspan(68 + 4 * (row * kAcross * width + column), 4 * width);
            rgba.insert(rgba.end(), part.begin(), part.end());
        }
    return rgba;
}

/// Hashes of what astcenc 4.2.0 makes of these blocks, by size: linear, sRGB. With TESSERA_ASTCENC=/usr/bin/astcenc it
/// is asked again, texel by texel.
constexpr std::uint64_t kAstcHashes[14][2] = {
    {0xd84b99994af307fa, 0x219bf0352139a7ff}, {0x2e7784e8e2c6b343, 0xa517908d347ef585},
    {0x8d1295e2fd63d971, 0x74a079e55acfdd5},  {0xd381a33de59f92bf, 0x8dc16b97d3671e12},
    {0x912bd582c926e544, 0x28b4ccaf846b2b57}, {0x7a3301db75925f2a, 0xa15dd1dcc998780},
    {0xa358e691a59d3f4e, 0x30f4c49905d2b9d6}, {0xc771e4983055a246, 0xf7cad624773457a8},
    {0x56f4fd7173130570, 0x3c01e8df13d9ed2d}, {0xdef3aa24fe9de58f, 0xd55871de008419e4},
    {0xf96aca01b1599e8f, 0xcf373b97c03626f1}, {0x6e80ebc4ae887653, 0x682c3c2ec8a0040f},
    {0x1c1076329b2138fb, 0xabd9c9292fe94975}, {0xacf5668944b66712, 0x34821a464ea4eae5}};

TEST(AstcBlocks, ShowWhatAstcencShows) {
    const char* program = std::getenv("TESSERA_ASTCENC");
    for (unsigned size = 0; size < TexelLayout::kAstcSizes.size(); ++size) {
        const auto [width, height] = TexelLayout::kAstcSizes[size];
        const std::vector<std::byte> blocks = astcBlocks(size);
        for (const bool srgb : {false, true}) {
            const Decoded decoded = decodedOf(blocks, width, height, srgb);
            EXPECT_GT(decoded.blocks.size(), kBlocks / 4) << width << 'x' << height;
            EXPECT_EQ(hash64(decoded.rgba), kAstcHashes[size][srgb])
                << width << 'x' << height << (srgb ? " sRGB" : "") << std::hex << " 0x" << hash64(decoded.rgba);
            if (program)
                EXPECT_EQ(decoded.rgba, byAstcenc(program, blocks, decoded, width, height, srgb))
                    << width << 'x' << height;
        }
    }
}

/// Of 32 bits each, of which some say more than others.
std::byte firstOf(std::uint64_t low, std::uint64_t high, AstcDecoder::Kind& kind) {
    const std::uint64_t words[2] = {low, high};
    std::byte rgba[4 * 36];
    kind = AstcDecoder(6, 6, AstcDecoder::Colours::kSrgb).decode(reinterpret_cast<const std::byte*>(words), rgba);
    return rgba[1];
}

TEST(AstcBlocks, OfHdrAreToldApartFromThoseThatAreNone) {
    AstcDecoder::Kind kind{};
    firstOf(0xfffffffffffffffc, 0, kind);
    EXPECT_EQ(kind, AstcDecoder::Kind::kHdr) << "one colour, of floats";
    firstOf(0xfffffffffffff1fc, 0, kind);
    EXPECT_EQ(kind, AstcDecoder::Kind::kReserved) << "one colour, of three dimensions";
    EXPECT_EQ(firstOf(0xfffffffffffffdfc, 0x1234567890abcdef, kind), std::byte{0x90});
    EXPECT_EQ(kind, AstcDecoder::Kind::kShown);
    firstOf(2 << 13 | 0x53, 0, kind);
    EXPECT_EQ(kind, AstcDecoder::Kind::kHdr) << "mode 2 of endpoints";
    firstOf(0, 0, kind);
    EXPECT_EQ(kind, AstcDecoder::Kind::kReserved);
}

/// Mesa's software, as tests of drawing have it.
class Mesa {
public:
    Mesa() {
        void* const library = ::dlopen("libOSMesa.so.8", RTLD_NOW);
        if (!library) return;
        const auto create =
            reinterpret_cast<decltype(&OSMesaCreateContextAttribs)>(::dlsym(library, "OSMesaCreateContextAttribs"));
        const auto use = reinterpret_cast<decltype(&OSMesaMakeCurrent)>(::dlsym(library, "OSMesaMakeCurrent"));
        find_ = reinterpret_cast<decltype(&OSMesaGetProcAddress)>(::dlsym(library, "OSMesaGetProcAddress"));
        constexpr int kAttributes[] = {OSMESA_FORMAT,
                                       OSMESA_RGBA,
                                       OSMESA_PROFILE,
                                       OSMESA_CORE_PROFILE,
                                       OSMESA_CONTEXT_MAJOR_VERSION,
                                       4,
                                       OSMESA_CONTEXT_MINOR_VERSION,
                                       5,
                                       0};
        const OSMesaContext context = create(kAttributes, nullptr);
        isThere_ = context && use(context, pixels_, GL_UNSIGNED_BYTE, 4, 4);
    }
    [[nodiscard]] bool isThere() const { return isThere_; }

    /// A texture of so many texels a side, as floats of red, green, blue and alpha.
    [[nodiscard]] std::vector<float> texels(GLenum format, GLsizei side, const std::vector<std::byte>& blocks) const {
        const auto upload = function<void (*)(GLenum, GLint, GLenum, GLsizei, GLsizei, GLint, GLsizei, const void*)>(
            "glCompressedTexImage2D");
        const auto read = function<void (*)(GLenum, GLint, GLenum, GLenum, void*)>("glGetTexImage");
        upload(GL_TEXTURE_2D, 0, format, side, side, 0, static_cast<GLsizei>(blocks.size()), blocks.data());
        std::vector<float> rgba(std::size_t{4} * static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
        read(GL_TEXTURE_2D, 0, GL_RGBA, GL_FLOAT, rgba.data());
        EXPECT_EQ(function<GLenum (*)()>("glGetError")(), GLenum{GL_NO_ERROR});
        return rgba;
    }

private:
    template <typename Function>
    [[nodiscard]] Function function(const char* name) const {
        return reinterpret_cast<Function>(find_(name));
    }
    decltype(&OSMesaGetProcAddress) find_ = nullptr;
    bool isThere_ = false;
    std::byte pixels_[64] = {};
};

TEST(EtcBlocks, ShowWhatMesaShows) {
    const Mesa mesa;
    ASSERT_TRUE(mesa.isThere());
    struct Known {
        GLenum gl;
        EtcFormat format;
        unsigned channels;
        bool hasSign;
    };
    // OpenGL 4.3. Of sRGB the numbers would come as light.
    constexpr Known kKnown[] = {{0x9274, EtcFormat::kRgb, 4, false},          {0x9276, EtcFormat::kRgbCutOut, 4, false},
                                {0x9278, EtcFormat::kRgba, 4, false},         {0x9270, EtcFormat::kRed, 1, false},
                                {0x9271, EtcFormat::kSignedRed, 1, true},     {0x9272, EtcFormat::kRedGreen, 2, false},
                                {0x9273, EtcFormat::kSignedRedGreen, 2, true}};
    constexpr unsigned kSide = 512, kBlocksAcross = kSide / 4;
    std::mt19937 random(1);
    for (const Known& known : kKnown) {
        std::vector<std::byte> blocks(kBlocksAcross * kBlocksAcross * etcBlockBytes(known.format));
        for (std::byte& byte : blocks) byte = static_cast<std::byte>(random());
        const std::vector<float> theirs = mesa.texels(known.gl, kSide, blocks);
        std::size_t differing = 0;
        for (unsigned block = 0; block < kBlocksAcross * kBlocksAcross; ++block) {
            std::byte ours[64];
            decodeEtcBlock(known.format, &blocks[block * etcBlockBytes(known.format)], ours);
            for (unsigned i = 0; i < 16; ++i)
                for (unsigned c = 0; c < known.channels; ++c) {
                    const std::size_t row = block / kBlocksAcross * 4 + i / 4,
                                      column = block % kBlocksAcross * 4 + i % 4;
                    const double value = double{theirs[4 * (row * kSide + column) + c]};
                    // -1 to 1 become 0 to 255. Mesa keeps sixteen bits of eleven.
                    const double expected = 255 * (known.hasSign ? (value + 1) / 2 : value);
                    if (std::abs(std::to_integer<int>(ours[4 * i + c]) - expected) > 0.504) ++differing;
                }
        }
        EXPECT_EQ(differing, 0u) << std::hex << known.gl;
    }
}

TEST(EtcBlocks, OfOneChannelAreGreyAndOfTwoHaveNoBlue) {
    const std::byte block[16] = {std::byte{100}, {}, {}, {}, {}, {}, {}, {}, std::byte{200}};
    std::byte rgba[64];
    decodeEtcBlock(EtcFormat::kRed, block, rgba);
    EXPECT_EQ(rgba[0], rgba[1]);
    EXPECT_EQ(rgba[0], rgba[2]);
    EXPECT_EQ(rgba[3], std::byte{255});
    decodeEtcBlock(EtcFormat::kRedGreen, block, rgba);
    EXPECT_GT(rgba[1], rgba[0]);
    EXPECT_EQ(rgba[2], std::byte{0});
    EXPECT_EQ(rgba[3], std::byte{255});
}

}  // namespace
}  // namespace tessera
