#include "client/replica/TileWindows.h"

#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace tessera {

TileWindows::TileWindows(TileWindowsOptions options, Log& log) : options_(std::move(options)), log_(log) {}

TileWindows::~TileWindows() {
    for (Window& window : windows_) end(window);
}

void TileWindows::follow(const Wall& wall, const std::vector<Tile>& tiles) {
    std::vector<Window> before = std::move(windows_);
    windows_.clear();
    for (std::size_t i = 0; i < tiles.size(); ++i) {
        const Tile& tile = tiles[i];
        Window window{.tile = tile.name,
                      .arguments = {options_.program, fmt::format("{}/tiles/{}/shown.frame", options_.output, tile.name), "--title",
                                    "Tessera " + tile.name, "--parent", std::to_string(::getpid())}};
        const auto add = [&](std::initializer_list<std::string> more) { window.arguments.insert(window.arguments.end(), more); };
        if (options_.vsync) add({"--vsync"});
        if (i < options_.monitors.size()) add({"--monitor", options_.monitors[i]});
        if (options_.fullScreen)
            add({"--full-screen"});
        else if (const Screen* const screen = wall.findScreen(tile.screen)) {
            const ScreenPixels all = screenPixels(*screen);
            add({"--part", std::to_string(tile.rect.x), std::to_string(all.height - tile.rect.y - tile.rect.height),
                 std::to_string(tile.rect.width), std::to_string(tile.rect.height), std::to_string(all.width), std::to_string(all.height)});
        }
        const auto same = std::ranges::find_if(before, [&](const Window& old) { return old.arguments == window.arguments; });
        if (same != before.end()) {
            window.process = std::exchange(same->process, 0);
        } else if (const auto started = start(window.arguments)) {
            window.process = *started;
        } else {
            log_.warning(fmt::format("tile {} has no window: {}", tile.name, started.error().message));
        }
        windows_.push_back(std::move(window));
    }
    for (Window& old : before) end(old);
}

void TileWindows::look() {
    for (Window& window : windows_) {
        int status = 0;
        if (window.process == 0 || ::waitpid(window.process, &status, WNOHANG) != window.process) continue;
        window.process = 0;
        if (WIFEXITED(status) && WEXITSTATUS(status) == 0)
            log_.info(fmt::format("the window of tile {} was closed; the tile is drawn as before", window.tile));
        else
            log_.warning(fmt::format("tile {} has no window any more: {} {}; the tile is drawn as before", window.tile,
                                     WIFEXITED(status) ? "tessera-window ended with exit code" : "tessera-window was killed by signal",
                                     WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status)));
    }
}

Expected<pid_t> TileWindows::start(const std::vector<std::string>& arguments) const {
    std::vector<char*> words;
    for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
    words.push_back(nullptr);
    // What this process has blocked for its threads is not blocked there.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
    pid_t process = 0;
    const int error = ::posix_spawn(&process, options_.program.c_str(), nullptr, &attributes, words.data(), environ);
    posix_spawnattr_destroy(&attributes);
    if (error != 0) return fail(ErrorCode::kFailed, fmt::format("{}: {}", options_.program, std::strerror(error)));
    return process;
}

/// A window that does not answer is killed after a second.
void TileWindows::end(Window& window) {
    if (window.process == 0) return;
    ::kill(window.process, SIGTERM);
    for (int i = 0; i < 100; ++i) {
        if (::waitpid(window.process, nullptr, WNOHANG) != 0) {
            window.process = 0;
            return;
        }
        ::usleep(10'000);
    }
    ::kill(window.process, SIGKILL);
    ::waitpid(window.process, nullptr, 0);
    window.process = 0;
}

}  // namespace tessera
