#include "server/sim/tracking/VrpnStream.h"

#include <algorithm>

#include <fmt/format.h>

#include "server/sim/tracking/BigEndian.h"

namespace tessera {

namespace {

constexpr std::size_t kCookieBytes = 24, kHeadBytes = 24;
constexpr std::string_view kMajorVersion = "vrpn: ver. 07.";
constexpr std::int32_t kSenderDescription = -1, kTypeDescription = -2, kDisconnect = -5;

constexpr std::size_t filledUp(std::size_t bytes) {
    return (bytes + 7) / 8 * 8;
}

}  // namespace

struct VrpnStream::Head {
    std::uint32_t length = 0;
    std::int32_t sender = 0, type = 0;
};

Bytes VrpnStream::cookie() {
    Bytes bytes(kCookieBytes);
    constexpr std::string_view kText = "vrpn: ver. 07.35  0";
    std::ranges::copy(asBytes(kText), bytes.begin());
    return bytes;
}

Expected<std::vector<SensorReport>> VrpnStream::take(ByteSpan bytes) {
    waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
    ByteSpan rest = waiting_;
    std::vector<SensorReport> reports;
    if (!greeted_) {
        // A stranger is known by its first bytes: nobody waits for 24 of them.
        const std::string_view said = asText(rest.first(std::min(rest.size(), kMajorVersion.size())));
        if (!kMajorVersion.starts_with(said))
            return fail(
                said.starts_with("vrpn:") ? ErrorCode::kUnsupported : ErrorCode::kBadInput,
                said.starts_with("vrpn:") ? "it speaks another version of VRPN than 7" : "it does not speak VRPN");
        if (rest.size() < kCookieBytes) return reports;
        rest = rest.subspan(kCookieBytes);
        greeted_ = true;
    }
    while (rest.size() >= kHeadBytes) {
        BigEndianReader in(rest);
        Head head;
        head.length = in.whole<std::uint32_t>();
        (void)in.int64();  // its clock is not ours
        head.sender = in.int32();
        head.type = in.int32();
        if (head.length < kHeadBytes || head.length > kMaxMessageBytes)
            return fail(ErrorCode::kLimit, fmt::format("a message of VRPN that claims {} bytes: {} to {} are possible",
                                                       head.length, kHeadBytes, kMaxMessageBytes));
        const std::size_t whole = filledUp(head.length);
        if (rest.size() < whole) break;
        const ByteSpan body = rest.subspan(kHeadBytes, head.length - kHeadBytes);
        if (Expected<void> done = head.type < 0 ? learn(head, body) : read(head, body, reports); !done)
            return tl::unexpected(done.error());
        rest = rest.subspan(whole);
    }
    waiting_.erase(waiting_.begin(), waiting_.end() - static_cast<std::ptrdiff_t>(rest.size()));
    return reports;
}

Expected<void> VrpnStream::learn(const Head& head, ByteSpan body) {
    if (head.type == kDisconnect) return fail(ErrorCode::kNetwork, "it has taken leave");
    if (head.type != kSenderDescription && head.type != kTypeDescription) return {};  // its port for datagrams, its log
    BigEndianReader in(body);
    const std::uint32_t length = in.whole<std::uint32_t>();
    const ByteSpan text = in.take(length);
    if (!in.good() || length == 0 || head.sender < 0)
        return fail(ErrorCode::kBadInput, "a name of VRPN that is longer than its message");
    std::string_view name = asText(text);
    name = name.substr(0, name.find('\0'));
    if (head.type == kSenderDescription) {
        if (senders_.size() >= kMaxNames)
            return fail(ErrorCode::kLimit, fmt::format("more than {} senders of VRPN", kMaxNames));
        senders_[head.sender] = std::string(name.substr(0, 100));
        knowsTracker_ = knowsTracker_ || name == devices_.tracker;
        return {};
    }
    if (types_.size() >= kMaxNames)
        return fail(ErrorCode::kLimit, fmt::format("more than {} types of VRPN", kMaxNames));
    Meaning& meaning = types_[head.sender];
    meaning = name == "vrpn_Tracker Pos_Quat" ? Meaning::kPose
              : name == "vrpn_Button Change"  ? Meaning::kButton
              : name == "vrpn_Button States"  ? Meaning::kButtons
              : name == "vrpn_Analog Channel" ? Meaning::kAnalog
                                              : Meaning::kOther;
    return {};
}

Expected<void> VrpnStream::read(const Head& head, ByteSpan body, std::vector<SensorReport>& reports) {
    const auto type = types_.find(head.type);
    const auto sender = senders_.find(head.sender);
    if (type == types_.end() || sender == senders_.end() || type->second == Meaning::kOther) return {};
    const auto from = [&](const std::string& device) {
        return sender->second == (device.empty() ? devices_.tracker : device);
    };
    BigEndianReader in(body);
    SensorReport report;
    switch (type->second) {
        case Meaning::kPose: {
            if (!from(devices_.tracker)) return {};
            const std::int32_t number = in.int32();
            (void)in.int32();  // fills up
            RawPose pose;
            for (int i = 0; i < 3; ++i) pose.position[i] = in.float64();
            double q[4];
            for (double& value : q) value = in.float64();
            pose.orientation = Quatd(q[3], q[0], q[1], q[2]);
            if (number < 0 || number > 65535) return {};
            report.sensor.number = number;
            report.pose = pose;
            break;
        }
        case Meaning::kButton: {
            if (!from(devices_.buttons)) return {};
            const std::int32_t button = in.int32();
            const std::int32_t pressed = in.int32();
            if (button < 0 || button >= kMostButtons) return {};
            report.buttonsSaid = 1u << button;
            if (pressed != 0) report.buttons = report.buttonsSaid;
            break;
        }
        case Meaning::kButtons: {
            if (!from(devices_.buttons)) return {};
            const std::int32_t count = in.int32();
            for (std::int32_t i = 0; i < count && i < kMostButtons && in.good(); ++i) {
                report.buttonsSaid |= 1u << i;
                if (in.int32() != 0) report.buttons |= 1u << i;
            }
            break;
        }
        case Meaning::kAnalog: {
            if (!from(devices_.analogs)) return {};
            const double count = in.float64();
            for (int i = 0; i < kMostAxes && i < count && in.good(); ++i) {
                report.axes[static_cast<std::size_t>(i)] = in.float64();
                report.axesSaid |= 1u << i;
            }
            break;
        }
        case Meaning::kOther:
            return {};
    }
    if (!in.good()) return fail(ErrorCode::kBadInput, "a message of VRPN that is shorter than what it tells of");
    if (reports.size() < 4 * kMostReports) reports.push_back(report);
    return {};
}

}  // namespace tessera
