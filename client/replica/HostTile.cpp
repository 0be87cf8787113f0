#include "client/replica/HostTile.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "client/testpicture/TestPicture.h"
#include "common/image/Shrink.h"

namespace tessera {

bool HostTile::takeOver(HostTile& before) {
    if (before.tile_.name != tile_.name || before.tile_.rect.width != tile_.rect.width ||
        before.tile_.rect.height != tile_.rect.height)
        return false;
    shown_ = before.shown_;
    shownFrame_ = before.shownFrame_;
    seen_ = std::move(before.seen_);
    file_ = std::move(before.file_);
    return true;
}

TileStats HostTile::drawNothing() {
    still_ = true;
    return {.tile = tile_.name};
}

Expected<TileStats> HostTile::drawScene(const TileSources& from, const ScreenCamera& camera, FrameNumber frame) {
    if (std::exchange(test_, nullptr)) painter_.forget();  // what it has drawn is no longer where it was drawn to
    if (auto ready = openFile(); !ready) return tl::unexpected(ready.error());
    PartCounts parts;
    Duration readBack{};
    const auto heldUp = [&from] {
        std::vector<ObjectId> programs;
        for (const HeldUpBy& held : from.renderer.heldUpBy(from.aspect)) programs.push_back(held.program);
        return programs;
    };
    auto painted = painter_.paint(from.scene, from.renderer, camera, from.queue, [&](const DrawList& list) {
        light_.reset();
        const auto whole = [&] {
            auto picture = drawWhole(from, list, camera, readBack);
            if (list.environment.metered) light_ = from.renderer.lastLight(elsewhere_);
            return picture;
        };
        if (!from.sharing) return whole();
        const std::vector<ObjectId> before = heldUp();
        auto picture = from.sharing->draw(from.renderer, from.aspect, list, camera, tile_, whole, parts);
        if (list.environment.metered && parts.parts > 0) light_ = parts.light;
        if (heldUp() == before) return picture;
        // Parts of before, and of neighbours, have the program that it is drawn without from here on: so have those
        // that would be drawn for them.
        from.sharing->forget();
        return whole();
    });
    if (!painted) return tl::unexpected(painted.error());
    painted_ = std::move(*painted);
    still_ = painted_.again && painted_.cull == Duration::zero();
    drawn_ = painted_.picture;
    const TimePoint painting = from.queue.now();
    handOver(frame, painted_.again);
    return TileStats{.tile = tile_.name,
                     .cullMs = toMilliseconds(painted_.cull),
                     .drawMs = toMilliseconds(painted_.draw),
                     .inFrustum = painted_.counts.inFrustum,
                     .drawn = painted_.counts.drawn,
                     .trianglesDrawn = painted_.counts.trianglesDrawn,
                     .queries = painted_.counts.queries,
                     .waits = painted_.counts.waits,
                     .depthTriangles = painted_.counts.depthTriangles,
                     .handOverMs = toMilliseconds(readBack + (file_ ? from.queue.now() - painting : Duration::zero())),
                     .cullQueuedMs = toMilliseconds(painted_.cullQueued),
                     .drawQueuedMs = toMilliseconds(painted_.drawQueued),
                     .parts = parts.parts,
                     .partsHelped = parts.helped,
                     .partsTwice = parts.twice};
}

Expected<TileStats> HostTile::drawTestPicture(const Wall& wall, Showing showing, FrameNumber frame,
                                              const ProcessorQueue& queue) {
    if (auto ready = openFile(); !ready) return tl::unexpected(ready.error());
    const bool counts = showing == Showing::kCountedTestPicture;
    const bool again = test_ && !counts && !testCounts_;
    const TimePoint begin = queue.now();
    if (!again)
        test_ = std::make_shared<const Picture>(
            testPicture(wall, tile_, {.frame = counts ? std::optional(frame.value) : std::nullopt}));
    testCounts_ = counts;
    still_ = again;
    light_.reset();
    drawn_ = test_;
    const TimePoint drawn = queue.now();
    handOver(frame, again);
    return TileStats{
        .tile = tile_.name, .drawMs = toMilliseconds(drawn - begin), .handOverMs = toMilliseconds(queue.now() - drawn)};
}

void HostTile::drawAgain(FrameNumber frame) {
    if (!drawn_) drawn_ = shown_;
    handOver(frame, true);
}

void HostTile::handOver(FrameNumber frame, bool again) {
    ++frames_;
    again_ += again ? 1 : 0;
    drawnFrame_ = frame;
    if (!file_) return;
    if (again)
        file_->prepareAgain(frame.value);
    else if (liesInFile(*drawn_))
        file_->prepared(frame.value);
    else
        file_->prepare(frame.value, *drawn_);
    ready_ = file_->ready();
}

/// Where the tile's pictures will be shown, before the first of them is drawn.
Expected<void> HostTile::openFile() {
    if (file_ || folder_.empty()) return {};
    auto file = SharedFrameWriter::create(folder_ + "/shown.frame", tile_.rect.width, tile_.rect.height);
    if (!file) return tl::unexpected(file.error());
    file_ = std::move(*file);
    return {};
}

/// Straight to where it will be shown, where there is such a place: that picture has no pixels of its own.
Expected<Picture> HostTile::drawWhole(const TileSources& from, const DrawList& list, const ScreenCamera& camera,
                                      Duration& readBack) {
    const PixelRect& rect = tile_.rect;
    if (!file_) return from.renderer.draw(from.aspect, list, camera, rect);
    if (auto drawn = from.renderer.drawInto(from.aspect, list, camera, rect, file_->begin()); !drawn)
        return tl::unexpected(drawn.error());
    readBack = from.renderer.lastCounts().readBack;
    return Picture{.widthPx = rect.width, .heightPx = rect.height, .rgb = {}};
}

bool HostTile::show() {
    if (!drawn_) return false;
    shown_ = std::exchange(drawn_, nullptr);
    shownFrame_ = drawnFrame_;
    seen_ = std::exchange(ready_, std::nullopt);
    copied_ = nullptr;
    return true;
}

std::shared_ptr<const Picture> HostTile::shown() {
    if (!liesInFile(*shown_)) return shown_;
    if (!copied_) copied_ = std::make_shared<const Picture>(seen_->picture());
    return copied_;
}

std::optional<Picture> HostTile::preview(std::uint32_t by, bool newsAlone) {
    constexpr std::size_t kMostSizes = 8;
    if (previewed_.size() >= kMostSizes && !previewed_.contains(by)) previewed_.clear();
    if (newsAlone && previewed_[by].lock() == shown_) return std::nullopt;
    const int sides = static_cast<int>(std::min<std::uint32_t>(by, kMostShrink));
    return liesInFile(*shown_) ? seen_->shrunk(sides) : shrunk(*shown_, sides);
}

std::string HostTile::pngPath() const {
    return fmt::format("{}/{:06}.png", folder_, shownFrame_.value);
}

}  // namespace tessera
