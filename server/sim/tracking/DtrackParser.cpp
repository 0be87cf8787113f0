#include "server/sim/tracking/DtrackParser.h"

#include <charconv>
#include <string_view>

#include <fmt/format.h>

namespace tessera {

namespace {

/// Reads one line from left to right; what is not there is remembered, not thrown.
class DtrackLine {
public:
    explicit DtrackLine(std::string_view text) : text_(text) {}

    template <typename Number>
    Number number() {
        skip();
        Number value{};
        const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), value);
        if (error != std::errc()) {
            good_ = false;
            return {};
        }
        text_.remove_prefix(static_cast<std::size_t>(end - text_.data()));
        return value;
    }
    void bracket(char which) {
        skip();
        if (text_.empty() || text_.front() != which) {
            good_ = false;
            return;
        }
        text_.remove_prefix(1);
    }
    std::string_view word() {
        skip();
        const std::size_t end = std::min(text_.find(' '), text_.size());
        const std::string_view word = text_.substr(0, end);
        text_.remove_prefix(end);
        return word;
    }
    [[nodiscard]] bool good() const { return good_; }
    [[nodiscard]] bool over() {
        skip();
        return text_.empty();
    }

private:
    void skip() {
        while (!text_.empty() && (text_.front() == ' ' || text_.front() == '\t')) text_.remove_prefix(1);
    }

    std::string_view text_;
    bool good_ = true;
};

Vec3d vectorFrom(DtrackLine& line) {
    Vec3d v;
    for (int i = 0; i < 3; ++i) v[i] = line.number<double>();
    return v;
}

Mat3d matrixFrom(DtrackLine& line) {
    Mat3d m;
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row) m(row, column) = line.number<double>();
    return m;
}

enum class DtrackShape { kBody, kFlystick, kFlystick2, kTool, kMarker };

/// One body's blocks. False: they are not what they should be.
bool readBody(DtrackLine& line, DtrackShape shape, std::vector<SensorReport>& reports) {
    SensorReport report;
    RawPose pose;
    line.bracket('[');
    const int id = line.number<int>();
    const double quality = line.number<double>();
    int buttons = 0, axes = 0;
    if (shape == DtrackShape::kFlystick || shape == DtrackShape::kTool) {
        report.buttons = line.number<std::uint32_t>();
        report.buttonsSaid = shape == DtrackShape::kTool ? 1u : 0xffu;
    } else if (shape == DtrackShape::kFlystick2) {
        buttons = line.number<int>();
        axes = line.number<int>();
        if (buttons < 0 || buttons > 256 || axes < 0 || axes > 64) return false;
    }
    line.bracket(']');
    line.bracket('[');
    pose.position = vectorFrom(line);
    const bool angles = shape == DtrackShape::kBody || shape == DtrackShape::kFlystick;
    if (angles) (void)vectorFrom(line);  // the matrix says the same, without a convention
    line.bracket(']');
    if (shape == DtrackShape::kMarker) {
        pose.turns = false;
    } else {
        line.bracket('[');
        const Mat3d matrix = matrixFrom(line);
        line.bracket(']');
        if (!line.good()) return false;
        const std::optional<Quatd> orientation = orientationOf(matrix);
        if (!orientation && quality >= 0) return false;
        if (orientation) pose.orientation = *orientation;
    }
    if (shape == DtrackShape::kFlystick2) {
        line.bracket('[');
        for (int word = 0; word < (buttons + 31) / 32; ++word) {
            const auto bits = line.number<std::uint32_t>();
            if (word == 0) report.buttons = bits;
        }
        report.buttonsSaid = buttons >= 32 ? ~0u : (1u << buttons) - 1;
        for (int axis = 0; axis < axes; ++axis) {
            const double value = line.number<double>();
            if (axis < kMostAxes) {
                report.axes[static_cast<std::size_t>(axis)] = value;
                report.axesSaid |= 1u << axis;
            }
        }
        line.bracket(']');
    }
    if (!line.good() || id < 0 || id > 65535) return false;
    report.buttons &= report.buttonsSaid;
    using enum SensorKind;
    constexpr SensorKind kKinds[] = {kBody, kFlystick, kFlystick, kTool, kMarker};
    report.sensor = {kKinds[static_cast<int>(shape)], id};
    if (quality >= 0) report.pose = pose;
    if (report.pose || report.buttonsSaid != 0 || report.axesSaid != 0) reports.push_back(report);
    return true;
}

}  // namespace

Expected<std::vector<SensorReport>> parseDtrack(ByteSpan datagram) {
    std::vector<SensorReport> reports;
    std::string_view text = asText(datagram);
    bool known = false;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string_view row = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        while (!row.empty() && (row.back() == '\r' || row.back() == '\0')) row.remove_suffix(1);
        DtrackLine line(row);
        const std::string_view what = line.word();
        const auto refuse = [&] {
            return fail(
                ErrorCode::kBadInput,
                fmt::format("no datagram of DTrack: its line \"{}\" is not what it should be", row.substr(0, 60)));
        };
        known = known || what == "fr" || what.starts_with("6d") || what == "3d";
        std::optional<DtrackShape> shape;
        if (what == "6d") shape = DtrackShape::kBody;
        if (what == "6df") shape = DtrackShape::kFlystick;
        if (what == "6df2") shape = DtrackShape::kFlystick2;
        if (what == "6dmt") shape = DtrackShape::kTool;
        if (what == "3d") shape = DtrackShape::kMarker;
        if (!shape) continue;
        if (shape == DtrackShape::kFlystick2) (void)line.number<int>();  // how many there could be
        const int count = line.number<int>();
        if (!line.good() || count < 0) return refuse();
        if (static_cast<std::size_t>(count) > kMostReports - reports.size())
            return fail(ErrorCode::kLimit, fmt::format("a datagram of more than {} sensors", kMostReports));
        for (int i = 0; i < count; ++i)
            if (!readBody(line, *shape, reports)) return refuse();
        if (!line.over()) return refuse();
    }
    if (!known) return fail(ErrorCode::kBadInput, "no datagram of DTrack: none of its lines is known");
    return reports;
}

}  // namespace tessera
