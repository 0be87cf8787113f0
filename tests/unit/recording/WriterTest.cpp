/// Recording must never be what a wall dies of.
#include "server/sim/recording/RecordingWriter.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>

#include "server/sim/recording/RecordingReplay.h"
#include "tests/support/words/Words.h"
#include "tests/unit/ReadableLog.h"
#include "tests/unit/recording/RecordFile.h"

namespace tessera {
namespace {

using test::RandomShow;

TEST(RecordingWriter, SaysWhyItCannotBegin) {
    test::ReadableLog words;
    const auto nowhere = RecordingWriter::create("/nowhere/at/all.rec", test::openingForTests(), words.log);
    ASSERT_FALSE(nowhere);
    EXPECT_EQ(nowhere.error().code, ErrorCode::kFailed);
    EXPECT_EQ(nowhere.error().message,
              "/nowhere/at/all.rec: the recording cannot be written: No such file or directory");
}

TEST(RecordingWriter, AFullDiskEndsTheRecordingAndNothingElse) {
    const test::TestFolder folder;
    test::ReadableLog words;
    Random random(2);
    // The system takes 20,000 bytes and then no more, in the middle of a record.
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit little{.rlim_cur = 20'000, .rlim_max = before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);
    {
        auto writer = RecordingWriter::create(folder / "full.rec", test::openingForTests(), words.log);
        ASSERT_TRUE(writer);
        RandomShow show(random);
        EXPECT_EQ(show.record(**writer, 150).size(), 150u);
    }
    ::setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, handler);
    EXPECT_EQ(std::filesystem::file_size(folder / "full.rec"), 20'000u);
    const std::string said = words.said();
    EXPECT_WORDS(said);
    EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
    Expected<RecordingReader> reader = RecordingReader::open(folder / "full.rec");
    ASSERT_TRUE(reader) << reader.error().message;
    const ReplayResult result = replay(*reader);
    EXPECT_EQ(result.end, ReplayResult::End::kCutOff) << result.error.message;
    EXPECT_GT(result.frames, 5u);
    EXPECT_FALSE(result.firstDifference);
}

TEST(RecordingWriter, EndsAtItsLongestWithOneLineAndWhatIsThereCanBeReplayed) {
    const test::TestFolder folder;
    test::ReadableLog words;
    Random random(2);
    {
        auto writer =
            RecordingWriter::create(folder / "long.rec", test::openingForTests(), words.log, {.maxFileBytes = 40'000});
        ASSERT_TRUE(writer);
        RandomShow show(random);
        EXPECT_EQ(show.record(**writer, 150).size(), 150u);
        EXPECT_FALSE((*writer)->recording());
    }
    EXPECT_LE(std::filesystem::file_size(folder / "long.rec"), 40'000u);
    const std::string said = words.said();
    EXPECT_WORDS(said);
    EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
    Expected<RecordingReader> reader = RecordingReader::open(folder / "long.rec");
    ASSERT_TRUE(reader) << reader.error().message;
    const ReplayResult result = replay(*reader);
    EXPECT_EQ(result.end, ReplayResult::End::kCutOff) << result.error.message;
    EXPECT_GT(result.frames, 10u);
    EXPECT_FALSE(result.firstDifference);
}

TEST(RecordingWriter, EndsWhereTheDiskIsTooSlow) {
    const test::TestFolder folder;
    test::ReadableLog words;
    Random random(2);
    {
        // No disk is as slow as one that may not have a byte waiting.
        auto writer =
            RecordingWriter::create(folder / "slow.rec", test::openingForTests(), words.log, {.maxQueuedBytes = 0});
        ASSERT_TRUE(writer);
        RandomShow show(random);
        (void)show.record(**writer, 3);
        EXPECT_FALSE((*writer)->recording());
    }
    EXPECT_WORDS(words.said());
    Expected<RecordingReader> reader = RecordingReader::open(folder / "slow.rec");
    ASSERT_TRUE(reader) << "the start scene does not wait in the queue";
    EXPECT_EQ(replay(*reader).end, ReplayResult::End::kCutOff);
}

TEST(RecordingWriter, WritesEachArrayOnce) {
    const test::TestFolder folder;
    test::ReadableLog words;
    test::ListMaker make;
    const MeshArrays box = makeBox(Vec3d::Ones()).toArrays();
    for (int i = 0; i < 5; ++i) {
        const ObjectId geometry = make.box(Vec3d::Ones());
        make.node("box", kRootNode, geometry);
    }
    const ChangeList list = make.builder.take();
    {
        auto writer = RecordingWriter::create(folder / "boxes.rec", test::openingForTests(), words.log);
        ASSERT_TRUE(writer);
        std::vector<Edit> edits{{.ticket = 1, .list = list}, {.ticket = 2, .list = list}};
        for (std::uint64_t frame = 0; frame < 3; ++frame)
            (*writer)->frameBegins(FrameNumber(frame), frame == 0, edits, {});
    }
    std::size_t arrays = 0, bytes = 0;
    for (const test::RawRecord& record : test::takeApart(test::readBytes(folder / "boxes.rec")))
        if (nameOfKind(record.kind) == "array") {
            ++arrays;
            bytes += record.content.size();
        }
    EXPECT_EQ(arrays, 3u);
    EXPECT_EQ(bytes, box.positions.sizeBytes() + box.normals.sizeBytes() + box.indices.sizeBytes());
}

}  // namespace
}  // namespace tessera
