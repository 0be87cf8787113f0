#include "server/import/NurbsCores.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "common/drawable/Drawable.h"
#include "server/import/MessageArrays.h"
#include "server/import/TableCores.h"

namespace tessera {
namespace {

using google::protobuf::RepeatedField;

/// What is said, or knots from 0 to 1 that are evenly spaced, the ends degree + 1 times. Nothing where that many points
/// are none.
std::vector<double> knotsOr(const RepeatedField<double>& said, std::int64_t degree, std::size_t count) {
    if (!said.empty()) return {said.begin(), said.end()};
    std::vector<double> knots;
    const auto p = static_cast<std::size_t>(degree);
    if (count <= p) return knots;
    for (std::size_t i = 0; i < count + p + 1; ++i)
        knots.push_back(i <= p ? 0 : i >= count ? 1 : static_cast<double>(i - p) / static_cast<double>(count - p));
    return knots;
}

}  // namespace

Expected<NurbsSurfaceCore> readNurbsSurface(const proto::scene::NurbsSurface& message) {
    Expected<NurbsSurfaceCore> core = readTableObject<NurbsSurfaceCore>(message);
    if (!core) return core;
    const auto points = static_cast<std::size_t>(message.point_size());
    if (points == 0) return fail(ErrorCode::kBadInput, "a NURBS surface has no control points");
    if (message.knot_u().empty() && message.count_u() == 0)
        return fail(ErrorCode::kBadInput, "it needs a count_u or a knot_u");
    const std::int64_t knotted = message.knot_u_size() - core->degreeU - 1;
    const std::size_t alongU =
        message.count_u() != 0 ? message.count_u() : static_cast<std::size_t>(std::max<std::int64_t>(knotted, 1));
    if (points % alongU != 0)
        return fail(ErrorCode::kBadInput, fmt::format("{} control points are no rows of {}", points, alongU));
    if (message.count_u() != 0 && !message.knot_u().empty() && static_cast<std::int64_t>(message.count_u()) != knotted)
        return fail(ErrorCode::kBadInput, fmt::format("its knot_u are for {} control points along u, not for {}",
                                                      knotted, message.count_u()));
    core->knotsU = blobOfNumbers(knotsOr(message.knot_u(), core->degreeU, alongU));
    core->knotsV = blobOfNumbers(knotsOr(message.knot_v(), core->degreeV, points / alongU));
    std::vector<double> numbers;
    for (const proto::scene::Vector& p : message.point()) numbers.insert(numbers.end(), {p.x(), p.y(), p.z()});
    core->points = blobOfNumbers(numbers);
    core->weights = blobOfNumbers(message.weight());
    if (message.has_begin_u() || message.has_end_u() || message.has_begin_v() || message.has_end_v()) {
        if (!(message.has_begin_u() && message.has_end_u() && message.has_begin_v() && message.has_end_v()))
            return fail(ErrorCode::kBadInput, "of begin_u, end_u, begin_v and end_v some are missing");
        core->range = blobOfNumbers(std::array{message.begin_u(), message.end_u(), message.begin_v(), message.end_v()});
    }
    std::vector<std::uint32_t> loops, curves;
    std::vector<double> curveKnots, curvePoints, curveRanges;
    for (const proto::scene::NurbsLoop& loop : message.loop()) {
        loops.insert(loops.end(), {loop.hole() ? 1u : 0u, static_cast<std::uint32_t>(loop.curve_size())});
        for (const proto::scene::NurbsCurve& curve : loop.curve()) {
            const std::uint32_t degree = curve.has_degree() ? curve.degree() : 1;
            const auto count = static_cast<std::size_t>(curve.point_size());
            if (curve.weight_size() != 0 && curve.weight_size() != curve.point_size())
                return fail(ErrorCode::kBadInput, fmt::format("a curve of a loop has {} weights for {} control points",
                                                              curve.weight_size(), count));
            if (degree > static_cast<std::uint32_t>(NurbsSurfaceCore::kHighestDegree))
                return fail(ErrorCode::kBadInput, fmt::format("a curve of a loop has degree {}: at most 24", degree));
            const std::vector<double> knots = knotsOr(curve.knot(), degree, count);
            if (knots.size() != count + degree + 1)
                return fail(ErrorCode::kBadInput,
                            fmt::format("a curve of a loop has {} knots for {} control points of degree {}",
                                        knots.size(), count, degree));
            curves.insert(curves.end(), {degree, static_cast<std::uint32_t>(count)});
            curveKnots.insert(curveKnots.end(), knots.begin(), knots.end());
            for (int k = 0; k < curve.point_size(); ++k)
                curvePoints.insert(curvePoints.end(), {curve.point(k).x(), curve.point(k).y(),
                                                       curve.weight_size() == 0 ? 1.0 : curve.weight(k)});
            curveRanges.push_back(curve.has_begin() ? curve.begin() : knots[degree]);
            curveRanges.push_back(curve.has_end() ? curve.end() : knots[count]);
        }
    }
    core->loops = blobOfNumbers(loops);
    core->curves = blobOfNumbers(curves);
    core->curveKnots = blobOfNumbers(curveKnots);
    core->curvePoints = blobOfNumbers(curvePoints);
    core->curveRanges = blobOfNumbers(curveRanges);
    if (Expected<void> good = Drawable(*findDrawable(NurbsSurfaceCore::kType), &*core).check(); !good)
        return tl::unexpected(good.error());
    return core;
}

}  // namespace tessera
