/// Images whose bytes do not fit their size never get into the scene.
#include <gtest/gtest.h>

#include <vector>

#include "common/cores/Image.h"
#include "common/scene/FieldTable.h"
#include "server/sim/commit/Committer.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

constexpr ObjectId kPicture{kFirstPlaceholder};

Blob bytesOf(std::size_t count) {
    return Blob::of(std::span<const std::uint8_t>(std::vector<std::uint8_t>(count)));
}
std::string refusalOf(const Image& image) {
    Committer committer;
    ChangeListBuilder builder;
    builder.create(kPicture, typeOf<Image>());
    setAllFields(builder, kPicture, Object::of(image));
    const auto applied = committer.apply(builder.take());
    return applied ? "" : applied.error().message;
}

TEST(ImageCheck, EveryShapeNeedsItsBytes) {
    struct Kind {
        Image image;
        std::size_t bytes;
    };
    const Kind kinds[] = {
        {{.widthPx = 5, .heightPx = 3}, 60},
        {{.widthPx = 5, .heightPx = 1, .shape = Image::kLine}, 20},
        {{.widthPx = 2, .heightPx = 3, .shape = Image::kSolid, .depthPx = 4}, 96},
        {{.widthPx = 2, .heightPx = 2, .shape = Image::kCube}, 96},
        {{.widthPx = 2, .heightPx = 2, .encoding = Image::kRgbe, .shape = Image::kCube}, 96},
        {{.widthPx = 5, .heightPx = 3, .encoding = Image::kBc1}, 16},
        {{.widthPx = 8, .heightPx = 8, .encoding = Image::kBc7, .mipmaps = 4}, 64 + 16 + 16 + 16},
        {{.widthPx = 4, .heightPx = 4, .encoding = Image::kBc6h, .shape = Image::kCube, .mipmaps = 2}, 12 * 16},
        {{.widthPx = 4, .heightPx = 4, .encoding = Image::kBc4, .shape = Image::kSolid, .depthPx = 5, .mipmaps = 3},
         (5 + 2 + 1) * 8},
    };
    for (const Kind& kind : kinds) {
        Image image = kind.image;
        EXPECT_EQ(refusalOf(image), "") << "nothing to show yet";
        image.pixels = bytesOf(kind.bytes);
        EXPECT_EQ(refusalOf(image), "");
        for (const std::size_t bytes : {kind.bytes - 1, kind.bytes + 1, std::size_t{1}, 2 * kind.bytes}) {
            image.pixels = bytesOf(bytes);
            EXPECT_WORDS(refusalOf(image));
        }
    }
}

TEST(ImageCheck, WhatGoesTogetherIsSaidInWords) {
    const auto with = [](Image image) {
        image.pixels = bytesOf(64);
        return refusalOf(image);
    };
    EXPECT_WORDS(with({.widthPx = 4, .heightPx = 4, .mipmaps = 2}));
    EXPECT_WORDS(with({.widthPx = 16, .heightPx = 1, .shape = Image::kFlat, .depthPx = 2}));
    EXPECT_WORDS(with({.widthPx = 8, .heightPx = 2, .shape = Image::kLine}));
    EXPECT_WORDS(with({.widthPx = 8, .heightPx = 2, .shape = Image::kCube}));
    EXPECT_WORDS(with({.widthPx = 4, .heightPx = 4, .encoding = Image::kRgbe, .shape = Image::kSolid}));
    EXPECT_WORDS(with({.widthPx = 8, .heightPx = 8, .encoding = Image::kBc1, .mipmaps = 5}));
    EXPECT_WORDS(with({.widthPx = 0, .heightPx = 4}));
    EXPECT_WORDS(with({.widthPx = 65536, .heightPx = 65536, .shape = Image::kCube}));
}

TEST(ImageCheck, SizeAndBytesChangeTogether) {
    Committer committer;
    ChangeListBuilder builder;
    builder.create(kPicture, typeOf<Image>());
    setAllFields(builder, kPicture, Object::of(Image{.pixels = bytesOf(16), .widthPx = 2, .heightPx = 2}));
    const ObjectId id = committer.apply(builder.take()).value().ids.at(0).second;
    ChangeListBuilder width;
    width.set(id, typeOf<Image>(), fieldId<&Image::widthPx>, std::int64_t{4});
    const auto refused = committer.apply(width.take());
    ASSERT_FALSE(refused);
    EXPECT_WORDS(refused.error().message);
    EXPECT_EQ(committer.scene().get<Image>(id)->widthPx, 2);
    ChangeListBuilder both;
    both.set(id, typeOf<Image>(), fieldId<&Image::widthPx>, std::int64_t{4});
    both.set(id, typeOf<Image>(), fieldId<&Image::pixels>, bytesOf(32));
    EXPECT_TRUE(committer.apply(both.take()));
    ChangeListBuilder wrap;
    wrap.set(id, typeOf<Image>(), fieldId<&Image::wrapU>, Image::kClamp);
    EXPECT_TRUE(committer.apply(wrap.take()));
}

}  // namespace
}  // namespace tessera
