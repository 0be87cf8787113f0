#include "server/door/WallPictures.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/codec/WallCodec.h"
#include "common/mosaic/Mosaic.h"
#include "server/door/Gatekeeper.h"
#include "server/door/Routes.h"

namespace tessera {
namespace {

constexpr int kQuality = 85;

HttpAnswer failed(const Error& error) {
    return apiErrorAnswer({error.code, error.message});
}
std::string textOf(ByteSpan bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

void WallPictures::images(DoorLink& link, Waiting waiting) {
    if (newest_ && std::chrono::steady_clock::now() - newestAt_ < kFresh) return waiting(newest_);
    waiting_.push_back(std::move(waiting));
    if (waiting_.size() > 1) return;
    link.ask(ImagesQuestion{}, {}, [this](const Expected<ApplicationAnswer>& answer) {
        const auto* images = answer ? std::get_if<answer::Images>(&*answer) : nullptr;
        const Expected<Images> all = images != nullptr
                                         ? Expected<Images>(std::make_shared<const answer::Images>(*images))
                                     : answer ? Expected<Images>(fail(ErrorCode::kFailed, "no pictures came"))
                                              : Expected<Images>(tl::unexpected(answer.error()));
        if (all) newest_ = *all, newestAt_ = std::chrono::steady_clock::now();
        for (const Waiting& each : std::exchange(waiting_, {})) each(all);
    });
}

void WallPictures::tile(DoorLink& link, const std::string& name, AnswerHttp answer) {
    images(link, [name, answer = std::move(answer)](const Expected<Images>& images) {
        if (!images) return answer(failed(images.error()));
        const auto tile = std::ranges::find((*images)->tiles, name, &answer::TileImageValue::tile);
        if (tile != (*images)->tiles.end()) return answer({.type = "image/png", .body = textOf(tile->png)});
        std::string known;
        for (const answer::TileImageValue& other : (*images)->tiles) known += (known.empty() ? "" : ", ") + other.tile;
        const bool missing = std::ranges::find((*images)->missing, name) != (*images)->missing.end();
        answer(missing ? errorAnswer(503, "refused", fmt::format("nobody draws tile {} now", name))
                       : errorAnswer(404, "not_found",
                                     fmt::format("there is no tile \"{}\"; there are {}", name,
                                                 known.empty() ? "none that are drawn" : known)));
    });
}

void WallPictures::wall(DoorLink& link, AnswerHttp answer) {
    const std::shared_ptr<DoorLink> held = link.shared_from_this();
    images(link, [this, held, answer = std::move(answer)](const Expected<Images>& images) {
        if (!images) return answer(failed(images.error()));
        if (jpegOf_ == *images) return answer({.type = "image/jpeg", .body = *jpeg_});
        const auto make = [images = *images, wall = held->wall()]() -> Expected<std::string> {
            const Expected<Wall> read = decodeWall(wall);
            if (!read) return tl::unexpected(read.error());
            const Expected<Mosaic> mosaic = stitch(*read, *images);
            if (!mosaic) return tl::unexpected(mosaic.error());
            return textOf(encodeJpeg(mosaic->picture, kQuality));
        };
        maker_.run(make, [this, images = *images, answer](const Expected<std::string>& jpeg) {
            if (!jpeg) return answer(failed(jpeg.error()));
            jpegOf_ = images, jpeg_ = std::make_shared<const std::string>(*jpeg);
            answer({.type = "image/jpeg", .body = *jpeg});
        });
    });
}

}  // namespace tessera
