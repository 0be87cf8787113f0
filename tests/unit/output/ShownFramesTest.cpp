/// Two eyes' pictures are of one frame, however late one of them is.
#include "client/output/ShownFrames.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <random>
#include <thread>

#include "tests/unit/Eventually.h"
#include "tests/unit/output/OutputScenes.h"

namespace tessera::test {
namespace {

using namespace std::chrono_literals;

class ShownPairs : public testing::Test {
protected:
    ShownPairs() {
        std::string pattern = testing::TempDir() + "tessera-frames-XXXXXX";
        folder_ = ::mkdtemp(pattern.data());
    }
    ~ShownPairs() override { std::filesystem::remove_all(folder_); }
    [[nodiscard]] std::string path(const std::string& eye) const { return folder_ + "/" + eye; }
    /// Each byte of frame n's picture says n.
    static void show(SharedFrameWriter& writer, std::uint64_t frame) {
        const auto value = static_cast<std::uint8_t>(frame);
        writer.prepare(frame, Picture::filled(64, 48, value, value, value));
        ASSERT_TRUE(writer.show());
    }
    std::string folder_;
};

/// The left eye shows at once, the right one after a while of its own; both wait for each other as a wall's tiles do.
TEST_F(ShownPairs, NeverMixFrames) {
    constexpr std::uint64_t kFrames = 400;
    auto left = SharedFrameWriter::create(path("left"), 64, 48).value(),
         right = SharedFrameWriter::create(path("right"), 64, 48).value();
    show(left, 1);
    show(right, 1);
    std::atomic<bool> over = false;
    std::thread host([&] {
        std::mt19937 random(4);
        for (std::uint64_t frame = 2; frame <= kFrames; ++frame) {
            const bool rightFirst = random() % 4 == 0;
            show(rightFirst ? right : left, frame);
            if (random() % 2 == 0) aMoment(random, 3ms);
            show(rightFirst ? left : right, frame);
            if (random() % 2 == 0) aMoment(random, 3ms);
        }
        over = true;
    });
    auto files = ShownFrames::open({path("left"), path("right")}).value();
    std::uint64_t last = 0, pairs = 0;
    while (last < kFrames) {
        const bool wasOver = over;
        const auto* frames = files.next(100ms);
        if (!frames && wasOver) break;
        if (!frames) continue;
        ASSERT_EQ(frames->size(), 2u);
        const std::uint64_t number = frames->at(0).number;
        ASSERT_EQ(frames->at(1).number, number);
        ASSERT_GT(number, last);
        for (const auto& frame : *frames)
            for (std::size_t i = 0; i < 64 * 48; ++i)
                ASSERT_EQ(frame.rgbx[4 * i + 1], static_cast<std::uint8_t>(number)) << "frame " << number;
        last = number;
        ++pairs;
    }
    host.join();
    EXPECT_EQ(last, kFrames) << "the last frame is shown when both eyes have it";
    EXPECT_GT(pairs, 20u);
}

TEST_F(ShownPairs, WaitWhileOneEyeIsMissing) {
    auto left = SharedFrameWriter::create(path("left"), 64, 48).value(),
         right = SharedFrameWriter::create(path("right"), 64, 48).value();
    show(left, 1);
    EXPECT_FALSE(ShownFrames::open({path("left"), path("right")}));
    show(right, 1);
    auto files = ShownFrames::open({path("left"), path("right")}).value();
    ASSERT_TRUE(files.next(1s));
    show(left, 2);
    EXPECT_FALSE(files.next(50ms)) << "the right eye still shows frame 1";
    EXPECT_FALSE(files.again());
    show(right, 2);
    const auto* frames = files.next(1s);
    ASSERT_TRUE(frames);
    EXPECT_EQ(frames->at(1).number, 2u);
    EXPECT_FALSE(files.next(10ms)) << "nothing new";
    EXPECT_TRUE(files.again());
    EXPECT_FALSE(files.replaced());
    auto anew = SharedFrameWriter::create(path("right"), 64, 48).value();
    show(anew, 3);
    EXPECT_TRUE(files.replaced());
}

TEST_F(ShownPairs, OneFileIsFollowedPictureByPicture) {
    auto writer = SharedFrameWriter::create(path("one"), 64, 48).value();
    show(writer, 7);
    auto files = ShownFrames::open({path("one")}).value();
    ASSERT_TRUE(files.next(1s));
    EXPECT_FALSE(files.next(10ms));
    show(writer, 7);  // the same number once more is another picture
    EXPECT_TRUE(files.next(1s));
}

}  // namespace
}  // namespace tessera::test
