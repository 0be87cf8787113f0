#include "server/door/WallPictures.h"

#include <fmt/format.h>
#include <boost/asio/post.hpp>

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
        boost::asio::post(maker_, [this, images = *images, wall = held->wall(), answer] {
            const Expected<Wall> read = decodeWall(wall);
            const Expected<Mosaic> mosaic =
                read ? stitch(*read, *images) : Expected<Mosaic>(tl::unexpected(read.error()));
            if (!mosaic) return boost::asio::post(io_, [answer, error = mosaic.error()] { answer(failed(error)); });
            auto jpeg = std::make_shared<const std::string>(textOf(encodeJpeg(mosaic->picture, kQuality)));
            boost::asio::post(io_, [this, images, jpeg, answer] {
                jpegOf_ = images, jpeg_ = jpeg;
                answer({.type = "image/jpeg", .body = *jpeg});
            });
        });
    });
}

}  // namespace tessera
