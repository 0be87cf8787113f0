#include "common/wall/Tracking.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace tessera {

std::string_view nameOf(TrackerProtocol protocol) {
    switch (protocol) {
        case TrackerProtocol::kDtrack:
            return "dtrack";
        case TrackerProtocol::kOsc:
            return "osc";
        case TrackerProtocol::kVrpn:
            break;
    }
    return "vrpn";
}

std::string_view nameOf(SensorKind kind) {
    switch (kind) {
        case SensorKind::kBody:
            return "body";
        case SensorKind::kFlystick:
            return "flystick";
        case SensorKind::kTool:
            return "tool";
        case SensorKind::kMarker:
            break;
    }
    return "marker";
}

std::string toString(const SensorName& sensor) {
    return fmt::format("{} {}", nameOf(sensor.kind), sensor.number);
}

Expected<Mat3d> parseAxes(std::string_view text) {
    const auto refuse = [&] {
        return fail(
            ErrorCode::kBadInput,
            fmt::format("axes \"{}\" name no frame: write which of the tracker's axes the wall's x, y and z are, "
                        "each once, e.g. \"x z -y\"",
                        text.substr(0, 32)));
    };
    Mat3d wallFromTracker = Mat3d::Zero();
    std::size_t at = 0;
    for (int row = 0; row < 3; ++row) {
        while (at < text.size() && text[at] == ' ') ++at;
        double sign = 1;
        if (at < text.size() && (text[at] == '-' || text[at] == '+')) sign = text[at++] == '-' ? -1 : 1;
        if (at == text.size() || text[at] < 'x' || text[at] > 'z') return refuse();
        wallFromTracker(row, text[at++] - 'x') = sign;
    }
    while (at < text.size() && text[at] == ' ') ++at;
    if (at != text.size() || std::abs(wallFromTracker.determinant()) != 1) return refuse();
    return wallFromTracker;
}

Expected<VrpnUrl> parseVrpnUrl(std::string_view text) {
    const auto refuse = [&](std::string_view why) {
        return fail(ErrorCode::kBadInput,
                    fmt::format("\"{}\" is no VRPN device: {}; write vrpn://HOST:PORT/DEVICE, e.g. "
                                "vrpn://10.0.0.5:3883/Tracker0",
                                text.substr(0, 100), why));
    };
    constexpr std::string_view kScheme = "vrpn://";
    if (!text.starts_with(kScheme)) return refuse("it does not begin with vrpn://");
    text.remove_prefix(kScheme.size());
    const std::size_t slash = text.find('/');
    if (slash == std::string_view::npos || slash + 1 == text.size()) return refuse("it names no device");
    VrpnUrl url;
    url.device = text.substr(slash + 1);
    if (url.device.size() > 99) return refuse("the device's name is longer than 99 bytes");
    std::string_view host = text.substr(0, slash);
    const std::size_t colon = host.rfind(':');
    if (colon != std::string_view::npos && host.find(']', colon) == std::string_view::npos) {
        const std::string_view port = host.substr(colon + 1);
        const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), url.port);
        if (error != std::errc() || end != port.data() + port.size() || url.port == 0)
            return refuse("its port is not a number from 1 to 65535");
        host = host.substr(0, colon);
    }
    if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
    if (host.empty()) return refuse("it names no host");
    url.host = host;
    return url;
}

}  // namespace tessera
