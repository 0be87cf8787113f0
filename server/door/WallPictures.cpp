#include "server/door/WallPictures.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/codec/WallCodec.h"
#include "common/mosaic/Mosaic.h"
#include "server/door/Gatekeeper.h"
#include "server/door/Routes.h"
#include "server/door/UploadFolder.h"

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
    constexpr std::size_t kMostWaiting = 256;
    if (waiting_.size() == kMostWaiting)
        return waiting(fail(ErrorCode::kNetwork, "as many wait for pictures already as may: try again"));
    waiting_.push_back(std::move(waiting));
    if (waiting_.size() > 1) return;
    link.ask(ImagesQuestion{}, {}, [this, &link](const Expected<ApplicationAnswer>& answer) {
        const auto* images = answer ? std::get_if<answer::Images>(&*answer) : nullptr;
        const Expected<Images> all = images != nullptr
                                         ? Expected<Images>(std::make_shared<const answer::Images>(*images))
                                     : answer ? Expected<Images>(fail(ErrorCode::kFailed, "no pictures came"))
                                              : Expected<Images>(tl::unexpected(answer.error()));
        if (all) newest_ = *all, newestAt_ = std::chrono::steady_clock::now();
        if (all) wall_ = link.wall();  // a link that is younger than the pictures may know none yet
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

void WallPictures::take(Turn& turn, AnswerHttp answer, std::function<void(AnswerHttp)> make) {
    turn.next.push_back(std::move(answer));
    if (turn.busy) {
        turn.make = std::move(make);  // by the link that has come last
        return;
    }
    turn.busy = true;
    make([this, &turn, takers = std::exchange(turn.next, {})](const HttpAnswer& made) {
        for (const AnswerHttp& taker : takers) taker(made);
        turn.busy = false;
        if (turn.next.empty()) return;
        AnswerHttp last = std::move(turn.next.back());
        turn.next.pop_back();
        take(turn, std::move(last), std::move(turn.make));
    });
}

void WallPictures::wall(DoorLink& link, AnswerHttp answer) {
    take(ofWall_, std::move(answer),
         [this, held = link.shared_from_this()](AnswerHttp made) { makeWall(*held, std::move(made)); });
}

void WallPictures::whole(DoorLink& link, const std::string& folder, AnswerHttp answer) {
    constexpr int kAttempts = 5;
    take(ofWhole_, std::move(answer), [this, held = link.shared_from_this(), folder](AnswerHttp made) {
        makeWhole(*held, folder, std::move(made), kAttempts);
    });
}

void WallPictures::makeWall(DoorLink& link, AnswerHttp answer) {
    images(link, [this, answer = std::move(answer)](const Expected<Images>& images) {
        if (!images) return answer(failed(images.error()));
        if (jpegOf_ == *images) return answer({.type = "image/jpeg", .body = *jpeg_});
        const auto make = [images = *images, wall = wall_]() -> Expected<std::string> {
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

void WallPictures::makeWhole(DoorLink& link, const std::string& folder, AnswerHttp answer, int attempts) {
    const std::shared_ptr<DoorLink> held = link.shared_from_this();
    images(link, [this, held, folder, answer = std::move(answer), attempts](const Expected<Images>& images) {
        if (!images) return answer(failed(images.error()));
        using Made = Expected<std::shared_ptr<const AnswerFile>>;
        const auto make = [images = *images, wall = wall_, folder]() -> Made {
            const Expected<Wall> read = decodeWall(wall);
            if (!read) return tl::unexpected(read.error());
            Expected<FileHandle> file = namelessFile(folder);
            if (!file) return tl::unexpected(file.error());
            std::uint64_t written = 0;
            Expected<void> room;
            Bytes piece;
            const auto flush = [&] {
                if (room) room = writeNameless(*file, piece);
                written += piece.size();
                piece.clear();
            };
            const Expected<void> done = stitchWhole(*read, *images, [&](ByteSpan bytes) {
                constexpr std::size_t kPiece = std::size_t{256} << 10;
                piece.insert(piece.end(), bytes.begin(), bytes.end());
                if (piece.size() >= kPiece) flush();
            });
            flush();
            if (!done) return tl::unexpected(done.error());
            if (!room) return tl::unexpected(room.error());
            return std::make_shared<const AnswerFile>(AnswerFile{std::move(*file), written});
        };
        maker_.run(make, [this, held, folder, answer, attempts, images = *images](const Made& made) {
            if (made) return answer({.type = "image/png", .body = {}, .file = *made});
            if (made.error().code != ErrorCode::kRefused || images->tiles.empty() || attempts == 1 || held->ended())
                return answer(failed(made.error()));
            if (newest_ == images) newest_.reset();  // of different frames: of no use to anybody
            makeWhole(*held, folder, answer, attempts - 1);
        });
    });
}

}  // namespace tessera
