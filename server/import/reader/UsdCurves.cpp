// Curves of USD as lines: straight ones as they are, cubic ones sampled.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/math/Srgb.h"
#include "server/import/reader/UsdMeshes.h"

namespace tessera {
namespace {

/// Of a cubic segment; fewer where there are very many of them, as hairs are.
constexpr std::size_t kStepsPerSegment = 12, kFewStepsPerSegment = 4, kMostFineSegments = 100'000;

enum class CurveBasis { kLinear, kBezier, kBspline, kCatmullRom };

CurveBasis usdBasisOf(const UsdComposedPrim& prim) {
    if (usdWord(prim, "type", "cubic") == "linear") return CurveBasis::kLinear;
    const std::string basis = usdWord(prim, "basis", "bezier");
    return basis == "bspline"      ? CurveBasis::kBspline
           : basis == "catmullRom" ? CurveBasis::kCatmullRom
                                   : CurveBasis::kBezier;
}

/// What the four points of a segment have of the place at `t`, from 0 to 1 (the matrices of UsdGeomBasisCurves).
std::array<double, 4> curveShares(CurveBasis basis, double t) {
    const double s = 1 - t, t2 = t * t, t3 = t2 * t;
    switch (basis) {
        case CurveBasis::kBspline:
            return {s * s * s / 6, (3 * t3 - 6 * t2 + 4) / 6, (-3 * t3 + 3 * t2 + 3 * t + 1) / 6, t3 / 6};
        case CurveBasis::kCatmullRom:
            return {(-t3 + 2 * t2 - t) / 2, (3 * t3 - 5 * t2 + 2) / 2, (-3 * t3 + 4 * t2 + t) / 2, (t3 - t2) / 2};
        default:
            return {s * s * s, 3 * s * s * t, 3 * s * t2, t3};
    }
}

/// The curves of one prim, one after another.
class CurveWalk {
public:
    CurveWalk(CurveBasis basis, const std::string& wrap, std::size_t steps, UsdCurves& out)
        : basis_(basis), periodic_(wrap == "periodic"), pinned_(wrap == "pinned"), steps_(steps), out_(out) {}

    [[nodiscard]] std::size_t segments(std::size_t points) const {
        if (basis_ == CurveBasis::kLinear) return points < 2 ? 0 : points - (periodic_ && points > 2 ? 0 : 1);
        if (basis_ == CurveBasis::kBezier) return periodic_ ? points / 3 : points < 4 ? 0 : (points - 1) / 3;
        if (periodic_) return points < 3 ? 0 : points;
        if (pinned_) return points < 2 ? 0 : points - 1;
        return points < 4 ? 0 : points - 3;
    }
    /// That vary along a curve: one for each end of a segment.
    [[nodiscard]] std::size_t valuesOf(std::size_t points) const {
        if (basis_ == CurveBasis::kLinear) return points;
        const std::size_t count = segments(points);
        return count == 0 ? 0 : count + (periodic_ ? 0 : 1);
    }
    void add(std::uint32_t first, std::size_t points) {
        const std::size_t count = segments(points);
        const std::uint32_t begin = size();
        for (std::size_t segment = 0; segment < count; ++segment) {
            const std::size_t steps = basis_ == CurveBasis::kLinear ? 1 : steps_;
            for (std::size_t step = segment == 0 ? 0 : 1; step <= steps; ++step) {
                if (periodic_ && segment + 1 == count && step == steps) break;  // it is the first one
                const double t = static_cast<double>(step) / static_cast<double>(steps);
                addVertex(first, points, segment, t);
            }
        }
        for (std::uint32_t v = begin; v + 1 < size(); ++v) out_.lines.lines.insert(out_.lines.lines.end(), {v, v + 1});
        if (periodic_ && size() > begin + 2) out_.lines.lines.insert(out_.lines.lines.end(), {size() - 1, begin});
        out_.varying += valuesOf(points);
        ++out_.curves;
    }

private:
    [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(out_.vertices.size()); }
    void addVertex(std::uint32_t first, std::size_t points, std::size_t segment, double t) {
        const std::size_t values = valuesOf(points);
        UsdCurves::Vertex vertex{
            .curve = static_cast<std::uint32_t>(out_.curves),
            .values = {static_cast<std::uint32_t>(out_.varying + segment),
                       static_cast<std::uint32_t>(out_.varying + (segment + 1) % std::max<std::size_t>(values, 1))},
            .share = static_cast<float>(t)};
        std::array<double, 4> shares{1 - t, t, 0, 0};
        std::array<std::int64_t, 4> at{};
        const auto begin = static_cast<std::int64_t>(segment * (basis_ == CurveBasis::kBezier ? 3 : 1)) -
                           (pinned_ && basis_ != CurveBasis::kLinear && basis_ != CurveBasis::kBezier ? 1 : 0);
        for (std::int64_t i = 0; i < 4; ++i) at[static_cast<std::size_t>(i)] = begin + i;
        if (basis_ != CurveBasis::kLinear) shares = curveShares(basis_, t);
        const auto last = static_cast<std::int64_t>(points) - 1;
        // Pinned curves begin and end at their points, as if those within were mirrored beyond: 2 p0 - p1.
        if (at[0] < 0) {
            shares[1] += 2 * shares[0];
            shares[2] -= shares[0];
            shares[0] = 0;
            at[0] = 0;
        }
        if (pinned_ && at[3] > last && basis_ != CurveBasis::kLinear) {
            shares[2] += 2 * shares[3];
            shares[1] -= shares[3];
            shares[3] = 0;
        }
        for (std::size_t i = 0; i < 4; ++i) {
            const std::int64_t point = periodic_ ? at[i] % (last + 1) : std::min(at[i], last);
            vertex.points[i] = first + static_cast<std::uint32_t>(point);
            vertex.shares[i] = static_cast<float>(shares[i]);
        }
        out_.vertices.push_back(vertex);
    }

    CurveBasis basis_;
    bool periodic_, pinned_;
    std::size_t steps_;
    UsdCurves& out_;
};

}  // namespace

UsdCurves usdCurvesOf(const UsdComposedPrim& prim) {
    UsdCurves out;
    out.lines.primitive = Primitive::kLines;
    const std::optional<UsdAttribute> said = prim.attribute("points"), counts = prim.attribute("curveVertexCounts");
    std::vector<float> points = said && said->value ? said->value->numbers<float>() : std::vector<float>();
    points.resize(points.size() / 3 * 3);
    const std::size_t most = points.size() / 3;
    const std::vector<std::int32_t> sizes =
        counts && counts->value ? counts->value->numbers<std::int32_t>() : std::vector<std::int32_t>();
    const std::string wrap = usdWord(prim, "wrap", "nonperiodic");
    const bool fine = most < kMostFineSegments;
    CurveWalk walk(usdBasisOf(prim), wrap, fine ? kStepsPerSegment : kFewStepsPerSegment, out);
    std::size_t first = 0;
    for (const std::int32_t count : sizes) {
        if (count < 0 || static_cast<std::size_t>(count) > most - first) {
            out.cut = true;
            break;
        }
        walk.add(static_cast<std::uint32_t>(first), static_cast<std::size_t>(count));
        first += static_cast<std::size_t>(count);
    }
    for (const UsdCurves::Vertex& vertex : out.vertices)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            float sum = 0;
            for (std::size_t i = 0; i < 4; ++i)
                if (vertex.shares[i] != 0) sum += vertex.shares[i] * points[std::size_t{3} * vertex.points[i] + axis];
            out.lines.positions.push_back(sum);
        }
    return out;
}

Expected<std::vector<UsdPart>> UsdMeshes::ofCurves(const UsdComposedPrim& prim, const std::string& material) {
    UsdCurves curves = usdCurvesOf(prim);
    const std::optional<UsdAttribute> points = prim.attribute("points");
    const std::size_t vertices = points && points->value ? points->value->count() / 3 : 0;
    if (points && points->samples.size() > 1)
        remarks_.add("curves that change their shape over time are shown as they are first", prim.path());
    if (curves.cut)
        scene_.noteMissing(fmt::format("{}: curves beyond its {} points are left out", prim.path(), vertices));
    if (const std::optional<UsdAttribute> widths = prim.attribute("widths"); widths && widths->value)
        remarks_.add("curves are shown as lines, whatever their widths are", prim.path());
    const UsdLook look = lookOf(prim, material, false);
    // Of a value: the same for all, of a curve, of a point, or along the curves.
    const UsdElements elements{curves.curves, vertices, curves.varying, true};
    const auto primvar = [&](const std::string& name, std::size_t width) {
        return UsdPrimvar::of(prim, worn_.primvars, "primvars:" + name, width, elements, remarks_);
    };
    const std::optional<UsdPrimvar> colors = look.colors.empty() ? std::nullopt : primvar(look.colors, 3),
                                    opacities = look.colors.empty() ? std::nullopt : primvar("displayOpacity", 1);
    const auto mixed = [&](const UsdPrimvar& values, const UsdCurves::Vertex& vertex, std::size_t part) {
        if (values.per() == UsdPrimvar::Per::kAll || values.per() == UsdPrimvar::Per::kFace)
            return values.at(vertex.curve, 0, 0)[part];
        float sum = 0;
        if (values.per() == UsdPrimvar::Per::kVertex) {
            for (std::size_t i = 0; i < 4; ++i)
                if (vertex.shares[i] != 0) sum += vertex.shares[i] * values.at(0, vertex.points[i], 0)[part];
            return sum;
        }
        const auto [from, to] = vertex.values;
        return (1 - vertex.share) * values.at(0, 0, from)[part] + vertex.share * values.at(0, 0, to)[part];
    };
    const auto byte = [](float share) {
        return static_cast<std::uint8_t>(
            std::lround(std::clamp(std::isfinite(share) ? share : 0.0F, 0.0F, 1.0F) * 255));
    };
    if (colors || opacities)
        for (const UsdCurves::Vertex& vertex : curves.vertices) {
            for (std::size_t i = 0; i < 3; ++i)
                curves.lines.colors.push_back(colors ? byte(srgbOfLinear(std::max(mixed(*colors, vertex, i), 0.0F)))
                                                     : 255);
            curves.lines.colors.push_back(opacities ? byte(mixed(*opacities, vertex, 0)) : 255);
        }
    return added(prim, std::move(curves.lines), look);
}

}  // namespace tessera
