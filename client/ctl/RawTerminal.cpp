#include "client/ctl/RawTerminal.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <utility>

namespace tessera {
namespace {

constexpr std::array kSignals{SIGINT, SIGTERM, SIGHUP};
volatile std::sig_atomic_t wished = 0;
std::array<struct sigaction, kSignals.size()> handlersBefore;

}  // namespace

Expected<RawTerminal> RawTerminal::open(std::string_view verb, std::string_view instead) {
    RawTerminal terminal;
    if (::tcgetattr(STDIN_FILENO, &terminal.before_) != 0)
        return fail(ErrorCode::kUsage, fmt::format("{}: standard input is no terminal; {}", verb, instead));
    termios raw = terminal.before_;
    ::cfmakeraw(&raw);
    raw.c_oflag |= OPOST;  // lines of help begin where lines begin
    if (::tcsetattr(STDIN_FILENO, TCSANOW, &raw) != 0)
        return fail(ErrorCode::kFailed, fmt::format("{}: the terminal cannot be set to single keys", verb));
    terminal.changed_ = true;
    return terminal;
}

RawTerminal::~RawTerminal() {
    if (changed_) ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
}

RawTerminal::RawTerminal(RawTerminal&& other) noexcept
    : before_(other.before_), changed_(std::exchange(other.changed_, false)) {}

std::optional<std::string> RawTerminal::typed(std::chrono::milliseconds wait) const {
    pollfd waiting{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
    if (::poll(&waiting, 1, static_cast<int>(wait.count())) <= 0) return std::string();
    std::array<char, 256> bytes;
    const ssize_t size = ::read(STDIN_FILENO, bytes.data(), bytes.size());
    if (size == 0 || (size < 0 && errno != EINTR && errno != EAGAIN)) return std::nullopt;
    return std::string(bytes.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
}

WishToLeave::WishToLeave() {
    wished = 0;
    struct sigaction noted {};
    noted.sa_handler = [](int) { wished = 1; };
    for (std::size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &noted, &handlersBefore[i]);
}

WishToLeave::~WishToLeave() {
    for (std::size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &handlersBefore[i], nullptr);
}

bool WishToLeave::there() {
    return wished != 0;
}

}  // namespace tessera
