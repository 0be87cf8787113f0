// The reader's pictures: decoded once, and no larger together than allowed.
#include <gtest/gtest.h>

#include "server/import/reader/Pictures.h"

namespace tessera {
namespace {

DecodedImage squareOf(int side) {
    return {.widthPx = side,
            .heightPx = side,
            .rgba = Bytes(static_cast<std::size_t>(side) * static_cast<std::size_t>(side) * 4)};
}

TEST(Pictures, AreDecodedOnceHoweverManyImagesShowThem) {
    PlainScene scene;
    const ReadLimits limits;
    Pictures pictures(scene, limits);
    int decoded = 0;
    for (const char* name : {"a", "b"}) {
        const auto image = pictures.addImage(name, "p", [&] { return ++decoded, squareOf(2); });
        ASSERT_TRUE(image);
        EXPECT_EQ((*image)->name(), name);
    }
    pictures.finish();
    EXPECT_EQ(decoded, 1);
    ASSERT_EQ(scene.blobs.size(), 1u);
    ASSERT_EQ(scene.file.image_size(), 2);
    EXPECT_EQ(scene.file.image(0).pixels_blob(), scene.file.image(1).pixels_blob());
    EXPECT_TRUE(scene.notes.empty());
}

TEST(Pictures, AreHalvedTheLargestFirstUntilAllFit) {
    PlainScene scene;
    const ReadLimits limits{.maxImageBytes = 4 * (8 * 8 + 4 * 4)};
    Pictures pictures(scene, limits);
    for (const int side : {16, 4, 4})  // 8 and 4 and 4 are too much still
        ASSERT_TRUE(pictures.addImage(std::to_string(scene.file.image_size()), std::to_string(scene.file.image_size()),
                                      [&] { return squareOf(side); }));
    pictures.finish();
    std::vector<std::uint32_t> sides;
    for (const proto::scene::Image& image : scene.file.image()) {
        EXPECT_EQ(image.width_px(), image.height_px());
        EXPECT_EQ(scene.blobs.at(image.pixels_blob() - 1).size(), image.width_px() * image.width_px() * 4);
        sides.push_back(image.width_px());
    }
    EXPECT_EQ(sides, (std::vector<std::uint32_t>{4, 4, 4}));
    EXPECT_EQ(scene.notes, (std::vector<std::string>{"0 was reduced to 4 × 4 pixels"}));
}

TEST(Pictures, ThatCannotBeHadAreNoImages) {
    PlainScene scene;
    const ReadLimits limits;
    Pictures pictures(scene, limits);
    for (int i = 0; i < 2; ++i)
        EXPECT_FALSE(
            pictures.addImage("a", "p", []() -> Expected<DecodedImage> { return fail(ErrorCode::kBadInput, "torn"); }));
    pictures.finish();
    EXPECT_EQ(scene.file.image_size(), 0);
}

}  // namespace
}  // namespace tessera
