/// What a program tells the service manager that has started it and watches it: sd_notify(3) of systemd, in a few
/// lines.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/Clock.h"

namespace tessera {

/// Datagrams to the socket that NOTIFY_SOCKET names. Where there is none nothing is said, and each call costs nothing.
/// One that is not taken at once is lost: nobody waits.
///
/// The watchdog is fed by whoever does the work, in `turned`: a thread that hangs starves it, and systemd starts the
/// program anew. For one thread, but for `stopping`.
class ServiceNotifier {
public:
    /// Nobody.
    ServiceNotifier() = default;
    /// Of this process, by its environment, which loses these variables: children do not speak for it. While the
    /// process has one thread.
    [[nodiscard]] static ServiceNotifier ofThisProcess();

    [[nodiscard]] bool isThere() const { return socket_ != nullptr; }

    /// This program does what it was started for, from now on.
    void ready();
    /// Its end has begun.
    void stopping() const;
    /// What it does, in a line.
    void status(const std::string& text);
    /// Each turn of the loop that is watched. `works`: it gets on, or has nothing to do; without that since the
    /// watchdog was fed last it is not fed again. `describe` is asked every two seconds at most.
    void turned(TimePoint now, bool works, const std::function<std::string()>& describe);

private:
    class Socket;
    void say(std::string_view words) const;

    std::shared_ptr<const Socket> socket_;  ///< null: nobody is told
    Duration feedEvery_{};                  ///< zero: there is no watchdog
    TimePoint feedAt_{}, describeAt_{};
    bool worked_ = false;  ///< since the watchdog was fed
    std::string said_;     ///< the status
};

/// How fast frames go by, for a status.
class PaceOfFrames {
public:
    /// So many have been shown, or the newest has this number.
    void shown(std::uint64_t frames) { frames_ = frames; }
    /// "frame 1200, 60 a second": since this was asked before.
    [[nodiscard]] std::string text(TimePoint now);

private:
    std::uint64_t frames_ = 0, framesBefore_ = 0;
    std::optional<TimePoint> before_;
};

}  // namespace tessera
