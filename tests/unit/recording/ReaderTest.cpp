/// Damaged, cut, disordered and hostile files.
#include "server/sim/recording/RecordingReader.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <set>
#include <string>

#include "server/sim/recording/RecordingReplay.h"
#include "tests/support/words/Words.h"
#include "tests/unit/recording/RecordFile.h"

namespace tessera {
namespace {

using test::oneInTwo;
using test::RawRecord;
using test::recordShow;

/// Reads to the end; the error, or nothing.
std::optional<Error> readAll(Bytes file) {
    Expected<RecordingReader> reader = RecordingReader::over(std::move(file), "show.rec");
    if (!reader) return reader.error();
    while (true) {
        Expected<RecordingReader::Item> item = reader->next();
        if (!item) return item.error();
        if (std::holds_alternative<record::Closing>(*item) || std::holds_alternative<RecordingReader::CutOff>(*item))
            return {};
    }
}

const Bytes& aRecording() {
    static const Bytes file = [] {
        Random random(21);
        return recordShow(random, 8).file;
    }();
    return file;
}

TEST(RecordingReader, FindsEveryChangedByteAndNamesTheRecord) {
    const Bytes& whole = aRecording();
    ASSERT_FALSE(readAll(whole));
    std::set<std::string> said;  // without the places
    for (std::size_t at = 0; at < whole.size(); at += at < 200 ? 1 : 13) {
        Bytes changed = whole;
        changed[at] ^= std::byte{0x10};
        const std::optional<Error> error = readAll(changed);
        ASSERT_TRUE(error) << "byte " << at;
        EXPECT_EQ(error->message.rfind("show.rec: ", 0), 0u) << error->message;
        if (at < kRecordingMark.size()) {
            said.insert(error->message);
            continue;
        }
        // The record named is the one in which the byte lies.
        unsigned long long number = 0, begin = 0;
        const std::size_t where = error->message.find(" at byte ");
        ASSERT_NE(where, std::string::npos) << error->message;
        ASSERT_EQ(std::sscanf(error->message.c_str(), "show.rec: record %llu", &number), 1);
        ASSERT_EQ(std::sscanf(error->message.c_str() + where, " at byte %llu", &begin), 1);
        EXPECT_LE(begin, at) << error->message;
        said.insert(error->message.substr(error->message.find(": ", where)));
        std::size_t next = kRecordingMark.size();
        const std::vector<RawRecord> records = test::takeApart(whole);
        for (std::size_t i = 0; i <= number; ++i) next += sizeof(RecordHeader) + records[i].content.size();
        EXPECT_LT(at, next) << error->message;
    }
    for (const std::string& each : said) EXPECT_WORDS(each);
}

TEST(RecordingReader, RefusesRecordsThatAreMissingOrMoved) {
    const Bytes& whole = aRecording();
    std::vector<std::pair<std::size_t, std::size_t>> spans;  // of each record in the file
    std::size_t at = kRecordingMark.size();
    for (const RawRecord& record : test::takeApart(whole)) {
        spans.emplace_back(at, sizeof(RecordHeader) + record.content.size());
        at += spans.back().second;
    }
    for (std::size_t i = 0; i + 1 < spans.size(); ++i) {
        Bytes without = whole;
        const auto begin = without.begin() + static_cast<std::ptrdiff_t>(spans[i].first);
        without.erase(begin, begin + static_cast<std::ptrdiff_t>(spans[i].second));
        EXPECT_TRUE(readAll(without)) << "without record " << i;
    }
}

TEST(RecordingReader, RefusesRecordsOutOfPlaceThoughTheirHashesFit) {
    const std::vector<RawRecord> good = test::takeApart(aRecording());
    const auto find = [&](std::string_view name) {
        for (std::size_t i = 0; i < good.size(); ++i)
            if (nameOfKind(good[i].kind) == name) return i;
        return good.size();
    };
    const auto refused = [&](const std::vector<RawRecord>& records) {
        const std::optional<Error> error = readAll(test::putTogether(records));
        ASSERT_TRUE(error);
        EXPECT_WORDS(error->message);
    };
    for (const char* twice : {"opening", "started", "start list", "inputs of a frame", "outcome of a frame"}) {
        std::vector<RawRecord> records = good;
        records.insert(records.end() - 1, records[find(twice)]);
        refused(records);  // inputs again, and the closing: a frame that never came to an end
    }
    std::vector<RawRecord> arrayTwice = good;
    arrayTwice.insert(arrayTwice.begin() + static_cast<std::ptrdiff_t>(find("array")), good[find("array")]);
    refused(arrayTwice);
    std::vector<RawRecord> withoutArray = good;
    withoutArray.erase(withoutArray.begin() + static_cast<std::ptrdiff_t>(find("array")));
    refused(withoutArray);
    std::vector<RawRecord> behindTheEnd = good;
    behindTheEnd.push_back(good.back());
    refused(behindTheEnd);
    std::vector<RawRecord> unknown = good;
    unknown[2].kind = 99;
    refused(unknown);
    std::vector<RawRecord> noOpening = good;
    std::swap(noOpening[0], noOpening[1]);
    refused(noOpening);
}

TEST(RecordingReader, RefusesOtherSchemasAndLimitsBeyondItsOwn) {
    std::vector<RawRecord> records = test::takeApart(aRecording());
    record::Opening opening = test::openingForTests();
    opening.schema ^= 1;
    records[0] = test::rawOf(encodeOpening(opening));
    EXPECT_EQ(readAll(test::putTogether(records))->code, ErrorCode::kUnsupported);
    opening = test::openingForTests();
    opening.limits.maxObjects *= 2;
    records[0] = test::rawOf(encodeOpening(opening));
    EXPECT_EQ(readAll(test::putTogether(records))->code, ErrorCode::kLimit);
    opening = test::openingForTests();
    opening.program = "\x1b[2Jtessera-server";
    records[0] = test::rawOf(encodeOpening(opening));
    EXPECT_WORDS(readAll(test::putTogether(records))->message);
}

TEST(RecordingReader, SaysWhatIsNoRecording) {
    const test::TestFolder folder;
    EXPECT_EQ(RecordingReader::open(folder / "none.rec").error().code, ErrorCode::kNotFound);
    EXPECT_WORDS(RecordingReader::open(folder.path()).error().message);
    ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
    EXPECT_WORDS(RecordingReader::open(folder / "pipe").error().message);
    test::writeBytes(folder / "empty.rec", {});
    EXPECT_WORDS(RecordingReader::open(folder / "empty.rec").error().message);
    test::writeBytes(folder / "text.rec", asBytes("solid cube\nfacet normal 0 0 1\n"));
    EXPECT_WORDS(RecordingReader::open(folder / "text.rec").error().message);
}

/// A header that claims what is not there costs no memory: nothing is taken for a record that is longer than the file.
TEST(RecordingReader, TakesNoMemoryForWhatIsOnlyClaimed) {
    const ByteSpan mark = asBytes(kRecordingMark);
    for (const std::uint64_t claimed : {std::uint64_t{1} << 31, std::uint64_t{1} << 62, ~std::uint64_t{0}}) {
        Bytes file(mark.begin(), mark.end());
        RecordHeader header{.bytes = claimed, .kind = 0, .contentHash = 0, .headerHash = 0};
        header.headerHash = hash64(std::as_bytes(std::span(&header, 1)), 0);
        ASSERT_TRUE(isIntact(header, 0));
        const ByteSpan head = std::as_bytes(std::span(&header, 1));
        file.insert(file.end(), head.begin(), head.end());
        EXPECT_TRUE(readAll(file)) << claimed;
    }
}

/// Hashes that fit around contents that do not: the decoders are reached, and what they let through is replayed.
TEST(RecordingReader, NoBytesCrashReaderOrReplay) {
    std::uint64_t refused = 0, replayed = 0;
    forSeeds(2000, [&](Random& random) {
        std::vector<RawRecord> records = test::takeApart(aRecording());
        for (std::size_t i = 1 + below(random, 3); i > 0; --i) {
            RawRecord& record = records[below(random, records.size())];
            switch (below(random, 9)) {
                case 0:
                    record.kind = below(random, 9);
                    break;
                case 1:
                    record.content.resize(below(random, record.content.size() + 1));
                    break;
                case 2:
                    record.content.resize(record.content.size() + below(random, 64), static_cast<std::byte>(random()));
                    break;
                case 3:
                    std::swap(record, records[below(random, records.size())]);
                    break;
                case 4:
                case 5:
                case 6:
                case 7:  // the last numbers of a list: most are as good as others
                    if (nameOfKind(record.kind) == "array" || record.content.size() < 40) break;
                    record.content[record.content.size() - 1 - below(random, 40)] ^=
                        static_cast<std::byte>(1 + below(random, 255));
                    break;
                default:
                    if (record.content.empty()) break;
                    for (std::size_t n = 1 + below(random, 8); n > 0; --n)
                        record.content[below(random, std::min<std::size_t>(record.content.size(),
                                                                           oneInTwo(random) ? 64 : ~std::size_t{0}))] =
                            static_cast<std::byte>(random());
            }
        }
        Expected<RecordingReader> reader = RecordingReader::over(test::putTogether(records), "fuzz.rec");
        if (!reader) {
            ++refused;
            return;
        }
        const ReplayResult result = replay(*reader);
        ++(result.end == ReplayResult::End::kDamaged ? refused : replayed);
    });
    if (std::getenv("TESSERA_SEED")) return;
    EXPECT_GT(refused, 500u);
    EXPECT_GT(replayed, 100u) << "some of it must get through, or the replay is not tried";
}

}  // namespace
}  // namespace tessera
