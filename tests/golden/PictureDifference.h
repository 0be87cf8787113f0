/// Pictures beside stored ones, with a tolerance.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "common/image/Picture.h"
#include "tests/golden/Stage.h"

namespace tessera::test {

struct PictureDifference {
    double mean = 0;   ///< of all bytes
    double share = 0;  ///< of pixels that anybody would call another colour
};

inline PictureDifference differenceOf(const Picture& a, const Picture& b) {
    PictureDifference out;
    for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
        int most = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const int apart = std::abs(a.rgb[i + c] - b.rgb[i + c]);
            out.mean += apart;
            most = std::max(most, apart);
        }
        constexpr int kAnotherColour = 16;
        out.share += most > kAnotherColour;
    }
    out.mean /= static_cast<double>(a.rgb.size());
    out.share /= static_cast<double>(a.rgb.size() / 3);
    return out;
}

/// Other processors round otherwise, here and there.
inline bool isAlike(const PictureDifference& d) {
    return d.mean < 0.3 && d.share < 2e-3;
}

/// Where it is not near the picture of that file it leaves its own for whoever looks.
inline void expectNear(const Picture& picture, const std::string& stored, const std::string& name) {
    const Expected<Bytes> bytes = readFile(stored, std::size_t{1} << 24);
    ASSERT_TRUE(bytes) << bytes.error().message;
    const Expected<DecodedPng> expected = decodePng(*bytes);
    ASSERT_TRUE(expected && expected->picture.rgb.size() == picture.rgb.size()) << stored;
    const PictureDifference difference = differenceOf(picture, expected->picture);
    if (!isAlike(difference)) {
        const std::string now = testing::TempDir() + "/" + name + ".png";
        ASSERT_TRUE(writeFile(now, encodePng(picture, std::nullopt)));
        ADD_FAILURE() << name << " looks another way: bytes differ by " << difference.mean << " in the mean, "
                      << 100 * difference.share << " % of the pixels are of another colour. Now " << now << ", stored "
                      << stored;
    }
    // A tolerance that takes anything would show nothing: one thing less, or all a little darker, is seen.
    Picture darker = picture;
    for (std::uint8_t& byte : darker.rgb) byte = static_cast<std::uint8_t>(byte * 99 / 100);
    EXPECT_FALSE(isAlike(differenceOf(darker, expected->picture)));
    Picture less = picture;
    paste(less, Picture::filled(24, 24, 128, 64, 128), picture.widthPx / 2, picture.heightPx / 2);
    EXPECT_FALSE(isAlike(differenceOf(less, expected->picture)));
}

}  // namespace tessera::test
