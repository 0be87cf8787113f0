/// Pictures on their way to files and to those who ask for them.
#include "client/replica/PictureWriter.h"

#include <gtest/gtest.h>

#include <future>

#include "tests/unit/ReadableLog.h"

namespace tessera {
namespace {

// Of a 4K tile each would be 25 MB, until somebody asks again.
TEST(PictureWriter, HoldsNoPictureThatIsDone) {
    test::ReadableLog words;
    PictureWriter writer(words.log);
    std::vector<std::weak_ptr<const Picture>> pictures;
    std::vector<std::future<void>> done;
    for (std::uint64_t frame = 0; frame < 5; ++frame) {
        auto picture = std::make_shared<const Picture>(Picture::filled(32, 32, 1, 2, 3));
        pictures.push_back(picture);
        auto told = std::make_shared<std::promise<void>>();
        done.push_back(told->get_future());
        ASSERT_TRUE(writer.encodePng(std::move(picture), frame, [told](const SharedBytes&) { told->set_value(); }));
    }
    for (std::future<void>& each : done) each.wait();
    for (const auto& picture : pictures) EXPECT_TRUE(picture.expired());
}

TEST(PictureWriter, EncodesOnceForAllWhoAskMeanwhile) {
    test::ReadableLog words;
    PictureWriter writer(words.log);
    // Something large before them, so that they meet.
    const auto large = std::make_shared<const Picture>(Picture::filled(2000, 2000, 9, 9, 9)),
               asked = std::make_shared<const Picture>(Picture::filled(64, 64, 1, 2, 3));
    ASSERT_TRUE(writer.encodePng(large, 0, [](const SharedBytes&) {}));
    std::vector<std::promise<SharedBytes>> told(3);
    for (std::size_t i = 0; i < told.size(); ++i)
        ASSERT_TRUE(
            writer.encodePng(asked, i == 2 ? 8 : 7, [&told, i](const SharedBytes& png) { told[i].set_value(png); }));
    const SharedBytes first = told[0].get_future().get(), second = told[1].get_future().get(),
                      other = told[2].get_future().get();
    EXPECT_EQ(first, second) << "the same bytes";
    EXPECT_NE(*first, *other) << "of another frame";
}

}  // namespace
}  // namespace tessera
