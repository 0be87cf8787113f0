#include "common/image/SharedFrame.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <thread>

#include "tests/unit/Eventually.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

constexpr int kWidthPx = 200, kHeightPx = 150;

/// All pixels tell the frame, so that a torn picture shows.
Picture pictureOf(std::uint64_t frame) {
    const auto value = static_cast<std::uint8_t>(frame % 251);
    return Picture::filled(kWidthPx, kHeightPx, value, value, value);
}

void showFrame(SharedFrameWriter& writer, std::uint64_t frame) {
    writer.prepare(frame, pictureOf(frame));
    ASSERT_TRUE(writer.show());
}

TEST(SharedFrame, ShowsOnlyWhatWasMadeTheShownImage) {
    const test::TestFolder folder;
    const std::string path = folder / "tiles/front-0-0/shown.frame";
    auto writer = SharedFrameWriter::create(path, kWidthPx, kHeightPx);
    ASSERT_TRUE(writer) << writer.error().message;
    writer->prepare(7, pictureOf(7));
    const auto before = readSharedFrame(path);
    ASSERT_FALSE(before);
    EXPECT_EQ(before.error().code, ErrorCode::kNotFound);

    ASSERT_TRUE(writer->show());
    writer->prepare(8, pictureOf(8));
    writer->prepare(9, pictureOf(9));
    const auto shown = readSharedFrame(path);
    ASSERT_TRUE(shown) << shown.error().message;
    EXPECT_EQ(shown->frame, 7u);
    EXPECT_EQ(shown->picture, pictureOf(7));

    ASSERT_TRUE(writer->show());
    EXPECT_EQ(readSharedFrame(path)->frame, 9u);
}

TEST(SharedFrame, IsNobodysButItsUsers) {
    const test::TestFolder folder;
    const std::string path = folder / "shown.frame";
    const mode_t before = ::umask(0);
    auto writer = SharedFrameWriter::create(path, kWidthPx, kHeightPx);
    showFrame(*writer, 1);
    ::umask(before);
    struct stat status {};
    ASSERT_EQ(::stat(path.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
}

TEST(SharedFrame, ShowsAPictureAgainUnderItsNewNumber) {
    const test::TestFolder folder;
    const std::string path = folder / "shown.frame";
    auto writer = SharedFrameWriter::create(path, kWidthPx, kHeightPx);
    ASSERT_TRUE(writer);
    const auto expectShown = [&](std::uint64_t frame, std::uint64_t pictureFrame) {
        ASSERT_TRUE(writer->show());
        const auto shown = readSharedFrame(path);
        ASSERT_TRUE(shown) << shown.error().message;
        EXPECT_EQ(shown->frame, frame);
        EXPECT_EQ(shown->picture, pictureOf(pictureFrame));
    };
    writer->prepare(1, pictureOf(1));
    expectShown(1, 1);
    for (std::uint64_t frame = 2; frame < 6; ++frame) {
        writer->prepareAgain(frame);
        expectShown(frame, 1);
    }
    // Prepared, and never shown.
    writer->prepare(6, pictureOf(6));
    writer->prepareAgain(7);
    expectShown(7, 6);
    writer->prepareAgain(8);
    expectShown(8, 6);
    writer->prepare(9, pictureOf(9));
    expectShown(9, 9);
    SharedFrameWriter moved = std::move(*writer);
    moved.prepareAgain(10);
    ASSERT_TRUE(moved.show());
    EXPECT_EQ(readSharedFrame(path)->frame, 10u);
    EXPECT_EQ(readSharedFrame(path)->picture, pictureOf(9));
}

TEST(SharedFrame, IsDrawnIntoWithoutShowingIt) {
    const test::TestFolder folder;
    const std::string path = folder / "shown.frame";
    auto writer = SharedFrameWriter::create(path, kWidthPx, kHeightPx);
    ASSERT_TRUE(writer);
    showFrame(*writer, 1);
    const auto draw = [&](std::uint64_t frame, int untilRow) {
        const PixelRows rows = writer->begin();
        ASSERT_GE(rows.pitchBytes, 4u * kWidthPx);
        for (int y = 0; y < untilRow; ++y)
            for (int x = 0; x < kWidthPx; ++x)
                std::fill_n(rows.rgbx + static_cast<std::size_t>(y) * rows.pitchBytes + 4 * static_cast<std::size_t>(x),
                            3, static_cast<std::uint8_t>(frame % 251));
    };
    draw(2, 75);
    EXPECT_EQ(readSharedFrame(path)->picture, pictureOf(1)) << "half a picture is nobody's";
    draw(3, kHeightPx);  // begun again
    writer->prepared(3);
    EXPECT_EQ(readSharedFrame(path)->frame, 1u);
    ASSERT_TRUE(writer->show());
    EXPECT_EQ(readSharedFrame(path)->frame, 3u);
    EXPECT_EQ(readSharedFrame(path)->picture, pictureOf(3));
}

TEST(SharedFrame, AReadyPictureIsShownByAnotherThanItsWriter) {
    const test::TestFolder folder;
    auto writer = SharedFrameWriter::create(folder / "shown.frame", kWidthPx, kHeightPx).value();
    const auto shown = [&] { return readSharedFrame(folder / "shown.frame"); };
    std::optional<ReadyFrame> before;
    for (std::uint64_t frame = 1; frame < 6; ++frame) {
        writer.prepare(frame, pictureOf(frame));
        const std::vector<ReadyFrame> ready{writer.ready()};
        if (before) {
            EXPECT_EQ(shown()->picture, pictureOf(frame - 1)) << "not before it is shown";
            EXPECT_EQ(before->picture(), pictureOf(frame - 1)) << "and the one before stays";
        } else {
            EXPECT_FALSE(shown());
        }
        std::thread([&] { EXPECT_TRUE(ReadyFrame::show(ready)); }).join();
        EXPECT_EQ(shown()->frame, frame);
        EXPECT_EQ(shown()->picture, pictureOf(frame));
        before = ready.front();
    }
    // Whoever holds a picture keeps its file, though the writer is gone.
    writer.prepare(7, pictureOf(7));
    const ReadyFrame last = writer.ready();
    { const SharedFrameWriter gone = std::move(writer); }
    EXPECT_TRUE(ReadyFrame::show(std::span(&last, 1)));
    EXPECT_EQ(shown()->picture, pictureOf(7));
}

TEST(SharedFrame, OutlivesAWriterKilledAtAnyInstant) {
    const test::TestFolder folder;
    const std::string path = folder / "shown.frame";
    std::mt19937 random(1);
    for (int run = 0; run < 10; ++run) {
        const auto left = readSharedFrame(path);  // by the last one
        const pid_t child = ::fork();
        ASSERT_GE(child, 0);
        if (child == 0) {
            auto writer = SharedFrameWriter::create(path, kWidthPx, kHeightPx);
            for (std::uint64_t frame = 0; writer; ++frame) {
                // Every picture is shown three times in a row.
                if (frame % 3 == 0)
                    writer->prepare(frame, pictureOf(frame));
                else
                    writer->prepareAgain(frame);
                if (!writer->show()) break;
            }
            ::_exit(1);
        }
        // A loaded machine may take its time to start the child; what is killed is a writer at work.
        EXPECT_TRUE(test::eventually([&] {
            const auto shown = readSharedFrame(path);
            return shown && (!left || shown->frame != left->frame);
        }));
        test::aMoment(random, std::chrono::milliseconds(16));
        ::kill(child, SIGKILL);
        ::waitpid(child, nullptr, 0);
        const auto shown = readSharedFrame(path);
        ASSERT_TRUE(shown) << shown.error().message;
        EXPECT_EQ(shown->picture, pictureOf(shown->frame / 3 * 3));
    }
}

TEST(SharedFrame, KeepsTheLastImageUntilARestartedWriterShowsItsFirst) {
    const test::TestFolder folder;
    const std::string path = folder / "shown.frame";
    {
        auto writer = SharedFrameWriter::create(path, kWidthPx, kHeightPx);
        ASSERT_TRUE(writer);
        showFrame(*writer, 41);
    }
    auto restarted = SharedFrameWriter::create(path, kWidthPx, kHeightPx);
    ASSERT_TRUE(restarted);
    restarted->prepare(60, pictureOf(60));
    EXPECT_EQ(readSharedFrame(path)->frame, 41u);
    ASSERT_TRUE(restarted->show());
    EXPECT_EQ(readSharedFrame(path)->frame, 60u);
}

TEST(SharedFrame, NeverGivesAReaderATornImage) {
    const test::TestFolder folder;
    const std::string path = folder / "shown.frame";
    auto writer = SharedFrameWriter::create(path, kWidthPx, kHeightPx);
    ASSERT_TRUE(writer);
    showFrame(*writer, 0);
    std::atomic<bool> stop = false;
    std::thread writing([&, random = std::mt19937(1)]() mutable {
        for (std::uint64_t frame = 1; !stop; ++frame) {
            writer->prepare(frame, pictureOf(frame));
            if (!writer->show()) return;
            // A frame takes time; a writer that does nothing but flip would leave no reader an instant.
            test::aMoment(random, std::chrono::microseconds(400));
        }
    });
    std::uint64_t last = 0;
    for (int i = 0; i < 500; ++i) {
        const auto shown = readSharedFrame(path);
        EXPECT_TRUE(shown) << shown.error().message;
        if (!shown) break;
        EXPECT_EQ(shown->picture, pictureOf(shown->frame));
        EXPECT_GE(shown->frame, last);
        last = shown->frame;
    }
    stop = true;
    writing.join();
}

TEST(SharedFrame, RefusesFilesThatAreSomethingElse) {
    const test::TestFolder folder;
    const std::string path = folder / "shown.frame";
    EXPECT_EQ(readSharedFrame(path).error().code, ErrorCode::kNotFound);
    ASSERT_TRUE(writeFile(path, asBytes("short")));
    EXPECT_EQ(readSharedFrame(path).error().code, ErrorCode::kBadInput);
    ASSERT_TRUE(writeFile(path, Bytes(100'000, std::byte{0x7f})));
    EXPECT_EQ(readSharedFrame(path).error().code, ErrorCode::kBadInput);

    // Nobody writes into it: to wait for that would be for ever.
    const std::string pipe = folder / "pipe";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    EXPECT_EQ(readSharedFrame(pipe).error().code, ErrorCode::kBadInput);
    EXPECT_EQ(SharedFrameReader::open(pipe).error().code, ErrorCode::kBadInput);

    auto writer = SharedFrameWriter::create(path, kWidthPx, kHeightPx);
    ASSERT_TRUE(writer);
    showFrame(*writer, 3);
    auto bytes = readFile(path, 10'000'000);
    ASSERT_TRUE(bytes);
    bytes->resize(bytes->size() - 1);
    ASSERT_TRUE(writeFile(folder / "cut", *bytes));
    EXPECT_EQ(readSharedFrame(folder / "cut").error().code, ErrorCode::kBadInput);
}

TEST(SharedFrame, AWriterThatIsKilledBeforeItsFirstImageLeavesNothing) {
    const test::TestFolder folder;
    const std::string path = folder / "shown.frame";
    for (int i = 0; i < 5; ++i) {
        const pid_t writer = ::fork();
        if (writer == 0) {
            auto made = SharedFrameWriter::create(path, kWidthPx, kHeightPx);
            if (!made) ::_exit(1);
            made->prepare(1, pictureOf(1));
            ::kill(::getpid(), SIGKILL);
        }
        int status = 0;
        ASSERT_EQ(::waitpid(writer, &status, 0), writer);
        EXPECT_TRUE(WIFSIGNALED(status));
    }
    EXPECT_TRUE(std::filesystem::is_empty(std::filesystem::path(path).parent_path()));
    // One that is killed between two names, as an older writer may have been.
    ASSERT_TRUE(std::ofstream(path + ".next") << "nonsense");
    auto writer = SharedFrameWriter::create(path, kWidthPx, kHeightPx);
    ASSERT_TRUE(writer) << writer.error().message;
    showFrame(*writer, 4);
    EXPECT_EQ(readSharedFrame(path)->frame, 4u);
    EXPECT_FALSE(std::filesystem::exists(path + ".next"));
}

TEST(SharedFrame, SaysWhereItCannotWrite) {
    const test::TestFolder folder;
    ASSERT_TRUE(writeFile(folder / "file", asBytes("x")));
    const auto writer = SharedFrameWriter::create(folder / "file/shown.frame", kWidthPx, kHeightPx);
    ASSERT_FALSE(writer);
    EXPECT_WORDS(writer.error().message);
    EXPECT_FALSE(SharedFrameWriter::create(folder / "x", 0, 5));
    EXPECT_FALSE(SharedFrameWriter::create(folder / "x", 16385, 5));
}

class SharedFrameReaderTest : public testing::Test {
protected:
    SharedFrameWriter newWriter() { return SharedFrameWriter::create(path_, kWidthPx, kHeightPx).value(); }
    const test::TestFolder folder_;
    const std::string path_ = folder_ / "shown.frame";
};

TEST_F(SharedFrameReaderTest, FollowsPictureByPicture) {
    EXPECT_EQ(SharedFrameReader::open(path_).error().code, ErrorCode::kNotFound);
    SharedFrameWriter writer = newWriter();
    showFrame(writer, 3);
    auto reader = SharedFrameReader::open(path_);
    ASSERT_TRUE(reader) << reader.error().message;
    const auto first = reader->read();
    ASSERT_TRUE(first);
    EXPECT_EQ(first->number, 3u);
    EXPECT_EQ(first->rgbx[0], 3);
    EXPECT_GT(first->shownAtNs, 0);
    EXPECT_FALSE(reader->waitForOther(first->times, std::chrono::milliseconds(20)));
    // Under the same number too, and when it is the same picture.
    writer.prepareAgain(3);
    ASSERT_TRUE(writer.show());
    EXPECT_TRUE(reader->waitForOther(first->times, std::chrono::seconds(10)));
    EXPECT_EQ(reader->read()->times, first->times + 1);
    EXPECT_GE(reader->read()->shownAtNs, first->shownAtNs);
}

TEST_F(SharedFrameReaderTest, IsWokenByAPictureAndNotByTime) {
    SharedFrameWriter writer = newWriter();
    showFrame(writer, 1);
    auto reader = SharedFrameReader::open(path_);
    ASSERT_TRUE(reader) << reader.error().message;
    // A sleeper that nobody woke would sleep for an hour each time.
    std::atomic<std::uint64_t> seen = reader->read()->times;
    std::thread sleeper([&] {
        while (seen < 50 && reader->waitForOther(seen, std::chrono::hours(1))) seen = reader->read()->times;
    });
    for (std::uint64_t frame = 2; frame <= 50; ++frame) {
        showFrame(writer, frame);
        while (seen < frame) std::this_thread::yield();
    }
    sleeper.join();
    EXPECT_EQ(seen, 50u);
}

TEST_F(SharedFrameReaderTest, KnowsWhenItsFileIsAnothersAndReadsWhatTheFirstLeft) {
    SharedFrameWriter writer = newWriter();
    showFrame(writer, 1);
    auto reader = SharedFrameReader::open(path_);
    ASSERT_TRUE(reader) << reader.error().message;
    EXPECT_FALSE(reader->replaced());
    SharedFrameWriter next = newWriter();
    EXPECT_FALSE(reader->replaced());
    showFrame(next, 9);
    EXPECT_TRUE(reader->replaced());
    EXPECT_EQ(reader->read()->number, 1u);
    EXPECT_EQ(SharedFrameReader::open(path_)->read()->number, 9u);
}

}  // namespace
}  // namespace tessera
