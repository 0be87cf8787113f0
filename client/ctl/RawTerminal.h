/// The terminal that a person sits at, key by key.
#pragma once

#include <termios.h>

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/Error.h"

namespace tessera {

/// Standard input without lines, echo and signals, for as long as this lives.
class RawTerminal {
public:
    /// kUsage: standard input is none; `verb` and `instead` are for that message.
    [[nodiscard]] static Expected<RawTerminal> open(std::string_view verb, std::string_view instead);
    ~RawTerminal();
    RawTerminal(RawTerminal&& other) noexcept;
    RawTerminal& operator=(RawTerminal&&) = delete;

    /// What has been typed within `wait`, empty where nothing has. Nothing: the terminal is gone.
    [[nodiscard]] std::optional<std::string> typed(std::chrono::milliseconds wait) const;

private:
    RawTerminal() = default;
    termios before_{};
    bool changed_ = false;
};

/// Takes SIGINT, SIGTERM and SIGHUP for a wish to leave, for as long as this lives. One at a time.
class WishToLeave {
public:
    WishToLeave();
    ~WishToLeave();
    WishToLeave(const WishToLeave&) = delete;
    WishToLeave& operator=(const WishToLeave&) = delete;
    [[nodiscard]] static bool there();
};

}  // namespace tessera
