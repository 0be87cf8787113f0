/// What somebody does at a window, as a whole state: mouse, keyboard, game pads.
#pragma once

#include <SDL2/SDL.h>

#include <array>
#include <map>
#include <string_view>

#include "client/window/Monitors.h"
#include "common/base/FileHandle.h"
#include "common/input/HandInput.h"

namespace tessera {

/// Folds SDL's events into an InputState. Keys count by where they are on the keyboard, so that the four under the left
/// hand are there on every one. Whatever is held is released when the window loses the keyboard. The process' main
/// thread.
class WindowInput {
public:
    WindowInput();
    ~WindowInput();
    WindowInput(const WindowInput&) = delete;
    WindowInput& operator=(const WindowInput&) = delete;

    /// Any event; those that are none of its own leave the state as it is. True: the keys are asked for (F1 or H).
    bool take(const SDL_Event& event);
    [[nodiscard]] const InputState& state() const { return state_; }
    /// Of what stands in the window: where a window has another shape, there is black beside it, and the cursor counts
    /// within the picture.
    void pictureIs(int widthPx, int heightPx);

    /// Which key does what, for a terminal.
    [[nodiscard]] static std::string_view keys();

private:
    struct Pad {
        SDL_GameController* controller = nullptr;
        std::array<std::int16_t, SDL_CONTROLLER_AXIS_MAX> axes{};
        std::array<bool, SDL_CONTROLLER_BUTTON_MAX> buttons{};
    };

    bool keyDown(const SDL_KeyboardEvent& key);
    void padButton(SDL_GameControllerButton button);
    void drag(const SDL_MouseMotionEvent& motion);
    void point(Uint32 window, int x, int y);
    [[nodiscard]] DesktopRect pictureIn(Uint32 window) const;
    void release();
    void fold();
    [[nodiscard]] bool held(std::initializer_list<SDL_Scancode> keys) const;

    InputState state_;
    std::array<bool, SDL_NUM_SCANCODES> keys_{};
    std::uint32_t buttons_ = 0;  ///< of the mouse: SDL_BUTTON masks
    int x_ = 0, y_ = 0;          ///< of the mouse
    Uint32 window_ = 0;
    int pictureWidth_ = 0, pictureHeight_ = 0;  ///< 0: it fills the window
    bool hand_ = false;                         ///< the left button took hold, and is down
    std::map<SDL_JoystickID, Pad> pads_;
    double lookRight_ = 0, lookDown_ = 0, panRight_ = 0, panDown_ = 0, wheel_ = 0;  ///< parts of a unit that are left
};

/// The way of states to the client that opened this window: a socket of packets. Never waits; a state that finds no
/// room goes with the next, or a moment later.
class InputPipe {
public:
    /// `descriptor`: below 0 leads nowhere. It is this object's from now on.
    explicit InputPipe(int descriptor);
    /// Call after each event, and when the wait for one is over.
    void say(const InputState& state, bool moreEventsWait);
    /// How long an event may be waited for, in SDL's words: -1 is without end.
    [[nodiscard]] int patienceMs() const { return owed_ ? 20 : -1; }

private:
    FileHandle socket_;
    InputState said_;
    bool begun_ = false, owed_ = false;
    Uint64 saidAt_ = 0;  ///< ms
};

}  // namespace tessera
