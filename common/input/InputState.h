/// What somebody does with mouse, keyboard and game pad, as it goes from a window over its host to the server.
///
/// Whole states, never events: keys and sticks as they are now, ways of the mouse and the wheel as sums since the
/// source began, and how often each action has been asked for. Whoever has missed some states knows from the next all
/// that they said, so that states may be left out, and nothing sticks. Plain numbers, all of whose values mean
/// something: nothing can be wrong with one. The bytes are those of the little-endian machines that Tessera runs on.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace tessera {

/// What is asked for once, not held.
enum class InputAction : std::uint8_t {
    kHome,    ///< to the first view
    kFit,     ///< to where what is below the cursor, else the whole scene, fills the wall
    kFitAll,  ///< the whole scene in any case
    kFly,
    kOrbit,
    kWalk,
    kNextMode,
    kLevel,               ///< upright again
    kGrab,                ///< a drag begins at the cursor: what is there is what orbits turn around
    kGoTo1,               ///< and the eight bookmarks after it
    kKeep1 = kGoTo1 + 9,  ///< the view becomes bookmark 1, and so on
};
inline constexpr std::size_t kBookmarks = 9;
inline constexpr std::size_t kInputActions = static_cast<std::size_t>(InputAction::kKeep1) + kBookmarks;

struct InputState {
    /// Of a window: its tile among those of its host. Applications have one source.
    std::uint32_t source = 0;

    enum Held : std::uint32_t { kFaster = 1 };
    std::uint32_t held = 0;

    // Sums since the source began, counted around without end. A window's height is kUnit, and so is a click of the
    // wheel.
    static constexpr std::int64_t kUnit = 65536;
    std::uint64_t lookRight = 0, lookDown = 0;  ///< drags that turn
    std::uint64_t panRight = 0, panDown = 0;    ///< drags that shift
    std::uint64_t wheel = 0;                    ///< away from the person

    // Keys and sticks: kFull is all the way.
    static constexpr std::int16_t kFull = 32767;
    std::int16_t right = 0, up = 0, back = 0;
    std::int16_t turnRight = 0, turnUp = 0, rollRight = 0;

    /// Of the newest grab or fit, in the tile's picture from the upper left: 65535 is the right or the lower edge.
    std::uint16_t cursorX = 32768, cursorY = 32768;

    /// How often each InputAction has been asked for, counted around.
    std::array<std::uint16_t, 28> asked{};

    void ask(InputAction action) { ++asked[static_cast<std::size_t>(action)]; }
    void ask(InputAction first, std::size_t number) { ++asked[static_cast<std::size_t>(first) + number]; }
    /// Nothing is held any more; what has been done stays done.
    void release() {
        held = 0;
        right = up = back = turnRight = turnUp = rollRight = 0;
    }
    [[nodiscard]] bool atRest() const { return (right | up | back | turnRight | turnUp | rollRight) == 0; }
    bool operator==(const InputState&) const = default;
};
static_assert(kInputActions <= std::tuple_size_v<decltype(InputState::asked)>);
static_assert(std::has_unique_object_representations_v<InputState> && sizeof(InputState) == 120);

}  // namespace tessera
