// The file of who did what.
#include "server/sim/audit/AuditLog.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/unit/Eventually.h"
#include "tests/unit/TestFolder.h"

namespace tessera {
namespace {

class AuditFile : public testing::Test {
protected:
    std::unique_ptr<AuditLog> open(const AuditLimits& limits = {}) {
        auto opened = AuditLog::open(path(), log, limits);
        EXPECT_TRUE(opened) << opened.error().message;
        return opened ? std::move(*opened) : nullptr;
    }
    /// One line in a batch of its own.
    static std::vector<AuditLine> did(const std::string& what) { return {AuditLine{.at = {}, .who = {}, .did = what}}; }
    [[nodiscard]] std::string path(const std::string& ending = "") const { return folder / ("audit.log" + ending); }
    /// Of a whole file: what was done, in order; of a line that tells of lost ones "lost".
    [[nodiscard]] std::vector<std::string> deeds(const std::string& ending = "") const {
        std::vector<std::string> all;
        std::ifstream file(path(ending));
        for (std::string line; std::getline(file, line);) {
            const std::size_t at = line.find("\"did\":\"");
            all.push_back(at == std::string::npos ? line : line.substr(at + 7, line.find('"', at + 7) - at - 7));
        }
        return all;
    }

    /// What people are told.
    [[nodiscard]] std::string said() {
        log.flush();
        std::ifstream file(folder / "said");
        return {std::istreambuf_iterator<char>(file), {}};
    }

    test::TestFolder folder;
    std::FILE* out = std::fopen((folder / "said").c_str(), "w");
    Log log{"test", out};
};

TEST_F(AuditFile, GoesOnBehindWhatIsThere) {
    open()->write(did("first"));
    open()->write(did("second"));
    EXPECT_EQ(deeds(), (std::vector<std::string>{"first", "second"}));
    struct stat found {};
    ASSERT_EQ(::stat(path().c_str(), &found), 0);
    EXPECT_EQ(found.st_mode & 0777u, 0600u);
}

TEST_F(AuditFile, HalfALineOfAServerThatWasKilledStandsAlone) {
    std::ofstream(path()) << R"({"at":"20)";
    open()->write(did("next"));
    EXPECT_EQ(deeds(), (std::vector<std::string>{R"({"at":"20)", "next"}));
}

TEST_F(AuditFile, IsCutIntoAsManyFilesAsItMayBe) {
    const AuditLimits limits{.fileBytes = 2'000, .files = 3};
    {
        const auto file = open(limits);
        for (int i = 0; i < 200; ++i) file->write(did(std::to_string(i)));
    }
    std::vector<std::string> all;
    for (const char* ending : {".2", ".1", ""}) {
        EXPECT_LE(std::filesystem::file_size(path(ending)), limits.fileBytes);
        for (std::string& deed : deeds(ending)) all.push_back(std::move(deed));
    }
    EXPECT_FALSE(std::filesystem::exists(path(".3")));
    ASSERT_GT(all.size(), 20u);
    EXPECT_EQ(all.back(), "199");
    for (std::size_t i = 1; i < all.size(); ++i) EXPECT_EQ(std::stoi(all[i]), std::stoi(all[i - 1]) + 1);
}

TEST_F(AuditFile, WhatTheDiskDoesNotTakeIsCountedAndNoLineIsHalf) {
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
    const rlimit little{1'000, before.rlim_max};
    {
        const auto file = open();
        ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);
        for (int i = 0; i < 100; ++i) file->write(did(std::to_string(i)));
        while (said().find("does not take") == std::string::npos) std::this_thread::yield();
        ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
        file->write(did("100"));
    }
    EXPECT_WORDS(said());
    std::size_t lines = 0, lost = 0;
    for (const std::string& deed : deeds()) {
        const bool tells = deed.starts_with("{\"lost\":");
        if (tells) lost += std::stoul(deed.substr(8));
        if (!tells) EXPECT_EQ(deed, std::to_string(lines++ + lost));
    }
    EXPECT_GT(lost, 0u);
    EXPECT_EQ(lines + lost, 101u);
}

TEST_F(AuditFile, OneBatchIsCutToo) {
    const AuditLimits limits{.fileBytes = 100'000, .files = 4};
    std::vector<AuditLine> many;
    for (int i = 0; i < 2'000; ++i) many.push_back(did(std::to_string(i))[0]);
    open(limits)->write(many);
    EXPECT_EQ(deeds().back(), "1999");
    for (const char* ending : {".2", ".1", ""}) EXPECT_LE(std::filesystem::file_size(path(ending)), limits.fileBytes);
}

TEST_F(AuditFile, IsThisUsersAloneAndOneServers) {
    std::ofstream(path()) << R"({"at":"before"})" << '\n';
    ASSERT_EQ(::chmod(path().c_str(), 0644), 0);
    const auto first = open();
    struct stat found {};
    ASSERT_EQ(::stat(path().c_str(), &found), 0);
    EXPECT_EQ(found.st_mode & 0777u, 0600u);
    const auto second = AuditLog::open(path(), log);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::kRefused);
}

TEST_F(AuditFile, AFileThatIsMovedAwayIsFollowedByAFreshOne) {
    const auto file = open();
    file->write(did("first"));
    while (deeds().empty()) std::this_thread::yield();
    std::filesystem::rename(path(), path(".kept"));
    file->write(did("second"));
    while (deeds().empty()) std::this_thread::yield();
    EXPECT_EQ(deeds(), std::vector<std::string>{"second"});
    EXPECT_EQ(deeds(".kept"), std::vector<std::string>{"first"});
}

/// What is open then has no name any more: nobody would ever read it.
TEST_F(AuditFile, WhatARemovedFileWouldTakeIsLostWhereNoneCanBeMade) {
    const auto blocks = [&](const auto& block, const std::string& why) {
        const std::size_t before = said().size();
        const auto saidNow = [&] { return said().substr(before); };
        const auto says = [&](const std::string& words) {
            EXPECT_TRUE(test::eventually([&] { return saidNow().find(words) != std::string::npos; })) << saidNow();
        };
        std::filesystem::remove_all(path());
        const auto file = open();
        file->write(did("first"));
        while (deeds().empty()) std::this_thread::yield();
        std::filesystem::remove(path());
        block();
        file->write(did("second"));
        says("does not take who did what");
        says(why);
        file->write(did("third"));
        std::filesystem::remove_all(path());
        file->write(did("fourth"));
        while (deeds().empty() || deeds().back() != "fourth") std::this_thread::yield();
        const std::vector<std::string> there = deeds();
        ASSERT_TRUE(there[0].starts_with("{\"lost\":")) << there[0];
        EXPECT_EQ(std::stoul(there[0].substr(8)) + there.size() - 1, 3u);
        says("takes lines again");  // after the line has been written
        EXPECT_EQ(saidNow().find("does not take"), saidNow().rfind("does not take")) << "it is said once";
    };
    blocks([&] { std::filesystem::create_directory(path()); }, "irectory");
    blocks([&] { std::ofstream(path()) << "my letters\n"; }, "something else");
    blocks([&] { std::filesystem::create_symlink(folder / "letters", path()); }, "link");
}

/// A file that was moved still takes lines where no fresh one can be made; what stands in its place stays there.
TEST_F(AuditFile, WhatStandsInTheFilesPlaceIsNotMovedOn) {
    const AuditLimits limits{.fileBytes = 1'000, .files = 3};
    {
        const auto file = open(limits);
        file->write(did("first"));
        while (deeds().empty()) std::this_thread::yield();
        std::filesystem::rename(path(), path(".kept"));
        std::filesystem::create_directory(path());
        for (int i = 0; i < 100; ++i) file->write(did(std::to_string(i)));
    }
    EXPECT_TRUE(std::filesystem::is_directory(path()));
    EXPECT_FALSE(std::filesystem::exists(path(".1")));
    EXPECT_GT(deeds(".kept").size(), 1u);
    EXPECT_WORDS(said());
}

TEST_F(AuditFile, LinksAndFilesOfSomethingElseAreLeftAsTheyAre) {
    const std::string letters = folder / "letters";
    const auto refusal = [&](const std::string& what) {
        const auto opened = AuditLog::open(path(), log);
        EXPECT_FALSE(opened) << what;
        if (opened) return std::string();
        EXPECT_EQ(opened.error().code, ErrorCode::kRefused) << what;
        struct stat found {};
        EXPECT_EQ(::stat(path().c_str(), &found), 0);
        EXPECT_EQ(found.st_mode & 0777u, 0644u) << what;
        std::ifstream file(path());
        EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), what);
        return opened.error().message;
    };
    const auto holds = [](const std::string& file, const std::string& text) {
        std::ofstream(file) << text;
        ASSERT_EQ(::chmod(file.c_str(), 0644), 0);
    };
    holds(letters, "my letters\n");
    std::filesystem::create_symlink(letters, path());
    EXPECT_WORDS(refusal("my letters\n"));
    std::filesystem::remove(path());
    std::filesystem::create_hard_link(letters, path());
    EXPECT_WORDS(refusal("my letters\n"));
    std::filesystem::remove(path());
    for (const char* text : {"my letters\n", "\n", "{}\n", "{\"atom\":1}\n", "x", "[{\"at\":\"2026"}) {
        holds(path(), text);
        EXPECT_WORDS(refusal(text));
    }
    // What a server left that was killed, or had lost lines.
    for (const char* text : {"", "{", "{\"at", "{\"at\n{\"at\":\"2026\"}\n", "{\"lost\":2}\n", "{\"lo"}) {
        holds(path(), text);
        EXPECT_TRUE(AuditLog::open(path(), log)) << text;
    }
}

TEST_F(AuditFile, WhereNoOtherFileCanBeBegunTheOldOnesStay) {
    const AuditLimits limits{.fileBytes = 1'000, .files = 3};
    std::filesystem::create_directory(path(".new"));
    {
        const auto file = open(limits);
        for (int i = 0; i < 100; ++i) file->write(did(std::to_string(i)));
    }
    EXPECT_EQ(deeds().front(), "0");
    EXPECT_FALSE(std::filesystem::exists(path(".1")));
    EXPECT_WORDS(said());
}

TEST_F(AuditFile, SaysWhatIsNoFile) {
    const auto folderOpened = AuditLog::open(folder.path(), log);
    ASSERT_FALSE(folderOpened);
    EXPECT_WORDS(folderOpened.error().message);
    ASSERT_EQ(::mkfifo(path().c_str(), 0600), 0);
    EXPECT_FALSE(AuditLog::open(path(), log)) << "nobody waits for a reader";
    EXPECT_FALSE(AuditLog::open(folder / "none/audit.log", log));
}

}  // namespace
}  // namespace tessera
