#include "server/sim/tracking/OscParser.h"

#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "server/sim/tracking/BigEndian.h"

namespace tessera {

namespace {

/// A text of OSC: up to a zero byte, then zeros up to a whole word. Nothing where it does not end.
std::optional<std::string_view> oscText(BigEndianReader& in) {
    const std::string_view all = asText(in.rest());
    const std::size_t end = all.find('\0');
    if (end == std::string_view::npos) return std::nullopt;
    const std::size_t padded = (end / 4 + 1) * 4;
    (void)in.take(padded);
    if (!in.good()) return std::nullopt;
    return all.substr(0, end);
}

constexpr std::size_t kMostArguments = 16;

struct OscArguments {
    std::array<double, kMostArguments> values{};
    std::size_t count = 0;
};

/// The numbers among a message's arguments, in their order; others are passed. Nothing where they are cut off or
/// unknown.
std::optional<OscArguments> argumentsOf(std::string_view types, BigEndianReader& in) {
    OscArguments arguments;
    const auto add = [&](double value) {
        if (arguments.count < kMostArguments) arguments.values[arguments.count++] = value;
    };
    for (const char type : types) {
        switch (type) {
            case 'i':
                add(in.int32());
                break;
            case 'f':
                add(static_cast<double>(in.float32()));
                break;
            case 'h':
                add(static_cast<double>(in.int64()));
                break;
            case 'd':
                add(in.float64());
                break;
            case 'T':
                add(1);
                break;
            case 'F':
                add(0);
                break;
            case 't':
                (void)in.int64();
                break;
            case 'c':
            case 'r':
            case 'm':
                (void)in.int32();
                break;
            case 'N':
            case 'I':
            case '[':
            case ']':
                break;
            case 's':
            case 'S':
                if (!oscText(in)) return std::nullopt;
                break;
            case 'b': {
                const std::uint32_t size = in.whole<std::uint32_t>();
                if (size > in.left()) return std::nullopt;
                (void)in.take((std::size_t{size} + 3) / 4 * 4);
                break;
            }
            default:
                return std::nullopt;
        }
        if (!in.good()) return std::nullopt;
    }
    return arguments;
}

struct OscAddress {
    SensorName sensor;
    std::string_view what;
};

/// None: it is not ours to judge.
std::optional<OscAddress> sensorAddress(std::string_view address) {
    constexpr std::string_view kOurs = "/tessera/";
    if (!address.starts_with(kOurs)) return std::nullopt;
    address.remove_prefix(kOurs.size());
    OscAddress result;
    using enum SensorKind;
    for (const SensorKind kind : {kBody, kFlystick, kTool, kMarker}) {
        const std::string_view name = nameOf(kind);
        if (!address.starts_with(name) || address.size() <= name.size() || address[name.size()] != '/') continue;
        result.sensor.kind = kind;
        address.remove_prefix(name.size() + 1);
        break;
    }
    const auto [end, error] = std::from_chars(address.data(), address.data() + address.size(), result.sensor.number);
    const auto read = static_cast<std::size_t>(end - address.data());
    if (error != std::errc() || result.sensor.number < 0 || result.sensor.number > 65535 || read == address.size() ||
        address[read] != '/')
        return std::nullopt;
    result.what = address.substr(read + 1);
    return result;
}

Expected<std::optional<SensorReport>> reportOf(const OscAddress& address, const OscArguments& arguments) {
    SensorReport report;
    report.sensor = address.sensor;
    const auto& v = arguments.values;
    const auto needs = [&](std::size_t count) -> Expected<std::optional<SensorReport>> {
        return fail(ErrorCode::kBadInput, fmt::format("a message \"{}\" with {} numbers where {} are needed",
                                                      address.what, arguments.count, count));
    };
    // A button or an axis by its number; false: there is none of it.
    const auto index = [&](int most) { return v[0] >= 0 && v[0] < most && v[0] == std::floor(v[0]); };
    if (address.what == "pose") {
        if (arguments.count != 7) return needs(7);
        report.pose = RawPose{.position = {v[0], v[1], v[2]}, .orientation = Quatd(v[6], v[3], v[4], v[5])};
    } else if (address.what == "position") {
        if (arguments.count != 3) return needs(3);
        report.pose = RawPose{.position = {v[0], v[1], v[2]}, .turns = false};
    } else if (address.what == "orientation") {
        if (arguments.count != 4) return needs(4);
        report.pose = RawPose{.orientation = Quatd(v[3], v[0], v[1], v[2]), .placed = false};
    } else if (address.what == "button") {
        if (arguments.count != 2) return needs(2);
        if (!index(kMostButtons))
            return fail(ErrorCode::kBadInput,
                        fmt::format("a button {:.6g}: 0 to {} are known", v[0], kMostButtons - 1));
        report.buttonsSaid = 1u << static_cast<unsigned>(v[0]);
        if (v[1] != 0) report.buttons = report.buttonsSaid;
    } else if (address.what == "axis") {
        if (arguments.count != 2) return needs(2);
        if (!index(kMostAxes))
            return fail(ErrorCode::kBadInput, fmt::format("an axis {:.6g}: 0 to {} are known", v[0], kMostAxes - 1));
        report.axesSaid = 1u << static_cast<unsigned>(v[0]);
        report.axes[static_cast<std::size_t>(v[0])] = v[1];
    } else {
        return std::nullopt;
    }
    return report;
}

Expected<void> readPacket(ByteSpan packet, int depth, std::vector<SensorReport>& reports) {
    BigEndianReader in(packet);
    const std::optional<std::string_view> address = oscText(in);
    if (!address) return fail(ErrorCode::kBadInput, "no packet of OSC: its address has no end");
    if (*address == "#bundle") {
        if (depth >= kMostNestedBundles)
            return fail(ErrorCode::kLimit,
                        fmt::format("bundles within bundles, more than {} deep", kMostNestedBundles));
        (void)in.int64();
        while (in.good() && in.left() > 0) {
            const std::uint32_t size = in.whole<std::uint32_t>();
            if (!in.good() || size > in.left() || size % 4 != 0)
                return fail(ErrorCode::kBadInput, "a bundle of OSC whose element is longer than it");
            if (Expected<void> read = readPacket(in.take(size), depth + 1, reports); !read) return read;
        }
        if (!in.good()) return fail(ErrorCode::kBadInput, "a bundle of OSC without a time");
        return {};
    }
    if (!address->starts_with('/'))
        return fail(ErrorCode::kBadInput, "no packet of OSC: it begins neither with an address nor with #bundle");
    const std::optional<OscAddress> known = sensorAddress(*address);
    if (!known) return {};
    const std::optional<std::string_view> types = oscText(in);
    if (!types || !types->starts_with(',')) return fail(ErrorCode::kBadInput, "a message of OSC without its types");
    const std::optional<OscArguments> arguments = argumentsOf(types->substr(1), in);
    if (!arguments || in.left() > 0)
        return fail(ErrorCode::kBadInput, "a message of OSC whose arguments are not those of its types");
    Expected<std::optional<SensorReport>> report = reportOf(*known, *arguments);
    if (!report) return tl::unexpected(report.error());
    if (!*report) return {};
    if (reports.size() == kMostReports)
        return fail(ErrorCode::kLimit, fmt::format("a datagram of more than {} messages", kMostReports));
    reports.push_back(**report);
    return {};
}

}  // namespace

Expected<std::vector<SensorReport>> parseOsc(ByteSpan datagram) {
    if (datagram.size() % 4 != 0) return fail(ErrorCode::kBadInput, "no packet of OSC: its length is no multiple of 4");
    std::vector<SensorReport> reports;
    if (Expected<void> read = readPacket(datagram, 0, reports); !read) return tl::unexpected(read.error());
    return reports;
}

}  // namespace tessera
