#include "server/collision/query/DistanceQuery.h"

#include <algorithm>
#include <array>

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/query/DistanceCandidates.h"
#include "server/collision/query/PairFrame.h"
#include "server/collision/query/TouchQuery.h"
#include "server/collision/query/TouchSearch.h"
#include "server/collision/tree/Kernels.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

/// Measures candidates in double and keeps the nearest.
class Nearest {
public:
    Nearest(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b, const DistanceOptions& options,
            const QueryWork& work)
        : a_(a.mesh()),
          b_(b.mesh()),
          viewA_(meshView(a_)),
          viewB_(meshView(b_)),
          a_T_b_(a_T_b),
          map_(pairMap(a, b, a_T_b)),
          found_(*this, work) {
        found_.setUnit(a.storage().unit, options.upperBound, options.tolerance);
    }

    [[nodiscard]] DistanceCandidates& found() { return found_; }

    void measure(FacePair faces) {
        found_.measured(faces, nearestPoints(a_.triangle(faces.a), transformed(a_T_b_, b_.triangle(faces.b))));
    }

    /// The nearest as it seems first: then most of the others are certainly farther.
    void decide() {
        auto &facesA = found_.facesA, &facesB = found_.facesB;
        std::uint32_t count = 0;
        for (std::uint32_t i = 0; i < found_.sink.count; ++i) {
            if (!found_.canBeNearest(i)) continue;
            facesA[count] = facesA[i];
            facesB[count++] = facesB[i];
        }
        found_.sink.count = 0;
        if (count == 0) return;
        kernel::treeKernels().measure(viewA_, viewB_, map_, facesA.data(), facesB.data(), count, low_.data(),
                                      high_.data());
        const auto first =
            static_cast<std::uint32_t>(std::min_element(high_.begin(), high_.begin() + count) - high_.begin());
        const auto look = [&](std::uint32_t i) {
            if (!(low_[i] > found_.best.distance)) measure({facesA[i], facesB[i]});
        };
        look(first);
        for (std::uint32_t i = 0; i < count; ++i)
            if (i != first) look(i);
    }

private:
    const TriangleMesh &a_, &b_;
    const kernel::MeshView viewA_, viewB_;
    const Affine3d& a_T_b_;
    const kernel::PairMap map_;
    DistanceCandidates found_;
    std::array<double, DistanceCandidates::kMost> low_, high_;  ///< of their distances
};

Distance atContact(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b, FacePair faces) {
    const Vec3d point = contactOf(a.mesh().triangle(faces.a), transformed(a_T_b, b.mesh().triangle(faces.b))).point;
    return {0, faces, point, point};
}

}  // namespace

Distance distanceBetween(const TriangleTree& a, const TriangleTree& b, const Affine3d& a_T_b, QueryWork& work,
                         const DistanceOptions& options) {
    Distance none;
    none.distance = options.upperBound;
    none.farther = true;
    if (a.storage().empty() || b.storage().empty()) return none;
    if (const std::optional<TriangleTree> alike = touch::ofOneShape(a, b))
        return touch::smallerIsA(a, b) ? distanceBetween(*alike, b, a_T_b, work, options)
                                       : distanceBetween(a, *alike, a_T_b, work, options);
    // Edges and corners do not see a triangle that is pierced in its middle: whether they meet is asked first.
    const TouchedPair touched = firstTouching(a, b, a_T_b, work);
    if (touched.touch == Touch::kYes) return atContact(a, b, a_T_b, touched.faces);
    Distance unknown;
    unknown.distance = 0;
    unknown.complete = false;
    if (touched.touch == Touch::kUnknown) return unknown;

    Nearest nearest(a, b, a_T_b, options, work);
    if (options.start && options.start->a < a.mesh().faceCount() && options.start->b < b.mesh().faceCount())
        nearest.measure(*options.start);
    DistanceCandidates& found = nearest.found();
    const kernel::PairFrame frame = pairFrame(a, b, a_T_b);
    kernel::treeKernels().distance[static_cast<std::size_t>(shapeOf(a.options().volume))](
        a.storage().view(), b.storage().view(), frame, {0, 0}, found.sink);
    nearest.decide();
    found.countIn(work);
    if (found.sink.exhausted) {
        const double left = std::max(0.0, static_cast<double>(found.sink.unexplored) / found.unit());
        unknown.distance = std::min({left, found.best.distance, options.upperBound});
        return unknown;
    }
    return found.best.distance < options.upperBound ? found.best : none;
}

}  // namespace tessera
