#include "server/sim/navigation/InputSources.h"

#include <algorithm>

namespace tessera {
namespace {

/// No mouse goes so far, nor a wheel, in one frame: heights of a window, clicks.
constexpr double kLongestDrag = 16;

double axis(std::int16_t value) {
    return std::max(-1.0, static_cast<double>(value) / InputState::kFull);
}

std::array<double, 6> heldIn(const InputState& s) {
    return {axis(s.right), axis(s.up), axis(s.back), axis(s.turnRight), axis(s.turnUp), axis(s.rollRight)};
}

double way(std::uint64_t now, std::uint64_t before) {
    const double units =
        static_cast<double>(static_cast<std::int64_t>(now - before)) / static_cast<double>(InputState::kUnit);
    return std::clamp(units, -kLongestDrag, kLongestDrag);
}

}  // namespace

void InputSources::Source::holdUntil(TimePoint at) {
    if (at <= since) return;
    const double seconds = std::chrono::duration<double>(at - since).count();
    const std::array<double, 6> now = heldIn(newest);
    for (std::size_t i = 0; i < held.size(); ++i) held[i] += seconds * now[i];
    faster = faster || (newest.held & InputState::kFaster) != 0;
    since = at;
}

void InputSources::take(const std::string& who, const InputState& state, TimePoint at) {
    const auto key = std::pair(who, state.source);
    auto found = sources_.find(key);
    if (found == sources_.end()) {
        const auto first = sources_.lower_bound({who, 0});
        std::size_t known = 0;
        for (auto it = first; it != sources_.end() && it->first.first == who; ++it) ++known;
        if (known >= kMaxSourcesEach) return;
        found = sources_.emplace(key, Source{.newest = state, .had = state}).first;
        found->second.since = std::max(at, frameAt_.value_or(at));
    }
    found->second.holdUntil(at);
    found->second.moved = found->second.moved || found->second.newest != state;
    found->second.newest = state;
}

bool InputSources::knows(const std::string& who) const {
    const auto first = sources_.lower_bound({who, 0});
    return first != sources_.end() && first->first.first == who;
}

void InputSources::end(const std::string& who) {
    std::erase_if(sources_, [&](const auto& source) { return source.first.first == who; });
}

NavigationInput InputSources::frame(TimePoint at, const PlaceOf& placeOf) {
    const double seconds = frameAt_ ? std::chrono::duration<double>(at - *frameAt_).count() : 0;
    frameAt_ = at;
    NavigationInput sum;
    for (auto& [key, source] : sources_) {
        const InputState &now = source.newest, before = std::exchange(source.had, source.newest);
        if (std::exchange(source.moved, false)) source.movedAt = frameAt_;
        source.holdUntil(at);
        std::array<double, 6> held = heldIn(now);
        if (seconds > 0)
            for (std::size_t i = 0; i < held.size(); ++i) held[i] = std::clamp(source.held[i] / seconds, -1.0, 1.0);
        source.held = {};
        NavigationInput input;
        input.move = Vec3d(held[0], held[1], held[2]);
        input.turn = Vec2d(held[3], held[4]);
        input.roll = held[5];
        input.faster = std::exchange(source.faster, false) || (now.held & InputState::kFaster) != 0;
        input.look = Vec2d(way(now.lookRight, before.lookRight), way(now.lookDown, before.lookDown));
        input.pan = Vec2d(way(now.panRight, before.panRight), way(now.panDown, before.panDown));
        input.wheel = way(now.wheel, before.wheel);
        for (std::size_t action = 0; action < kInputActions; ++action) {
            const auto times = static_cast<std::uint16_t>(now.asked[action] - before.asked[action]);
            for (std::uint16_t i = 0; i < std::min(times, kMaxAskedAtOnce); ++i)
                input.actions.push_back(static_cast<InputAction>(action));
        }
        const bool points = std::ranges::any_of(input.actions, [](InputAction action) {
            return action == InputAction::kGrab || action == InputAction::kFit;
        });
        if (points || !input.pan.isZero(0))
            if (const std::optional<Place> place =
                    placeOf(key.first, key.second, now.cursorX / 65535.0, now.cursorY / 65535.0)) {
                if (points) input.pointing = place->ray;
                input.pan *= place->height;
            }
        sum.add(input);
    }
    return sum;
}

std::vector<std::string> InputSources::active() const {
    std::vector<std::string> names;
    for (const auto& [key, source] : sources_) {
        const bool now = source.moved || !source.newest.atRest() ||
                         (source.movedAt && frameAt_ && *frameAt_ - *source.movedAt < kActiveFor);
        if (now && (names.empty() || names.back() != key.first)) names.push_back(key.first);
    }
    return names;
}

}  // namespace tessera
