/// What somebody takes away from under a journal: writing into a file without a name fails nowhere.
#include <filesystem>
#include <fstream>
#include <functional>

#include "tests/unit/Eventually.h"
#include "tests/unit/journal/KeptShow.h"

namespace tessera {
namespace {

using test::KeptShow;
namespace fs = std::filesystem;
using namespace std::chrono_literals;

struct Theft {
    std::string what;
    std::function<void(const std::string& folder)> deed;
    std::string said;  ///< names what is missing
};

/// The folder has log 1, which has ended, and log 2, which is written to.
const std::vector<Theft>& thefts() {
    // A look goes from file to file: of a folder that goes meanwhile it may miss any of them first.
    const std::string anyFile = "/wall/";
    static const std::vector<Theft> all{
        {"the folder is removed", [](const std::string& folder) { fs::remove_all(folder); }, anyFile},
        {"the folder gets another name", [](const std::string& folder) { fs::rename(folder, folder + "-old"); },
         anyFile},
        {"another folder comes in its place",
         [](const std::string& folder) {
             fs::copy(folder, folder + "-copy");
             fs::rename(folder, folder + "-old");
             fs::rename(folder + "-copy", folder);
         },
         anyFile},
        {"the lock is removed", [](const std::string& folder) { fs::remove(folder + "/lock"); }, "/lock"},
        {"the file `last` is removed", [](const std::string& folder) { fs::remove(folder + "/last"); }, "/last"},
        {"the open log is removed", [](const std::string& folder) { fs::remove(folder + "/log-0000000002"); },
         "/log-0000000002"},
        {"the open log is emptied", [](const std::string& folder) { fs::resize_file(folder + "/log-0000000002", 0); },
         "/log-0000000002"},
        {"a copy of the open log comes in its place",
         [](const std::string& folder) {
             fs::copy_file(folder + "/log-0000000002", folder + "/copy");
             fs::rename(folder + "/copy", folder + "/log-0000000002");
         },
         "/log-0000000002"},
        {"an earlier log is removed", [](const std::string& folder) { fs::remove(folder + "/log-0000000001"); },
         "/log-0000000001"},
    };
    return all;
}

class StolenFrom : public testing::TestWithParam<std::size_t> {
protected:
    void begin(std::chrono::milliseconds lookEvery) {
        limits.lookEvery = lookEvery;
        {
            Expected<Journal::Opened> first = test::openJournal(folder / "wall", arrays, words.log, limits);
            ASSERT_TRUE(first) << first.error().message;
            ASSERT_NO_FATAL_FAILURE(kept.load(*first->journal));
            kept.frames(*first->journal, 3);
            first->journal->ends(kept.next);
        }
        Expected<Journal::Opened> second = test::openJournal(folder / "wall", arrays, words.log, limits);
        ASSERT_TRUE(second) << second.error().message;
        kept.show.connectAnew();
        journal = std::move(second->journal);
        kept.frames(*journal, 3);
        ASSERT_TRUE(test::waitUntilWritten(*journal));
        ASSERT_FALSE(journal->trouble()) << journal->trouble()->message;
    }
    void waitForTrouble() {
        ASSERT_TRUE(test::eventually([&] { return journal->trouble().has_value(); }, 10s))
            << theft.what << ": nobody noticed";
        const auto isSaid = [&] { return words.said().find("the journal ends here: ") != std::string::npos; };
        ASSERT_TRUE(test::eventually(isSaid, 10s)) << theft.what << ": nothing was said";
        EXPECT_NE(journal->trouble()->message.find(theft.said), std::string::npos) << journal->trouble()->message;
        EXPECT_NE(words.said().find(theft.said), std::string::npos) << words.said();
    }

    const Theft& theft = thefts()[GetParam()];
    const test::TestFolder folder;
    test::ReadableLog words;
    BlobStore arrays;
    JournalLimits limits;
    Random random{7};
    KeptShow kept{random};
    std::unique_ptr<Journal> journal;
};

TEST_P(StolenFrom, SaysSoThoughNobodyEdits) {
    ASSERT_NO_FATAL_FAILURE(begin(1ms));
    theft.deed(folder / "wall");
    ASSERT_NO_FATAL_FAILURE(waitForTrouble());
}

/// (Whether earlier logs are there is looked at now and then alone.)
TEST_P(StolenFrom, GrantsNothingFromThenOn) {
    if (theft.said == "/log-0000000001") return;
    ASSERT_NO_FATAL_FAILURE(begin(std::chrono::hours(1)));
    theft.deed(folder / "wall");
    const std::uint64_t before = journal->written();
    kept.frames(*journal, 10);
    ASSERT_GT(journal->handed(), before);
    ASSERT_NO_FATAL_FAILURE(waitForTrouble());
    EXPECT_EQ(journal->written(), before);
}

INSTANTIATE_TEST_SUITE_P(Thefts, StolenFrom, testing::Range(std::size_t{0}, thefts().size()));

}  // namespace
}  // namespace tessera
