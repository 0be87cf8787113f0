#include "deploy/wall/Film.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <sstream>

#include "deploy/wall/Child.h"
#include "deploy/wall/Stitch.h"

namespace tessera {

namespace fs = std::filesystem;

namespace {

constexpr std::chrono::seconds kFinish{60};

/// Each tile's latest image, so that tiles without one for a frame keep it.
class Frames {
public:
    Frames(const PictureLayout& layout, const TileImages& images) : layout_(layout), images_(images) {
        for (const PictureLayout::Place& place : layout.places) {
            Tile& tile = tiles_[place.tile];
            tile.frames = images.frames(place.tile);
            if (tile.frames.empty()) continue;
            first_ = std::min(first_, tile.frames.front());
            last_ = std::max(last_, tile.frames.back());
        }
    }
    [[nodiscard]] bool empty() const { return first_ > last_; }
    [[nodiscard]] std::uint64_t first() const { return first_; }
    [[nodiscard]] std::uint64_t last() const { return last_; }

    [[nodiscard]] Expected<Picture> at(std::uint64_t frame) {
        Expected<Stitched> stitched = stitch(layout_, [&](const std::string& name) -> Expected<std::optional<Picture>> {
            Tile& tile = tiles_.at(name);
            if (std::binary_search(tile.frames.begin(), tile.frames.end(), frame)) {
                Expected<TileImages::Image> image = images_.read(name, frame);
                if (!image) return tl::unexpected(image.error());
                tile.latest = std::move(image->picture);
            }
            return tile.latest;
        });
        if (!stitched) return tl::unexpected(stitched.error());
        return std::move(stitched->picture);
    }

private:
    struct Tile {
        std::vector<std::uint64_t> frames;
        std::optional<Picture> latest;
    };
    const PictureLayout& layout_;
    const TileImages& images_;
    std::map<std::string, Tile> tiles_;
    std::uint64_t first_ = UINT64_MAX, last_ = 0;
};

/// What ffmpeg has to say goes to the person; its end is waited for, but not for ever.
std::optional<ChildEnd> waitForEnd(Child& child, Signals& signals, Console& console) {
    const auto deadline = std::chrono::steady_clock::now() + kFinish;
    while (std::chrono::steady_clock::now() < deadline) {
        pollfd handles[] = {{.fd = signals.handle(), .events = POLLIN, .revents = 0},
                            {.fd = child.handle(Child::kOut), .events = POLLIN, .revents = 0},
                            {.fd = child.handle(Child::kError), .events = POLLIN, .revents = 0}};
        ::poll(handles, 3, 200);
        if (signals.takeStopRequest()) return std::nullopt;
        for (const Child::Stream stream : {Child::kOut, Child::kError}) {
            for (const std::string& line : child.readLines(stream)) console.passOn(true, "ffmpeg: " + line);
        }
        if (const std::optional<ChildEnd> end = child.reap()) return end;
    }
    return std::nullopt;
}

}  // namespace

Expected<bool> writeFilm(const std::string& ffmpeg, const std::string& path, const PictureLayout& layout,
                         const TileImages& images, Signals& signals, Console& console) {
    Frames frames(layout, images);
    if (frames.empty()) return fail(ErrorCode::kNotFound, "there are no frames to make a film of");
    const std::string partial = path + ".part";
    Expected<Child> child = Child::start(
        {.program = ffmpeg,
         .arguments = {"-y", "-loglevel", "error", "-f", "rawvideo", "-pixel_format", "rgb24", "-video_size",
                       fmt::format("{}x{}", layout.widthPx, layout.heightPx), "-framerate", "60", "-i", "pipe:0",
                       // Video formats want even sizes.
                       "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264", "-preset", "veryfast", "-crf", "18",
                       "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", partial},
         .feedInput = true});
    if (!child) return tl::unexpected(child.error());
    const auto giveUp = [&] {
        child->send(SIGKILL);
        std::error_code ignored;
        fs::remove(partial, ignored);
    };
    const std::uint64_t count = frames.last() - frames.first() + 1;
    for (std::uint64_t frame = frames.first(); frame <= frames.last(); ++frame) {
        const Expected<Picture> picture = frames.at(frame);
        if (!picture) {
            giveUp();
            return tl::unexpected(picture.error());
        }
        // Where it stops reading, its own words and exit code below say why.
        if (!child->feed(picture->rgb.data(), picture->rgb.size())) break;
        console.progress(frame - frames.first() + 1, count, "frames of the film");
        if (signals.takeStopRequest()) {
            giveUp();
            return false;
        }
    }
    child->closeInput();
    const std::optional<ChildEnd> end = waitForEnd(*child, signals, console);
    console.finishProgress();
    if (!end || !end->good()) {
        giveUp();
        if (!end) return false;
        return fail(ErrorCode::kFailed, fmt::format("{} {}", ffmpeg, describe(*end)));
    }
    std::error_code error;
    fs::rename(partial, path, error);
    if (error) return fail(ErrorCode::kFailed, fmt::format("{}: {}", path, error.message()));
    return true;
}

}  // namespace tessera
