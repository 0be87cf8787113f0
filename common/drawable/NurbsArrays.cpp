#include "common/drawable/NurbsArrays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/drawable/ContentCache.h"
#include "common/drawable/SmoothSurface.h"
#include "common/freeform/nurbs/tessellation/NurbsTriangles.h"

namespace tessera {
namespace {

const NurbsSurfaceCore& nurbsOf(const void* core) {
    return *static_cast<const NurbsSurfaceCore*>(core);
}

/// All but the control points.
std::array<const Blob*, 9> nurbsArraysOf(const NurbsSurfaceCore& s) {
    return {&s.knotsU, &s.knotsV,     &s.weights,     &s.range,      &s.loops,
            &s.curves, &s.curveKnots, &s.curvePoints, &s.curveRanges};
}
bool isNoNurbs(const NurbsSurfaceCore& s) {
    const auto blobs = nurbsArraysOf(s);
    return s.points.empty() && std::all_of(blobs.begin(), blobs.end(), [](const Blob* blob) { return blob->empty(); });
}
bool isNurbsHere(const NurbsSurfaceCore& s) {
    const auto blobs = nurbsArraysOf(s);
    return (s.points.empty() || s.points.resident()) &&
           std::all_of(blobs.begin(), blobs.end(), [](const Blob* blob) { return blob->empty() || blob->resident(); });
}

/// So many steps of a quarter of the tolerance each: edges half as long.
constexpr unsigned kNurbsSteps = 5;

Hash128 nurbsRecipeOf(const NurbsSurfaceCore& s, unsigned fineness) {
    std::array<Hash128, 13> parts{};
    parts[0] = {NurbsSurfaceCore::kType.value, s.points.sizeBytes()};
    const auto blobs = nurbsArraysOf(s);
    for (std::size_t i = 0; i < blobs.size(); ++i) parts[1 + i] = blobs[i]->id();
    parts[10] = {static_cast<std::uint64_t>(s.degreeU), static_cast<std::uint64_t>(s.degreeV)};
    parts[11] = hash128(std::as_bytes(std::span(&s.tolerance, 1)));
    parts[12] = {fineness, 0};
    return hash128(std::as_bytes(std::span(parts)));
}

std::vector<double> doublesOf(const Blob& blob) {
    const std::span<const double> values = blob.as<double>();
    return {values.begin(), values.end()};
}

Expected<std::vector<TrimLoop>> loopsOf(const NurbsSurfaceCore& s) {
    const auto loops = s.loops.as<std::uint32_t>(), curves = s.curves.as<std::uint32_t>();
    const auto knots = s.curveKnots.as<double>(), points = s.curvePoints.as<double>(),
               ranges = s.curveRanges.as<double>();
    if (!ranges.empty() && ranges.size() != curves.size())
        return fail(ErrorCode::kBadInput, "curveRanges has not two numbers for each curve");
    std::size_t knot = 0, point = 0, curve = 0;
    std::vector<TrimLoop> made;
    for (std::size_t l = 0; l < loops.size(); l += 2) {
        if (loops[l] > 1)
            return fail(ErrorCode::kBadInput, "loop " + std::to_string(l / 2 + 1) +
                                                  " is neither 0 (around what is kept) nor 1 (around a hole)");
        if (loops[l + 1] > curves.size() / 2 - curve)
            return fail(ErrorCode::kBadInput, "loop " + std::to_string(l / 2 + 1) + " has more curves than there are");
        TrimLoop& loop =
            made.emplace_back(TrimLoop{.role = loops[l] == 0 ? LoopRole::kOuter : LoopRole::kHole, .curves = {}});
        for (std::uint32_t c = 0; c < loops[l + 1]; ++c, ++curve) {
            const std::size_t degree = curves[2 * curve], count = curves[2 * curve + 1], many = count + degree + 1;
            if (count > (points.size() - point) / 3 || many > knots.size() - knot || degree > kMaxNurbsDegree)
                return fail(ErrorCode::kBadInput,
                            "curve " + std::to_string(curve + 1) +
                                " has more control points or knots than there are, or too high a degree");
            TrimCurve& t = loop.curves.emplace_back();
            t.knots = {.degree = static_cast<int>(degree),
                       .knots = {knots.begin() + static_cast<std::ptrdiff_t>(knot),
                                 knots.begin() + static_cast<std::ptrdiff_t>(knot + many)}};
            for (std::size_t k = 0; k < count; ++k, point += 3)
                t.points.emplace_back(points[point + 2] * points[point], points[point + 2] * points[point + 1],
                                      points[point + 2]);
            knot += many;
            if (Expected<void> sound = checkKnots(t.knots, count, "curve " + std::to_string(curve + 1)); !sound)
                return tl::unexpected(sound.error());
            t.begin = ranges.empty() ? t.knots.domain().lower : ranges[2 * curve];
            t.end = ranges.empty() ? t.knots.domain().upper : ranges[2 * curve + 1];
        }
    }
    if (2 * curve != curves.size() || knot != knots.size() || point != points.size())
        return fail(ErrorCode::kBadInput, "curves, curveKnots or curvePoints have more than the loops ask for");
    return made;
}

/// A surface's triangles, or why there are none: judged once, when it is edited, and not made again for whoever derives
/// it next.
struct NurbsVerdict {
    std::shared_ptr<const NurbsTriangles> triangles;
    Error error;
    [[nodiscard]] std::size_t bytes() const {
        return triangles ? triangles->positions.size() * 64 + triangles->triangles.size() * 12 : 256;
    }
    /// Whoever uses one holds it.
    [[nodiscard]] bool inUse() const { return false; }
};
double toleranceOf(const NurbsSurfaceCore& s, const NurbsSurface& surface, unsigned fineness) {
    Box around;
    for (const Vec4d& p : surface.definition().points) around.extend(p.head<3>() / p.w());
    const double size = around.size().norm();
    // A point alone, or what rounding leaves of one, has no triangles, whatever is asked for.
    return std::ldexp(s.tolerance > 0 ? s.tolerance : std::max(1e-3 * size, 1e-30), -2 * static_cast<int>(fineness));
}

std::shared_ptr<const NurbsVerdict> verdictOf(const NurbsSurfaceCore& s, unsigned fineness) {
    constexpr std::size_t kMostBytes = std::size_t{1} << 26;
    static ContentCache<NurbsVerdict> verdicts(kMostBytes);
    const std::array<Hash128, 2> key{nurbsRecipeOf(s, fineness), s.points.id()};
    return verdicts.get(hash128(std::as_bytes(std::span(key))), [&]() -> NurbsVerdict {
        const Expected<NurbsSurface> surface = surfaceOfCore(s);
        if (!surface) return {.triangles = {}, .error = surface.error()};
        Expected<NurbsTriangles> made = tessellate(*surface, toleranceOf(s, *surface, fineness),
                                                   {.maxTriangles = kMostNurbsTriangles, .maxSums = kMostNurbsSums});
        if (!made) return {.triangles = {}, .error = made.error()};
        return {.triangles = std::make_shared<const NurbsTriangles>(std::move(*made)), .error = {}};
    });
}

Expected<void> checkNurbs(const void* core) {
    const NurbsSurfaceCore& s = nurbsOf(core);
    if (isNoNurbs(s)) return {};
    if (!isNurbsHere(s)) return fail(ErrorCode::kBadInput, "an array of the surface is not here");
    const std::shared_ptr<const NurbsVerdict> verdict = verdictOf(s, 0);
    if (!verdict->triangles) return tl::unexpected(verdict->error);
    return {};
}

std::optional<DerivedSource> nurbsSourceOf(const void* core, const Fineness& fineness) {
    const NurbsSurfaceCore& s = nurbsOf(core);
    if (isNoNurbs(s) || !isNurbsHere(s)) return std::nullopt;
    return DerivedSource{nurbsRecipeOf(s, fineness.steps), s.points};
}

/// Whole, whatever has moved: how fine the triangles are follows the control points, so parts of earlier ones are no
/// use.
DerivedMesh deriveNurbs(const void* core, const Fineness& fineness, const EarlierMesh*) {
    const std::shared_ptr<const NurbsVerdict> verdict = verdictOf(nurbsOf(core), fineness.steps);
    if (!verdict->triangles || verdict->triangles->triangles.empty()) return {};
    const NurbsTriangles& t = *verdict->triangles;
    const NurbsSurfaceCore& s = nurbsOf(core);
    std::vector<float> positions, normals, texcoords;
    Vec2d low = t.parameters.front(), high = low;
    for (const Vec2d& p : t.parameters) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    if (s.range.empty()) {
        const Expected<NurbsSurface> surface = surfaceOfCore(s);
        low = {surface->domain().u.lower, surface->domain().v.lower};
        high = {surface->domain().u.upper, surface->domain().v.upper};
    }
    for (std::size_t i = 0; i < t.positions.size(); ++i) {
        for (int k = 0; k < 3; ++k) {
            positions.push_back(static_cast<float>(t.positions[i][k]));
            normals.push_back(static_cast<float>(t.normals[i][k]));
        }
        for (int k = 0; k < 2; ++k)
            texcoords.push_back(
                high[k] > low[k] ? static_cast<float>((t.parameters[i][k] - low[k]) / (high[k] - low[k])) : 0.0F);
    }
    std::vector<std::uint32_t> indices;
    for (const auto& c : t.triangles) {
        // What floats cannot tell apart has no area.
        const auto same = [&](std::uint32_t a, std::uint32_t b) {
            return std::equal(&positions[3 * a], &positions[3 * a] + 3, &positions[3 * b]);
        };
        if (same(c[0], c[1]) || same(c[1], c[2]) || same(c[2], c[0])) continue;
        indices.insert(indices.end(), c.begin(), c.end());
    }
    if (indices.empty()) return {};
    DerivedMesh out;
    out.arrays.positions = Blob::of(std::span<const float>(positions));
    out.arrays.normals = Blob::of(std::span<const float>(normals));
    out.arrays.texcoords = Blob::of(std::span<const float>(texcoords));
    out.arrays.indices = Blob::of(std::span<const std::uint32_t>(indices));
    return out;
}

constexpr ScreenSteps kNurbsScreenSteps{
    .finest = [](const void*) { return kNurbsSteps; },
    .screenError = [](const void* core) { return nurbsOf(core).screenError; },
    .deviation =
        [](const void* core, unsigned fineness) {
            const std::shared_ptr<const NurbsVerdict> verdict = verdictOf(nurbsOf(core), fineness);
            return verdict->triangles ? verdict->triangles->error : 0.0;
        },
    // Edges are cut by their own curves and the tolerance alone.
    .seam = [](const void* core) { return nurbsOf(core).tolerance; },
    .copy = [](const void* core) -> std::shared_ptr<const void> {
        return std::make_shared<const NurbsSurfaceCore>(nurbsOf(core));
    },
};

std::shared_ptr<const SmoothSurface> smoothNurbs(const void* core) {
    if (isNoNurbs(nurbsOf(core)) || !checkNurbs(core)) return nullptr;
    Expected<NurbsSurface> surface = surfaceOfCore(nurbsOf(core));
    return surface ? std::make_shared<const SmoothSurface>(SmoothSurface{std::move(*surface)}) : nullptr;
}

}  // namespace

constinit const Derivation kNurbsDerivation{
    .check = &checkNurbs,
    .source = &nurbsSourceOf,
    .derive = &deriveNurbs,
    .resident = [](const void* core) { return isNurbsHere(nurbsOf(core)); },
    .byScreen = &kNurbsScreenSteps,
    .smooth = &smoothNurbs,
};

Expected<NurbsSurface> surfaceOfCore(const NurbsSurfaceCore& s) {
    const std::pair<const Blob*, const char*> doubles[] = {
        {&s.knotsU, "knotsU"}, {&s.knotsV, "knotsV"}, {&s.weights, "weights"}, {&s.curveKnots, "curveKnots"}};
    for (const auto& [blob, name] : doubles)
        if (blob->sizeBytes() % 8 != 0)
            return fail(ErrorCode::kBadInput, std::string(name) + " has bytes that are no whole number");
    if (s.points.sizeBytes() % 24 != 0 || s.curvePoints.sizeBytes() % 24 != 0)
        return fail(ErrorCode::kBadInput, "points or curvePoints have not three numbers each");
    if (s.range.sizeBytes() != 0 && s.range.sizeBytes() != 32)
        return fail(ErrorCode::kBadInput, "range has not four numbers");
    if (s.loops.sizeBytes() % 8 != 0 || s.curves.sizeBytes() % 8 != 0 || s.curveRanges.sizeBytes() % 16 != 0)
        return fail(ErrorCode::kBadInput, "loops, curves or curveRanges have not two numbers each");
    const auto points = s.points.as<double>(), weights = s.weights.as<double>();
    if (!weights.empty() && weights.size() != points.size() / 3)
        return fail(ErrorCode::kBadInput, "there are " + std::to_string(weights.size()) + " weights for " +
                                              std::to_string(points.size() / 3) + " control points");
    NurbsDefinition d{.u = {.degree = static_cast<int>(s.degreeU), .knots = doublesOf(s.knotsU)},
                      .v = {.degree = static_cast<int>(s.degreeV), .knots = doublesOf(s.knotsV)},
                      .points = {},
                      .rangeU = {},
                      .rangeV = {},
                      .loops = {}};
    for (std::size_t i = 0; i < points.size() / 3; ++i) {
        const double w = weights.empty() ? 1 : weights[i];
        d.points.emplace_back(w * points[3 * i], w * points[3 * i + 1], w * points[3 * i + 2], w);
    }
    if (!s.range.empty()) {
        const auto range = s.range.as<double>();
        d.rangeU = {range[0], range[1]};
        d.rangeV = {range[2], range[3]};
    }
    Expected<std::vector<TrimLoop>> loops = loopsOf(s);
    if (!loops) return tl::unexpected(loops.error());
    d.loops = std::move(*loops);
    return NurbsSurface::make(std::move(d));
}

NurbsSurfaceCore coreOfSurface(const NurbsSurface& surface) {
    const NurbsDefinition& d = surface.definition();
    NurbsSurfaceCore s;
    const auto blobOf = [](const std::vector<double>& values) {
        return values.empty() ? Blob() : Blob::of(std::span<const double>(values));
    };
    const auto numbersOf = [](const std::vector<std::uint32_t>& values) {
        return values.empty() ? Blob() : Blob::of(std::span<const std::uint32_t>(values));
    };
    s.degreeU = d.u.degree;
    s.degreeV = d.v.degree;
    s.knotsU = blobOf(d.u.knots);
    s.knotsV = blobOf(d.v.knots);
    std::vector<double> points, weights, curveKnots, curvePoints, curveRanges;
    bool rational = false;
    for (const Vec4d& p : d.points) {
        for (int k = 0; k < 3; ++k) points.push_back(p[k] / p.w());
        weights.push_back(p.w());
        rational = rational || p.w() != 1;
    }
    s.points = blobOf(points);
    if (rational) s.weights = blobOf(weights);
    if (surface.domain().u != d.u.domain() || surface.domain().v != d.v.domain())
        s.range = blobOf(
            {surface.domain().u.lower, surface.domain().u.upper, surface.domain().v.lower, surface.domain().v.upper});
    std::vector<std::uint32_t> loops, curves;
    for (const TrimLoop& loop : d.loops) {
        loops.insert(loops.end(),
                     {loop.role == LoopRole::kHole ? 1u : 0u, static_cast<std::uint32_t>(loop.curves.size())});
        for (const TrimCurve& c : loop.curves) {
            curves.insert(curves.end(),
                          {static_cast<std::uint32_t>(c.knots.degree), static_cast<std::uint32_t>(c.points.size())});
            curveKnots.insert(curveKnots.end(), c.knots.knots.begin(), c.knots.knots.end());
            for (const Vec3d& p : c.points)
                curvePoints.insert(curvePoints.end(), {p.x() / p.z(), p.y() / p.z(), p.z()});
            curveRanges.insert(curveRanges.end(), {c.begin, c.end});
        }
    }
    s.loops = numbersOf(loops);
    s.curves = numbersOf(curves);
    s.curveKnots = blobOf(curveKnots);
    s.curvePoints = blobOf(curvePoints);
    s.curveRanges = blobOf(curveRanges);
    return s;
}

}  // namespace tessera
