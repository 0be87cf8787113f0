/// A folder with programs that play server and client, as shell scripts, and a console that can be read.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "deploy/wall/Console.h"
#include "deploy/wall/Signals.h"

namespace tessera::test {

namespace fs = std::filesystem;

class Stage : public testing::Test {
protected:
    Stage() {
        std::string pattern = testing::TempDir() + "tessera-test-XXXXXX";
        folder_ = ::mkdtemp(pattern.data());
        said_ = std::fopen((folder_ / "said").c_str(), "w");
        console_.emplace(said_, said_, Console::Manner{.verbose = true});
    }
    ~Stage() override {
        std::fclose(said_);
        fs::remove_all(folder_);
    }

    /// An executable script. `$S` is the stage's folder; `await FILE` waits until a file is there, ten seconds at most.
    std::string program(const std::string& name, const std::string& script) {
        const fs::path path = folder_ / name;
        std::ofstream(path)
            << "#!/bin/bash\nS=" << folder_.string()
            << "\nawait() { for _ in $(seq 500); do [ -e \"$1\" ] && return 0; sleep 0.02; done; return 1; }\n"
            << script << "\n";
        fs::permissions(path, fs::perms::owner_all);
        return path.string();
    }
    [[nodiscard]] std::string read(const fs::path& path) const {
        std::ifstream in(path);
        return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    }
    [[nodiscard]] std::string said() const { return read(folder_ / "said"); }
    [[nodiscard]] bool has(const std::string& file) const { return fs::exists(folder_ / file); }
    [[nodiscard]] Console& console() { return *console_; }

    fs::path folder_;

private:
    std::FILE* said_ = nullptr;
    std::optional<Console> console_;
};

#define EXPECT_SAID(part) EXPECT_NE(said().find(part), std::string::npos) << said()

}  // namespace tessera::test
