/// From the states of all windows and terminals to what is wanted in a frame.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/Clock.h"
#include "server/sim/navigation/NavigationInput.h"

namespace tessera {

/// Remembers of each source its newest state and what a frame has had of it. What is lost on the way, repeated or late
/// changes nothing. Not thread-safe.
class InputSources {
public:
    static constexpr std::chrono::seconds kActiveFor{1};

    static constexpr std::size_t kMaxSourcesEach = 64;   ///< of one host or application; more are not heard
    static constexpr std::uint16_t kMaxAskedAtOnce = 4;  ///< of one action, in one frame

    /// The first state of a source says where its sums and counts begin. `at`: of `frame`'s clock, when it came; what
    /// is held counts from then on, so that a key which goes down and up between two frames moves as far as it was
    /// held. Unsaid: since the frame before.
    void take(const std::string& who, const InputState& state, TimePoint at = {});
    [[nodiscard]] bool knows(const std::string& who) const;
    /// Whatever they held is released; should they come again, they begin anew.
    void end(const std::string& who);

    /// Where a source's window is: its ray at a cursor (0 to 1, from the upper left), and the tangent of the angle of
    /// its height. Of what is no window: nothing.
    struct Place {
        Ray ray;
        double height = 1;
    };
    using PlaceOf =
        std::function<std::optional<Place>(const std::string& who, std::uint32_t source, double x, double y)>;
    /// What all say together since the frame before, what is held on the average over that time. `now`: of a steady
    /// clock.
    [[nodiscard]] NavigationInput frame(TimePoint now, const PlaceOf& placeOf);

    /// Who has said anything in the second before the newest frame, or holds something.
    [[nodiscard]] std::vector<std::string> active() const;
    [[nodiscard]] bool empty() const { return sources_.empty(); }

private:
    struct Source {
        InputState newest, had;
        std::optional<TimePoint> movedAt;  ///< the frame that had it
        bool moved = false;
        // Since the frame before: what was held until `since`, times how long, in seconds.
        std::array<double, 6> held{};
        bool faster = false;
        TimePoint since{};

        void holdUntil(TimePoint at);
    };
    std::map<std::pair<std::string, std::uint32_t>, Source> sources_;
    std::optional<TimePoint> frameAt_;
};

}  // namespace tessera
