// What somebody does at a window, folded into states: SDL's own events, under its driver without a display.
#include <gtest/gtest.h>

#include <random>

#include <sys/socket.h>

#include "client/window/WindowInput.h"

namespace tessera {
namespace {

class WindowInputs : public testing::Test {
protected:
    void SetUp() override {
        ::setenv("SDL_VIDEODRIVER", "dummy", 1);
        SDL_SetHint(SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, "1");  // this driver never gives a window the keyboard
        ASSERT_EQ(SDL_Init(SDL_INIT_VIDEO), 0) << SDL_GetError();
        window_ = SDL_CreateWindow("test", 0, 0, 800, 400, 0);
        ASSERT_TRUE(window_);
        input_ = std::make_unique<WindowInput>();
        drain();
    }
    void TearDown() override {
        input_.reset();
        SDL_DestroyWindow(window_);
        SDL_Quit();
    }
    /// Through SDL's queue, as a window's own events come.
    bool push(SDL_Event event) {
        EXPECT_EQ(SDL_PushEvent(&event), 1);
        return drain();
    }
    bool drain() {
        SDL_Event event{};
        bool keys = false;
        while (SDL_PollEvent(&event) == 1) keys = input_->take(event) || keys;
        return keys;
    }
    bool key(SDL_Scancode code, bool down, Uint16 mod = 0, bool repeat = false) {
        SDL_Event event{};
        event.type = down ? SDL_KEYDOWN : SDL_KEYUP;
        event.key.keysym = {.scancode = code, .sym = SDL_GetKeyFromScancode(code), .mod = mod};
        event.key.repeat = repeat;
        event.key.windowID = SDL_GetWindowID(window_);
        return push(event);
    }
    void button(Uint8 which, bool down, int x = 0, int y = 0) {
        SDL_Event event{};
        event.type = down ? SDL_MOUSEBUTTONDOWN : SDL_MOUSEBUTTONUP;
        event.button.button = which;
        event.button.x = x;
        event.button.y = y;
        event.button.windowID = SDL_GetWindowID(window_);
        push(event);
    }
    void motion(int right, int down) {
        SDL_Event event{};
        event.type = SDL_MOUSEMOTION;
        event.motion.xrel = right;
        event.motion.yrel = down;
        event.motion.windowID = SDL_GetWindowID(window_);
        push(event);
    }
    [[nodiscard]] const InputState& state() const { return input_->state(); }
    [[nodiscard]] int asked(InputAction action, std::size_t number = 0) const {
        return state().asked[static_cast<std::size_t>(action) + number];
    }

    SDL_Window* window_ = nullptr;
    std::unique_ptr<WindowInput> input_;
};

TEST_F(WindowInputs, KeysAreHeldUntilTheyAreLetGo) {
    key(SDL_SCANCODE_W, true);
    EXPECT_EQ(state().back, -InputState::kFull);
    key(SDL_SCANCODE_W, true, 0, true);
    key(SDL_SCANCODE_UP, true);
    key(SDL_SCANCODE_W, false);
    EXPECT_EQ(state().back, -InputState::kFull) << "the arrow still is";
    key(SDL_SCANCODE_S, true);
    EXPECT_EQ(state().back, 0) << "forth and back";
    key(SDL_SCANCODE_UP, false);
    EXPECT_EQ(state().back, InputState::kFull);
    key(SDL_SCANCODE_S, false);
    key(SDL_SCANCODE_LSHIFT, true);
    key(SDL_SCANCODE_E, true);
    EXPECT_EQ(state().up, InputState::kFull);
    EXPECT_EQ(state().held, InputState::kFaster);
    key(SDL_SCANCODE_LSHIFT, false);
    key(SDL_SCANCODE_E, false);
    EXPECT_TRUE(state().atRest());
    EXPECT_EQ(state().held, 0u);
}

TEST_F(WindowInputs, WhatIsHeldIsReleasedWithTheKeyboard) {
    key(SDL_SCANCODE_D, true);
    button(SDL_BUTTON_LEFT, true);
    SDL_Event lost{};
    lost.type = SDL_WINDOWEVENT;
    lost.window.event = SDL_WINDOWEVENT_FOCUS_LOST;
    push(lost);
    EXPECT_TRUE(state().atRest());
    const InputState before = state();
    motion(100, 100);
    EXPECT_EQ(state(), before) << "no drag any more";
}

TEST_F(WindowInputs, DragsAreSumsInHeightsOfTheWindow) {
    motion(50, 50);
    EXPECT_EQ(state().lookRight, 0u) << "nothing is dragged";
    button(SDL_BUTTON_LEFT, true, 800, 0);
    EXPECT_EQ(asked(InputAction::kGrab), 1);
    EXPECT_EQ(state().cursorX, 65535);
    EXPECT_EQ(state().cursorY, 0);
    for (int i = 0; i < 100; ++i) motion(1, -2);
    EXPECT_NEAR(static_cast<double>(static_cast<std::int64_t>(state().lookRight)) / InputState::kUnit, 0.25, 1e-4)
        << "of 400 pixels";
    EXPECT_NEAR(static_cast<double>(static_cast<std::int64_t>(state().lookDown)) / InputState::kUnit, -0.5, 1e-4);
    button(SDL_BUTTON_LEFT, false);
    button(SDL_BUTTON_MIDDLE, true);
    motion(40, 0);
    button(SDL_BUTTON_MIDDLE, false);
    EXPECT_NEAR(static_cast<double>(state().panRight) / InputState::kUnit, 0.1, 1e-4);
    key(SDL_SCANCODE_RSHIFT, true);
    button(SDL_BUTTON_LEFT, true);
    motion(40, 0);
    EXPECT_NEAR(static_cast<double>(state().panRight) / InputState::kUnit, 0.2, 1e-4) << "Shift shifts";
}

TEST_F(WindowInputs, TheLeftButtonTakesHoldAndHoldsUntilItIsLetGo) {
    const auto takes = [this] { return state().asked[kHandTakes]; };
    const auto holds = [this] { return (state().held & kHandHolds) != 0; };
    button(SDL_BUTTON_LEFT, true, 200, 100);
    EXPECT_EQ(takes(), 1);
    EXPECT_TRUE(holds());
    EXPECT_EQ(asked(InputAction::kGrab), 1) << "the view's, too";
    motion(40, 0);
    EXPECT_EQ(state().cursorX, 16384) << "where it was taken: the way since is in the sums";
    button(SDL_BUTTON_LEFT, false);
    EXPECT_FALSE(holds());
    EXPECT_EQ(takes(), 1);
    for (const Uint8 other : {SDL_BUTTON_MIDDLE, SDL_BUTTON_RIGHT}) {
        button(other, true);
        button(SDL_BUTTON_LEFT, true);
        EXPECT_FALSE(holds()) << "not beside another button";
        button(SDL_BUTTON_LEFT, false);
        button(other, false);
    }
    key(SDL_SCANCODE_LSHIFT, true);
    button(SDL_BUTTON_LEFT, true);
    EXPECT_FALSE(holds()) << "Shift shifts";
    button(SDL_BUTTON_LEFT, false);
    key(SDL_SCANCODE_LSHIFT, false);
    EXPECT_EQ(takes(), 1);
    button(SDL_BUTTON_LEFT, true);
    EXPECT_TRUE(holds());
    SDL_Event lost{};
    lost.type = SDL_WINDOWEVENT;
    lost.window.event = SDL_WINDOWEVENT_FOCUS_LOST;
    push(lost);
    EXPECT_FALSE(holds()) << "without the keyboard it holds nothing";
}

TEST_F(WindowInputs, TheCursorCountsWithinThePictureWhereThereIsBlackBesideIt) {
    input_->pictureIs(100, 100);  // in 800 x 400: 400 x 400 from 200 on
    button(SDL_BUTTON_LEFT, true, 200, 0);
    EXPECT_EQ(state().cursorX, 0);
    button(SDL_BUTTON_LEFT, false);
    button(SDL_BUTTON_LEFT, true, 400, 100);
    EXPECT_EQ(state().cursorX, 32768);
    EXPECT_EQ(state().cursorY, 16384);
    button(SDL_BUTTON_LEFT, false);
    button(SDL_BUTTON_LEFT, true, 799, 399);
    EXPECT_EQ(state().cursorX, 65535) << "beside it counts as its edge";
    button(SDL_BUTTON_LEFT, false);
    input_->pictureIs(800, 200);  // 100 rows of black above
    button(SDL_BUTTON_LEFT, true, 0, 150);
    EXPECT_EQ(state().cursorY, 16384);
    motion(0, 50);
    EXPECT_NEAR(static_cast<double>(state().lookDown) / InputState::kUnit, 0.25, 1e-4) << "of 200 pixels";
}

TEST_F(WindowInputs, WheelAndActionsCount) {
    SDL_Event wheel{};
    wheel.type = SDL_MOUSEWHEEL;
    wheel.wheel.preciseY = 0.25f;
    for (int i = 0; i < 6; ++i) push(wheel);
    wheel.wheel.direction = SDL_MOUSEWHEEL_FLIPPED;
    push(wheel);
    EXPECT_EQ(state().wheel, static_cast<std::uint64_t>(1.25 * InputState::kUnit));
    key(SDL_SCANCODE_3, true);
    key(SDL_SCANCODE_3, false);
    EXPECT_EQ(asked(InputAction::kGoTo1, 2), 1);
    key(SDL_SCANCODE_LCTRL, true, KMOD_LCTRL);
    key(SDL_SCANCODE_9, true, KMOD_LCTRL);
    EXPECT_EQ(asked(InputAction::kKeep1, 8), 1);
    EXPECT_EQ(asked(InputAction::kGoTo1, 8), 0);
    key(SDL_SCANCODE_LCTRL, false);
    key(SDL_SCANCODE_F, true);
    key(SDL_SCANCODE_HOME, true);
    key(SDL_SCANCODE_TAB, true);
    key(SDL_SCANCODE_TAB, true, 0, true);
    EXPECT_EQ(asked(InputAction::kFit), 1);
    EXPECT_EQ(asked(InputAction::kHome), 1);
    EXPECT_EQ(asked(InputAction::kNextMode), 1) << "a repeat is no press";
    EXPECT_TRUE(key(SDL_SCANCODE_F1, true));
    EXPECT_TRUE(key(SDL_SCANCODE_H, true));
    EXPECT_FALSE(key(SDL_SCANCODE_L, true));
    EXPECT_FALSE(WindowInput::keys().empty());
}

/// Any events at all: what is held afterwards is what SDL says is down, and nothing else.
TEST_F(WindowInputs, WhateverComesTheKeysAreThoseThatAreDown) {
    const unsigned seed = std::random_device{}();
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937 random(seed);
    std::array<bool, SDL_NUM_SCANCODES> down{};
    const std::array codes = {SDL_SCANCODE_W, SDL_SCANCODE_S,  SDL_SCANCODE_A,
                              SDL_SCANCODE_D, SDL_SCANCODE_UP, SDL_SCANCODE_LEFT};
    for (int i = 0; i < 5000; ++i) {
        const SDL_Scancode code = codes[random() % codes.size()];
        switch (random() % 5) {
            case 0:
            case 1:
                key(code, true);
                down[code] = true;
                break;
            case 2:
                key(code, false);
                down[code] = false;
                break;
            case 3: {
                SDL_Event event{};
                event.type = SDL_CONTROLLERAXISMOTION;  // of a pad that nobody has opened
                event.caxis.which = static_cast<SDL_JoystickID>(random() % 5);
                event.caxis.axis = static_cast<Uint8>(random());
                event.caxis.value = static_cast<Sint16>(random());
                push(event);
                break;
            }
            default: {
                SDL_Event event{};
                event.type = SDL_MOUSEBUTTONDOWN;
                event.button.button = static_cast<Uint8>(random());
                event.button.windowID = random() % 3;
                push(event);
                motion(static_cast<int>(random()), static_cast<int>(random()));
            }
        }
        const auto is = [&](SDL_Scancode a, SDL_Scancode b) { return down[a] || down[b] ? 1 : 0; };
        ASSERT_EQ(state().back,
                  InputState::kFull * ((down[SDL_SCANCODE_S] ? 1 : 0) - is(SDL_SCANCODE_W, SDL_SCANCODE_UP)));
        ASSERT_EQ(state().right,
                  InputState::kFull * ((down[SDL_SCANCODE_D] ? 1 : 0) - is(SDL_SCANCODE_A, SDL_SCANCODE_LEFT)));
    }
}

TEST_F(WindowInputs, GamePadsComeAddUpAndGo) {
    std::array<SDL_Joystick*, 2> pads{};
    std::array<int, 2> devices{};
    for (std::size_t i = 0; i < 2; ++i) {
        devices[i] = SDL_JoystickAttachVirtual(SDL_JOYSTICK_TYPE_GAMECONTROLLER, SDL_CONTROLLER_AXIS_MAX,
                                               SDL_CONTROLLER_BUTTON_MAX, 0);
        ASSERT_GE(devices[i], 0) << SDL_GetError();
        drain();
        pads[i] = SDL_JoystickOpen(devices[i]);
        ASSERT_TRUE(pads[i]) << SDL_GetError();
    }
    const auto update = [&] {
        SDL_JoystickUpdate();
        drain();
    };
    SDL_JoystickSetVirtualAxis(pads[0], SDL_CONTROLLER_AXIS_LEFTX, 5000);
    update();
    EXPECT_EQ(state().right, 0) << "nobody touches it";
    SDL_JoystickSetVirtualAxis(pads[0], SDL_CONTROLLER_AXIS_LEFTX, 20000);
    SDL_JoystickSetVirtualAxis(pads[0], SDL_CONTROLLER_AXIS_RIGHTY, -32768);
    update();
    const std::int16_t one = state().right;
    EXPECT_NEAR(one, InputState::kFull * (20000.0 - 8000) / (32767 - 8000), 2);
    EXPECT_EQ(state().turnUp, InputState::kFull);
    SDL_JoystickSetVirtualAxis(pads[1], SDL_CONTROLLER_AXIS_LEFTX, 12000);
    SDL_JoystickSetVirtualButton(pads[1], SDL_CONTROLLER_BUTTON_Y, 1);
    SDL_JoystickSetVirtualButton(pads[1], SDL_CONTROLLER_BUTTON_RIGHTSHOULDER, 1);
    update();
    EXPECT_GT(state().right, one) << "they add up";
    EXPECT_EQ(state().rollRight, InputState::kFull);
    EXPECT_EQ(asked(InputAction::kHome), 1);
    for (SDL_Joystick* pad : pads) SDL_JoystickClose(pad);
    SDL_JoystickDetachVirtual(devices[1]);
    SDL_JoystickDetachVirtual(devices[0]);
    update();
    EXPECT_TRUE(state().atRest()) << "a pad that is pulled out holds nothing";
}

TEST_F(WindowInputs, AFullSocketOwesTheStateAndNobodyWaits) {
    int ends[2];
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends), 0);
    InputPipe pipe(ends[0]);
    InputState said;
    pipe.say(said, false);
    while (pipe.patienceMs() < 0) {
        ++said.wheel;
        pipe.say(said, false);
    }
    const std::uint64_t last = ++said.wheel;
    pipe.say(said, false);
    EXPECT_GT(pipe.patienceMs(), 0);
    InputState heard;
    while (::recv(ends[1], &heard, sizeof heard, MSG_DONTWAIT) == static_cast<ssize_t>(sizeof heard)) {
    }
    EXPECT_LT(heard.wheel, last);
    pipe.say(said, false);
    EXPECT_LT(pipe.patienceMs(), 0);
    ASSERT_EQ(::recv(ends[1], &heard, sizeof heard, MSG_DONTWAIT), static_cast<ssize_t>(sizeof heard));
    EXPECT_EQ(heard, said);
    ::close(ends[1]);
    ++said.wheel;
    pipe.say(said, false);  // and nothing happens where nobody listens
    pipe.say(said, false);
    EXPECT_LT(pipe.patienceMs(), 0);
}

}  // namespace
}  // namespace tessera
