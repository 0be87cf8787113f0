/// Handles of manipulators in the hands of who stands before a window, sits at a terminal or holds a wand.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/input/HandInput.h"
#include "common/math/Ray.h"
#include "common/request/StatusRequests.h"
#include "server/manipulators/ManipulatorDrags.h"
#include "server/sim/frame/Frame.h"

namespace tessera {

class Simulation;

/// From whole states (common/input/HandInput.h) to grabs, drags and releases. Each source has one hand, which holds one
/// handle; what it does from a grab to its release is one step of undo. While it holds one, its drags move that and not
/// the view. A hand that was refused (somebody else holds the handle, something drives the target) moves nothing until
/// it lets go, and `takeRemarks` says why.
///
/// What is lost on the way, repeated or late changes nothing: the newest state says where the hand is. Frame thread
/// only.
class HandleInput {
public:
    static constexpr std::size_t kMostSources = 64;  ///< of one host or application; others take hold of nothing
    static constexpr double kFarthest = 8;           ///< of a hand beside its picture, in widths and heights of that
    static constexpr std::uint32_t kWandButton = 1;  ///< of WandState::buttons: the first takes hold

    /// Both outlive it.
    HandleInput(Simulation& simulation, ManipulatorDrags& drags) : simulation_(simulation), drags_(drags) {}

    /// Where a source points.
    struct Aim {
        /// The ray of the world at a place of its picture: 0 to 1 from the upper left, and beyond. Nothing where it has
        /// none.
        std::function<std::optional<Ray>(double x, double y)> rayAt;
        double heightPerWidth = 1;  ///< of the picture
    };
    /// Returns the state as it is for the view: without the drags and grabs that were a handle's.
    [[nodiscard]] InputState take(const std::string& who, const InputState& state, const Aim& aim);
    /// Once a frame.
    void take(const std::vector<WandState>& wands);
    /// It lets go of what it holds; should it come again, it begins anew.
    void end(const std::string& who);
    /// They all do, as nothing may be edited now.
    void letGo();

    /// What the hands want in the frame to come, an edit each.
    [[nodiscard]] std::vector<Edit> edits();
    /// Why nothing moves, for a person; since the last call.
    [[nodiscard]] std::vector<std::string> takeRemarks() { return std::exchange(remarks_, {}); }
    /// Whether this source holds a handle.
    [[nodiscard]] bool holds(const std::string& who, std::uint32_t source = 0) const;

private:
    enum class Grip : std::uint8_t { kNone, kHolds, kRefused };
    struct Hand {
        std::uint64_t holder = 0;  ///< as ManipulatorDrags has it: no connection has such a number
        Grip grip = Grip::kNone;
        bool opening = false;    ///< it lets go as soon as its ray has been followed
        std::optional<Ray> ray;  ///< the newest, not followed yet
        // Of windows and terminals.
        InputState newest;
        double x = 0.5, y = 0.5;
        InputState kept;  ///< of its sums and counts: what was no drag or grab of the view
        // Of wands.
        bool pressed = false;
    };
    using Source = std::pair<std::string, std::uint32_t>;

    [[nodiscard]] Hand& handOf(const Source& source);
    void grab(const Source& source, Hand& hand, const Ray& ray);
    /// Makes an edit of where it has been led to.
    void follow(const Source& source, Hand& hand);
    void open(Hand& hand);
    void remark(const Source& source, const Error& error);

    Simulation& simulation_;
    ManipulatorDrags& drags_;
    std::map<Source, Hand> hands_;
    std::uint64_t holders_ = 0;
    std::vector<Edit> edits_;  ///< for the frame to come
    std::vector<std::string> remarks_;
};

}  // namespace tessera
