/// A desktop without a screen (Xvfb) whose keyboard and mouse a test uses, through the server's own XTEST extension.
#pragma once

#include <string>

#include "common/base/FileHandle.h"
#include "common/image/Picture.h"
#include "tests/integration/Process.h"

namespace tessera::test {

/// Keycodes of a keyboard as Xvfb has one (evdev's: the kernel's number of the key, and 8).
enum class DesktopKey : unsigned char { kW = 25, kD = 40, kTab = 23, kHome = 110, kF1 = 67 };

class InputDesktop {
public:
    InputDesktop(const std::string& folder, int widthPx, int heightPx);
    /// ":7"; empty: it did not start, or does not let itself be used.
    [[nodiscard]] const std::string& display() const { return display_; }
    [[nodiscard]] Process& server() { return server_; }

    [[nodiscard]] Picture screenshot() const;
    void key(DesktopKey key, bool down) { fake(down ? 2 : 3, static_cast<unsigned char>(key), 0, 0); }
    void button(unsigned char number, bool down) { fake(down ? 4 : 5, number, 0, 0); }
    void pointer(int x, int y) { fake(6, 0, x, y); }

private:
    bool connect();
    void fake(unsigned char type, unsigned char detail, int x, int y);

    Process server_;
    std::string screen_;
    std::string display_;
    FileHandle link_;
    unsigned char opcode_ = 0;
};

}  // namespace tessera::test
