#include "client/window/TileWindow.h"

#include <SDL2/SDL.h>
#include <dlfcn.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <thread>
#include <utility>
#include <vector>

#include "client/output/ShownFrames.h"
#include "client/window/KeysOverlay.h"
#include "client/window/StereoWindow.h"
#include "client/window/WindowInput.h"

namespace tessera {
namespace {

using std::chrono::milliseconds;

/// How often a file that is not there yet, or whose host is silent, is looked for anew.
constexpr milliseconds kLook(100);

std::int64_t nowNs() {
    timespec now{};
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

tl::unexpected<Error> refuse(ErrorCode code, const std::string& what) {
    return fail(code, fmt::format("{}: {}", what, SDL_GetError()));
}

/// Xlib ends with exit() when its server is gone, in the middle of anything and in each thread that notices. What was
/// registered for the end runs then, the destructors of the GL driver too, while the driver's threads still draw: now
/// and then that is a crash. A handler of our own ends the process before any of it. Xlib comes with SDL (its headers
/// do not), and a desktop without it needs nothing.
void endAtOnceWithTheDisplay() {
    using Handler = int (*)(void* display);
    void* const set = ::dlsym(RTLD_DEFAULT, "XSetIOErrorHandler");
    if (set == nullptr) return;
    const Handler end = [](void*) -> int {
        fmt::print(stderr, "tessera-window: the display is gone\n");
        std::fflush(nullptr);
        ::_exit(1);
    };
    reinterpret_cast<Handler (*)(Handler)>(set)(end);
}

class Video {
public:
    static Expected<std::unique_ptr<Video>> start() {
        // Nothing of the desktop is to change because a wall is shown, and no film is to be dimmed.
        SDL_SetHint(SDL_HINT_VIDEO_X11_NET_WM_BYPASS_COMPOSITOR, "0");
        SDL_SetHint(SDL_HINT_VIDEO_MINIMIZE_ON_FOCUS_LOSS, "0");
        if (SDL_Init(SDL_INIT_VIDEO) != 0)
            return refuse(ErrorCode::kUnsupported,
                          "no display to open a window on (is DISPLAY or WAYLAND_DISPLAY set?)");
        std::unique_ptr<Video> video(new Video);
        // SDL's last resorts show nothing to anybody. Who wants one of them says so.
        const std::string driver = SDL_GetCurrentVideoDriver();
        if (!std::getenv("SDL_VIDEODRIVER") && (driver == "dummy" || driver == "offscreen" || driver == "evdev"))
            return fail(ErrorCode::kUnsupported, "no display to open a window on (is DISPLAY or WAYLAND_DISPLAY set?)");
        return video;
    }
    ~Video() { SDL_Quit(); }
    Video(const Video&) = delete;
    Video& operator=(const Video&) = delete;

    [[nodiscard]] static std::vector<Monitor> monitors() {
        std::vector<Monitor> found;
        for (int i = 0; i < SDL_GetNumVideoDisplays(); ++i) {
            SDL_Rect all{}, usable{};
            SDL_DisplayMode mode{};
            if (SDL_GetDisplayBounds(i, &all) != 0) continue;
            if (SDL_GetDisplayUsableBounds(i, &usable) != 0) usable = all;
            const char* const name = SDL_GetDisplayName(i);
            found.push_back({.name = name ? name : "",
                             .all = {all.x, all.y, all.w, all.h},
                             .usable = {usable.x, usable.y, usable.w, usable.h},
                             .refreshHz = SDL_GetDesktopDisplayMode(i, &mode) == 0 ? mode.refresh_rate : 0});
        }
        return found;
    }

private:
    Video() = default;
};

template <auto destroy>
struct Destroyer {
    template <typename T>
    void operator()(T* thing) const {
        destroy(thing);
    }
};
using WindowPtr = std::unique_ptr<SDL_Window, Destroyer<SDL_DestroyWindow>>;
using RendererPtr = std::unique_ptr<SDL_Renderer, Destroyer<SDL_DestroyRenderer>>;
using TexturePtr = std::unique_ptr<SDL_Texture, Destroyer<SDL_DestroyTexture>>;
using SurfacePtr = std::unique_ptr<SDL_Surface, Destroyer<SDL_FreeSurface>>;

SDL_Rect rectOf(const DesktopRect& r) {
    return {r.x, r.y, r.width, r.height};
}

/// Bytes R, G, B, unused.
constexpr Uint32 kPictureFormat = SDL_BYTEORDER == SDL_LIL_ENDIAN ? SDL_PIXELFORMAT_XBGR8888 : SDL_PIXELFORMAT_RGBX8888;

/// A picture on its way into the window.
struct PanePicture {
    std::uint64_t number = 0;
    std::int64_t shownAtNs = 0;
    int widthPx = 0, heightPx = 0, pitchBytes = 0;
    const std::uint8_t* rgbx = nullptr;
};

/// The window itself, and how a picture gets into it.
class Pane {
public:
    static Expected<Pane> open(const WindowOptions& options, const std::vector<Monitor>& monitors) {
        std::size_t monitor = 0;
        if (!options.monitor.empty()) {
            const auto found = findMonitor(monitors, options.monitor);
            if (!found) return tl::unexpected(found.error());
            monitor = *found;
        }
        const Monitor& on = monitors[monitor];
        DesktopRect place = on.all;
        if (!options.fullScreen)
            place = placeOnDesktop(options.part.value_or(PlacedPart{{0, 0, 960, 540}, 960, 540}), on.usable);
        const bool stereo = options.output && options.output->packing() == StereoPacking::kQuadBuffered;
        Pane pane;
        if (stereo) pane.stereo_ = StereoWindow::open(options.title, place, options.fullScreen);
        if (pane.stereo_) return pane;
        const Uint32 flags = options.fullScreen
                                 ? SDL_WINDOW_FULLSCREEN_DESKTOP | SDL_WINDOW_BORDERLESS
                                 : static_cast<Uint32>(options.part ? SDL_WINDOW_BORDERLESS : SDL_WINDOW_RESIZABLE);
        pane.window_.reset(SDL_CreateWindow(options.title.c_str(), place.x, place.y, place.width, place.height, flags));
        if (!pane.window_) return refuse(ErrorCode::kUnsupported, "no window can be opened");
        if (options.fullScreen) SDL_ShowCursor(SDL_DISABLE);
        if (!options.vsync) return pane;
        pane.renderer_.reset(
            SDL_CreateRenderer(pane.window_.get(), -1, SDL_RENDERER_ACCELERATED | SDL_RENDERER_PRESENTVSYNC));
        if (!pane.renderer_)
            return refuse(ErrorCode::kUnsupported, "no driver here shows a window in step with the monitor (--vsync)");
        return pane;
    }

    [[nodiscard]] bool showsBothEyes() const { return stereo_ != nullptr; }
    /// What is laid over each picture from now on, in the lower left corner. No part of a window of both eyes.
    void layOver(std::optional<Picture> overlay) { overlay_ = std::move(overlay); }
    [[nodiscard]] DesktopRect size() const {
        DesktopRect size;
        if (window_) SDL_GetWindowSize(window_.get(), &size.width, &size.height);
        return size;
    }
    /// Black where there is no picture.
    Expected<void> show(const PanePicture* frame) {
        if (stereo_)
            return stereo_->show(frame ? frame->rgbx : nullptr, frame ? frame->widthPx / 2 : 0,
                                 frame ? frame->heightPx : 0);
        return renderer_ ? showRendered(frame) : showPlain(frame);
    }

private:
    Pane() = default;

    Expected<void> showPlain(const PanePicture* frame) {
        SDL_Surface* const target = SDL_GetWindowSurface(window_.get());
        if (!target) return refuse(ErrorCode::kUnsupported, "the window cannot be drawn into");
        const DesktopRect place = frame ? fitted(frame->widthPx, frame->heightPx, target->w, target->h) : DesktopRect{};
        if (!frame || place.width != target->w || place.height != target->h)
            SDL_FillRect(target, nullptr, SDL_MapRGB(target->format, 0, 0, 0));
        if (frame) {
            const SurfacePtr picture(SDL_CreateRGBSurfaceWithFormatFrom(const_cast<std::uint8_t*>(frame->rgbx),
                                                                        frame->widthPx, frame->heightPx, 32,
                                                                        frame->pitchBytes, kPictureFormat));
            if (!picture) return refuse(ErrorCode::kFailed, "a picture cannot be taken over");
            SDL_SetSurfaceBlendMode(picture.get(), SDL_BLENDMODE_NONE);
            SDL_Rect to = rectOf(place);
            int failed = 0;
            if (place.width == frame->widthPx && place.height == frame->heightPx) {
                failed = SDL_BlitSurface(picture.get(), nullptr, target, &to);
            } else {
                // Soft stretching wants one format.
                const SurfacePtr same(SDL_ConvertSurface(picture.get(), target->format, 0));
                failed = same ? SDL_SoftStretchLinear(same.get(), nullptr, target, &to) : -1;
                if (failed != 0) failed = SDL_BlitScaled(picture.get(), nullptr, target, &to);
            }
            if (failed != 0) return refuse(ErrorCode::kFailed, "a picture cannot be drawn into the window");
        }
        if (overlay_) {
            const SurfacePtr over = overlaySurface();
            SDL_Rect to{0, std::max(0, target->h - overlay_->heightPx), overlay_->widthPx, overlay_->heightPx};
            if (!over || SDL_BlitSurface(over.get(), nullptr, target, &to) != 0)
                return refuse(ErrorCode::kFailed, "the keys cannot be drawn into the window");
        }
        if (SDL_UpdateWindowSurface(window_.get()) != 0)
            return refuse(ErrorCode::kFailed, "the window cannot be shown");
        return {};
    }

    Expected<void> showRendered(const PanePicture* frame) {
        SDL_RenderSetViewport(renderer_.get(), nullptr);
        SDL_SetRenderDrawColor(renderer_.get(), 0, 0, 0, 255);
        SDL_RenderClear(renderer_.get());
        if (frame) {
            if (!texture_ || textureWidthPx_ != frame->widthPx || textureHeightPx_ != frame->heightPx) {
                SDL_SetHint(SDL_HINT_RENDER_SCALE_QUALITY, "linear");
                texture_.reset(SDL_CreateTexture(renderer_.get(), kPictureFormat, SDL_TEXTUREACCESS_STREAMING,
                                                 frame->widthPx, frame->heightPx));
                if (!texture_) return refuse(ErrorCode::kUnsupported, "the driver has no room for the picture");
                SDL_SetTextureBlendMode(texture_.get(), SDL_BLENDMODE_NONE);
                textureWidthPx_ = frame->widthPx;
                textureHeightPx_ = frame->heightPx;
            }
            int width = 0, height = 0;
            SDL_GetRendererOutputSize(renderer_.get(), &width, &height);
            const SDL_Rect to = rectOf(fitted(frame->widthPx, frame->heightPx, width, height));
            if (SDL_UpdateTexture(texture_.get(), nullptr, frame->rgbx, frame->pitchBytes) != 0 ||
                SDL_RenderCopy(renderer_.get(), texture_.get(), nullptr, &to) != 0)
                return refuse(ErrorCode::kFailed, "a picture cannot be drawn into the window");
        }
        if (overlay_) {
            const SurfacePtr over = overlaySurface();
            const TexturePtr texture(over ? SDL_CreateTextureFromSurface(renderer_.get(), over.get()) : nullptr);
            int width = 0, height = 0;
            SDL_GetRendererOutputSize(renderer_.get(), &width, &height);
            const SDL_Rect to{0, std::max(0, height - overlay_->heightPx), overlay_->widthPx, overlay_->heightPx};
            if (!texture || SDL_RenderCopy(renderer_.get(), texture.get(), nullptr, &to) != 0)
                return refuse(ErrorCode::kFailed, "the keys cannot be drawn into the window");
        }
        SDL_RenderPresent(renderer_.get());
        return {};
    }

    /// The picture shines through a little.
    [[nodiscard]] SurfacePtr overlaySurface() {
        constexpr Uint8 kShare = 216;  // of 255
        SurfacePtr surface(SDL_CreateRGBSurfaceWithFormatFrom(overlay_->rgb.data(), overlay_->widthPx,
                                                              overlay_->heightPx, 24, 3 * overlay_->widthPx,
                                                              SDL_PIXELFORMAT_RGB24));
        if (!surface) return surface;
        SDL_SetSurfaceBlendMode(surface.get(), SDL_BLENDMODE_BLEND);
        SDL_SetSurfaceAlphaMod(surface.get(), kShare);
        return surface;
    }

    std::optional<Picture> overlay_;
    std::unique_ptr<StereoWindow>
        stereo_;  ///< of a driver that shows both eyes; else the left one stands in the window
    WindowPtr window_;
    RendererPtr renderer_;  ///< before the window it goes
    TexturePtr texture_;
    int textureWidthPx_ = 0, textureHeightPx_ = 0;
};

/// Follows the files in a thread of its own and calls the window's, by an event, when there is another picture.
class Follower {
public:
    /// `bothEyes`: the window takes a quad-buffered output's two pictures; else it gets the left one.
    Follower(std::vector<std::string> paths, std::optional<OutputMaker> output, bool bothEyes, Uint32 event)
        : paths_(std::move(paths)), output_(std::move(output)), bothEyes_(bothEyes), event_(event), thread_([this] {
              run();
          }) {}
    ~Follower() {
        over_ = true;
        taken();
        thread_.join();
    }
    /// The picture that the event was about: until `taken`.
    [[nodiscard]] const PanePicture& picture() const { return picture_; }
    void taken() {
        taken_ = true;
        taken_.notify_one();
    }
    /// The same picture once more, within kLook.
    void again() { again_ = true; }

private:
    void run() {
        while (!over_) {
            if (auto files = ShownFrames::open(paths_)) {
                saidFault_ = false;
                follow(*files);
            } else {
                // What is not there may come; what is something else a person has to know.
                if (files.error().code != ErrorCode::kNotFound && !std::exchange(saidFault_, true))
                    fmt::print(stderr, "tessera-window: {}\n", files.error().message);
                std::this_thread::sleep_for(kLook);
            }
        }
    }
    void follow(ShownFrames& files) {
        while (!over_) {
            const auto* frames = files.next(kLook);
            if (!frames && again_.exchange(false)) frames = files.again();
            if (!frames) {
                if (files.replaced()) return;
                continue;
            }
            if (!make(*frames)) continue;
            taken_ = false;
            SDL_Event call{};
            call.type = event_;
            if (SDL_PushEvent(&call) == 1 && !over_) taken_.wait(false);
        }
    }
    /// False: not pictures of this output.
    bool make(const std::vector<SharedFrameReader::Frame>& frames) {
        const SharedFrameReader::Frame& first = frames.front();
        picture_ = {first.number, first.shownAtNs, first.widthPx, first.heightPx, 4 * first.widthPx, first.rgbx};
        if (!output_) return true;
        const std::uint8_t* pictures[2] = {};
        for (std::size_t i = 0; i < frames.size(); ++i) {
            picture_.shownAtNs = std::max(picture_.shownAtNs, frames[i].shownAtNs);
            pictures[i] = frames[i].rgbx;
            if (frames[i].widthPx == output_->fromWidthPx() && frames[i].heightPx == output_->fromHeightPx()) continue;
            if (!std::exchange(saidSize_, true))
                fmt::print(stderr, "tessera-window: {} holds {} x {} pixels, and its tile has {} x {}\n", paths_[i],
                           frames[i].widthPx, frames[i].heightPx, output_->fromWidthPx(), output_->fromHeightPx());
            return false;
        }
        picture_.rgbx = output_->draw({pictures, frames.size()});
        picture_.widthPx = output_->widthPx();
        picture_.heightPx = output_->heightPx();
        picture_.pitchBytes = 4 * picture_.widthPx;
        if (output_->packing() == StereoPacking::kQuadBuffered && !bothEyes_) picture_.widthPx /= 2;
        return true;
    }

    std::vector<std::string> paths_;
    std::optional<OutputMaker> output_;
    bool bothEyes_, saidSize_ = false, saidFault_ = false;
    Uint32 event_;
    PanePicture picture_;
    std::atomic<bool> over_ = false, taken_ = false, again_ = false;
    std::thread thread_;
};

}  // namespace

Expected<std::vector<Monitor>> monitorsHere() {
    const auto video = Video::start();
    if (!video) return tl::unexpected(video.error());
    return Video::monitors();
}

Expected<void> runWindow(WindowOptions options) {
    std::unique_ptr<std::FILE, Destroyer<std::fclose>> log;
    if (!options.log.empty()) {
        log.reset(std::fopen(options.log.c_str(), "we"));
        if (!log) return fail(ErrorCode::kFailed, options.log + ": cannot be written");
    }
    const auto video = Video::start();
    if (!video) return tl::unexpected(video.error());
    endAtOnceWithTheDisplay();
    const std::vector<Monitor> monitors = Video::monitors();
    if (monitors.empty()) return fail(ErrorCode::kUnsupported, "the desktop has no monitor");
    auto pane = Pane::open(options, monitors);
    if (!pane) return tl::unexpected(pane.error());
    if (auto black = pane->show(nullptr); !black) return black;

    const Uint32 another = SDL_RegisterEvents(1);
    Follower follower(std::move(options.frameFiles), std::move(options.output), pane->showsBothEyes(), another);
    SDL_Event event{};
    WindowInput input;
    AskedManner manner;
    bool showsKeys = options.showsKeys;
    const auto layKeys = [&] {
        const DesktopRect size = pane->size();
        pane->layOver(showsKeys ? std::optional(keysOverlay(manner, size.width, size.height)) : std::nullopt);
        follower.again();
    };
    if (showsKeys) layKeys();
    InputPipe pipe(options.input);
    pipe.say(input.state(), false);
    for (;;) {
        const bool patient = pipe.patienceMs() < 0;
        const bool came = SDL_WaitEventTimeout(&event, pipe.patienceMs()) == 1;
        if (!came && patient) break;
        const bool asksForKeys = came && input.take(event);
        if (asksForKeys && pane->showsBothEyes()) {
            fmt::print("{}", WindowInput::keys());
            std::fflush(stdout);
        }
        if (asksForKeys) showsKeys = !showsKeys;
        if (const bool other = manner.take(input.state()); asksForKeys || (other && showsKeys)) layKeys();
        pipe.say(input.state(), SDL_PollEvent(nullptr) == 1);
        if (!came) continue;
        if (event.type == SDL_QUIT) return {};
        if (event.type == SDL_KEYDOWN && event.key.keysym.sym == SDLK_ESCAPE) return {};
        if (event.type == SDL_WINDOWEVENT) {
            if (event.window.event == SDL_WINDOWEVENT_CLOSE) return {};
            if (event.window.event == SDL_WINDOWEVENT_EXPOSED || event.window.event == SDL_WINDOWEVENT_SIZE_CHANGED)
                layKeys();
        }
        if (event.type != another) continue;
        const PanePicture picture = follower.picture();
        input.pictureIs(picture.widthPx, picture.heightPx);
        auto shown = pane->show(&picture);
        if (log) {
            fmt::print(log.get(), "{} {} {}\n", picture.number, picture.shownAtNs, nowNs());
            std::fflush(log.get());
        }
        follower.taken();
        if (!shown) return shown;
    }
    return refuse(ErrorCode::kFailed, "the window's events ended");
}

}  // namespace tessera
