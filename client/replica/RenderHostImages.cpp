/// Pictures of what a host shows, for those who ask for them.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "client/replica/RenderHost.h"

namespace tessera {

bool RenderHost::on(const work::SendImages& images) {
    constexpr std::size_t kMaxWaiting = 64;
    if (!surface_) {
        for (const auto& tile : tiles_) sendNoImage({attempt_, images.request}, *tile);
        return true;
    }
    const WaitingImages asked{attempt_, images.request};
    const bool here = !tiles_.empty() && std::all_of(tiles_.begin(), tiles_.end(), [&](const auto& tile) {
        return tile->showsAny() && tile->shownFrame() >= images.request.frame;
    });
    if (here)
        sendImages(asked);
    else if (waitingImages_.size() < kMaxWaiting)
        waitingImages_.push_back(asked);
    else
        for (const auto& tile : tiles_) sendNoImage(asked, *tile);
    return true;
}

void RenderHost::sendNoImage(const WaitingImages& waiting, const HostTile& tile) {
    report_({waiting.attempt,
             outcome::Image{
                 {.request = waiting.request.request, .frame = waiting.request.frame, .tile = tile.tile().name}}});
}

void RenderHost::sendImages(const WaitingImages& waiting) {
    for (const auto& tile : tiles_) {
        if (!tile->showsAny()) continue;
        if (waiting.request.shrink > 0) {
            sendPreview(waiting, *tile);
            continue;
        }
        message::TileImage image{
            .request = waiting.request.request, .frame = tile->shownFrame(), .tile = tile->tile().name};
        const bool taken = writer_->encodePng(
            tile->shown(), tile->shownFrame().value,
            [report = report_, attempt = waiting.attempt, image = std::move(image)](SharedBytes png) mutable {
                image.picture = std::move(png);
                report({attempt, outcome::Image{std::move(image)}});
            });
        if (taken) continue;
        log_.warning(fmt::format("frame {}: no picture of tile {} is sent: {} others are still being encoded",
                                 tile->shownFrame().value, tile->tile().name, PictureWriter::kMostWaiting));
        sendNoImage(waiting, *tile);
    }
}

/// Shrunk here, as the pixels may be drawn over; encoded by the writer. What was sent is not sent again.
void RenderHost::sendPreview(const WaitingImages& waiting, HostTile& tile) {
    constexpr int kQuality = 75;
    const message::ImageRequest& request = waiting.request;
    message::TileImage image{.request = request.request, .frame = tile.shownFrame(), .tile = tile.tile().name};
    std::optional<Picture> small = tile.preview(request.shrink, request.news);
    if (!small) {
        image.same = true;
        return report_({waiting.attempt, outcome::Image{std::move(image)}});
    }
    const bool taken = writer_->encodeJpeg(
        std::move(*small), kQuality,
        [report = report_, attempt = waiting.attempt, image = std::move(image)](SharedBytes jpeg) mutable {
            image.picture = std::move(jpeg);
            report({attempt, outcome::Image{std::move(image)}});
        });
    if (!taken) return sendNoImage(waiting, tile);
    tile.notePreview(request.shrink);
}

}  // namespace tessera
