/// A folder of a test's own, gone with the test.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace tessera::test {

class TestFolder {
public:
    TestFolder() {
        std::string pattern = testing::TempDir() + "tessera-test-XXXXXX";
        path_ = ::mkdtemp(pattern.data());
    }
    ~TestFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TestFolder(const TestFolder&) = delete;
    TestFolder& operator=(const TestFolder&) = delete;
    [[nodiscard]] const std::string& path() const { return path_; }
    [[nodiscard]] std::string operator/(const std::string& name) const { return path_ + "/" + name; }
    /// Writes a file into it and returns its path.
    std::string write(const std::string& name, const std::string& content) const {
        std::ofstream(*this / name) << content;
        return *this / name;
    }

private:
    std::string path_;
};

}  // namespace tessera::test
