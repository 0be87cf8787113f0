#include "server/import/reader/UsdTransforms.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace tessera {
namespace {

/// What a Transform may hold.
constexpr double kUtmostPlace = 1e15;
/// A key between others at least every so many degrees of a turn.
constexpr double kTurnPerKey = 30;

bool isSoundPlace(const Affine3d& map) {
    return map.matrix().allFinite() && map.matrix().cwiseAbs().maxCoeff() <= kUtmostPlace;
}

/// Of a matrix of 16 numbers, whether its last column is more than a weight.
bool isPerspective(const std::vector<double>& numbers) {
    return numbers.size() == 16 && (numbers[3] != 0 || numbers[7] != 0 || numbers[11] != 0);
}

Vec3d axisOfLetter(char letter) {
    return letter == 'X' ? Vec3d::UnitX() : letter == 'Y' ? Vec3d::UnitY() : Vec3d::UnitZ();
}

}  // namespace

std::vector<double> usdNumbersAt(const UsdAttribute& attribute, double time) {
    const auto& samples = attribute.samples;
    if (samples.empty()) return attribute.value ? attribute.value->numbers<double>() : std::vector<double>();
    const auto after = std::ranges::upper_bound(samples, time, {}, [](const auto& sample) { return sample.first; });
    if (after == samples.begin()) return samples.front().second->numbers<double>();
    const auto before = std::prev(after);
    std::vector<double> low = before->second->numbers<double>();
    if (after == samples.end() || before->first == time) return low;
    std::vector<double> high = after->second->numbers<double>();
    if (low.size() != high.size()) return low;
    const double share = (time - before->first) / (after->first - before->first);
    if (usdTypeOf(attribute.type).quaternion && low.size() == 4) {
        const Quatd mixed = Quatd(low[3], low[0], low[1], low[2])
                                .normalized()
                                .slerp(share, Quatd(high[3], high[0], high[1], high[2]).normalized());
        return {mixed.x(), mixed.y(), mixed.z(), mixed.w()};
    }
    for (std::size_t i = 0; i < low.size(); ++i) low[i] += share * (high[i] - low[i]);
    return low;
}

UsdTransform::UsdTransform(const UsdComposedPrim& prim, UsdRemarks& remarks) {
    const std::optional<UsdAttribute> order = prim.attribute("xformOpOrder");
    if (!order || !order->value || order->value->words() == nullptr) return;
    constexpr std::string_view kInverse = "!invert!", kPrefix = "xformOp:";
    for (std::string_view name : *order->value->words()) {
        if (name == "!resetXformStack!") {
            resetsStack_ = true;
            operations_.clear();  // those before it are of the stack, too
            continue;
        }
        Operation operation;
        operation.inverse = name.starts_with(kInverse);
        if (operation.inverse) name.remove_prefix(kInverse.size());
        const std::optional<UsdAttribute> attribute = prim.attribute(name);
        std::string_view kind = name.starts_with(kPrefix) ? name.substr(kPrefix.size()) : std::string_view();
        kind = kind.substr(0, kind.find(':'));
        if (kind == "transform")
            operation.kind = Kind::kMatrix;
        else if (kind == "orient")
            operation.kind = Kind::kOrient;
        else if (kind.starts_with("rotate"))
            operation.kind = Kind::kRotate, operation.axes = kind.substr(6);
        else if (kind.starts_with("translate"))
            operation.kind = Kind::kTranslate, operation.axes = kind.substr(9);
        else if (kind.starts_with("scale"))
            operation.kind = Kind::kScale, operation.axes = kind.substr(5);
        else
            kind = {};
        if (prim.metadata(name, "spline") != nullptr)
            remarks.add("splines are left out", fmt::format("{}.{}", prim.path(), name));
        if (!attribute || !attribute->value || kind.empty()) {
            remarks.add("operations of transforms that have no value are left out",
                        fmt::format("{}.{}", prim.path(), name));
            continue;
        }
        operation.attribute = *attribute;
        const std::optional<Affine3d> value = valueOf(operation, std::nullopt);
        if (!value || !isSoundPlace(*value)) {
            remarks.add("operations of transforms that are not finite, or have no inverse, are left out",
                        fmt::format("{}.{}", prim.path(), name));
            continue;
        }
        if (operation.kind == Kind::kMatrix && isPerspective(operation.attribute.value->numbers<double>()))
            remarks.add("matrices of a perspective are taken without it", fmt::format("{}.{}", prim.path(), name));
        moves_ = moves_ || operation.attribute.samples.size() > 1;
        operations_.push_back(std::move(operation));
    }
    if (!operations_.empty() && !moves_ && at().linear().determinant() == 0)
        remarks.add("transforms without an inverse leave nothing, or something flat, of what stands there",
                    prim.path());
}

std::optional<Affine3d> UsdTransform::valueOf(const Operation& operation, std::optional<double> time) {
    const std::vector<double> numbers =
        time ? usdNumbersAt(operation.attribute, *time) : operation.attribute.value->numbers<double>();
    Affine3d map = Affine3d::Identity();
    const bool three = numbers.size() == 3;
    const auto along = [&](double otherwise) -> std::optional<Vec3d> {
        if (three && operation.axes.empty()) return Vec3d(numbers[0], numbers[1], numbers[2]);
        if (numbers.size() != 1 || operation.axes.size() != 1) return std::nullopt;
        Vec3d out = Vec3d::Constant(otherwise);
        for (int i = 0; i < 3; ++i)
            if (axisOfLetter(operation.axes.front())[i] == 1) out[i] = numbers.front();
        return out;
    };
    switch (operation.kind) {
        case Kind::kTranslate: {
            const std::optional<Vec3d> move = along(0);
            if (!move) return std::nullopt;
            map.translation() = *move;
            break;
        }
        case Kind::kScale: {
            const std::optional<Vec3d> factors = along(1);
            if (!factors) return std::nullopt;
            map.linear() = factors->asDiagonal();
            break;
        }
        case Kind::kRotate: {
            if (numbers.empty() || numbers.size() != operation.axes.size() || !(three || numbers.size() == 1))
                return std::nullopt;
            for (const char letter : operation.axes) {
                // The numbers are those of X, Y and Z, whatever the order.
                const auto axis = static_cast<std::size_t>(std::clamp(letter - 'X', 0, 2));
                const double degrees = three ? numbers[axis] : numbers[0];
                map = Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axisOfLetter(letter)) * map;
            }
            break;
        }
        case Kind::kOrient: {
            if (numbers.size() != 4) return std::nullopt;
            const Quatd turn(numbers[3], numbers[0], numbers[1], numbers[2]);
            if (!(turn.norm() > 1e-12)) return std::nullopt;
            map.linear() = turn.normalized().toRotationMatrix();
            break;
        }
        case Kind::kMatrix: {
            if (numbers.size() != 16) return std::nullopt;
            // Row vectors are multiplied with it; what stands in columns here stands in rows there.
            map.matrix().topRows<3>() = Eigen::Map<const Mat4d>(numbers.data()).topRows<3>();
            if (!isPerspective(numbers) && std::abs(numbers[15]) > 1e-300) map.matrix().topRows<3>() /= numbers[15];
            break;
        }
    }
    if (!operation.inverse) return map;
    if (!(std::abs(map.linear().determinant()) > 1e-300)) return std::nullopt;
    return map.inverse();
}

Affine3d UsdTransform::at(std::optional<double> time) const {
    Affine3d parent_T_prim = Affine3d::Identity();
    for (const Operation& operation : operations_)
        if (const std::optional<Affine3d> value = valueOf(operation, time); value && isSoundPlace(*value))
            parent_T_prim = parent_T_prim * *value;
    return isSoundPlace(parent_T_prim) ? parent_T_prim : Affine3d::Identity();
}

UsdTransform::KeyTimes UsdTransform::keyTimes(std::size_t most, std::size_t& between) const {
    KeyTimes out;
    std::set<double> times;
    for (const Operation& operation : operations_) {
        const auto& samples = operation.attribute.samples;
        for (std::size_t i = 0; i < samples.size(); ++i) {
            if (times.size() >= most) {
                out.cut = true;
                break;
            }
            times.insert(samples[i].first);
            if (operation.kind != Kind::kRotate || i == 0) continue;
            const std::vector<double> from = samples[i - 1].second->numbers<double>(),
                                      to = samples[i].second->numbers<double>();
            double turn = 0;
            for (std::size_t k = 0; k < std::min(from.size(), to.size()); ++k)
                turn = std::max(turn, std::abs(to[k] - from[k]));
            const double steps = std::ceil(turn / kTurnPerKey);
            if (!(steps > 1)) continue;
            if (!(steps <= static_cast<double>(std::min(between, most - times.size())))) {
                out.turnsLost = true;
                continue;
            }
            between -= static_cast<std::size_t>(steps);
            for (double step = 1; step < steps; ++step)
                times.insert(samples[i - 1].first + (samples[i].first - samples[i - 1].first) * step / steps);
        }
    }
    out.times.assign(times.begin(), times.end());
    return out;
}

}  // namespace tessera
