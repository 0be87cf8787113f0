/// What is recorded comes out again; what does not is named.
#include "server/sim/recording/RecordingReplay.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>

#include "tests/unit/recording/RecordFile.h"

namespace tessera {
namespace {

using test::RawRecord;
using test::Recorded;
using test::recordShow;

ReplayResult replayed(Bytes file, const ReplayOptions& options = {}) {
    Expected<RecordingReader> reader = RecordingReader::over(std::move(file), "show.rec");
    EXPECT_TRUE(reader) << (reader ? "" : reader.error().message);
    return reader ? replay(*reader, options) : ReplayResult();
}

std::string firstWords(const ReplayResult& result) {
    std::string text;
    if (result.firstDifference)
        for (const std::string& what : result.firstDifference->what) text += what + "\n";
    return text;
}

TEST(Replay, IsTheRecordingForAnyNumberOfThreads) {
    std::uint64_t contacts = 0, refused = 0, shownInParts = 0;
    forSeeds(12, [&](Random& random) {
        const Recorded recorded = recordShow(random, 40);
        contacts += recorded.contacts;
        refused += recorded.refused;
        shownInParts += recorded.shownInParts;
        for (const unsigned threads : {1u, 2u, 3u}) {
            std::vector<FrameDigest> digests;
            const ReplayResult result =
                replayed(recorded.file,
                         {.threads = threads, .onFrame = [&](FrameNumber, const FrameResult& frame, const Aspect&) {
                              digests.push_back(digestOf(frame));
                          }});
            EXPECT_EQ(result.end, ReplayResult::End::kClosed) << result.error.message;
            EXPECT_EQ(result.frames, 40u);
            EXPECT_EQ(result.differingFrames, 0u) << firstWords(result);
            EXPECT_EQ(firstWords(result), "");
            EXPECT_EQ(digests, recorded.digests)
                << "the digests in the file are those of the frames, not merely of each other";
        }
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(contacts, 100u) << "shows in which nothing happens prove nothing";
    EXPECT_GT(refused, 10u);
    EXPECT_GT(shownInParts, 3u);
}

/// The recording with the outcome of one frame changed by `change`, with hashes that fit.
Bytes withOutcome(const Recorded& recorded, std::uint64_t frame, const std::function<void(FrameDigest&)>& change) {
    std::vector<RawRecord> records = test::takeApart(recorded.file);
    const BlobStore none;
    for (RawRecord& raw : records) {
        if (nameOfKind(raw.kind) != "outcome of a frame") continue;
        auto outcome = std::get<record::Outcome>(*decodeRecord(raw.kind, raw.content, none));
        if (outcome.frame != FrameNumber(frame)) continue;
        change(outcome.digest);
        raw = test::rawOf(encodeOutcome(outcome));
    }
    return test::putTogether(records);
}

TEST(Replay, NamesTheFirstFrameThatDiffersAndInWhat) {
    Random random(7);
    const Recorded recorded = recordShow(random, 12);
    const std::vector<std::pair<std::string, std::function<void(FrameDigest&)>>> changes{
        {"contacts: recorded ",
         [](FrameDigest& d) { d.parts[static_cast<std::size_t>(DigestPart::kContacts)].hash ^= 1; }},
        {"events: recorded ", [](FrameDigest& d) { ++d.parts[static_cast<std::size_t>(DigestPart::kEvents)].count; }},
        {"state hash: recorded ", [](FrameDigest& d) { d.stateHash.value ^= 1; }},
        {"sequence: recorded ", [](FrameDigest& d) { ++d.sequence.value; }},
        {"triangle tests: recorded ", [](FrameDigest& d) { ++d.counters[8]; }},
        {"outcomes of edits: recorded ", [](FrameDigest& d) { d.parts[0].hash ^= 1; }}};
    for (const auto& [words, change] : changes) {
        const ReplayResult result = replayed(withOutcome(recorded, 5, change));
        EXPECT_EQ(result.end, ReplayResult::End::kClosed) << result.error.message;
        EXPECT_EQ(result.frames, 12u);
        EXPECT_EQ(result.differingFrames, 1u);
        ASSERT_TRUE(result.firstDifference) << words;
        EXPECT_EQ(result.firstDifference->frame, FrameNumber(5));
        ASSERT_EQ(result.firstDifference->what.size(), 1u) << firstWords(result);
        EXPECT_EQ(result.firstDifference->what.front().rfind(words, 0), 0u) << firstWords(result);
    }
}

/// Not the recorded result is changed but what was put in: then the replay itself must come out different.
TEST(Replay, SeesAnEditThatIsMissing) {
    Random random(3);
    const Recorded recorded = recordShow(random, 20);
    std::vector<RawRecord> records = test::takeApart(recorded.file);
    BlobStore arrays;
    std::vector<Blob> kept;
    std::optional<FrameNumber> changed;
    for (RawRecord& raw : records) {
        Expected<Record> record = decodeRecord(raw.kind, raw.content, arrays);
        ASSERT_TRUE(record);
        if (auto* array = std::get_if<record::Array>(&*record)) kept.push_back(arrays.add(array->blob));
        auto* inputs = std::get_if<record::Inputs>(&*record);
        if (!inputs || inputs->edits.empty() || inputs->frame < FrameNumber(4) || changed) continue;
        changed = inputs->frame;
        inputs->edits.pop_back();
        raw = test::rawOf(encodeInputs(inputs->frame, inputs->first, inputs->edits, inputs->replies));
    }
    ASSERT_TRUE(changed);
    const ReplayResult result = replayed(test::putTogether(records));
    ASSERT_TRUE(result.firstDifference);
    EXPECT_EQ(result.firstDifference->frame, *changed);
    EXPECT_EQ(result.firstDifference->what.front().rfind("outcomes of edits: ", 0), 0u) << firstWords(result);
}

TEST(Replay, SeesAnotherStartScene) {
    Random random(5), otherRandom(6);
    std::vector<RawRecord> records = test::takeApart(recordShow(random, 2).file);
    for (RawRecord& raw : records)
        if (nameOfKind(raw.kind) == "started")
            raw = test::rawOf(encodeStarted({.sequence = Sequence(1), .stateHash = StateHash(4711)}));
    const ReplayResult result = replayed(test::putTogether(records));
    ASSERT_TRUE(result.firstDifference);
    EXPECT_FALSE(result.firstDifference->frame);
    EXPECT_WORDS(firstWords(result));
}

TEST(Replay, StopsAfterAsManyFramesAsAsked) {
    Random random(9);
    const ReplayResult result = replayed(recordShow(random, 10).file, {.maxFrames = 4});
    EXPECT_EQ(result.frames, 4u);
    EXPECT_EQ(result.frameMs.size(), 4u);
    EXPECT_EQ(result.end, ReplayResult::End::kMaxFrames);
    EXPECT_FALSE(result.firstDifference);
}

/// The server was killed at any moment: what the file has is replayed, up to and with the frame that it was at work on.
TEST(Replay, GoesAsFarAsACutOffFileGoes) {
    Random random(11);
    const Recorded recorded = recordShow(random, 6);
    std::uint64_t unfinished = 0;
    for (std::size_t bytes = kRecordingMark.size(); bytes < recorded.file.size(); bytes += 1 + bytes % 97) {
        const Bytes part(recorded.file.begin(), recorded.file.begin() + static_cast<std::ptrdiff_t>(bytes));
        Expected<RecordingReader> reader = RecordingReader::over(part, "cut.rec");
        if (!reader) {
            EXPECT_EQ(reader.error().code, ErrorCode::kBadInput) << reader.error().message;
            continue;
        }
        const ReplayResult result = replay(*reader);
        EXPECT_EQ(result.end, ReplayResult::End::kCutOff) << bytes << ": " << result.error.message;
        EXPECT_FALSE(result.firstDifference) << bytes << ": " << firstWords(result);
        EXPECT_LE(result.frames, 6u);
        unfinished += result.unfinishedFrame.has_value() ? 1 : 0;
        if (result.unfinishedFrame) {
            EXPECT_EQ(result.unfinishedFrame->value, result.frames);
        }
    }
    EXPECT_GT(unfinished, 0u);
}

}  // namespace
}  // namespace tessera
