/// A file of another journal, or of an earlier time, is refused by name.
#include "tests/support/words/Words.h"
#include "tests/unit/journal/DamagedFolder.h"

namespace tessera {
namespace {

using test::JournalBytes;
using test::LeftJournal;
using test::Start;

constexpr const char *kFirst = "log-0000000001", *kMiddle = "log-0000000002", *kNewest = "log-0000000003",
                     *kSnapshot = "snapshot-0000000002";

/// How a journal came about. All begin with the same scene; two of equal edits and other places have equal lengths.
struct Course {
    double place = 1;                 ///< where bookmarks stand
    std::vector<int> edits{3, 3, 3};  ///< bookmarks that each server set
    bool snapshot = false;            ///< of the first log
};

LeftJournal journalOf(const Course& course) {
    const test::TestFolder folder;
    test::ReadableLog words;
    BlobStore arrays;
    Random random(1);
    test::KeptShow kept(random);
    const Wall screens;
    ViewSource view(screens, "");
    for (std::size_t server = 0; server < course.edits.size(); ++server) {
        Expected<Journal::Opened> opened = test::openJournal(folder / "wall", arrays, words.log);
        EXPECT_TRUE(opened) << opened.error().message;
        if (!opened) return {};
        if (server == 0) kept.load(*opened->journal);
        for (int edit = 0; edit < course.edits[server]; ++edit) {
            View stand;
            stand.position = Vec3d(course.place, static_cast<double>(server + 1), edit + 1);
            view.keepBookmark(static_cast<std::size_t>(edit % 9), stand);
            opened->journal->viewIs(view);
        }
        opened->journal->ends(kept.next);
        opened->journal.reset();
        // The snapshot is of the first log, and the second one is open.
        if (course.snapshot && server == 1) test::makeSnapshot(folder / "wall");
    }
    LeftJournal left{.files = test::bytesIn(folder / "wall"), .granted = {}};
    left.granted.standing = test::standingOf(kept.show.simulation());
    left.granted.view = asText(encodeJournal(journal::View{view.state()}).bytes());
    return left;
}

class JournalExchange : public testing::Test {
protected:
    /// Puts these files of `other` into the folder of `own`.
    void exchange(const LeftJournal& own, const LeftJournal& other, const std::vector<std::string>& names) {
        files = own.files;
        for (const std::string& name : names) files[name] = other.files.at(name);
        test::ModelDisk::write(files, wall);
    }
    void expectRefusalThatNames(const std::string& name) {
        const Start start(wall);
        ASSERT_TRUE(start.refusal) << name << " of another journal was taken";
        EXPECT_EQ(start.refusal->code, ErrorCode::kBadInput);
        EXPECT_NE(start.refusal->message.find(fmt::format("{}/{}", wall, name)), std::string::npos)
            << start.refusal->message;
        EXPECT_WORDS(start.refusal->message);
        EXPECT_EQ(test::bytesIn(wall), files) << "a refused start has changed something";
    }

    const test::TestFolder folder;
    const std::string wall = folder / "wall";
    JournalBytes files;
};

TEST_F(JournalExchange, OfTheOnlyLogIsRefused) {
    const LeftJournal own = journalOf({.edits = {5}}), alike = journalOf({.place = 2, .edits = {5}});
    ASSERT_EQ(own.files.at(kFirst).size(), alike.files.at(kFirst).size());
    ASSERT_FALSE(own.granted == alike.granted);
    for (const LeftJournal& other : {alike, journalOf({.place = 2, .edits = {9}}), journalOf({.edits = {5}})}) {
        exchange(own, other, {kFirst});
        ASSERT_NO_FATAL_FAILURE(expectRefusalThatNames(kFirst));
        exchange(own, own, {});
        EXPECT_TRUE(*Start(wall).state == own.granted);
    }
}

TEST_F(JournalExchange, OfTheNewestLogIsRefused) {
    const LeftJournal own = journalOf({}), alike = journalOf({.place = 2});
    ASSERT_EQ(own.files.at(kNewest).size(), alike.files.at(kNewest).size());
    for (const LeftJournal& other : {alike, journalOf({.place = 2, .edits = {3, 3, 7}})}) {
        exchange(own, other, {kNewest});
        ASSERT_NO_FATAL_FAILURE(expectRefusalThatNames(kNewest));
        // `last` tells the same.
        exchange(own, other, {kNewest, "last"});
        ASSERT_NO_FATAL_FAILURE(expectRefusalThatNames(kNewest));
    }
}

TEST_F(JournalExchange, OfAnEarlierLogIsRefused) {
    const LeftJournal own = journalOf({}), alike = journalOf({.place = 2});
    const LeftJournal longer = journalOf({.place = 2, .edits = {5, 5, 3}});
    ASSERT_EQ(own.files.at(kMiddle).size(), alike.files.at(kMiddle).size());
    for (const LeftJournal& other : {alike, longer})
        for (const std::vector<std::string>& names : {std::vector<std::string>{kFirst}, {kMiddle}, {kFirst, kMiddle}}) {
            exchange(own, other, names);
            ASSERT_NO_FATAL_FAILURE(expectRefusalThatNames(names.back()));
        }
}

TEST_F(JournalExchange, OfTheSnapshotIsRefused) {
    const LeftJournal own = journalOf({.snapshot = true}), alike = journalOf({.place = 2, .snapshot = true});
    ASSERT_TRUE(own.files.contains(kSnapshot) && !own.files.contains(kFirst));
    ASSERT_EQ(own.files.at(kSnapshot).size(), alike.files.at(kSnapshot).size());
    for (const LeftJournal& other : {alike, journalOf({.place = 2, .edits = {9, 3, 3}, .snapshot = true})})
        for (const char* name : {kSnapshot, kMiddle}) {
            exchange(own, other, {name});
            ASSERT_NO_FATAL_FAILURE(expectRefusalThatNames(name));
        }
    // One that is made of the logs of the same journal fits, whoever made it.
    exchange(journalOf({}), journalOf({}), {});
    ASSERT_NO_FATAL_FAILURE(test::makeSnapshot(wall));
    EXPECT_TRUE(*Start(wall).state == journalOf({}).granted);
}

TEST_F(JournalExchange, OfLastIsRefusedUntilAPersonSaysToGoOn) {
    const LeftJournal own = journalOf({});
    for (const LeftJournal& other :
         {journalOf({.place = 2}), journalOf({.place = 2, .edits = {3, 3, 1}}), journalOf({.edits = {3, 3, 9}})}) {
        exchange(own, other, {"last"});
        ASSERT_NO_FATAL_FAILURE(expectRefusalThatNames("last"));
        test::goOnWith(wall, 3);
        const Start start(wall);
        ASSERT_TRUE(start.state) << start.refusal->message;
        EXPECT_TRUE(*start.state == own.granted);
        EXPECT_TRUE(Start(wall).state);
    }
}

/// It names the log before the newest one, as a kill leaves it while a log is begun: then nothing is in that log.
TEST_F(JournalExchange, OfLastByAnEarlierOneIsRefused) {
    const LeftJournal earlier = journalOf({.edits = {3, 3}});
    test::ModelDisk::write(earlier.files, wall);
    ASSERT_TRUE(Start(wall).state);
    files = test::bytesIn(wall);
    files["last"] = earlier.files.at("last");
    test::ModelDisk::write(files, wall);
    const Start nothingGranted(wall);
    ASSERT_TRUE(nothingGranted.state) << nothingGranted.refusal->message;
    EXPECT_TRUE(*nothingGranted.state == earlier.granted);
    {
        BlobStore arrays;
        test::ReadableLog words;
        test::ModelDisk::write(earlier.files, wall);
        const Expected<Journal::Opened> opened = test::openJournal(wall, arrays, words.log);
        ASSERT_TRUE(opened) << opened.error().message;
        const Wall screens;
        ViewSource view(screens, "");
        view.keepBookmark(0, View());
        ASSERT_TRUE(opened->journal->viewIs(view));
    }
    files = test::bytesIn(wall);
    files["last"] = earlier.files.at("last");
    test::ModelDisk::write(files, wall);
    const Start granted(wall);
    ASSERT_TRUE(granted.refusal);
    EXPECT_NE(granted.refusal->message.find(wall + "/last"), std::string::npos) << granted.refusal->message;
    EXPECT_EQ(test::bytesIn(wall), files);
}

}  // namespace
}  // namespace tessera
