/// tessera-replay as a person meets it.
#include "server/tools/replay/ReplayCommand.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>

#include <sstream>

#include "tests/unit/recording/RecordFile.h"

namespace tessera {
namespace {

struct Ran {
    int code = 0;
    std::string out, err;
};
Ran run(const std::vector<std::string>& words) {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    Ran ran;
    ran.code = runReplay(words);
    ran.out = testing::internal::GetCapturedStdout();
    ran.err = testing::internal::GetCapturedStderr();
    return ran;
}

class ReplayCommand : public testing::Test {
protected:
    ReplayCommand() {
        Random random(4);
        recorded_ = test::recordShow(random, 15);
        test::writeBytes(file_, recorded_.file);
    }
    test::TestFolder folder_;
    std::string file_ = folder_ / "show.rec";
    test::Recorded recorded_;
};

TEST_F(ReplayCommand, SaysThatItIsTheSame) {
    const Ran ran = run({file_, "--threads", "2"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(ran.err, "");
    EXPECT_NE(ran.out.find("show.rec: recorded by unit_recording on none with 1 thread\n15 frames on "),
              std::string::npos)
        << ran.out;
    EXPECT_NE(ran.out.find(" with 2 threads: "), std::string::npos) << ran.out;
    EXPECT_NE(ran.out.find("the same: "), std::string::npos) << ran.out;
}

TEST_F(ReplayCommand, SaysWhatDiffersWithExitCodeOne) {
    std::vector<test::RawRecord> records = test::takeApart(recorded_.file);
    const BlobStore none;
    for (test::RawRecord& raw : records) {
        if (nameOfKind(raw.kind) != "outcome of a frame") continue;
        auto outcome = std::get<record::Outcome>(*decodeRecord(raw.kind, raw.content, none));
        if (outcome.frame < FrameNumber(8)) continue;
        outcome.digest.stateHash = StateHash(1);
        raw = test::rawOf(encodeOutcome(outcome));
    }
    test::writeBytes(file_, test::putTogether(records));
    const Ran ran = run({file_});
    EXPECT_EQ(ran.code, 1);
    EXPECT_NE(
        ran.out.find("differs first in frame 8 (7 frames differ):\n  state hash: recorded 0000000000000001, now "),
        std::string::npos)
        << ran.out;
    const Ran json = run({file_, "--json"});
    EXPECT_EQ(json.code, 1);
    EXPECT_NE(json.out.find("\"result\":\"different\""), std::string::npos) << json.out;
    EXPECT_NE(json.out.find("\"first_difference\":{\"frame\":8,"), std::string::npos) << json.out;
    EXPECT_EQ(std::ranges::count(json.out, '\n'), 1);
}

TEST_F(ReplayCommand, NamesADamagedFileWithExitCodeThree) {
    recorded_.file[recorded_.file.size() / 2] ^= std::byte{1};
    test::writeBytes(file_, recorded_.file);
    const Ran ran = run({file_});
    EXPECT_EQ(ran.code, 3);
    EXPECT_EQ(ran.err.rfind("tessera-replay: " + file_ + ": record ", 0), 0u) << ran.err;
    EXPECT_WORDS(ran.err);
    EXPECT_EQ(ran.out.find("the same"), std::string::npos) << ran.out;
    EXPECT_EQ(run({folder_ / "none.rec"}).code, 3);
}

TEST_F(ReplayCommand, NotesAFileThatWasCutOff) {
    recorded_.file.resize(recorded_.file.size() - 3);
    test::writeBytes(file_, recorded_.file);
    const Ran ran = run({file_});
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_NE(ran.out.find("15 frames"), std::string::npos) << ran.out;
    EXPECT_NE(ran.out.find("note: the recording was cut off"), std::string::npos) << ran.out;
}

TEST_F(ReplayCommand, PrintsContactsALinePerFrame) {
    const Ran ran = run({file_, "--contacts", "--frames", "6"});
    EXPECT_EQ(ran.code, 0);
    EXPECT_EQ(std::ranges::count(ran.out, '\n'), 6);
    EXPECT_EQ(ran.out.rfind("{\"frame\":0,\"state_hash\":\"", 0), 0u) << ran.out;
    EXPECT_NE(ran.err.find("the same"), std::string::npos) << "the summary does not stand among the lines";
}

TEST(ReplayWords, AreRefusedWhereTheyMakeNoSense) {
    for (const std::vector<std::string>& words : {std::vector<std::string>{},
                                                  {"a.rec", "b.rec"},
                                                  {"a.rec", "--threads", "0"},
                                                  {"a.rec", "--frames", "0"},
                                                  {"a.rec", "--what"}})
        EXPECT_EQ(run(words).code, 2);
}

TEST(ReplayWords, HelpFitsATerminal) {
    const Ran help = run({"--help"});
    EXPECT_EQ(help.code, 0);
    std::istringstream lines(help.out);
    for (std::string line; std::getline(lines, line);) EXPECT_LT(line.size(), 80u) << line;
    EXPECT_NE(run({"--version"}).out.find("protocol"), std::string::npos);
}

}  // namespace
}  // namespace tessera
