#include "client/replica/TileWindows.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <thread>

#include "common/base/FileHandle.h"

namespace tessera {

class TileWindows::Window {
public:
    static Expected<std::unique_ptr<Window>> start(std::string tile, std::vector<std::string> arguments, Log& log) {
        std::vector<char*> words;
        for (std::string& argument : arguments) words.push_back(argument.data());
        words.push_back(nullptr);
        // What this process has blocked for its threads is not blocked there.
        posix_spawnattr_t attributes;
        posix_spawnattr_init(&attributes);
        sigset_t none;
        sigemptyset(&none);
        posix_spawnattr_setsigmask(&attributes, &none);
        posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
        pid_t process = 0;
        const int error = ::posix_spawn(&process, words[0], nullptr, &attributes, words.data(), environ);
        posix_spawnattr_destroy(&attributes);
        if (error != 0) return fail(ErrorCode::kFailed, fmt::format("{}: {}", arguments[0], std::strerror(error)));
        return std::unique_ptr<Window>(new Window(std::move(tile), std::move(arguments), process, log));
    }
    /// One that does not answer is killed after a second.
    ~Window() {
        ending_ = true;
        send(SIGTERM);
        pollfd over{.fd = handle_.get(), .events = POLLIN, .revents = 0};
        if (handle_.get() < 0 || ::poll(&over, 1, 1000) == 0) send(SIGKILL);
        watcher_.join();
    }
    [[nodiscard]] const std::vector<std::string>& arguments() const { return arguments_; }

private:
    Window(std::string tile, std::vector<std::string> arguments, pid_t process, Log& log)
        : tile_(std::move(tile)),
          arguments_(std::move(arguments)),
          process_(process),
          handle_(static_cast<int>(::syscall(SYS_pidfd_open, process, 0))),
          log_(log),
          watcher_([this] { watch(); }) {}

    /// By the handle where there is one: the number may be another process' by now.
    void send(int signal) const {
        if (handle_.get() >= 0)
            ::syscall(SYS_pidfd_send_signal, handle_.get(), signal, nullptr, 0);
        else
            ::kill(process_, signal);
    }
    void watch() {
        siginfo_t end{};
        while (::waitid(P_PID, static_cast<id_t>(process_), &end, WEXITED) != 0 && errno == EINTR) {
        }
        if (ending_) return;
        if (end.si_code == CLD_EXITED && end.si_status == 0)
            return log_.info(fmt::format("the window of tile {} was closed; the tile is drawn as before", tile_));
        log_.warning(fmt::format("tile {} has no window any more: tessera-window {} {}; the tile is drawn as before", tile_,
                                 end.si_code == CLD_EXITED ? "ended with exit code" : "was killed by signal", end.si_status));
    }

    std::string tile_;
    std::vector<std::string> arguments_;
    pid_t process_;
    FileHandle handle_;  ///< of the process; none on kernels before 5.3
    Log& log_;
    std::atomic<bool> ending_ = false;
    std::thread watcher_;
};

TileWindows::TileWindows(TileWindowsOptions options, Log& log) : options_(std::move(options)), log_(log) {}

TileWindows::~TileWindows() = default;

void TileWindows::follow(const Wall& wall, const std::vector<Tile>& tiles) {
    std::vector<std::unique_ptr<Window>> before = std::move(windows_);
    windows_.clear();
    for (std::size_t i = 0; i < tiles.size(); ++i) {
        const Tile& tile = tiles[i];
        std::vector<std::string> arguments = {options_.program, fmt::format("{}/tiles/{}/shown.frame", options_.output, tile.name),
                                              "--title", "Tessera " + tile.name, "--parent", std::to_string(::getpid())};
        const auto add = [&](std::initializer_list<std::string> more) { arguments.insert(arguments.end(), more); };
        if (options_.vsync) add({"--vsync"});
        if (!options_.logFolder.empty()) add({"--log", fmt::format("{}/{}.log", options_.logFolder, tile.name)});
        if (i < options_.monitors.size()) add({"--monitor", options_.monitors[i]});
        if (options_.fullScreen)
            add({"--full-screen"});
        else if (const Screen* const screen = wall.findScreen(tile.screen)) {
            const ScreenPixels all = screenPixels(*screen);
            add({"--part", std::to_string(tile.rect.x), std::to_string(all.height - tile.rect.y - tile.rect.height),
                 std::to_string(tile.rect.width), std::to_string(tile.rect.height), std::to_string(all.width), std::to_string(all.height)});
        }
        const auto same = std::ranges::find_if(before, [&](const auto& old) { return old && old->arguments() == arguments; });
        if (same != before.end()) {
            windows_.push_back(std::move(*same));
            continue;
        }
        auto started = Window::start(tile.name, std::move(arguments), log_);
        if (started)
            windows_.push_back(std::move(*started));
        else
            log_.warning(fmt::format("tile {} has no window: {}", tile.name, started.error().message));
    }
}

}  // namespace tessera
