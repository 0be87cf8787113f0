/// A server that ends while something is on its way that is too large for one frame.
#include "server/sim/frame/LoadParts.h"
#include "tests/unit/Eventually.h"
#include "tests/unit/journal/KeptShow.h"

namespace tessera {
namespace {

std::vector<Edit> one(Edit::Kind kind, ChangeList list = {}) {
    std::vector<Edit> edits(1);
    edits[0].kind = kind;
    edits[0].list = std::move(list);
    return edits;
}

ChangeList newNode(const std::string& name) {
    test::ListMaker make;
    make.node(name, kRootNode);
    return make.builder.take();
}

/// Servers of one journal, one after the other.
class Servers {
public:
    explicit Servers(JournalLimits limits = {}) : limits_(limits) {}

    /// Ends the last one, whatever is on its way, and starts another.
    void next() {
        opened_.reset();
        simulation.reset();
        arrays_ = std::make_unique<BlobStore>();
        Expected<Journal::Opened> opened = test::openJournal(folder_ / "wall", *arrays_, words_.log, limits_);
        ASSERT_TRUE(opened) << opened.error().message;
        opened_ = std::move(*opened);
        simulation = std::make_unique<Simulation>();
        test::goOn(*simulation, *opened_);
        number_ = opened_->state.nextFrame;
        if (limits_.compactBytes > 1 || !opened_->state.begun) return;
        // A snapshot, and the log that begins with it.
        ASSERT_TRUE(test::eventually([&] { return test::filesIn(folder_ / "wall").size() == 2; }))
            << "no snapshot was made";
    }
    FrameResult frame(std::vector<Edit> edits = {}) {
        FrameResult result = simulation->step(number_ == FrameNumber(0), std::move(edits));
        opened_->journal->frameDone(number_, result, simulation->display());
        number_ = number_.next();
        return result;
    }
    /// As many parts of a load of `nodes` nodes.
    void load(std::size_t nodes, std::size_t parts) {
        test::ListMaker make;
        for (std::size_t i = 0; i < nodes; ++i) make.node("n" + std::to_string(i), kRootNode);
        ChangeList whole = make.builder.take();
        const std::size_t objects = whole.creations.size();
        std::vector<ChangeList> cut = cutForFrames(std::move(whole), {.changes = 50, .seen = seen});
        ASSERT_GT(cut.size(), 5u);
        for (std::size_t i = 0; i < std::min(parts, cut.size()); ++i) {
            std::vector<Edit> edits =
                one(i + 1 < cut.size() ? Edit::Kind::kPart : Edit::Kind::kLastPart, std::move(cut[i]));
            edits[0].ticket = 7;
            edits[0].objects = objects;
            const FrameResult result = frame(std::move(edits));
            ASSERT_TRUE(result.outcomes.at(0).result) << result.outcomes[0].result.error().message;
        }
    }

    std::unique_ptr<Simulation> simulation;
    std::size_t seen = 8'192;  ///< more of a load in each frame

private:
    const test::TestFolder folder_;
    test::ReadableLog words_;
    JournalLimits limits_;
    std::unique_ptr<BlobStore> arrays_;
    std::optional<Journal::Opened> opened_;
    FrameNumber number_;
};

/// With logs that become snapshots at every start, and without.
std::vector<JournalLimits> bothWays() {
    JournalLimits always;
    always.compactBytes = 1;
    always.maxLogs = 1;
    return {JournalLimits(), always};
}

TEST(JournalParts, ALoadThatIsHalfThereIsTakenAway) {
    for (const JournalLimits& limits : bothWays()) {
        Servers servers(limits);
        servers.next();
        (void)servers.frame(one(Edit::Kind::kChange, newNode("before")));
        const test::Standing before = test::standingOf(*servers.simulation);
        servers.load(200, 4);
        const std::size_t hidden = servers.simulation->scene().objectCount();
        ASSERT_GT(hidden, 2u);
        servers.next();
        ASSERT_EQ(servers.simulation->scene().objectCount(), hidden) << "it is taken away where everybody sees it";
        EXPECT_TRUE(servers.simulation->stepUnderWay());
        const FrameResult made = servers.frame(one(Edit::Kind::kChange, newNode("after")));
        ASSERT_TRUE(made.outcomes.at(0).result) << made.outcomes[0].result.error().message;
        EXPECT_LT(servers.simulation->scene().objectCount(), hidden + 1);
        servers.next();  // and is killed meanwhile
        for (int i = 0; i < 10 && servers.simulation->stepUnderWay(); ++i) (void)servers.frame();
        ASSERT_FALSE(servers.simulation->stepUnderWay());
        const test::Standing after = test::standingOf(*servers.simulation);
        EXPECT_EQ(after.undo, before.undo + 1);
        EXPECT_EQ(after.redo, 0u);
        ASSERT_TRUE(servers.frame(one(Edit::Kind::kUndo)).outcomes[0].result);
        EXPECT_EQ(servers.simulation->scene().stateHash(), before.stateHash) << "as if nobody had loaded anything";
        servers.load(200, 1'000);
        EXPECT_EQ(servers.simulation->history().undoDepth(), before.undo + 1);
    }
}

TEST(JournalParts, ALoadThatIsHalfSeenIsHiddenAndTakenAway) {
    for (const JournalLimits& limits : bothWays()) {
        for (std::size_t parts = 1;; parts += 3) {
            Servers servers(limits);
            servers.seen = 20;
            servers.next();
            (void)servers.frame(one(Edit::Kind::kChange, newNode("before")));
            const test::Standing before = test::standingOf(*servers.simulation);
            servers.load(200, parts);
            if (!servers.simulation->history().arriving()) break;
            const bool appears = servers.simulation->appearing();
            servers.next();
            EXPECT_FALSE(servers.simulation->appearing());
            ASSERT_TRUE(servers.simulation->stepUnderWay());
            for (std::size_t seen = servers.simulation->scene().root().children.size();
                 servers.simulation->stepUnderWay();) {
                (void)servers.frame();
                const std::size_t now = servers.simulation->scene().root().children.size();
                ASSERT_LE(seen - now, servers.seen);
                seen = now;
                if (appears) servers.next();  // and is killed each time
            }
            EXPECT_EQ(test::standingOf(*servers.simulation), before) << parts;
        }
    }
}

TEST(JournalParts, ALargeStepThatIsHalfTakenBackOrDoneAgainGoesOn) {
    for (const JournalLimits& limits : bothWays()) {
        Servers servers(limits);
        servers.seen = limits.compactBytes > 1 ? 60 : 8'192;
        servers.next();
        (void)servers.frame(one(Edit::Kind::kChange, newNode("before")));
        const test::Standing before = test::standingOf(*servers.simulation);
        servers.load(200, 1'000);
        const test::Standing after = test::standingOf(*servers.simulation);
        for (const auto& [kind, reached] : {std::pair(Edit::Kind::kUndo, test::Standing(before)),
                                            std::pair(Edit::Kind::kRedo, test::Standing(after))}) {
            ASSERT_TRUE(servers.frame(one(kind)).outcomes.at(0).result);
            for (int server = 0; servers.simulation->stepUnderWay(); ++server) {
                ASSERT_LT(server, 100);
                const StateHash here = servers.simulation->scene().stateHash();
                servers.next();
                ASSERT_EQ(servers.simulation->scene().stateHash(), here);
                ASSERT_TRUE(servers.simulation->stepUnderWay());
                (void)servers.frame();
            }
            EXPECT_EQ(servers.simulation->scene().stateHash(), reached.stateHash);
            EXPECT_EQ(servers.simulation->history().undoDepth(), reached.undo);
        }
    }
}

/// An undo over several frames begins while parts come, and both are cut short.
TEST(JournalParts, AHalfLoadWaitsForTheStepThatIsUnderWay) {
    Servers servers;
    servers.next();
    (void)servers.frame(one(Edit::Kind::kChange, newNode("before")));
    const test::Standing before = test::standingOf(*servers.simulation);
    servers.load(200, 1'000);
    servers.load(200, 3);
    ASSERT_TRUE(servers.frame(one(Edit::Kind::kUndo)).outcomes.at(0).result);
    ASSERT_TRUE(servers.simulation->stepUnderWay());
    servers.next();
    for (int i = 0; i < 100 && servers.simulation->stepUnderWay(); ++i) (void)servers.frame();
    ASSERT_FALSE(servers.simulation->stepUnderWay());
    EXPECT_EQ(test::standingOf(*servers.simulation), (test::Standing{before.stateHash, before.undo, 1}));
}

}  // namespace
}  // namespace tessera
