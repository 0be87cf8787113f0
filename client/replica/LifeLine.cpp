#include "client/replica/LifeLine.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace tessera {

namespace {

[[noreturn]] void endLife(std::string_view why, const std::function<void()>& cleanUp, Log& log) {
    log.warning(fmt::format("whoever started this client {}: it ends", why));
    cleanUp();
    log.flush(std::chrono::milliseconds(200));
    // No destructor: a draw thread that hangs could not be joined.
    std::_Exit(exitCode(ErrorCode::kNetwork));
}

void readUntilStopped(int stop, std::chrono::seconds patience, const std::function<void()>& cleanUp, Log& log) {
    for (;;) {
        pollfd handles[2] = {{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0},
                             {.fd = stop, .events = POLLIN, .revents = 0}};
        const int ready = ::poll(handles, 2, static_cast<int>(std::chrono::milliseconds(patience).count()));
        if (ready < 0 && errno == EINTR) continue;
        if (handles[1].revents != 0) return;
        if (ready == 0) endLife(fmt::format("has been silent for {} s", patience.count()), cleanUp, log);
        char bytes[4096];
        const ssize_t got = ::read(STDIN_FILENO, bytes, sizeof bytes);
        if (got == 0 || (got < 0 && errno != EINTR && errno != EAGAIN)) endLife("is gone", cleanUp, log);
    }
}

}  // namespace

Expected<LifeLine> LifeLine::hold(std::chrono::seconds patience, std::function<void()> cleanUp, Log& log) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0)
        return fail(ErrorCode::kFailed, fmt::format("--while-input: {}", std::strerror(errno)));
    LifeLine line;
    line.stop_ = FileHandle(ends[1]);
    line.reader_ = std::thread([heard = ends[0], patience, cleanUp = std::move(cleanUp), &log] {
        const FileHandle stop(heard);
        readUntilStopped(stop.get(), patience, cleanUp, log);
    });
    return line;
}

LifeLine::~LifeLine() {
    stop_ = FileHandle();  // the other end sees that
    if (reader_.joinable()) reader_.join();
}

}  // namespace tessera
