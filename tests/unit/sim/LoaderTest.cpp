/// Several files at once: who waits for whom.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "common/base/Channel.h"
#include "server/sim/desk/Loader.h"
#include "tests/unit/Sanitized.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

constexpr const char* kLoadedBox = R"(node { name: "box" box { size { x: 1 y: 1 z: 1 } } })";

/// Its importer says which file it has begun with, then stands at those called slow until `letGo`.
class Loads : public testing::Test {
protected:
    Loads() {
        EXPECT_EQ(::mkfifo(scratch.path("gate").c_str(), 0600), 0);
        gate_ = ::open(scratch.path("gate").c_str(),
                       O_RDWR | O_CLOEXEC);  // held open for both ends: nobody's opening waits
        const std::string says = "echo \"$2\" >> '" + scratch.path("begun") + "'\n";
        const std::string waits = "case \"$2\" in *slow*) read -r line < '" + scratch.path("gate") + "';; esac\n";
        const std::string program = scratch.write(
            "importer", "#!/bin/sh\n" + says + waits + "exec '" + importOptions().importerProgram + "' \"$@\"\n");
        std::filesystem::permissions(program, std::filesystem::perms::owner_all);
        options_ = importOptions();
        options_.importerProgram = program;
    }
    ~Loads() override { ::close(gate_); }

    [[nodiscard]] bool order(Loader& loader, std::uint64_t ticket, const std::string& name) const {
        return loader.order({.ticket = ticket, .node = kRootNode, .path = scratch.write(name, kLoadedBox)});
    }
    void letGo(int files) const {
        for (int i = 0; i < files; ++i) EXPECT_EQ(::write(gate_, "\n", 1), 1);
    }
    [[nodiscard]] std::vector<std::string> begun() const {
        std::vector<std::string> names;
        std::ifstream in(scratch.path("begun"));
        for (std::string line; std::getline(in, line);) names.push_back(std::filesystem::path(line).filename());
        return names;
    }

    Scratch scratch;
    ImportOptions options_;
    Channel<Preparation> finished{64};

private:
    int gate_ = -1;
};

TEST_F(Loads, AFileThatTakesLongHoldsUpNoOther) {
    // The slow ones have 60 s, and a sanitized importer takes some of them itself.
    const std::uint64_t last = kSanitized ? 13 : 20;
    Loader loader(options_, std::make_shared<SceneFiles>(options_, std::vector{scratch.path("")}),
                  [this](Preparation done) { finished.push(std::move(done)); });
    for (std::uint64_t slow = 1; slow < Loader::kAtOnce; ++slow)
        ASSERT_TRUE(order(loader, slow, "slow" + std::to_string(slow) + ".tsct"));
    for (std::uint64_t quick = 10; quick < last; ++quick)
        ASSERT_TRUE(order(loader, quick, "quick" + std::to_string(quick) + ".tsct"));
    // None of the slow ones has been let go: without threads of their own this would wait for ever.
    for (std::uint64_t quick = 10; quick < last; ++quick) {
        const Preparation done = *finished.pop();
        EXPECT_FALSE(done.refused) << done.refused->message;
        EXPECT_EQ(done.ticket, quick) << "one thread is left: in the order of asking";
    }
    letGo(Loader::kAtOnce - 1);
    std::set<std::uint64_t> tickets;
    for (std::uint64_t slow = 1; slow < Loader::kAtOnce; ++slow) {
        const Preparation done = *finished.pop();
        EXPECT_FALSE(done.refused) << done.refused->message;
        tickets.insert(done.ticket);
    }
    EXPECT_EQ(tickets.size(), Loader::kAtOnce - 1) << "each once";
}

TEST_F(Loads, BeginInTheOrderOfAskingAndNeverMoreAtOnceThanMayBe) {
    Loader loader(options_, std::make_shared<SceneFiles>(options_, std::vector{scratch.path("")}),
                  [this](Preparation done) { finished.push(std::move(done)); });
    std::vector<std::string> asked;
    for (std::uint64_t i = 0; i < 3 * Loader::kAtOnce; ++i) {
        asked.push_back("slow" + std::to_string(i) + ".tsct");
        ASSERT_TRUE(order(loader, i, asked.back()));
    }
    for (std::size_t done = 0; done < asked.size(); ++done) {
        letGo(1);
        const Preparation finishedOne = *finished.pop();
        EXPECT_FALSE(finishedOne.refused) << finishedOne.refused->message;
        const std::vector<std::string> names = begun();
        // What one that is done leaves free may be taken already.
        EXPECT_LE(names.size(), done + 1 + Loader::kAtOnce);
        for (const std::string& name : names) {
            const auto place = static_cast<std::size_t>(std::ranges::find(asked, name) - asked.begin());
            EXPECT_LT(place, done + 1 + Loader::kAtOnce)
                << name << " was begun before others that had been asked for earlier";
        }
    }
    EXPECT_EQ(begun().size(), asked.size());
}

}  // namespace
}  // namespace tessera
