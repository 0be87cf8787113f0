#include "common/geometry/Primitives.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "common/geometry/EarClipping.h"

namespace tessera {
namespace {

struct RunWords {
    std::string_view one, many;
    std::size_t least;  ///< corners
};
RunWords wordsOf(RunKind kind) {
    switch (kind) {
        case RunKind::kLineStrips:
            return {"line strip", "line strips", 2};
        case RunKind::kLineLoops:
            return {"line loop", "line loops", 3};
        case RunKind::kTriangleStrips:
            return {"triangle strip", "triangle strips", 3};
        case RunKind::kTriangleFans:
            return {"triangle fan", "triangle fans", 3};
        case RunKind::kQuads:
            return {"quad", "quads", 4};
        case RunKind::kQuadStrips:
            return {"quad strip", "quad strips", 4};
        case RunKind::kPolygons:
            break;
    }
    return {"polygon", "polygons", 3};
}

/// Calls `visit(run, first corner, corners)`, in order.
template <typename Visit>
void forEachRun(const PrimitiveRuns& runs, Visit&& visit) {
    if (runs.kind == RunKind::kQuads) {
        for (std::size_t quad = 0; quad < runs.corners() / 4; ++quad) visit(quad, 4 * quad, std::size_t{4});
    } else if (runs.lengths.empty()) {
        if (runs.corners() > 0) visit(std::size_t{0}, std::size_t{0}, runs.corners());
    } else {
        std::size_t first = 0;
        for (std::size_t run = 0; run < runs.lengths.size(); ++run) {
            visit(run, first, std::size_t{runs.lengths[run]});
            first += runs.lengths[run];
        }
    }
}

Vec3d placeOf(const PrimitiveRuns& runs, std::size_t corner) {
    const std::size_t at = std::size_t{3} * runs.vertex(corner);
    return {runs.positions[at], runs.positions[at + 1], runs.positions[at + 2]};
}

/// As seen along the axis that the normal is nearest to, from where they go around to the left; empty: they have no
/// area from anywhere.
std::vector<GridPoint> seenFlat(const PrimitiveRuns& runs, std::size_t first, std::size_t count) {
    // From its own middle, as far from the origin products would lose what tells corners apart.
    Vec3d low = placeOf(runs, first), high = low;
    for (std::size_t i = 1; i < count; ++i) {
        low = low.cwiseMin(placeOf(runs, first + i));
        high = high.cwiseMax(placeOf(runs, first + i));
    }
    const Vec3d middle = 0.5 * (low + high);
    Vec3d normal = Vec3d::Zero();
    Vec3d before = placeOf(runs, first + count - 1) - middle;
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3d at = placeOf(runs, first + i) - middle;
        normal += before.cross(at);
        before = at;
    }
    Eigen::Index axis = 0;
    const double most = normal.cwiseAbs().maxCoeff(&axis);
    if (!(most > 0)) return {};
    Eigen::Index across = (axis + 1) % 3, up = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(across, up);
    const double extent = std::max(high[across] - low[across], high[up] - low[up]);
    if (!(extent > 0)) return {};
    const double steps = static_cast<double>(GridPoint::kMost) / extent;
    if (!std::isfinite(steps)) return {};
    std::vector<GridPoint> flat(count);
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3d at = placeOf(runs, first + i);
        const auto onGrid = [&](Eigen::Index k) {
            return std::clamp<std::int64_t>(std::llround((at[k] - low[k]) * steps), 0, GridPoint::kMost);
        };
        flat[i] = {onGrid(across), onGrid(up)};
    }
    return flat;
}

/// Whether the diagonal from the second corner to the fourth is the one inside.
bool isCutAcross(const PrimitiveRuns& runs, std::size_t first) {
    std::array<Vec3d, 4> p;
    for (std::size_t i = 0; i < 4; ++i) p[i] = placeOf(runs, first + i);
    const Vec3d normal = (p[2] - p[0]).cross(p[3] - p[1]);
    const auto faces = [&](std::size_t a, std::size_t b, std::size_t c) {
        return (p[b] - p[a]).cross(p[c] - p[a]).dot(normal);
    };
    return std::min(faces(0, 1, 2), faces(0, 2, 3)) <= 0 && std::min(faces(0, 1, 3), faces(1, 2, 3)) > 0;
}

constexpr std::array<std::uint32_t, 6> kAlong{0, 1, 2, 0, 2, 3}, kAcross{0, 1, 3, 1, 2, 3};

/// Of one quad or polygon: corner numbers of its triangles.
Expected<std::vector<std::uint32_t>> cut(const PrimitiveRuns& runs, std::size_t run, std::size_t first,
                                         std::size_t count) {
    if (runs.kind == RunKind::kQuads || count == 4) {
        const auto& corners = isCutAcross(runs, first) ? kAcross : kAlong;
        return std::vector<std::uint32_t>(corners.begin(), corners.end());
    }
    const std::vector<GridPoint> flat = count > 3 ? seenFlat(runs, first, count) : std::vector<GridPoint>();
    if (!flat.empty()) {
        std::uint64_t steps = kMostClipSteps * count;
        Expected<std::vector<std::uint32_t>> triangles = clipEars(flat, steps);
        if (!triangles) return failWith(fmt::format("polygon {}", run), triangles.error());
        return triangles;
    }
    std::vector<std::uint32_t> fan;
    for (std::uint32_t i = 2; i < count; ++i) fan.insert(fan.end(), {0, i - 1, i});
    return fan;
}

/// Lines and triangles that corners' order says.
class RunAssembly {
public:
    explicit RunAssembly(const PrimitiveRuns& runs) : runs_(runs) {}
    void add(std::size_t first, std::size_t count) {
        const auto at = [&](std::size_t i) { return runs_.vertex(first + i); };
        switch (runs_.kind) {
            case RunKind::kLineStrips:
            case RunKind::kLineLoops:
                for (std::size_t i = 1; i < count; ++i) line(at(i - 1), at(i));
                if (runs_.kind == RunKind::kLineLoops) line(at(count - 1), at(0));
                break;
            case RunKind::kTriangleStrips:
                for (std::size_t i = 2; i < count; ++i)
                    if (i % 2 == 0)
                        triangle(at(i - 2), at(i - 1), at(i));
                    else
                        triangle(at(i - 1), at(i - 2), at(i));
                break;
            case RunKind::kTriangleFans:
                for (std::size_t i = 2; i < count; ++i) triangle(at(0), at(i - 1), at(i));
                break;
            case RunKind::kQuadStrips:
                // OpenGL 1.1's order: around the quad go 0, 1, 3, 2.
                for (std::size_t i = 3; i < count; i += 2) {
                    triangle(at(i - 3), at(i - 2), at(i));
                    triangle(at(i - 3), at(i), at(i - 1));
                }
                break;
            case RunKind::kQuads:
            case RunKind::kPolygons:
                break;
        }
    }
    [[nodiscard]] std::vector<std::uint32_t> take() { return std::move(made_); }

private:
    void line(std::uint32_t a, std::uint32_t b) {
        if (a != b) made_.insert(made_.end(), {a, b});
    }
    void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (a != b && b != c && c != a) made_.insert(made_.end(), {a, b, c});
    }
    const PrimitiveRuns& runs_;
    std::vector<std::uint32_t> made_;
};

}  // namespace

Expected<void> checkRuns(const PrimitiveRuns& runs, const MeshLimits& limits) {
    const RunWords words = wordsOf(runs.kind);
    const std::size_t corners = runs.corners();
    if (runs.kind == RunKind::kQuads) {
        if (corners % 4 != 0)
            return fail(ErrorCode::kBadInput, fmt::format("{} corners are no whole number of quads", corners));
    } else {
        std::uint64_t sum = 0;
        for (const std::uint32_t length : runs.lengths) sum += length;
        if (!runs.lengths.empty() && sum != corners)
            return fail(ErrorCode::kBadInput, fmt::format("the lengths of {} {} add up to {} corners, but there are {}",
                                                          runs.lengths.size(), words.many, sum, corners));
        std::size_t bad = 0, badCount = 0;
        bool found = false;
        forEachRun(runs, [&](std::size_t run, std::size_t, std::size_t count) {
            if (found || (count >= words.least && (runs.kind != RunKind::kQuadStrips || count % 2 == 0))) return;
            found = true;
            bad = run;
            badCount = count;
        });
        if (found)
            return fail(
                ErrorCode::kBadInput,
                fmt::format("{} {} has {} corner{}: it takes {}", words.one, bad, badCount, badCount == 1 ? "" : "s",
                            runs.kind == RunKind::kQuadStrips ? "an even number from 4"
                                                              : fmt::format("at least {}", words.least)));
    }
    const std::uint64_t most = areLines(runs.kind) ? limits.maxLines : limits.maxTriangles;
    if (corners > most)
        return fail(ErrorCode::kLimit,
                    fmt::format("{} corners of {}, at most {} are allowed", corners, words.many, most));
    for (std::size_t i = 0; i < runs.indices.size(); ++i)
        if (runs.indices[i] >= runs.vertices())
            return fail(ErrorCode::kBadInput,
                        fmt::format("corner {} of the {} names vertex {}, but there are {} vertices", i, words.many,
                                    runs.indices[i], runs.vertices()));
    return {};
}

Expected<std::vector<std::uint32_t>> assembleRuns(const PrimitiveRuns& runs) {
    if (!followPlaces(runs.kind)) {
        RunAssembly assembly(runs);
        forEachRun(runs, [&](std::size_t, std::size_t first, std::size_t count) { assembly.add(first, count); });
        return assembly.take();
    }
    std::size_t triangles = 0;
    forEachRun(runs, [&](std::size_t, std::size_t, std::size_t count) { triangles += count - 2; });
    std::vector<std::uint32_t> assembled(3 * triangles);
    if (const Expected<ByteRange> done = reassembleRuns(runs, 0, runs.vertices(), assembled); !done)
        return tl::unexpected(done.error());
    return assembled;
}

Expected<ByteRange> reassembleRuns(const PrimitiveRuns& runs, std::size_t firstVertex, std::size_t endVertex,
                                   std::vector<std::uint32_t>& assembled) {
    ByteRange touched{.begin = assembled.size(), .end = 0};
    if (!followPlaces(runs.kind)) return ByteRange();
    std::size_t slot = 0;
    Error wrong;
    bool failed = false;
    forEachRun(runs, [&](std::size_t run, std::size_t first, std::size_t count) {
        const std::size_t begin = slot;
        slot += 3 * (count - 2);
        bool moved = false;
        for (std::size_t i = 0; i < count && !moved; ++i) {
            const std::uint32_t vertex = runs.vertex(first + i);
            moved = vertex >= firstVertex && vertex < endVertex;
        }
        if (!moved || failed) return;
        const Expected<std::vector<std::uint32_t>> corners = cut(runs, run, first, count);
        if (!corners) {
            failed = true;
            wrong = corners.error();
            return;
        }
        for (std::size_t i = 0; i < corners->size(); ++i) assembled[begin + i] = runs.vertex(first + (*corners)[i]);
        touched.begin = std::min<std::uint64_t>(touched.begin, begin);
        touched.end = slot;
    });
    if (failed) return tl::unexpected(wrong);
    return touched.empty() ? ByteRange() : touched;
}

}  // namespace tessera
