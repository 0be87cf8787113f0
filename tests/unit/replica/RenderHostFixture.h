/// A render host without a network: work in, outcomes and files out.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <future>
#include <optional>
#include <set>

#include "client/draw/surface/Surface.h"
#include "client/replica/RenderHost.h"
#include "common/base/Channel.h"
#include "common/codec/ChangeCodec.h"
#include "common/codec/WallCodec.h"
#include "common/image/SharedFrame.h"
#include "tests/golden/TestScene.h"
#include "tests/support/surface/PooledSurface.h"
#include "tests/unit/HistoryLiterals.h"
#include "tests/unit/TestFolder.h"

namespace tessera {

inline Wall oneTileEach(int tileWidthPx = 64) {
    Wall wall;
    wall.name = "test";
    Screen screen;
    screen.name = "front";
    screen.lowerLeft = {-1.6, 0.6, 0};
    screen.lowerRight = {1.6, 0.6, 0};
    screen.upperLeft = {-1.6, 2.4, 0};
    screen.grid = {.columns = 2, .rows = 1, .tileWidthPx = tileWidthPx, .tileHeightPx = 48};
    wall.screens = {screen};
    wall.users = {User{.name = "viewer"}};
    for (int column = 0; column < 2; ++column)
        wall.hosts.push_back({.name = column ? "right" : "left",
                              .tiles = {{.screen = "front", .column = column, .row = 0, .user = "viewer"}}});
    wall.samples = 1;
    return wall;
}

class RenderHostTest : public testing::Test {
protected:
    void start(RenderHostOptions options = {}) {
        options.name = "left";
        host_.reset();
        surface_ = test::pooledSurface();
        host_ = std::make_unique<RenderHost>(options, surface_.get(), store_, log_, [this](Outcome outcome) {
            if (onOutcome_) onOutcome_(outcome);
            outcomes_.push(std::move(outcome));
        });
        ASSERT_TRUE(host_->probe());
        configure(oneTileEach());
    }
    void configure(const Wall& wall) { EXPECT_TRUE(perform(work::Configure{.configuration = encodeWall(wall)})); }
    bool perform(decltype(Work::what) what) { return host_->perform({Attempt{1}, std::move(what)}); }
    /// As the session thread does it: at once where that goes.
    bool performOrAgain(decltype(Work::what) what) {
        const Work work{Attempt{1}, std::move(what)};
        auto outcome = host_->again(work);
        if (!outcome) return host_->perform(work);
        return std::holds_alternative<outcome::Noted>(outcome->what) || outcomes_.push(std::move(*outcome));
    }
    /// The next outcome, which must be a T.
    template <typename T>
    std::optional<T> next() {
        auto outcome = outcomes_.popFor(std::chrono::seconds(20));
        if (outcome && std::holds_alternative<T>(outcome->what)) return std::get<T>(outcome->what);
        ADD_FAILURE() << "another outcome, or none";
        return std::nullopt;
    }
    /// A scene with a ball in front of the wall, as the server would send it.
    message::Snapshot snapshotOf(Aspect& scene) {
        const ChangeList list = snapshot(scene);
        for (const Blob& blob : blobsOf(list)) kept_.push_back(store_.add(blob));
        return {share(CommittedList{7_seq, scene.stateHash(), encodeChangeList(list), {}})};
    }
    Aspect makeBall() {
        test::TestScene scene;
        scene.place(scene.add(makeSphere(0.8, 24)), {-0.6, 1.5, -1});
        return scene.take();
    }
    bool applied(Aspect& scene) { return perform(work::ApplySnapshot{snapshotOf(scene)}) && next<outcome::Applied>(); }
    /// Some of it before the wall and some behind it.
    static Aspect makeMuchToUpload(int balls = 30) {
        test::TestScene made;
        for (int i = 0; i < balls; ++i)
            made.place(made.add(makeSphere(0.5 + 0.01 * i, 90)), {-0.6, 1.5, i % 2 ? -3.0 : 6.0});
        return made.take();
    }
    /// Whether what can be done ahead of need comes to an end, at that time.
    bool endsAhead(TimePoint now) {
        for (int i = 0; i < 1000; ++i)
            if (!host_->workAhead(now)) return true;
        return false;
    }
    message::Begin beginOf(FrameNumber frame, ByteSlice list = {}, const View& view = {}) {
        return {.frame = frame,
                .payload = encodeFrame({.view = view}),
                .list = share(CommittedList{7_seq, {}, std::move(list), {}})};
    }
    /// By then whatever was shown is shown everywhere.
    static TimePoint afterFlips() { return clockNow() + std::chrono::seconds(1); }
    /// Draws and shows a frame in which `list` changes the scene: what the tile took.
    TileStats frame(FrameNumber number, const ChangeList& list = {}, const View& view = {}) {
        for (const Blob& blob : blobsOf(list)) kept_.push_back(store_.add(blob));
        EXPECT_TRUE(performOrAgain(
            work::Draw{beginOf(number, list.empty() ? ByteSlice() : ByteSlice(share(encodeChangeList(list))), view)}));
        const auto drawn = next<outcome::Drawn>();
        if (drawn) show(*drawn);
        EXPECT_TRUE(performOrAgain(work::Shown{number}));
        if (!drawn || !decodeStats(drawn->stats)) return {};
        return decodeStats(drawn->stats)->tiles.front();
    }
    void drawAndShow(FrameNumber frame) {
        ASSERT_TRUE(perform(work::Draw{beginOf(frame)}));
        const auto drawn = next<outcome::Drawn>();
        ASSERT_TRUE(drawn);
        show(*drawn);
        ASSERT_TRUE(perform(work::Shown{frame}));
    }
    /// As the session thread does it.
    static void show(const outcome::Drawn& drawn) { ASSERT_TRUE(ReadyFrame::show(drawn.pictures)); }

    test::TestFolder folder_;
    Log log_{"test"};
    BlobStore store_;
    std::vector<Blob> kept_;
    Channel<Outcome> outcomes_{256};
    std::function<void(const Outcome&)> onOutcome_;  ///< on the thread that tells it
    std::unique_ptr<Surface> surface_;
    std::unique_ptr<RenderHost> host_;
};

}  // namespace tessera
