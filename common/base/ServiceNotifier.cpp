#include "common/base/ServiceNotifier.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "common/base/FileHandle.h"

namespace tessera {
namespace {

constexpr std::chrono::seconds kDescribeEvery(2);  // each status is a signal to all who follow the unit

/// The variable's text, which the environment loses.
std::string takeVariable(const char* name) {
    const char* value = std::getenv(name);
    std::string text = value != nullptr ? value : "";
    ::unsetenv(name);
    return text;
}

std::optional<std::uint64_t> numberIn(const std::string& text) {
    std::uint64_t number = 0;
    const char* end = text.data() + text.size();
    const auto [stopped, error] = std::from_chars(text.data(), end, number);
    return error == std::errc() && stopped == end && !text.empty() ? std::optional(number) : std::nullopt;
}

}  // namespace

class ServiceNotifier::Socket {
public:
    /// "/path" or "@abstract"; null where it is neither, or no socket can be had.
    static std::shared_ptr<const Socket> to(const std::string& name) {
        auto made = std::make_shared<Socket>();
        sockaddr_un& address = made->address_;
        if (name.size() < 2 || name.size() >= sizeof address.sun_path || (name[0] != '/' && name[0] != '@'))
            return nullptr;
        address.sun_family = AF_UNIX;
        std::memcpy(address.sun_path, name.data(), name.size());
        if (name[0] == '@') address.sun_path[0] = '\0';
        // An abstract name is as long as it says; a path ends with a zero.
        made->length_ =
            static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size() + (name[0] == '/' ? 1 : 0));
        made->file_ = FileHandle(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
        return made->file_.get() >= 0 ? made : nullptr;
    }
    void send(std::string_view words) const {
        (void)::sendto(file_.get(), words.data(), words.size(), MSG_NOSIGNAL,
                       reinterpret_cast<const sockaddr*>(&address_), length_);
    }

private:
    FileHandle file_;
    sockaddr_un address_{};
    socklen_t length_ = 0;
};

ServiceNotifier ServiceNotifier::ofThisProcess() {
    ServiceNotifier notifier;
    const std::string socket = takeVariable("NOTIFY_SOCKET");
    const std::optional<std::uint64_t> watchdog = numberIn(takeVariable("WATCHDOG_USEC"));
    const std::string watched = takeVariable("WATCHDOG_PID");
    notifier.socket_ = Socket::to(socket);
    // Three times in the time that is allowed: a turn may be late.
    const bool isOurs = watched.empty() || numberIn(watched) == static_cast<std::uint64_t>(::getpid());
    constexpr std::uint64_t kLongest = std::uint64_t{1} << 40;  // 12 days, in microseconds
    if (watchdog && isOurs && *watchdog < kLongest) notifier.feedEvery_ = std::chrono::microseconds(*watchdog) / 3;
    return notifier;
}

void ServiceNotifier::say(std::string_view words) const {
    if (socket_) socket_->send(words);
}

void ServiceNotifier::ready() {
    say("READY=1\nWATCHDOG=1\n");
}

void ServiceNotifier::stopping() const {
    say("STOPPING=1\n");
}

void ServiceNotifier::status(const std::string& text) {
    if (!socket_ || text == said_) return;
    said_ = text;
    std::string line = text;
    for (char& c : line)
        if (c == '\n') c = ' ';
    say("STATUS=" + line + "\n");
}

void ServiceNotifier::turned(TimePoint now, bool works, const std::function<std::string()>& describe) {
    if (!socket_) return;
    worked_ = worked_ || works;
    if (feedEvery_ > Duration::zero() && worked_ && now >= feedAt_) {
        say("WATCHDOG=1\n");
        feedAt_ = now + feedEvery_;
        worked_ = false;
    }
    if (now < describeAt_) return;
    describeAt_ = now + kDescribeEvery;
    status(describe());
}

std::string PaceOfFrames::text(TimePoint now) {
    const std::optional<TimePoint> before = std::exchange(before_, now);
    const std::uint64_t since = frames_ - std::min(std::exchange(framesBefore_, frames_), frames_);
    if (frames_ == 0) return "no frame yet";
    if (!before || since == frames_) return fmt::format("frame {}", frames_);  // the first, or those of earlier servers
    const double seconds = std::chrono::duration<double>(now - *before).count();
    return fmt::format("frame {}, {:.0f} a second", frames_, static_cast<double>(since) / seconds);
}

}  // namespace tessera
