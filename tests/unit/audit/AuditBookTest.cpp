// Who did what: from asking to a line.
#include "server/sim/audit/AuditBook.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>

namespace tessera {
namespace {

constexpr RequestInfo kLook{.number = 1, .name = "GetStatus", .help = ""};
constexpr RequestInfo kMove{.number = 2, .name = "MoveNode", .role = Role::kEditor, .help = ""};
constexpr RequestInfo kShow{.number = 3, .name = "ShowPicture", .role = Role::kOperator, .help = ""};
const ConnectionId kAda{1}, kBob{2};
const auto kNobodys = [](std::uint64_t) { return false; };

class Audit : public testing::Test {
protected:
    Audit() {
        book.came(kAda, {{Role::kEditor, Entrant::By::kKey, "ada"}, "blender", "10.0.0.7:4000"});
        book.came(kBob, {{Role::kOperator, Entrant::By::kPass, "ci"}, "script", "127.0.0.1:5000"});
    }
    void does(ConnectionId who, const RequestInfo& what, std::vector<std::string> objects = {}, bool done = true) {
        const std::uint64_t deed = book.asked(who, what);
        if (!objects.empty()) book.names(who, deed, std::move(objects));
        book.answered(who, deed, done);
    }
    std::vector<AuditLine> handedOver() {
        book.advance(TimePoint::max());
        return std::exchange(written, {});
    }

    std::vector<AuditLine> written;
    /// A millisecond later each time somebody looks.
    struct Ticking : TimeSource {
        [[nodiscard]] TimePoint now() const override { return clockNow(); }
        [[nodiscard]] DateTime date() const override { return clock += std::chrono::milliseconds(1); }
        mutable DateTime clock = std::chrono::sys_days(std::chrono::year(2026) / 11 / 26);
    } time;
    AuditBook book{[this](std::vector<AuditLine> lines) { std::ranges::move(lines, std::back_inserter(written)); },
                   time};
};

TEST_F(Audit, SaysWhoDidWhatToWhat) {
    does(kAda, kMove, {"/hall/crane"});
    const std::vector<AuditLine> lines = handedOver();
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_EQ(toJson(lines[0]),
              R"({"at":"2026-11-26T00:00:00.001Z","who":"ada","by":"a key","role":"editor","program":"blender",)"
              R"("from":"10.0.0.7:4000","did":"MoveNode","objects":["/hall/crane"]})");
}

TEST_F(Audit, ALineIsOfOneAddressAndManyFillNoFile) {
    const auto moves = [&](const std::string& from) { book.answered(kAda, book.asked(kAda, kMove, from), true); };
    for (int i = 0; i < 3; ++i)
        for (const char* from : {"10.0.0.1", "10.0.0.2", "10.0.0.3"}) moves(from);
    std::vector<AuditLine> lines = handedOver();
    ASSERT_EQ(lines.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(lines[i].from, "10.0.0." + std::to_string(i + 1));
        EXPECT_EQ(lines[i].times, 3u);
    }
    for (int i = 0; i < 1'000; ++i) moves("fd00::" + std::to_string(i));
    lines = handedOver();
    ASSERT_EQ(lines.size(), static_cast<std::size_t>(AuditBook::kMostPlaces) + 1);
    EXPECT_EQ(lines.back().from, "others");
    EXPECT_EQ(lines.back().times, 1'000u - AuditBook::kMostPlaces);
}

TEST_F(Audit, WhoLooksAndWhatIsRefusedIsNoDeed) {
    does(kAda, kLook);
    does(kAda, kMove, {"/a"}, false);
    EXPECT_TRUE(handedOver().empty());
    EXPECT_EQ(book.nextDeadline(), TimePoint::max()) << "nothing wakes a server that rests";
}

TEST_F(Audit, WhatARoleForbidsIsSaidOnceASecond) {
    for (int i = 0; i < 1'000; ++i) book.mayNot(kAda, kShow, "ShowPicture is for an operator");
    const std::vector<AuditLine> lines = handedOver();
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_EQ(lines[0].refused, "ShowPicture is for an operator");
    EXPECT_EQ(lines[0].times, 1'000u);
}

TEST_F(Audit, WhatOneDoesAlikeWithinASecondIsOneLine) {
    for (int i = 0; i < 600; ++i) {
        does(kAda, kMove, {"/n" + std::to_string(i % 40)});
        does(kBob, kMove, {"/m"});
    }
    does(kBob, kShow);
    const std::vector<AuditLine> lines = handedOver();
    ASSERT_EQ(lines.size(), 3u);
    EXPECT_EQ(lines[0].times, 600u);
    EXPECT_EQ(lines[0].objects.size(), AuditBook::kMostObjects);
    EXPECT_EQ(lines[0].objects[0], "/n0");
    EXPECT_EQ(lines[1].objects, std::vector<std::string>{"/m"});
    EXPECT_EQ(lines[2].did, "ShowPicture");
    EXPECT_TRUE(lines[0].at < lines[1].at && lines[1].at < lines[2].at);
}

TEST_F(Audit, NamesAreWantedUntilALineIsFull) {
    for (std::size_t i = 0; i < AuditBook::kMostObjects; ++i) {
        const std::uint64_t deed = book.asked(kAda, kMove);
        EXPECT_TRUE(book.wantsObjects(kAda, deed));
        book.names(kAda, deed, {std::to_string(i)});
        EXPECT_FALSE(book.wantsObjects(kAda, deed)) << "it has them";
        book.answered(kAda, deed, true);
    }
    EXPECT_FALSE(book.wantsObjects(kAda, book.asked(kAda, kMove)));
    EXPECT_TRUE(book.wantsObjects(kBob, book.asked(kBob, kMove)));
}

TEST_F(Audit, WhatIsUnderWayIsSaidOfWhoHasGone) {
    const std::uint64_t first = book.asked(kAda, kMove), second = book.asked(kAda, kMove);
    book.left(kAda, [&](std::uint64_t deed) { return deed == first; });
    book.answered(kAda, second, true);
    book.changes(kAda, first, 3);
    book.answered(kAda, first, true);
    book.left(kBob, kNobodys);
    const std::vector<AuditLine> lines = handedOver();
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_EQ(lines[0].who.name, "ada");
    EXPECT_EQ(lines[0].times, 1u);
    EXPECT_EQ(lines[0].changes, 3u);
}

/// Whoever is refused in a thousand ways, in words as long as they like, makes no more lines for it.
TEST_F(Audit, LinesAreFewAndShortWhateverIsSaid) {
    for (int i = 0; i < 1'000; ++i) {
        book.mayNot(kAda, kMove, std::string(4'000, 'a') + std::to_string(i));
        does(kAda, kShow, {std::string(4'000, 'b') + std::to_string(i)});
    }
    const std::vector<AuditLine> lines = handedOver();
    ASSERT_EQ(lines.size(), 2u);
    for (const AuditLine& line : lines) EXPECT_LE(toJson(line).size(), 6'000u);
    EXPECT_TRUE(lines[1].objects[15].ends_with("b15")) << "the end of a path says most";
}

TEST_F(Audit, WhoStandsBeforeTheWallHasNoName) {
    book.byHand({"/hall/lamp"}, 1);
    const std::vector<AuditLine> lines = handedOver();
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_EQ(lines[0].program, "the wall itself");
    EXPECT_EQ(lines[0].who.name, "");
}

TEST_F(Audit, NothingOfWhatIsSaidLeavesItsLine) {
    does(kAda, kMove, {"/a\n{\"who\":\"bob\"}", std::string("\xff\x00\x1b[2J", 6)});
    const std::string text = toJson(handedOver().at(0));
    EXPECT_EQ(text.find('\n'), std::string::npos);
    EXPECT_EQ(text.find('\x1b'), std::string::npos);
    EXPECT_NE(text.find(R"("/a\n{\"who\":\"bob\"}")"), std::string::npos) << text;
}

/// To whoever reads the file in a terminal a name would look like another one, or be a command.
TEST_F(Audit, CharactersThatChangeHowALineLooksAreWrittenAsNumbers) {
    does(kAda, kMove,
         {"Bö \u202Eabc\u2066\u2069",
          "\x7F\xC2\x9B"
          "31m",
          "\u2028\u2029\u200B\u200F\uFEFF", "日本 😀 \u00A0"});
    const std::string text = toJson(handedOver().at(0));
    for (const char* part : {R"("Bö \u202eabc\u2066\u2069")", R"("\u007f\u009b31m")",
                             R"("\u2028\u2029\u200b\u200f\ufeff")", "\"日本 😀 \u00A0\""})
        EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
}

}  // namespace
}  // namespace tessera
