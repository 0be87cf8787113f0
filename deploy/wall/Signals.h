/// The signals a launcher lives by, as a file handle to poll.
#pragma once

#include "common/base/Error.h"

namespace tessera {

/// Keeps SIGINT, SIGTERM, SIGHUP (unless it is ignored) and SIGCHLD from interrupting anything as long as it lives;
/// SIGPIPE is ignored, so that a reader who went away shows as an error of write. One per process; start threads
/// afterwards.
class Signals {
public:
    [[nodiscard]] static Expected<Signals> take();
    ~Signals();
    Signals(Signals&& other) noexcept;
    Signals(const Signals&) = delete;
    Signals& operator=(const Signals&) = delete;
    Signals& operator=(Signals&&) = delete;

    /// Readable when a signal has come.
    [[nodiscard]] int handle() const { return handle_; }
    /// Takes what has come; true when somebody asks for the end (SIGINT, SIGTERM, or SIGHUP: the terminal has gone).
    [[nodiscard]] bool takeStopRequest();

private:
    explicit Signals(int handle) : handle_(handle) {}
    int handle_ = -1;
};

}  // namespace tessera
