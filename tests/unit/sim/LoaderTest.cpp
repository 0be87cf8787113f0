/// Several files at once: who waits for whom.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <set>
#include <string>

#include "common/base/Channel.h"
#include "server/sim/desk/Loader.h"
#include "tests/unit/Sanitized.h"
#include "tests/unit/sim/GatedImporter.h"

namespace tessera {
namespace {

class Loads : public testing::Test {
protected:
    [[nodiscard]] bool order(Loader& loader, std::uint64_t ticket, const std::string& name) const {
        return loader.order(
            {.ticket = ticket, .node = kRootNode, .path = importer.scratch.write(name, test::GatedImporter::kBox)});
    }
    [[nodiscard]] std::shared_ptr<SceneFiles> files() const {
        return std::make_shared<SceneFiles>(importer.options, std::vector{importer.scratch.path("")});
    }
    [[nodiscard]] std::function<void(Preparation)> deliver() {
        return [this](Preparation done) { finished.push(std::move(done)); };
    }

    test::GatedImporter importer;
    Channel<Preparation> finished{64};
};

TEST_F(Loads, AFileThatTakesLongHoldsUpNoOther) {
    // The slow ones have 60 s, and a sanitized importer takes some of them itself.
    const std::uint64_t last = kSanitized ? 13 : 20;
    Loader loader(importer.options, files(), deliver());
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
    importer.letGo(Loader::kAtOnce - 1);
    std::set<std::uint64_t> tickets;
    for (std::uint64_t slow = 1; slow < Loader::kAtOnce; ++slow) {
        const Preparation done = *finished.pop();
        EXPECT_FALSE(done.refused) << done.refused->message;
        tickets.insert(done.ticket);
    }
    EXPECT_EQ(tickets.size(), Loader::kAtOnce - 1) << "each once";
}

TEST_F(Loads, BeginInTheOrderOfAskingAndNeverMoreAtOnceThanMayBe) {
    Loader loader(importer.options, files(), deliver());
    std::vector<std::string> asked;
    for (std::uint64_t i = 0; i < 3 * Loader::kAtOnce; ++i) {
        asked.push_back("slow" + std::to_string(i) + ".tsct");
        ASSERT_TRUE(order(loader, i, asked.back()));
    }
    for (std::size_t done = 0; done < asked.size(); ++done) {
        importer.letGo(1);
        const Preparation finishedOne = *finished.pop();
        EXPECT_FALSE(finishedOne.refused) << finishedOne.refused->message;
        const std::vector<std::string> names = importer.begun();
        // What one that is done leaves free may be taken already.
        EXPECT_LE(names.size(), done + 1 + Loader::kAtOnce);
        for (const std::string& name : names) {
            const auto place = static_cast<std::size_t>(std::ranges::find(asked, name) - asked.begin());
            EXPECT_LT(place, done + 1 + Loader::kAtOnce)
                << name << " was begun before others that had been asked for earlier";
        }
    }
    EXPECT_EQ(importer.begun().size(), asked.size());
}

TEST_F(Loads, AreCancelledWhereverTheyAre) {
    Loader loader(importer.options, files(), deliver());
    const Error why{ErrorCode::kFailed, "cancelled by ada"};
    for (std::uint64_t slow = 1; slow <= Loader::kAtOnce; ++slow)
        ASSERT_TRUE(order(loader, slow, "slow" + std::to_string(slow) + ".tsct"));
    ASSERT_TRUE(order(loader, 10, "waits.tsct"));
    importer.awaitBegun(Loader::kAtOnce);
    ASSERT_EQ(loader.underWay().size(), Loader::kAtOnce + 1);
    EXPECT_EQ(loader.underWay().back().ticket, 10u);
    EXPECT_EQ(loader.underWay().back().watch->progress().stage, ImportWatch::Stage::kWaiting);
    EXPECT_EQ(loader.underWay().front().watch->progress().stage, ImportWatch::Stage::kReading);
    EXPECT_FALSE(loader.cancel(11, why)) << "nobody has ordered it";

    // Nobody opens the gate: only who is cancelled ends.
    EXPECT_TRUE(loader.cancel(10, why));
    EXPECT_TRUE(loader.cancel(2, why));
    std::set<std::uint64_t> tickets;
    for (int i = 0; i < 2; ++i) {
        const Preparation done = *finished.pop();
        ASSERT_TRUE(done.refused);
        EXPECT_TRUE(done.refused->message.ends_with(": " + why.message)) << done.refused->message;
        tickets.insert(done.ticket);
    }
    EXPECT_EQ(tickets, (std::set<std::uint64_t>{2, 10}));
    EXPECT_EQ(loader.underWay().size(), Loader::kAtOnce - 1);
    EXPECT_FALSE(loader.cancel(2, why)) << "it is over";
    EXPECT_EQ(importer.begun().size(), Loader::kAtOnce) << "nobody reads what is not wanted any more";
}

TEST_F(Loads, TellTenNotesAndHowManyMoreThereAre) {
    std::string scene = test::GatedImporter::kBox;
    for (int i = 0; i < 25; ++i)
        scene += fmt::format(
            "image {{ name: \"i{0}\" uri: \"missing-{0}.png\" }}\n"
            "material {{ name: \"m{0}\" base_color_image: \"i{0}\" }}\n",
            i);
    Loader loader(importer.options, files(), deliver());
    ASSERT_TRUE(loader.order({.ticket = 1, .node = kRootNode, .path = importer.scratch.write("many.tsct", scene)}));
    const Preparation done = *finished.pop();
    ASSERT_FALSE(done.refused) << done.refused->message;
    ASSERT_EQ(done.notes.size(), 11u);
    EXPECT_EQ(done.notes.back(),
              fmt::format("15 more notes; tessera-check {} tells all", importer.scratch.path("many.tsct")));
}

TEST_F(Loads, AreNotWaitedForByAServerThatEnds) {
    {
        Loader loader(importer.options, files(), deliver());
        ASSERT_TRUE(order(loader, 1, "slow.tsct"));
        importer.awaitBegun(1);
    }
    const std::optional<Preparation> done = finished.tryPop();
    ASSERT_TRUE(done) << "with the deadline of an import, 60 s, this test would have run out of time";
    ASSERT_TRUE(done->refused);
    EXPECT_TRUE(done->refused->message.ends_with(": the server ends")) << done->refused->message;
}

}  // namespace
}  // namespace tessera
