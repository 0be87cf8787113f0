#include "server/sim/navigation/HandleInput.h"

#include <algorithm>

#include <fmt/format.h>

#include "server/sim/frame/Simulation.h"

namespace tessera {
namespace {

/// Connections count up from 1 and never come so far.
constexpr std::uint64_t kFirstHolder = std::uint64_t{1} << 62;
/// Of edits that nobody waits for.
constexpr std::uint64_t kHandTicket = ~std::uint64_t{4};
constexpr std::size_t kMostRemarks = 16;

double heights(std::uint64_t units) {
    return static_cast<double>(static_cast<std::int64_t>(units)) / static_cast<double>(InputState::kUnit);
}

void limitHand(double& at) {
    at = std::clamp(at, -HandleInput::kFarthest, HandleInput::kFarthest);
}

constexpr std::size_t kGrabs = static_cast<std::size_t>(InputAction::kGrab);

/// Counts go around.
std::uint16_t more(std::uint16_t now, std::uint16_t before) {
    return static_cast<std::uint16_t>(now - before);
}

}  // namespace

HandleInput::Hand& HandleInput::handOf(const Source& source) {
    Hand& hand = hands_[source];
    if (hand.holder == 0) hand.holder = kFirstHolder + ++holders_;
    return hand;
}

InputState HandleInput::take(const std::string& who, const InputState& state, const Aim& aim) {
    const Source source(who, state.source);
    InputState left = state;
    left.held &= ~kHandHolds;
    left.asked[kHandTakes] = 0;
    const auto known = hands_.find(source);
    if (known == hands_.end()) {
        const auto first = hands_.lower_bound({who, 0});
        std::size_t others = 0;
        for (auto it = first; it != hands_.end() && it->first.first == who; ++it) ++others;
        if (others < kMostSources) handOf(source).newest = state;
        return left;
    }
    Hand& hand = known->second;
    const InputState before = std::exchange(hand.newest, state);
    if (state.asked[kHandTakes] != before.asked[kHandTakes]) {
        follow(source, hand);
        open(hand);
        hand.x = state.cursorX / 65535.0;
        hand.y = state.cursorY / 65535.0;
        if (const std::optional<Ray> ray = aim.rayAt(hand.x, hand.y)) grab(source, hand, *ray);
    }
    if (hand.grip != Grip::kNone && !hand.opening) {
        const std::uint64_t lookRight = state.lookRight - before.lookRight, lookDown = state.lookDown - before.lookDown;
        const std::uint64_t panRight = state.panRight - before.panRight, panDown = state.panDown - before.panDown;
        hand.kept.asked[kGrabs] = more(hand.kept.asked[kGrabs], more(before.asked[kGrabs], state.asked[kGrabs]));
        hand.kept.lookRight += lookRight;
        hand.kept.lookDown += lookDown;
        hand.kept.panRight += panRight;
        hand.kept.panDown += panDown;
        if ((lookRight | lookDown | panRight | panDown) != 0) {
            hand.x += (heights(lookRight) + heights(panRight)) * aim.heightPerWidth;
            hand.y += heights(lookDown) + heights(panDown);
            limitHand(hand.x);
            limitHand(hand.y);
            if (std::optional<Ray> ray = aim.rayAt(hand.x, hand.y)) hand.ray = *ray;
        }
        if ((state.held & kHandHolds) == 0) hand.opening = true;
        if (hand.opening && !hand.ray) open(hand);
    }
    left.lookRight -= hand.kept.lookRight;
    left.lookDown -= hand.kept.lookDown;
    left.panRight -= hand.kept.panRight;
    left.panDown -= hand.kept.panDown;
    left.asked[kGrabs] = more(left.asked[kGrabs], hand.kept.asked[kGrabs]);
    return left;
}

void HandleInput::take(const std::vector<WandState>& wands) {
    for (const WandState& wand : wands) {
        const Source source("wand " + wand.name, 0);
        const bool pressed = wand.tracked && (wand.buttons & kWandButton) != 0;
        const auto known = hands_.find(source);
        if (known == hands_.end() && !pressed) continue;
        Hand& hand = handOf(source);
        const Ray ray{.origin = wand.worldPosition, .direction = wand.worldOrientation * -Vec3d::UnitZ()};
        if (pressed && !std::exchange(hand.pressed, pressed)) {
            open(hand);
            grab(source, hand, ray);
        } else if (pressed && hand.grip == Grip::kHolds) {
            hand.ray = ray;
        }
        if (pressed) continue;
        hand.pressed = false;
        hand.opening = hand.grip != Grip::kNone;
        if (hand.opening && !hand.ray) open(hand);
    }
}

void HandleInput::end(const std::string& who) {
    for (auto it = hands_.lower_bound({who, 0}); it != hands_.end() && it->first.first == who;) {
        drags_.release(it->second.holder);
        it = hands_.erase(it);
    }
}

void HandleInput::letGo() {
    for (auto& [source, hand] : hands_) open(hand);
    edits_.clear();
}

void HandleInput::grab(const Source& source, Hand& hand, const Ray& ray) {
    const auto drivers = [this](const ChangeList& list) { return simulation_.drivingWhat(list); };
    const Expected<ManipulatorDrags::Held> held =
        drags_.grab(simulation_.scene(), simulation_.manipulators(), hand.holder, ray, drivers);
    if (!held && held.error().code == ErrorCode::kBadInput) return;  // an eye or a wand out of this world: no ray
    if (!held) remark(source, held.error());
    hand.grip = !held ? Grip::kRefused : held->any ? Grip::kHolds : Grip::kNone;
}

void HandleInput::open(Hand& hand) {
    if (hand.grip == Grip::kHolds) drags_.release(hand.holder);
    hand.grip = Grip::kNone;
    hand.opening = false;
    hand.ray.reset();
}

void HandleInput::follow(const Source& source, Hand& hand) {
    const std::optional<Ray> ray = std::exchange(hand.ray, std::nullopt);
    if (!ray || hand.grip != Grip::kHolds) return;
    const auto drivers = [this](const ChangeList& list) { return simulation_.drivingWhat(list); };
    // Not a number that proposals could name: theirs count from 1 up.
    const Gesture gesture{hand.holder, ~drags_.gesture(hand.holder)};
    Expected<ChangeList> list = drags_.drag(simulation_.scene(), hand.holder, *ray, drivers);
    if (list && !list->empty()) edits_.push_back({.ticket = kHandTicket, .list = std::move(*list), .gesture = gesture});
    if (list || list.error().code != ErrorCode::kRefused) return;
    remark(source, list.error());
    hand.grip = Grip::kRefused;
}

void HandleInput::remark(const Source& source, const Error& error) {
    if (remarks_.size() < kMostRemarks) remarks_.push_back(fmt::format("{}: {}", source.first, error.message));
}

std::vector<Edit> HandleInput::edits() {
    for (auto& [source, hand] : hands_) {
        follow(source, hand);
        if (hand.opening) open(hand);
    }
    return std::exchange(edits_, {});
}

bool HandleInput::holds(const std::string& who, std::uint32_t source) const {
    const auto found = hands_.find({who, source});
    return found != hands_.end() && found->second.grip == Grip::kHolds;
}

}  // namespace tessera
