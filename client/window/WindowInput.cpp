#include "client/window/WindowInput.h"

#include <algorithm>
#include <cerrno>
#include <cmath>

#include <sys/socket.h>

namespace tessera {
namespace {

/// Of a stick that is let go: it does not come to rest exactly in the middle.
constexpr int kDeadZone = 8000;
/// Events of one moment make one state, unless they never end.
constexpr Uint64 kLongestSilenceMs = 8;

double stick(std::int16_t value) {
    const double way = (std::abs(static_cast<double>(value)) - kDeadZone) / (32767 - kDeadZone);
    return way > 0 ? std::copysign(std::min(way, 1.0), value) : 0;
}

std::int16_t full(double value) {
    return static_cast<std::int16_t>(std::lround(std::clamp(value, -1.0, 1.0) * InputState::kFull));
}

/// Adds to a sum of whole units what is there of them; the rest stays.
void add(std::uint64_t& sum, double& rest, double ways) {
    if (!std::isfinite(ways) || std::abs(ways) > 1e6) return;
    rest += ways * static_cast<double>(InputState::kUnit);
    const double whole = std::trunc(rest);
    rest -= whole;
    sum += static_cast<std::uint64_t>(static_cast<std::int64_t>(whole));
}

/// A window that is closing has no size.
DesktopRect sizeOf(Uint32 window) {
    DesktopRect size;
    if (SDL_Window* const there = SDL_GetWindowFromID(window)) SDL_GetWindowSize(there, &size.width, &size.height);
    return size;
}

std::uint16_t across(int at, int size) {
    return static_cast<std::uint16_t>(std::clamp(std::lround(65535.0 * at / std::max(1, size)), 0l, 65535l));
}

}  // namespace

std::string_view WindowInput::keys() {
    return "W A S D, arrows   go and step aside        mouse, left drag      look; orbit: turn around what is there\n"
           "E, Page Up        up                       middle, right drag,\n"
           "Q, Page Down      down                     Shift and left drag   shift\n"
           "Shift             faster                   wheel                 the pace; orbit: nearer, farther\n"
           "Z, C              roll     L  upright      Tab                   fly, orbit, walk; or F2, F3, F4\n"
           "F                 fit what is below the cursor, else all; Shift+F fit all      Home  back to the first "
           "view\n"
           "left drag from a handle of a manipulator moves, turns or scales what it belongs to; the release ends the "
           "step of undo\n"
           "1 … 9             to a bookmark; Ctrl+1 … 9 keeps one         F1, H  these keys      Escape  closes the "
           "window\n"
           "Game pad: sticks go and look, triggers go up and down, shoulders roll, a pressed left stick is faster;\n"
           "          A next mode, B upright, X fit all, Y home\n";
}

WindowInput::WindowInput() {
    // Without pads there is still the rest.
    SDL_InitSubSystem(SDL_INIT_GAMECONTROLLER);
}

WindowInput::~WindowInput() {
    for (auto& [id, pad] : pads_) SDL_GameControllerClose(pad.controller);
    SDL_QuitSubSystem(SDL_INIT_GAMECONTROLLER);
}

bool WindowInput::held(std::initializer_list<SDL_Scancode> keys) const {
    return std::ranges::any_of(keys, [this](SDL_Scancode key) { return keys_[key]; });
}

void WindowInput::release() {
    keys_ = {};
    buttons_ = 0;
    hand_ = false;
    for (auto& [id, pad] : pads_) {
        pad.axes = {};
        pad.buttons = {};
    }
}

void WindowInput::point(Uint32 window, int x, int y) {
    const DesktopRect picture = pictureIn(window);
    state_.cursorX = across(x - picture.x, picture.width);
    state_.cursorY = across(y - picture.y, picture.height);
}

DesktopRect WindowInput::pictureIn(Uint32 window) const {
    const DesktopRect whole = sizeOf(window);
    if (pictureWidth_ <= 0 || pictureHeight_ <= 0 || whole.width <= 0 || whole.height <= 0) return whole;
    return fitted(pictureWidth_, pictureHeight_, whole.width, whole.height);
}

void WindowInput::pictureIs(int widthPx, int heightPx) {
    pictureWidth_ = widthPx;
    pictureHeight_ = heightPx;
}

bool WindowInput::keyDown(const SDL_KeyboardEvent& key) {
    const SDL_Scancode code = key.keysym.scancode;
    if (code < 0 || code >= SDL_NUM_SCANCODES || key.repeat != 0 || keys_[code]) return false;
    keys_[code] = true;
    const bool control = (key.keysym.mod & KMOD_CTRL) != 0, shift = (key.keysym.mod & KMOD_SHIFT) != 0;
    if (code >= SDL_SCANCODE_1 && code <= SDL_SCANCODE_9) {
        state_.ask(control ? InputAction::kKeep1 : InputAction::kGoTo1,
                   static_cast<std::size_t>(code - SDL_SCANCODE_1));
        return false;
    }
    switch (code) {
        case SDL_SCANCODE_F:
            point(window_, x_, y_);
            state_.ask(shift ? InputAction::kFitAll : InputAction::kFit);
            break;
        case SDL_SCANCODE_HOME:
            state_.ask(InputAction::kHome);
            break;
        case SDL_SCANCODE_TAB:
            state_.ask(InputAction::kNextMode);
            break;
        case SDL_SCANCODE_F2:
            state_.ask(InputAction::kFly);
            break;
        case SDL_SCANCODE_F3:
            state_.ask(InputAction::kOrbit);
            break;
        case SDL_SCANCODE_F4:
            state_.ask(InputAction::kWalk);
            break;
        case SDL_SCANCODE_L:
            state_.ask(InputAction::kLevel);
            break;
        default:
            return code == SDL_SCANCODE_F1 || code == SDL_SCANCODE_H;
    }
    return false;
}

void WindowInput::padButton(SDL_GameControllerButton button) {
    switch (button) {
        case SDL_CONTROLLER_BUTTON_A:
            return state_.ask(InputAction::kNextMode);
        case SDL_CONTROLLER_BUTTON_B:
            return state_.ask(InputAction::kLevel);
        case SDL_CONTROLLER_BUTTON_X:
            return state_.ask(InputAction::kFitAll);
        case SDL_CONTROLLER_BUTTON_Y:
            return state_.ask(InputAction::kHome);
        default:
            return;
    }
}

void WindowInput::drag(const SDL_MouseMotionEvent& motion) {
    x_ = motion.x;
    y_ = motion.y;
    window_ = motion.windowID;
    if (buttons_ == 0) return;
    const int height = pictureIn(motion.windowID).height;
    if (height <= 0) return;
    const bool shifts =
        (buttons_ & (SDL_BUTTON_MMASK | SDL_BUTTON_RMASK)) != 0 || held({SDL_SCANCODE_LSHIFT, SDL_SCANCODE_RSHIFT});
    const double right = static_cast<double>(motion.xrel) / height, down = static_cast<double>(motion.yrel) / height;
    add(shifts ? state_.panRight : state_.lookRight, shifts ? panRight_ : lookRight_, right);
    add(shifts ? state_.panDown : state_.lookDown, shifts ? panDown_ : lookDown_, down);
}

bool WindowInput::take(const SDL_Event& event) {
    bool wantsKeys = false;
    switch (event.type) {
        case SDL_KEYDOWN:
            wantsKeys = keyDown(event.key);
            break;
        case SDL_KEYUP:
            if (event.key.keysym.scancode >= 0 && event.key.keysym.scancode < SDL_NUM_SCANCODES)
                keys_[event.key.keysym.scancode] = false;
            break;
        case SDL_MOUSEMOTION:
            drag(event.motion);
            break;
        case SDL_MOUSEBUTTONDOWN:
            if (event.button.button < SDL_BUTTON_LEFT || event.button.button > SDL_BUTTON_RIGHT) break;
            buttons_ |= SDL_BUTTON(event.button.button);
            point(event.button.windowID, event.button.x, event.button.y);
            state_.ask(InputAction::kGrab);
            if (buttons_ == SDL_BUTTON_LMASK && !held({SDL_SCANCODE_LSHIFT, SDL_SCANCODE_RSHIFT})) {
                ++state_.asked[kHandTakes];
                hand_ = true;
            }
            break;
        case SDL_MOUSEBUTTONUP:
            if (event.button.button == SDL_BUTTON_LEFT) hand_ = false;
            if (event.button.button >= SDL_BUTTON_LEFT && event.button.button <= SDL_BUTTON_RIGHT)
                buttons_ &= ~SDL_BUTTON(event.button.button);
            break;
        case SDL_MOUSEWHEEL:
            add(state_.wheel, wheel_,
                event.wheel.direction == SDL_MOUSEWHEEL_FLIPPED ? -event.wheel.preciseY : event.wheel.preciseY);
            break;
        case SDL_WINDOWEVENT:
            if (event.window.event == SDL_WINDOWEVENT_FOCUS_LOST || event.window.event == SDL_WINDOWEVENT_CLOSE)
                release();
            break;
        case SDL_CONTROLLERDEVICEADDED:
            if (SDL_GameController* const pad = SDL_GameControllerOpen(event.cdevice.which))
                pads_.emplace(SDL_JoystickInstanceID(SDL_GameControllerGetJoystick(pad)), Pad{.controller = pad});
            break;
        case SDL_CONTROLLERDEVICEREMOVED:
            if (const auto pad = pads_.find(event.cdevice.which); pad != pads_.end()) {
                SDL_GameControllerClose(pad->second.controller);
                pads_.erase(pad);
            }
            break;
        case SDL_CONTROLLERAXISMOTION:
            if (const auto pad = pads_.find(event.caxis.which);
                pad != pads_.end() && event.caxis.axis < SDL_CONTROLLER_AXIS_MAX)
                pad->second.axes[event.caxis.axis] = event.caxis.value;
            break;
        case SDL_CONTROLLERBUTTONDOWN:
        case SDL_CONTROLLERBUTTONUP:
            if (const auto pad = pads_.find(event.cbutton.which);
                pad != pads_.end() && event.cbutton.button < SDL_CONTROLLER_BUTTON_MAX) {
                const bool down = event.type == SDL_CONTROLLERBUTTONDOWN;
                if (down && !pad->second.buttons[event.cbutton.button])
                    padButton(static_cast<SDL_GameControllerButton>(event.cbutton.button));
                pad->second.buttons[event.cbutton.button] = down;
            }
            break;
        default:
            return false;
    }
    fold();
    return wantsKeys;
}

void WindowInput::fold() {
    const auto pair = [this](std::initializer_list<SDL_Scancode> forth, std::initializer_list<SDL_Scancode> back) {
        return (held(forth) ? 1.0 : 0.0) - (held(back) ? 1.0 : 0.0);
    };
    // Ctrl is for bookmarks and for what a desktop makes of it.
    const bool control = held({SDL_SCANCODE_LCTRL, SDL_SCANCODE_RCTRL});
    double right = 0, up = 0, back = 0, roll = 0, turnRight = 0, turnUp = 0;
    if (!control) {
        right = pair({SDL_SCANCODE_D, SDL_SCANCODE_RIGHT}, {SDL_SCANCODE_A, SDL_SCANCODE_LEFT});
        up = pair({SDL_SCANCODE_E, SDL_SCANCODE_PAGEUP}, {SDL_SCANCODE_Q, SDL_SCANCODE_PAGEDOWN});
        back = pair({SDL_SCANCODE_S, SDL_SCANCODE_DOWN}, {SDL_SCANCODE_W, SDL_SCANCODE_UP});
        roll = pair({SDL_SCANCODE_C}, {SDL_SCANCODE_Z});
    }
    bool faster = held({SDL_SCANCODE_LSHIFT, SDL_SCANCODE_RSHIFT});
    for (const auto& [id, pad] : pads_) {
        right += stick(pad.axes[SDL_CONTROLLER_AXIS_LEFTX]);
        back += stick(pad.axes[SDL_CONTROLLER_AXIS_LEFTY]);
        turnRight += stick(pad.axes[SDL_CONTROLLER_AXIS_RIGHTX]);
        turnUp -= stick(pad.axes[SDL_CONTROLLER_AXIS_RIGHTY]);
        up += stick(pad.axes[SDL_CONTROLLER_AXIS_TRIGGERRIGHT]) - stick(pad.axes[SDL_CONTROLLER_AXIS_TRIGGERLEFT]);
        roll += (pad.buttons[SDL_CONTROLLER_BUTTON_RIGHTSHOULDER] ? 1 : 0) -
                (pad.buttons[SDL_CONTROLLER_BUTTON_LEFTSHOULDER] ? 1 : 0);
        faster = faster || pad.buttons[SDL_CONTROLLER_BUTTON_LEFTSTICK];
    }
    state_.right = full(right);
    state_.up = full(up);
    state_.back = full(back);
    state_.turnRight = full(turnRight);
    state_.turnUp = full(turnUp);
    state_.rollRight = full(roll);
    state_.held = (faster ? static_cast<std::uint32_t>(InputState::kFaster) : 0u) | (hand_ ? kHandHolds : 0u);
}

InputPipe::InputPipe(int descriptor) : socket_(descriptor) {}

void InputPipe::say(const InputState& state, bool moreEventsWait) {
    if (socket_.get() < 0) return;
    // The first one says where sums and counts begin.
    if (begun_ && !owed_ && state == said_) return;
    const Uint64 now = SDL_GetTicks64();
    if (begun_ && moreEventsWait && now - saidAt_ < kLongestSilenceMs) {
        owed_ = true;
        return;
    }
    const ssize_t sent = ::send(socket_.get(), &state, sizeof state, MSG_DONTWAIT | MSG_NOSIGNAL);
    owed_ = sent != static_cast<ssize_t>(sizeof state);
    if (owed_ && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR && errno != ENOBUFS) {
        // Nobody listens any more.
        owed_ = false;
        socket_.close();
        return;
    }
    if (owed_) return;
    begun_ = true;
    said_ = state;
    saidAt_ = now;
}

}  // namespace tessera
