#include "client/deform/Deforming.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace tessera {
namespace {

constexpr double kMostAmount = 1e4, kMostSeconds = 1e6;
constexpr std::array<std::string_view, 3> kKinds{"bend", "twist", "swell"};

std::optional<double> numberIn(std::string_view text, double most) {
    if (text.starts_with('+')) text.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !(std::abs(value) <= most)) return {};
    return value;
}

/// sin(x) / x and (1 - cos(x)) / x, also where x is small.
std::pair<double, double> arcOf(double x) {
    if (std::abs(x) < 1e-4) return {1 - x * x / 6, x / 2};
    const double half = std::sin(x / 2);
    return {std::sin(x) / x, 2 * half * half / x};
}

}  // namespace

Expected<Deforming> Deforming::parse(std::string_view words) {
    const auto refuse = [&](std::string_view why) {
        return fail(ErrorCode::kUsage,
                    fmt::format("\"{}\": {}; write KIND[-AXIS]:AMOUNT:SECONDS:NODE, such as bend:25:4:/court or "
                                "swell-y:-20..60:3:/court/ball",
                                words, why));
    };
    std::array<std::string_view, 3> parts;
    std::string_view rest = words;
    for (std::string_view& part : parts) {
        const std::size_t colon = rest.find(':');
        if (colon == std::string_view::npos) return refuse("there are fewer than four parts");
        part = rest.substr(0, colon);
        rest.remove_prefix(colon + 1);
    }
    Deforming deforming{.node = std::string(rest)};
    if (rest.empty()) return refuse("no node is named");
    auto [kind, amount, seconds] = parts;
    if (const std::size_t dash = kind.find('-'); dash != std::string_view::npos) {
        const std::string_view axis = kind.substr(dash + 1);
        if (axis != "x" && axis != "y" && axis != "z") return refuse("an axis is x, y or z");
        deforming.axis = axis[0] - 'x';
        kind = kind.substr(0, dash);
    }
    const auto known = std::ranges::find(kKinds, kind);
    if (known == kKinds.end()) return refuse("the kinds are bend, twist and swell");
    deforming.kind = static_cast<DeformingKind>(known - kKinds.begin());
    const std::size_t dots = amount.find("..");
    const std::optional<double> to =
        numberIn(dots == std::string_view::npos ? amount : amount.substr(dots + 2), kMostAmount);
    if (!to) return refuse("an amount is a number from -10000 to 10000, or two with .. between them");
    deforming.to = *to;
    deforming.from = -*to;
    if (dots != std::string_view::npos) {
        const std::optional<double> from = numberIn(amount.substr(0, dots), kMostAmount);
        if (!from) return refuse("an amount is a number from -10000 to 10000, or two with .. between them");
        deforming.from = *from;
    }
    const std::optional<double> length = numberIn(seconds, kMostSeconds);
    if (!length || !(*length >= 1e-3)) return refuse("seconds are a number from 0.001 to 1000000");
    deforming.seconds = *length;
    return deforming;
}

double Deforming::amountAt(double time) const {
    const double turn = 2 * std::numbers::pi * (time / seconds - std::floor(time / seconds));
    // What goes as far one way as the other begins at rest, in the middle.
    if (from == -to) return to * std::sin(turn);
    return from + (to - from) * (1 - std::cos(turn)) / 2;
}

std::vector<Vec3d> deformed(std::span<const Vec3d> rest, DeformingKind kind, int axis, double amount) {
    std::vector<Vec3d> points(rest.begin(), rest.end());
    if (points.empty()) return points;
    Vec3d lower = points.front(), upper = lower;
    for (const Vec3d& point : points) {
        if (!point.allFinite()) return points;
        lower = lower.cwiseMin(point);
        upper = upper.cwiseMax(point);
    }
    const Vec3d size = upper - lower, middle = lower + 0.5 * size;
    int along = axis;
    if (along < 0) size.maxCoeff(&along);
    const double length = size[along];
    if (!(length > 0) || !std::isfinite(length)) return points;
    // What is bent goes up and down where it can.
    const int across = along == 1 ? 0 : 1, other = 3 - along - across;
    const double angle = amount * std::numbers::pi / 180;
    for (Vec3d& point : points) {
        const double s = (point[along] - lower[along]) / length;
        const double a = point[across] - middle[across], b = point[other] - middle[other];
        switch (kind) {
            case DeformingKind::kBend: {
                const auto [forward, aside] = arcOf(angle * s);
                point[along] = lower[along] + length * s * forward - a * std::sin(angle * s);
                point[across] = middle[across] + length * s * aside + a * std::cos(angle * s);
                break;
            }
            case DeformingKind::kTwist: {
                const double sine = std::sin(angle * s), cosine = std::cos(angle * s);
                point[across] = middle[across] + cosine * a - sine * b;
                point[other] = middle[other] + sine * a + cosine * b;
                break;
            }
            case DeformingKind::kSwell: {
                const double scale = 1 + amount / 100 * std::sin(std::numbers::pi * s);
                point[across] = middle[across] + scale * a;
                point[other] = middle[other] + scale * b;
                break;
            }
        }
    }
    return points;
}

}  // namespace tessera
