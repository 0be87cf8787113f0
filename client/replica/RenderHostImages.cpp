/// Pictures of what a host shows, for those who ask for them.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "client/replica/RenderHost.h"
#include "common/image/Shrink.h"

namespace tessera {

/// What the tile shows, with its pixels.
std::shared_ptr<const Picture> RenderHost::shownBy(TileState& state) {
    if (!liesInFile(*state.shown)) return state.shown;
    if (!state.copied) state.copied = std::make_shared<const Picture>(state.seen->picture());
    return state.copied;
}

bool RenderHost::on(const work::SendImages& images) {
    constexpr std::size_t kMaxWaiting = 64;
    if (!surface_) {
        for (const auto& state : tiles_) sendNoImage({attempt_, images.request}, *state);
        return true;
    }
    const WaitingImages asked{attempt_, images.request};
    const bool here = !tiles_.empty() && std::all_of(tiles_.begin(), tiles_.end(), [&](const auto& state) {
        return state->shown && state->shownFrame >= images.request.frame;
    });
    if (here)
        sendImages(asked);
    else if (waitingImages_.size() < kMaxWaiting)
        waitingImages_.push_back(asked);
    else
        for (const auto& state : tiles_) sendNoImage(asked, *state);
    return true;
}

void RenderHost::sendNoImage(const WaitingImages& waiting, const TileState& state) {
    report_({waiting.attempt,
             outcome::Image{
                 {.request = waiting.request.request, .frame = waiting.request.frame, .tile = state.tile.name}}});
}

void RenderHost::sendImages(const WaitingImages& waiting) {
    for (const auto& state : tiles_) {
        if (!state->shown) continue;
        if (waiting.request.shrink > 0) {
            sendPreview(waiting, *state);
            continue;
        }
        message::TileImage image{
            .request = waiting.request.request, .frame = state->shownFrame, .tile = state->tile.name};
        const bool taken = writer_->encodePng(
            shownBy(*state), state->shownFrame.value,
            [report = report_, attempt = waiting.attempt, image = std::move(image)](SharedBytes png) mutable {
                image.picture = std::move(png);
                report({attempt, outcome::Image{std::move(image)}});
            });
        if (taken) continue;
        log_.warning(fmt::format("frame {}: no picture of tile {} is sent: {} others are still being encoded",
                                 state->shownFrame.value, state->tile.name, PictureWriter::kMostWaiting));
        sendNoImage(waiting, *state);
    }
}

/// Shrunk here, as the pixels may be drawn over; encoded by the writer. What was sent is not sent again.
void RenderHost::sendPreview(const WaitingImages& waiting, TileState& state) {
    constexpr int kQuality = 75;
    constexpr std::size_t kMostSizes = 8;
    const message::ImageRequest& request = waiting.request;
    message::TileImage image{.request = request.request, .frame = state.shownFrame, .tile = state.tile.name};
    if (state.previewed.size() >= kMostSizes && !state.previewed.contains(request.shrink)) state.previewed.clear();
    std::weak_ptr<const Picture>& sent = state.previewed[request.shrink];
    if (request.news && sent.lock() == state.shown) {
        image.same = true;
        return report_({waiting.attempt, outcome::Image{std::move(image)}});
    }
    const int by = static_cast<int>(std::min<std::uint32_t>(request.shrink, kMostShrink));
    Picture small = liesInFile(*state.shown) ? state.seen->shrunk(by) : shrunk(*state.shown, by);
    const bool taken = writer_->encodeJpeg(
        std::move(small), kQuality,
        [report = report_, attempt = waiting.attempt, image = std::move(image)](SharedBytes jpeg) mutable {
            image.picture = std::move(jpeg);
            report({attempt, outcome::Image{std::move(image)}});
        });
    if (!taken) return sendNoImage(waiting, state);
    sent = state.shown;
}

}  // namespace tessera
