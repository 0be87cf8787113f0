/// What can be wrong with a wall's trackers, heads and wands, in words.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "common/base/HostRange.h"
#include "common/wall/Wall.h"
#include "common/wall/WallNames.h"

namespace tessera {

namespace {

using Text = std::optional<std::string>;

constexpr std::size_t kMaxTrackers = 16, kMaxWands = 32, kMaxAllowed = 64;

/// "HOST:PORT" with a port of one's own: who sends has to know it.
Text listenFault(const std::string& address) {
    const std::size_t colon = address.rfind(':');
    std::uint16_t port = 0;
    if (address.size() < 300 && colon != std::string::npos && colon > 0) {
        const char* end = address.data() + address.size();
        const auto [stop, error] = std::from_chars(address.data() + colon + 1, end, port);
        if (error == std::errc() && stop == end && port > 0) return std::nullopt;
    }
    return fmt::format(
        "listens at \"{}\", which is no address with a port from 1 to 65535: write e.g. `listen: \"0.0.0.0:5000\"`",
        address.substr(0, 100));
}

/// Whether two addresses that are good to listen at cannot both be: one port, and one host or every one.
bool clash(const std::string& a, const std::string& b) {
    const auto everywhere = [](std::string_view host) {
        return host == "0.0.0.0" || host == "[::]" || host == "::" || host == "*";
    };
    const std::size_t colonA = a.rfind(':'), colonB = b.rfind(':');
    const std::string_view hostA = std::string_view(a).substr(0, colonA), hostB = std::string_view(b).substr(0, colonB);
    std::uint16_t portA = 0, portB = 0;
    std::from_chars(a.data() + colonA + 1, a.data() + a.size(), portA);
    std::from_chars(b.data() + colonB + 1, b.data() + b.size(), portB);
    return portA == portB && (hostA == hostB || everywhere(hostA) || everywhere(hostB));
}

Text rigidFault(const Vec3d& position, const Quatd& orientation, double maxMetres) {
    if (!position.allFinite()) return "has a position that is not made of finite numbers";
    if (position.cwiseAbs().maxCoeff() > maxMetres)
        return fmt::format("is {:.6g} m away: that looks like millimetres; positions are in metres",
                           position.cwiseAbs().maxCoeff());
    if (!tellsRotation(orientation.squaredNorm()))
        return "has an orientation whose length is 0, or nearly, or beyond what numbers can hold: a quaternion w, x, "
               "y, z is needed";
    return std::nullopt;
}

Text filterFault(const TrackerFilter& filter) {
    const auto outside = [](double value, double least, double most) { return !(value >= least && value <= most); };
    if (outside(filter.jitterMillimetres, 0.001, 100))
        return fmt::format("has a filter with jitter_mm {:.6g}: 0.001 to 100 are possible", filter.jitterMillimetres);
    if (outside(filter.jitterDegrees, 0.0001, 28))
        return fmt::format("has a filter with jitter_degrees {:.6g}: 0.0001 to 28 are possible", filter.jitterDegrees);
    if (outside(static_cast<double>(filter.longestPrediction.count()), 0, 500))
        return fmt::format("has a filter with predict_ms {}: 0 to 500 are possible", filter.longestPrediction.count());
    if (outside(filter.jumpMetres, 0.01, 100))
        return fmt::format("has a filter with jump_m {:.6g}: 0.01 to 100 are possible", filter.jumpMetres);
    if (outside(static_cast<double>(filter.holdFor.count()), 100, 3'600'000) ||
        outside(static_cast<double>(filter.easeFor.count()), 0, 3'600'000))
        return fmt::format("has a filter with hold_ms {} and ease_ms {}: 100 and 0 to 3600000 are possible",
                           filter.holdFor.count(), filter.easeFor.count());
    return std::nullopt;
}

Text trackerFault(const WallTracker& tracker, const WallLimits& limits) {
    if (tracker.protocol == TrackerProtocol::kVrpn) {
        if (const auto url = parseVrpnUrl(tracker.address); !url) return ": " + url.error().message;
        if (!tracker.allowFrom.empty())
            return "has allow_from, which is for datagrams: of VRPN nobody else can say anything";
    } else if (Text wrong = listenFault(tracker.address)) {
        return wrong;
    }
    if (Text wrong = rigidFault(tracker.position, tracker.orientation, limits.maxMetres)) return wrong;
    if (const auto axes = parseAxes(tracker.axes); !axes) return ": " + axes.error().message;
    if (!(tracker.metresPerUnit == 0 || (tracker.metresPerUnit >= 1e-6 && tracker.metresPerUnit <= 1e3)))
        return fmt::format("has a scale of {:.6g} metres per unit: 0.000001 to 1000 are possible",
                           tracker.metresPerUnit);
    if (tracker.allowFrom.size() > kMaxAllowed) return fmt::format("has more than {} allow_from", kMaxAllowed);
    for (const std::string& allowed : tracker.allowFrom)
        if (const auto range = parseHostRange(allowed); !range) return ": allow_from: " + range.error().message;
    return filterFault(tracker.filter);
}

Text mountFault(const Wall& wall, const TrackedMount& mount) {
    const auto& trackers = wall.tracking.trackers;
    if (std::ranges::find(trackers, mount.tracker, &WallTracker::name) == trackers.end())
        return ": " + unknownName("tracker", mount.tracker, namesOf(trackers));
    if (mount.sensor.number < 0 || mount.sensor.number > 65535)
        return fmt::format("follows {} {}: 0 to 65535 are possible", nameOf(mount.sensor.kind), mount.sensor.number);
    if (Text wrong = rigidFault(mount.offset, mount.turn, 10)) return fmt::format("has an offset that {}", *wrong);
    return std::nullopt;
}

std::string said(std::string_view kind, const std::string& name, const std::string& text) {
    return fmt::format("{} \"{}\"{}{}", kind, name, text.starts_with(':') ? "" : " ", text);
}

}  // namespace

std::optional<WallFault> findTrackingFault(const Wall& wall, const WallLimits& limits) {
    using Part = WallFault::Part;
    const WallTracking& tracking = wall.tracking;
    const auto fault = [](Part part, std::size_t index, std::string message) {
        return WallFault{.part = part, .index = index, .tile = 0, .message = std::move(message)};
    };
    if (tracking.trackers.size() > kMaxTrackers)
        return fault(
            Part::kTracker, kMaxTrackers,
            fmt::format("the wall has {} trackers, at most {} are allowed", tracking.trackers.size(), kMaxTrackers));
    if (tracking.wands.size() > kMaxWands)
        return fault(Part::kWand, kMaxWands,
                     fmt::format("the wall has {} wands, at most {} are allowed", tracking.wands.size(), kMaxWands));
    std::set<std::string> taken;
    for (std::size_t i = 0; i < tracking.trackers.size(); ++i) {
        const WallTracker& tracker = tracking.trackers[i];
        if (Text wrong = nameFault("tracker", i, tracker.name, limits.maxName, taken))
            return fault(Part::kTracker, i, std::move(*wrong));
        if (Text wrong = trackerFault(tracker, limits))
            return fault(Part::kTracker, i, said("tracker", tracker.name, *wrong));
        if (tracker.protocol == TrackerProtocol::kVrpn) continue;
        for (std::size_t j = 0; j < i; ++j) {
            const WallTracker& other = tracking.trackers[j];
            if (other.protocol != TrackerProtocol::kVrpn && clash(tracker.address, other.address))
                return fault(Part::kTracker, i,
                             said("tracker", tracker.name,
                                  fmt::format("listens at {}, where \"{}\" does ({}): one port is one tracker's",
                                              tracker.address, other.name, other.address)));
        }
    }
    for (const WallHead& head : tracking.heads) {
        const auto user = std::ranges::find(wall.users, head.user, &User::name);
        const auto index = static_cast<std::size_t>(user - wall.users.begin());
        if (user == wall.users.end())
            return fault(Part::kWall, 0, "a head: " + unknownName("user", head.user, namesOf(wall.users)));
        if (std::ranges::count(tracking.heads, head.user, &WallHead::user) > 1)
            return fault(Part::kUser, index, said("the head of user", head.user, "is tracked twice"));
        if (Text wrong = mountFault(wall, head.mount))
            return fault(Part::kUser, index, said("the head of user", head.user, *wrong));
    }
    taken.clear();
    for (std::size_t i = 0; i < tracking.wands.size(); ++i) {
        const WallWand& wand = tracking.wands[i];
        if (Text wrong = nameFault("wand", i, wand.name, limits.maxName, taken))
            return fault(Part::kWand, i, std::move(*wrong));
        if (Text wrong = mountFault(wall, wand.mount)) return fault(Part::kWand, i, said("wand", wand.name, *wrong));
    }
    return std::nullopt;
}

}  // namespace tessera
