/// Files that are looked at again and again.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>

#include "common/base/Channel.h"
#include "server/sim/reload/FileWatch.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

class Watched : public testing::Test {
protected:
    using Told = std::pair<std::uint64_t, FileWatch::News>;

    void watch(std::uint64_t group, std::vector<std::string> files) {
        std::vector<FileStamp> stamps = stampsOf(files);
        watch_.watch(group, {.paths = std::move(files), .stamps = std::move(stamps), .called = {}});
    }
    [[nodiscard]] Told next() { return *told_.pop(); }

    Scratch scratch;
    Channel<Told> told_{64};
    FileWatch watch_{[this](std::uint64_t group, FileWatch::News news) { told_.push({group, news}); }};
};

TEST_F(Watched, OneThatIsWrittenReplacedOrNamedIsToldOnce) {
    const std::string file = scratch.write("a", "one"), beside = scratch.write("b", "two");
    watch(5, {file, beside});
    std::ofstream(file) << "longer";
    EXPECT_EQ(next(), Told(5, FileWatch::News::kChanged));
    std::ofstream(scratch.path("new")) << "longer";
    std::filesystem::rename(scratch.path("new"), file);  // as long, and another one
    EXPECT_EQ(next(), Told(5, FileWatch::News::kChanged));
    std::ofstream(beside) << "three";
    EXPECT_EQ(next(), Told(5, FileWatch::News::kChanged));
    std::ofstream(beside) << "seven";  // and nothing else was said in between
    EXPECT_EQ(next(), Told(5, FileWatch::News::kChanged));
}

TEST_F(Watched, OneThatIsGoneIsToldWhenItIsBack) {
    const std::string file = scratch.write("a", "one");
    watch(5, {file});
    std::filesystem::remove(file);
    EXPECT_EQ(next(), Told(5, FileWatch::News::kGone));
    std::ofstream(file) << "one";
    EXPECT_EQ(next(), Told(5, FileWatch::News::kChanged));
}

TEST_F(Watched, WhatHasChangedBeforeItWasWatchedIsAChange) {
    const std::string file = scratch.write("a", "one");
    const std::vector<FileStamp> read = stampsOf({file});
    std::ofstream(file) << "more than that";
    watch_.watch(7, {.paths = {file}, .stamps = read, .called = {}});
    EXPECT_EQ(next(), Told(7, FileWatch::News::kChanged));
}

TEST_F(Watched, ALinkThatLeadsElsewhereIsAChange) {
    const std::string one = scratch.write("one", "same"), two = scratch.write("two", "same"),
                      link = scratch.path("link");
    std::filesystem::create_symlink(one, link);
    watch(9, {link});
    std::filesystem::create_symlink(two, scratch.path("other"));
    std::filesystem::rename(scratch.path("other"), link);
    EXPECT_EQ(next(), Told(9, FileWatch::News::kChanged));
}

TEST_F(Watched, OneThatIsWrittenWithoutAPauseIsToldOnceItRests) {
    const std::string file = scratch.write("a", "0");
    watch(5, {file});
    const TimePoint begin = clockNow();
    bool paused = false;  // a busy machine may stop this thread for longer
    for (TimePoint last = begin; last < begin + 3 * FileWatch::kQuiet;) {
        std::ofstream(file, std::ios::app) << "more";
        const TimePoint now = clockNow();
        paused = paused || now - std::exchange(last, now) > FileWatch::kQuiet / 2;
        if (!paused) {
            EXPECT_FALSE(told_.tryPop()) << "while it is written";
        }
    }
    EXPECT_EQ(next(), Told(5, FileWatch::News::kChanged));
}

TEST_F(Watched, OneThatNeverRestsIsToldStill) {
    const std::string file = scratch.write("a", "0");
    watch(5, {file});
    std::optional<Told> told;
    for (const TimePoint begin = clockNow(); !told && clockNow() < begin + 5 * FileWatch::kLongest;) {
        std::ofstream(file, std::ios::app) << "more";
        told = told_.popFor(FileWatch::kQuiet / 10);
    }
    ASSERT_TRUE(told);
    EXPECT_EQ(*told, Told(5, FileWatch::News::kChanged));
}

TEST_F(Watched, WhatNobodyWantsIsNotTold) {
    const std::string file = scratch.write("a", "one"), other = scratch.write("b", "one");
    watch(5, {file});
    watch_.forget(5);
    watch(6, {other});
    std::ofstream(file) << "longer";
    std::ofstream(other) << "longer";
    EXPECT_EQ(next(), Told(6, FileWatch::News::kChanged));
}

}  // namespace
}  // namespace tessera
