/// Who moves the wall: inputs of hosts and applications in, the view out, once a frame.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/Clock.h"
#include "common/request/ViewRequests.h"
#include "server/sim/frame/Frame.h"
#include "server/sim/navigation/HandleInput.h"
#include "server/sim/navigation/InputSources.h"
#include "server/sim/navigation/Lookout.h"
#include "server/sim/navigation/Navigator.h"
#include "server/sim/view/ViewSource.h"

namespace tessera {

class Simulation;

/// Joins sources, navigator, scene and ViewSource. A frame in which nobody wants anything costs nothing that grows with
/// the scene; one who walks costs a look at what is near. Frame thread only.
class Steering {
public:
    /// No frame counts longer: who holds a key through a pause does not come out of it somewhere else.
    static constexpr std::chrono::milliseconds kLongestFrame{600};

    /// All outlive it.
    struct Surroundings {
        const Wall& wall;
        Simulation& simulation;
        ViewSource& view;
        bool takesInput = true;             ///< false: nothing that anybody does here moves the wall
        ManipulatorDrags* drags = nullptr;  ///< null: windows, terminals and wands take hold of no handle
        LooksBeside beside = {};
    };
    explicit Steering(const Surroundings& around);

    /// What people do at a host's windows. `at`: as of InputSources::take.
    void received(const std::string& host, const std::vector<InputState>& states, TimePoint at = {});
    void hostLeft(const std::string& host);
    /// kRefused: no input is taken. kNotFound: no such node or bookmark. `fit`: the bounds of what is to be fitted, for
    /// who knows them; null: they are found at once.
    [[nodiscard]] Expected<void> asked(std::uint64_t application, const NavigationWish& wish, TimePoint at = {},
                                       const Box* fit = nullptr);
    void applicationLeft(std::uint64_t application);
    /// One more source, for the frame to come alone: whatever is no window. Not heard where no input is taken.
    /// `who`: for `active`.
    void add(const NavigationInput& input, const std::string& who);

    /// Wands of the newest frame: their first buttons take hold of handles.
    void wands(const std::vector<WandState>& wands);
    /// What handles that are held want in the frame to come (HandleInput.h).
    [[nodiscard]] std::vector<Edit> takeEdits() { return hands_ ? hands_->edits() : std::vector<Edit>(); }
    /// Nothing may be edited now: whatever handles are held are let go.
    void letGoOfHandles() {
        if (hands_) hands_->letGo();
    }
    /// Why a handle that somebody took hold of does not move; since the last call.
    [[nodiscard]] std::vector<std::string> takeRemarks() {
        return hands_ ? hands_->takeRemarks() : std::vector<std::string>();
    }

    /// Before a frame's view is asked for, after the scene's list has been applied. What people do is timed by the
    /// clock: all that moves moves by what has passed since the frame before, kLongestFrame at most. Until somebody has
    /// wanted anything a frame is 1/60 s, so that runs which nobody steers are the same to the bit. `now`: of a steady
    /// clock.
    void frame(TimePoint now);

    [[nodiscard]] bool takesInput() const { return around_.takesInput; }
    [[nodiscard]] NavigationMode mode() const { return navigator_.mode(); }
    /// Names of hosts, "application N" of applications, and those that `add` was told: who moves the wall now, or has
    /// in the last second.
    [[nodiscard]] std::vector<std::string> active() const;
    /// Boxes and faces looked at in the last frame.
    [[nodiscard]] std::uint64_t work() const { return lookout_.work(); }

private:
    [[nodiscard]] std::optional<InputSources::Place> placeOf(const View& view, const std::string& who,
                                                             std::uint32_t source, double x, double y) const;
    /// Through a place of a tile's picture, 0 to 1 from the upper left and beyond, as its user sees it: the world's.
    [[nodiscard]] std::optional<Ray> rayThrough(Tile tile, double x, double y) const;
    struct TilePlace {
        const Tile* tile;
        double x, y;  ///< of its picture, 0 to 1 from the upper left and beyond
    };
    /// Of the first screen's mosaic, 0 to 1 from the upper left.
    [[nodiscard]] std::optional<TilePlace> onFirstScreen(double x, double y) const;
    /// Where a window points; where an application does, on all of the first screen.
    [[nodiscard]] HandleInput::Aim aimOf(const std::string& host, std::uint32_t source) const;
    [[nodiscard]] HandleInput::Aim aimOfApplication() const;
    [[nodiscard]] NavigationScene scene();

    Surroundings around_;
    std::map<std::string, std::vector<Tile>> tiles_;  ///< by host
    Lookout lookout_;
    InputSources sources_;
    std::optional<HandleInput> hands_;
    Navigator navigator_;
    std::optional<NavigationInput> added_;
    std::set<std::string> addedBy_;             ///< for the frame to come
    std::map<std::string, TimePoint> addedAt_;  ///< who, and in which frame last
    std::optional<TimePoint> frameAt_;          ///< the newest
    bool wanted_ = false;                       ///< somebody has steered, or asked
    std::uint64_t setByHand_ = 0;
};

}  // namespace tessera
