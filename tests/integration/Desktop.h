/// A desktop without a screen (Xvfb), for tests of windows.
#pragma once

#include <fmt/format.h>

#include <chrono>
#include <sstream>
#include <string>

#include "common/image/Picture.h"
#include "tests/integration/LiveWall.h"
#include "tests/unit/Eventually.h"

namespace tessera::test {

/// An X server whose screen lies in a file in the format of xwd (X11/XWDFile.h: 25 numbers, most significant byte
/// first, a name, colours, rows).
/// It stays as it is when the last client leaves: one that begins anew meanwhile refuses the next.
class Desktop {
public:
    Desktop(const std::string& folder, int widthPx, int heightPx)
        : file_(folder + "/Xvfb_screen0"),
          server_(folder, "xvfb",
                  {"/usr/bin/Xvfb", "-displayfd", "1", "-screen", "0", fmt::format("{}x{}x24", widthPx, heightPx),
                   "-fbdir", folder, "-nolisten", "tcp", "-noreset"}),
          display_(displayOf(server_)) {}
    /// Waits until an Xvfb with `-displayfd 1` says its display. Empty: it ended without, or has not said it in time.
    [[nodiscard]] static std::string displayOf(Process& server) {
        std::string display;
        (void)eventually([&] {
            const bool ended = !server.running();
            display = displayIn(server.output());
            return ended || !display.empty();
        });
        return display;
    }
    /// What `-displayfd 1` says, among complaints about displays that others have taken; empty as long as it has not.
    [[nodiscard]] static std::string displayIn(const std::string& said) {
        std::istringstream lines(said);
        for (std::string line; std::getline(lines, line) && !lines.eof();)
            if (!line.empty() && line.find_first_not_of("0123456789") == std::string::npos) return ":" + line;
        return {};
    }
    /// Empty: it did not start.
    [[nodiscard]] const std::string& display() const { return display_; }
    [[nodiscard]] Process& server() { return server_; }

    [[nodiscard]] Picture screenshot() const { return screenshotIn(file_); }
    /// What an Xvfb with `-fbdir` keeps there.
    [[nodiscard]] static Picture screenshotIn(const std::string& file) {
        const std::string bytes = readText(file);
        const auto number = [&](std::size_t i) {
            std::uint32_t value = 0;
            for (std::size_t b = 0; b < 4; ++b) value = value << 8 | static_cast<std::uint8_t>(bytes.at(4 * i + b));
            return value;
        };
        const std::size_t pitch = number(12), from = number(0) + 12 * std::size_t{number(19)};
        Picture picture = Picture::filled(static_cast<int>(number(4)), static_cast<int>(number(5)), 0, 0, 0);
        for (std::size_t y = 0, to = 0; y < number(5); ++y)
            for (std::size_t x = 0; x < number(4); ++x)
                for (std::size_t c = 3; c-- > 0;)
                    picture.rgb[to++] = static_cast<std::uint8_t>(bytes.at(from + y * pitch + 4 * x + c));
        return picture;
    }
    /// Until it looks like `wanted`.
    [[nodiscard]] bool waitFor(const Picture& wanted, std::chrono::seconds patience) const {
        return eventually([&] { return screenshot() == wanted; }, patience);
    }

    /// Where it does not look like `wanted`, for messages: how many pixels, and the first and the last of them.
    [[nodiscard]] std::string difference(const Picture& wanted) const {
        const Picture is = screenshot();
        if (is.widthPx != wanted.widthPx || is.heightPx != wanted.heightPx)
            return fmt::format("{} x {} pixels", is.widthPx, is.heightPx);
        std::size_t count = 0, first = 0, last = 0;
        for (std::size_t i = 0; i < is.rgb.size(); ++i)
            if (is.rgb[i] != wanted.rgb[i]) {
                last = i / 3;
                if (count++ == 0) first = last;
            }
        const auto width = static_cast<std::size_t>(is.widthPx);
        return fmt::format("{} bytes are otherwise, from ({}, {}) to ({}, {})", count, first % width, first / width,
                           last % width, last / width);
    }

private:
    std::string file_;
    Process server_;
    std::string display_;
};

}  // namespace tessera::test
