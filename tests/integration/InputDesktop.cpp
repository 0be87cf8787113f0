#include "tests/integration/InputDesktop.h"

#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cstring>

#include <fmt/format.h>

#include "tests/integration/Desktop.h"

namespace tessera::test {
namespace {

bool sendAll(int to, const std::string& bytes) {
    return ::send(to, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
}
/// Exactly so many; empty where they do not come.
std::string receive(int from, std::size_t size) {
    std::string bytes(size, '\0');
    return ::recv(from, bytes.data(), size, MSG_WAITALL) == static_cast<ssize_t>(size) ? bytes : std::string();
}
std::string u16(int value) {
    return {static_cast<char>(value & 0xff), static_cast<char>(value >> 8 & 0xff)};
}

}  // namespace

InputDesktop::InputDesktop(const std::string& folder, int widthPx, int heightPx)
    : server_(folder, "xvfb-input",
              {"/usr/bin/Xvfb", "-displayfd", "1", "-screen", "0", fmt::format("{}x{}x24", widthPx, heightPx), "-fbdir",
               folder, "-nolisten", "tcp", "-noreset"}),
      screen_(folder + "/Xvfb_screen0") {
    display_ = Desktop::displayOf(server_);
    if (!display_.empty() && !connect()) display_.clear();
}

/// The handshake of X11, and which number XTEST has here (X Window System Protocol, chapters 8 and 9; XTEST's, chapter
/// 2).
bool InputDesktop::connect() {
    link_ = FileHandle(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
    const std::string path = "/tmp/.X11-unix/X" + display_.substr(1);
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    if (::connect(link_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return false;
    if (!sendAll(link_.get(), "l" + std::string(1, '\0') + u16(11) + u16(0) + u16(0) + u16(0) + u16(0))) return false;
    const std::string begun = receive(link_.get(), 8);
    if (begun.empty() || begun[0] != 1) return false;
    const std::size_t more = 4 * (static_cast<unsigned char>(begun[6]) +
                                  256 * static_cast<std::size_t>(static_cast<unsigned char>(begun[7])));
    if (receive(link_.get(), more).size() != more) return false;
    if (!sendAll(link_.get(), std::string{98, 0} + u16(4) + u16(5) + u16(0) + "XTEST" + std::string(3, '\0')))
        return false;
    const std::string found = receive(link_.get(), 32);
    if (found.empty() || found[0] != 1 || found[8] == 0) return false;
    opcode_ = static_cast<unsigned char>(found[9]);
    return true;
}

Picture InputDesktop::screenshot() const {
    return Desktop::screenshotIn(screen_);
}

void InputDesktop::fake(unsigned char type, unsigned char detail, int x, int y) {
    std::string event(32, '\0');
    event[0] = static_cast<char>(type);
    event[1] = static_cast<char>(detail);
    event.replace(20, 4, u16(x) + u16(y));
    (void)sendAll(link_.get(), std::string{static_cast<char>(opcode_), 2} + u16(9) + event);
}

}  // namespace tessera::test
