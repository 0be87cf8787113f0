#include "client/replica/TileWindows.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <map>
#include <thread>

#include "common/base/FileHandle.h"
#include "common/base/Hash.h"
#include "common/base/StartThread.h"
#include "common/codec/WallCodec.h"
#include "common/wall/WindowLayout.h"

namespace tessera {

namespace {

/// Where a window finds its end of the socket, and the wall whose output it shows, where it has them.
constexpr int kWindowsInput = 3, kWallHandle = 4;

/// A copy that is none of these, so that giving one does not overwrite the other.
FileHandle apartFrom(int descriptor) {
    return FileHandle(::fcntl(descriptor, F_DUPFD_CLOEXEC, kWallHandle + 1));
}

/// The wall's bytes as a file without a name.
FileHandle fileOf(const Bytes& bytes) {
    FileHandle file(::memfd_create("wall", MFD_CLOEXEC));
    for (std::size_t done = 0; file.get() >= 0 && done < bytes.size();) {
        const ssize_t n = ::write(file.get(), bytes.data() + done, bytes.size() - done);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return FileHandle(-1);
        done += static_cast<std::size_t>(n);
    }
    return file;
}

}  // namespace

class TileWindows::Window {
public:
    /// `wall`: what the window shall find at kWallHandle; below 0: nothing.
    static Expected<std::unique_ptr<Window>> start(std::string tile, std::uint32_t number,
                                                   std::vector<std::string> arguments, Hash128 wall, int wallFile,
                                                   Log& log, const OnInput& onInput) {
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
        posix_spawn_file_actions_t files;
        posix_spawn_file_actions_init(&files);
        FileHandle ours, theirs;
        if (int ends[2]; onInput && ::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) == 0) {
            ours = FileHandle(ends[0]);
            theirs = apartFrom(ends[1]);
            ::close(ends[1]);
            posix_spawn_file_actions_adddup2(&files, theirs.get(), kWindowsInput);
        }
        const FileHandle wallApart = wallFile >= 0 ? apartFrom(wallFile) : FileHandle();
        if (wallFile >= 0) posix_spawn_file_actions_adddup2(&files, wallApart.get(), kWallHandle);
        pid_t process = 0;
        const int error = ::posix_spawn(&process, words[0], &files, &attributes, words.data(), environ);
        posix_spawn_file_actions_destroy(&files);
        posix_spawnattr_destroy(&attributes);
        if (error != 0) return fail(ErrorCode::kFailed, fmt::format("{}: {}", arguments[0], std::strerror(error)));
        std::unique_ptr<Window> window(
            new Window(std::move(tile), number, std::move(arguments), wall, process, std::move(ours), log, onInput));
        window->watcher_ = startThread([watched = window.get()] { watched->watch(); });
        if (!window->watcher_.joinable()) return fail(ErrorCode::kFailed, kNoThread);
        return window;
    }
    /// One that does not answer is killed after a second.
    ~Window() {
        ending_ = true;
        send(SIGTERM);
        pollfd over{.fd = handle_.get(), .events = POLLIN, .revents = 0};
        if (handle_.get() < 0 || ::poll(&over, 1, 1000) == 0) send(SIGKILL);
        if (watcher_.joinable())
            watcher_.join();
        else
            (void)awaitEnd();
    }
    [[nodiscard]] std::uint32_t number() const { return number_; }
    [[nodiscard]] bool isAs(std::uint32_t number, const std::vector<std::string>& arguments, Hash128 wall) const {
        return number_ == number && arguments_ == arguments && wall_ == wall;
    }

private:
    Window(std::string tile, std::uint32_t number, std::vector<std::string> arguments, Hash128 wall, pid_t process,
           FileHandle input, Log& log, const OnInput& onInput)
        : tile_(std::move(tile)),
          number_(number),
          input_(std::move(input)),
          onInput_(onInput),
          arguments_(std::move(arguments)),
          wall_(wall),
          process_(process),
          handle_(static_cast<int>(::syscall(SYS_pidfd_open, process, 0))),
          log_(log) {}

    /// By the handle where there is one: the number may be another process' by now.
    void send(int signal) const {
        if (handle_.get() >= 0)
            ::syscall(SYS_pidfd_send_signal, handle_.get(), signal, nullptr, 0);
        else
            ::kill(process_, signal);
    }
    /// Until the window ends, or says what no window says.
    void listen() {
        using Clock = std::chrono::steady_clock;
        InputState last{.source = number_};
        std::size_t heard = 0;
        for (Clock::time_point second = Clock::now();;) {
            // A byte more than a state has: what is longer is none.
            std::array<std::byte, sizeof(InputState) + 1> bytes;
            const ssize_t size = ::recv(input_.get(), bytes.data(), bytes.size(), 0);
            if (size < 0 && errno == EINTR) continue;
            if (size <= 0) break;
            const Clock::time_point now = Clock::now();
            if (now - second > std::chrono::seconds(1)) {
                second = now;
                heard = 0;
            }
            if (size != static_cast<ssize_t>(sizeof(InputState)) || ++heard > kMaxStatesPerSecond) {
                log_.warning(fmt::format("the window of tile {} says {}: it is heard no longer", tile_,
                                         size != static_cast<ssize_t>(sizeof(InputState)) ? "what is no input"
                                                                                          : "more than hands can do"),
                             {.tile = tile_});
                break;
            }
            std::memcpy(&last, bytes.data(), sizeof last);
            last.source = number_;
            onInput_(last);
        }
        input_.close();
        last.release();
        onInput_(last);
    }
    [[nodiscard]] siginfo_t awaitEnd() const {
        siginfo_t end{};
        while (::waitid(P_PID, static_cast<id_t>(process_), &end, WEXITED) != 0 && errno == EINTR) {
        }
        return end;
    }
    void watch() {
        if (input_.get() >= 0) listen();
        const siginfo_t end = awaitEnd();
        if (ending_) return;
        if (end.si_code == CLD_EXITED && end.si_status == 0)
            return log_.info(fmt::format("the window of tile {} was closed; the tile is drawn as before", tile_),
                             {.tile = tile_});
        log_.warning(
            fmt::format("tile {} has no window any more: tessera-window {} {}; the tile is drawn as before", tile_,
                        end.si_code == CLD_EXITED ? "ended with exit code" : "was killed by signal", end.si_status),
            {.tile = tile_});
    }

    std::string tile_;
    std::uint32_t number_;
    FileHandle input_;  ///< none: it is not listened to
    const OnInput& onInput_;
    std::vector<std::string> arguments_;
    Hash128 wall_;
    pid_t process_;
    FileHandle handle_;  ///< of the process; none on kernels before 5.3
    Log& log_;
    std::atomic<bool> ending_ = false;
    std::thread watcher_;
};

TileWindows::TileWindows(TileWindowsOptions options, Log& log, OnInput onInput)
    : options_(std::move(options)), log_(log), onInput_(std::move(onInput)) {}

TileWindows::~TileWindows() = default;

void TileWindows::follow(const Wall& wall, const std::vector<Tile>& tiles) {
    std::vector<std::unique_ptr<Window>> before = std::move(windows_);
    windows_.clear();
    const Bytes bytes = encodeWall(wall);
    const WindowLayout layout = layoutWindows(wall);
    std::map<std::string, std::string> covered;  // monitor, the first tile on all of it
    const Hash128 wallNow = hash128(bytes);
    const bool wallIsNew = !(wallNow == saidOf_);  // what is wrong with it is said once
    saidOf_ = wallNow;
    std::size_t index = 0;
    for (const Tile& tile : tiles) {
        const Tile* const partner = partnerOf(tile, tiles);
        if (partner && tile.eye == Eye::kRight) continue;
        const bool plain = tile.output.plain();
        const auto fileOfTile = [&](const Tile& t) {
            return fmt::format("{}/tiles/{}/shown.frame", options_.output, t.name);
        };
        std::vector<std::string> arguments = {options_.program, fileOfTile(tile)};
        const auto add = [&](std::initializer_list<std::string> more) { arguments.insert(arguments.end(), more); };
        if (partner) add({fileOfTile(*partner)});
        add({"--title", "Tessera " + tile.name, "--parent", std::to_string(::getpid())});
        if (!plain) add({"--wall", fmt::format("/proc/self/fd/{}", kWallHandle), "--tile", tile.name});
        if (onInput_) add({"--input", std::to_string(kWindowsInput)});
        if (options_.vsync) add({"--vsync"});
        if (!options_.logFolder.empty()) add({"--log", fmt::format("{}/{}.log", options_.logFolder, tile.name)});
        // The command line wins over the wall; a monitor that the wall names is this output's alone.
        const bool told = index < options_.monitors.size(), named = !told && !tile.output.monitor.empty();
        if (told || named) add({"--monitor", told ? options_.monitors[index] : tile.output.monitor});
        ++index;
        if (options_.fullScreen || named) {
            add({"--full-screen"});
            const std::string monitor = told ? options_.monitors[index - 1] : tile.output.monitor;
            const auto [first, alone] = covered.try_emplace(monitor, tile.name);
            if (!alone && wallIsNew)
                log_.warning(fmt::format("tiles {} and {} both take all of {}: one window lies on the other",
                                         first->second, tile.name,
                                         monitor.empty() ? "the first monitor" : "monitor \"" + monitor + "\""));
        } else {
            const auto place = std::ranges::find(layout.places, tile.name, &WindowLayout::Place::tile);
            if (place != layout.places.end()) {
                add({"--part"});
                for (const int number : {place->x, place->y, place->width, place->height, layout.width, layout.height})
                    add({std::to_string(number)});
            }
        }
        const Hash128 key = plain ? Hash128{} : wallNow;
        const auto number = static_cast<std::uint32_t>(index - 1);
        const auto same =
            std::ranges::find_if(before, [&](const auto& old) { return old && old->isAs(number, arguments, key); });
        if (same != before.end()) {
            windows_.push_back(std::move(*same));
            continue;
        }
        const FileHandle file = plain ? FileHandle(-1) : fileOf(bytes);
        auto started = plain || file.get() >= 0
                           ? Window::start(tile.name, number, std::move(arguments), key, file.get(), log_, onInput_)
                           : Expected<std::unique_ptr<Window>>(fail(ErrorCode::kFailed, "no memory for its output"));
        if (started)
            windows_.push_back(std::move(*started));
        else
            log_.warning(fmt::format("tile {} has no window: {}", tile.name, started.error().message),
                         {.tile = tile.name});
    }
    if (wallIsNew && index < options_.monitors.size())
        log_.warning(fmt::format("{} monitors are named, and there {} to show", options_.monitors.size(),
                                 index == 1 ? "is 1 output" : fmt::format("are {} outputs", index)));
}

}  // namespace tessera
