/// A torn end is told from damage; what is cut off is kept.
#include <cerrno>

#include "tests/support/words/Words.h"
#include "tests/unit/journal/DamagedFolder.h"

namespace tessera {
namespace {

using test::JournalBytes;
using test::LeftJournal;
using test::ModelDisk;
using test::Start;

constexpr const char* kLog = "log-0000000001";

class JournalTornEnd : public testing::Test {
protected:
    void write(const JournalBytes& files) { ModelDisk::write(files, wall); }
    void append(const std::string& name, const std::string& bytes) {
        std::ofstream(wall + "/" + name, std::ios::binary | std::ios::app) << bytes;
    }
    [[nodiscard]] std::string contentOf(const std::string& name) const { return test::bytesIn(wall).at(name); }

    const test::TestFolder folder;
    const std::string wall = folder / "wall";
    Random random{5};
    /// One log, of a server that was killed.
    const LeftJournal left = test::leftJournal(random, 1, true, false);
    const std::string whole = left.files.at(kLog);
    const std::vector<std::size_t> records = test::recordsIn(whole);
};

/// The same log as older versions wrote it: records know their numbers by their headers' hashes alone.
std::string inFormat2(const std::string& log, const std::vector<std::size_t>& records) {
    std::string old(log.substr(0, kJournalMark.size()));
    for (std::size_t i = 0; i + 1 < records.size(); ++i) {
        RecordHeader header;
        std::memcpy(&header, log.data() + records[i], sizeof(header));
        const std::string text = log.substr(records[i] + sizeof(header), header.bytes);
        Bytes content(asBytes(std::string_view(text)).begin(), asBytes(std::string_view(text)).end());
        if (i == 0) {
            Expected<JournalRecord> opening = decodeJournal(0, Bytes(content), BlobStore());
            EXPECT_TRUE(opening) << opening.error().message;
            std::get<journal::Opening>(*opening).format = 2;
            const RecordContent again = encodeJournal(*opening);
            content.assign(again.bytes().begin(), again.bytes().end());
        }
        header = headerFor(header.kind & 0xff, content, i);
        old += asText(std::as_bytes(std::span(&header, 1)));
        old += asText(content);
    }
    return old;
}

TEST_F(JournalTornEnd, HeadersThatAreZeroedInTheMiddleMakeNone) {
    ASSERT_GT(records.size(), 40u);
    const std::string old = inFormat2(whole, records);
    for (const bool isOld : {false, true}) {
        const std::string& log = isOld ? old : whole;
        const std::vector<std::size_t> at = test::recordsIn(log);
        for (const std::size_t bytes : {512, 4096})
            for (std::size_t i = 1; at[i] + bytes < at[at.size() - 4]; i += at.size() / 12) {
                SCOPED_TRACE(fmt::format("format {}, {} bytes at record {}", isOld ? 2 : 3, bytes, i));
                JournalBytes files = left.files;
                files[kLog] = log;
                files[kLog].replace(at[i], bytes, bytes, '\0');
                if (isOld) files["last"] = "1\n";
                write(files);
                const Start start(wall);
                ASSERT_TRUE(start.refusal) << "granted edits are gone";
                EXPECT_EQ(start.refusal->code, ErrorCode::kBadInput);
                const std::string where = fmt::format("{}/{}: record {} at byte {}: ", wall, kLog, i, at[i]);
                EXPECT_NE(start.refusal->message.find(where), std::string::npos) << start.refusal->message;
                EXPECT_EQ(test::bytesIn(wall), files);
                // Who follows the message goes on with what is before the damage.
                std::filesystem::resize_file(wall + "/" + kLog, at[i]);
                test::goOnWith(wall, 1);
                EXPECT_TRUE(Start(wall).state);
            }
    }
}

TEST_F(JournalTornEnd, IsKeptBesideAndSaid) {
    const std::string torn = whole.substr(records[records.size() / 2], 45);
    write(left.files);
    append(kLog, torn);
    Start first(wall);
    ASSERT_TRUE(first.state) << first.refusal->message;
    EXPECT_TRUE(*first.state == left.granted);
    EXPECT_NE(first.words.said().find(fmt::format("the last 45 bytes, from byte {} on, are no whole record (the server "
                                                  "was killed): cut off, and kept in {}/{}.torn-1",
                                                  whole.size(), wall, kLog)),
              std::string::npos)
        << first.words.said();
    EXPECT_EQ(contentOf(std::string(kLog) + ".torn-1"), torn);
    EXPECT_EQ(contentOf(kLog), whole);
    Start second(wall);
    ASSERT_TRUE(second.state) << second.refusal->message;
    EXPECT_TRUE(*second.state == left.granted);
    EXPECT_EQ(second.words.said(), "");
    EXPECT_EQ(contentOf(std::string(kLog) + ".torn-1"), torn);
}

TEST_F(JournalTornEnd, ReplacesNoOther) {
    write(left.files);
    append(kLog, "a record that");
    append(std::string(kLog) + ".torn-1", "somebody's");
    ASSERT_TRUE(Start(wall).state);
    EXPECT_EQ(contentOf(std::string(kLog) + ".torn-1"), "somebody's");
    EXPECT_EQ(contentOf(std::string(kLog) + ".torn-2"), "a record that");
}

TEST_F(JournalTornEnd, ThatCannotBeKeptIsNotCutOff) {
    JournalBytes files = left.files;
    files[kLog] += "a record that";
    for (const ModelDisk::Call call : {ModelDisk::Call::kCreate, ModelDisk::Call::kAppend, ModelDisk::Call::kSync,
                                       ModelDisk::Call::kRename, ModelDisk::Call::kSyncFolder}) {
        write(files);
        const auto disk = std::make_shared<ModelDisk>();
        disk->adopt(wall);
        disk->faults = {{.call = call, .number = 1, .error = ENOSPC}};
        BlobStore arrays;
        test::ReadableLog words;
        const Expected<Journal::Opened> opened =
            Journal::open({.folder = wall, .scenes = {}, .limits = {}, .calls = disk}, arrays, words.log, {});
        ASSERT_FALSE(opened) << static_cast<int>(call);
        EXPECT_NE(opened.error().message.find(fmt::format("{}/{}.torn-1: ", wall, kLog)), std::string::npos)
            << opened.error().message;
        EXPECT_EQ(contentOf(kLog), files[kLog]);
    }
    write(files);
    for (std::size_t i = 1; i <= JournalFolder::kMostTornEnds; ++i) append(fmt::format("{}.torn-{}", kLog, i), "");
    const Start start(wall);
    ASSERT_TRUE(start.refusal);
    EXPECT_WORDS(start.refusal->message);
    EXPECT_EQ(contentOf(kLog), files[kLog]);
}

/// The disk has written any of the sectors that were not synced.
TEST_F(JournalTornEnd, OfAPowerCutMayHaveRecordsBehindIt) {
    const std::size_t hole = records[records.size() / 2];
    JournalBytes files = left.files;
    files[kLog].replace(hole, 512, 512, '\0');
    write(files);
    const Start killed(wall);
    ASSERT_TRUE(killed.refusal) << "a kill leaves no hole";
    Start cut(wall, true);
    ASSERT_TRUE(cut.state) << cut.refusal->message;
    EXPECT_WORDS(cut.words.said());
    EXPECT_EQ(contentOf(std::string(kLog) + ".torn-1"), files[kLog].substr(hole));
    Start again(wall, true);
    ASSERT_TRUE(again.state) << again.refusal->message;
    EXPECT_TRUE(*again.state == *cut.state);
    // The opening and its numbers were synced.
    files = left.files;
    files[kLog].replace(records[1], 100, 100, '\0');
    write(files);
    const Start damaged(wall, true);
    ASSERT_TRUE(damaged.refusal) << "what was synced is gone";
    EXPECT_NE(damaged.refusal->message.find(fmt::format("{}: record 1 at byte ", kLog)), std::string::npos)
        << damaged.refusal->message;
}

/// Nothing in the log tells: a shorter one is whole too.
TEST_F(JournalTornEnd, IsNoneWhereALogHasLostWhatWasGranted) {
    for (const std::size_t bytes : {whole.size() - 1, records[records.size() - 2], records[records.size() / 2]}) {
        JournalBytes files = left.files;
        files[kLog].resize(bytes);
        write(files);
        const Start start(wall);
        ASSERT_TRUE(start.refusal) << bytes << " of " << whole.size() << " bytes";
        EXPECT_NE(start.refusal->message.find(fmt::format("edits are granted up to byte {}", whole.size())),
                  std::string::npos)
            << start.refusal->message;
        test::goOnWith(wall, 1);
        EXPECT_TRUE(Start(wall).state);
    }
}

/// Files of an older version or a person say less, and are read.
TEST_F(JournalTornEnd, OfAnOlderVersionIsCutOffToo) {
    const std::string old = inFormat2(whole, records);
    for (const bool hasLast : {false, true}) {
        JournalBytes files{{kLog, old.substr(0, old.size() - 3)}};
        if (hasLast) files["last"] = "1\n";
        write(files);
        Start start(wall);
        ASSERT_TRUE(start.state) << start.refusal->message;
        EXPECT_NE(start.words.said().find(".torn-1"), std::string::npos) << start.words.said();
    }
    write({{kLog, old}});
    const Start start(wall);
    ASSERT_TRUE(start.state) << start.refusal->message;
    EXPECT_TRUE(*start.state == left.granted);
}

/// Each place might be a header; then each number would have to be tried.
TEST_F(JournalTornEnd, OfAHostileFileIsGivenUp) {
    std::string old = inFormat2(whole, records);
    old.replace(test::recordsIn(old)[1], 32, 32, '\1');
    for (int i = 0; i < 1 << 15; ++i) old += std::string("\3\0\0\0\0\0\0\0", 8);
    write({{kLog, old}});
    const Start start(wall);
    ASSERT_TRUE(start.refusal);
    EXPECT_NE(start.refusal->message.find(fmt::format("{}/{}: record 1 at byte ", wall, kLog)), std::string::npos)
        << start.refusal->message;
}

}  // namespace
}  // namespace tessera
