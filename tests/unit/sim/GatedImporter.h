/// An importer that stands at files called slow until it is let go.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/unit/Eventually.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera::test {

/// It says which file it has begun with, then stands at those called slow until `letGo`.
class GatedImporter {
public:
    static constexpr const char* kBox = R"(node { name: "box" box { size { x: 1 y: 1 z: 1 } } })";

    GatedImporter() {
        EXPECT_EQ(::mkfifo(scratch.path("gate").c_str(), 0600), 0);
        gate_ = ::open(scratch.path("gate").c_str(),
                       O_RDWR | O_CLOEXEC);  // held open for both ends: nobody's opening waits
        const std::string says = "echo \"$2\" >> '" + scratch.path("begun") + "'\n";
        const std::string waits = "case \"$2\" in *slow*) read -r line < '" + scratch.path("gate") + "';; esac\n";
        const std::string program = scratch.write(
            "importer", "#!/bin/sh\n" + says + waits + "exec '" + importOptions().importerProgram + "' \"$@\"\n");
        std::filesystem::permissions(program, std::filesystem::perms::owner_all);
        options = importOptions();
        options.importerProgram = program;
    }
    GatedImporter(const GatedImporter&) = delete;
    GatedImporter& operator=(const GatedImporter&) = delete;
    ~GatedImporter() { ::close(gate_); }

    void letGo(int files) const {
        for (int i = 0; i < files; ++i) EXPECT_EQ(::write(gate_, "\n", 1), 1);
    }
    [[nodiscard]] std::vector<std::string> begun() const {
        std::vector<std::string> names;
        std::ifstream in(scratch.path("begun"));
        for (std::string line; std::getline(in, line);) names.push_back(std::filesystem::path(line).filename());
        return names;
    }
    /// Until it has begun with so many files.
    void awaitBegun(std::size_t files) const {
        EXPECT_TRUE(eventually([&] { return begun().size() >= files; }));
    }

    Scratch scratch;
    ImportOptions options;

private:
    int gate_ = -1;
};

}  // namespace tessera::test
