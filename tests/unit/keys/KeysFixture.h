/// tessera-keys in a folder of the test's own.
#pragma once

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "common/tls/KeyFolder.h"
#include "tests/unit/TestFolder.h"

#include "server/tools/keys/KeysCommand.h"

namespace tessera::test {

using Words = std::vector<std::string>;

struct Ran {
    int code = 0;
    std::string out, err;
};
inline Ran run(const Words& words) {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    Ran ran;
    ran.code = runKeys(words);
    ran.out = testing::internal::GetCapturedStdout();
    ran.err = testing::internal::GetCapturedStderr();
    return ran;
}

inline std::string textOf(const std::string& path) {
    std::ifstream file(path);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

inline std::set<std::string> filesIn(const std::string& folder) {
    std::set<std::string> names;
    for (const auto& each : std::filesystem::directory_iterator(folder)) names.insert(each.path().filename());
    return names;
}

inline unsigned modeOf(const std::string& path) {
    struct stat info {};
    EXPECT_EQ(::stat(path.c_str(), &info), 0) << path;
    return info.st_mode & 0777u;
}

inline bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

inline DateTime inDays(int days) {
    return std::chrono::system_clock::now() + std::chrono::days(days);
}

/// A folder of keys for the wall 'hall', as `init` makes it of such a wall.
class KeysCommand : public testing::Test {
protected:
    KeysCommand() {
        const Identity server{.wall = "hall", .kind = Identity::Kind::kServer, .name = {}};
        const Expected<KeyFolder::Writer> writer = KeyFolder::Writer::open(folder_);
        const Expected<Authority::Issued> made = authority_.issue(server, {"localhost"}, inDays(0));
        EXPECT_TRUE(writer && made);
        EXPECT_TRUE(writer->write({{.serial = made->certificate.serial, .holder = server, .until = inDays(397)}}));
        EXPECT_TRUE(writer->write("server.pem", made->pem));
        EXPECT_TRUE(writer->write("authority.crt", authority_.certificatePem()));
        EXPECT_TRUE(writer->write("authority.pem", authority_.pem()));
    }
    Ran keys(const Words& words) const {
        Words all{"--keys", keys_};
        all.insert(all.end(), words.begin(), words.end());
        return run(all);
    }
    /// What it says where it does what it is told.
    std::string said(const Words& words) const {
        const Ran ran = keys(words);
        EXPECT_EQ(ran.code, 0) << ran.err;
        EXPECT_EQ(ran.err, "");
        return ran.out;
    }
    /// Of a command that is refused, and changes nothing.
    std::string refusal(int code, const Words& words) const {
        const std::set<std::string> files = filesIn(keys_);
        const std::string issued = textOf(keys_ + "/issued");
        const Ran ran = keys(words);
        EXPECT_EQ(ran.code, code) << ran.err << ran.out;
        EXPECT_EQ(ran.out, "");
        EXPECT_EQ(ran.err.rfind("tessera-keys: ", 0), 0u) << ran.err;
        EXPECT_EQ(std::ranges::count(ran.err, '\n'), 1) << ran.err;
        EXPECT_EQ(filesIn(keys_), files);
        EXPECT_EQ(textOf(keys_ + "/issued"), issued);
        return ran.err;
    }
    std::vector<IssuedKey> issued() const {
        const Expected<std::vector<IssuedKey>> all = folder_.issued();
        EXPECT_TRUE(all) << all.error().message;
        return all.value_or(std::vector<IssuedKey>());
    }
    /// Issued long ago, as it were.
    void issueUntil(const Identity& holder, DateTime until, bool revoked = false) const {
        std::vector<IssuedKey> all = issued();
        const std::string serial = "40000000000000000000000000000" + std::to_string(100 + all.size());
        all.push_back({.serial = serial, .holder = holder, .until = until, .revoked = revoked});
        EXPECT_TRUE(KeyFolder::Writer::open(folder_)->write(all));
    }
    static Identity host(const std::string& name) {
        return {.wall = "hall", .kind = Identity::Kind::kHost, .name = name};
    }
    static Identity person(const std::string& name, Role role) {
        return {.wall = "hall", .kind = Identity::Kind::kPerson, .name = name, .role = role};
    }
    static Certificate certificateIn(const std::string& path) {
        const Expected<Certificate> read = Certificate::read(textOf(path));
        EXPECT_TRUE(read) << path;
        return read ? *read : Certificate();
    }
    /// The lines of `list`, without the first.
    std::vector<std::string> listed() const {
        std::istringstream text(said({"list"}));
        std::vector<std::string> lines;
        for (std::string line; std::getline(text, line);) lines.push_back(line);
        EXPECT_FALSE(lines.empty());
        lines.erase(lines.begin());
        return lines;
    }
    /// The state of the last key of a kind and name.
    std::string stateOf(const std::string& start) const {
        std::string state;
        for (const std::string& line : listed())
            if (line.rfind(start, 0) == 0) state = line.substr(line.find("UTC") + 5);
        return state;
    }

    test::TestFolder around_;
    std::string keys_ = around_ / "keys";
    KeyFolder folder_{keys_};
    Authority authority_ = Authority::make("hall", inDays(0));
};

}  // namespace tessera::test
