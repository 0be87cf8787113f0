// The file of who did what.
#include "server/sim/audit/AuditLog.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>

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
    [[nodiscard]] std::string path(const std::string& ending = "") const {
        return folder / ("audit.log" + ending);
    }
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
    EXPECT_NE(said().find("takes lines again"), std::string::npos);
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
    std::ofstream(path()) << "before\n";
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

TEST_F(AuditFile, WhereNoOtherFileCanBeBegunTheOldOnesStay) {
    const AuditLimits limits{.fileBytes = 1'000, .files = 3};
    std::filesystem::create_directory(path(".new"));
    {
        const auto file = open(limits);
        for (int i = 0; i < 100; ++i) file->write(did(std::to_string(i)));
    }
    EXPECT_EQ(deeds().front(), "0");
    EXPECT_FALSE(std::filesystem::exists(path(".1")));
    EXPECT_NE(said().find("no other file can be begun"), std::string::npos);
}

TEST_F(AuditFile, SaysWhatIsNoFile) {
    const auto folderOpened = AuditLog::open(folder.path(), log);
    ASSERT_FALSE(folderOpened);
    EXPECT_NE(folderOpened.error().message.find("--audit"), std::string::npos);
    ASSERT_EQ(::mkfifo(path().c_str(), 0600), 0);
    EXPECT_FALSE(AuditLog::open(path(), log)) << "nobody waits for a reader";
    EXPECT_FALSE(AuditLog::open(folder / "none/audit.log", log));
}

}  // namespace
}  // namespace tessera
