#include "server/collision/query/DistanceQuery.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/collision/mesh/TriangleContact.h"
#include "server/collision/query/PairFrame.h"
#include "server/collision/query/TouchQuery.h"
#include "server/collision/tree/Kernels.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

using kernel::DistanceSink;

float roundedUp(double x) {
    const float f = static_cast<float>(std::min(x, 3e38));
    return static_cast<double>(f) >= x ? f : std::nextafter(f, std::numeric_limits<float>::infinity());
}

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
          unit_(a.storage().unit) {
        sink_.bound = roundedUp(options.upperBound * unit_);
        sink_.tolerance = -roundedUp(-options.tolerance * unit_);
        sink_.facesA = facesA_.data();
        sink_.facesB = facesB_.data();
        sink_.atLeast = atLeast_.data();
        sink_.capacity = static_cast<std::uint32_t>(facesA_.size());
        sink_.decide = [](DistanceSink&, void* self) { static_cast<Nearest*>(self)->decide(); };
        sink_.context = this;
        sink_.nodeTests = work.boxTests;
        sink_.triangleTests = work.triangleTests;
        sink_.limit = work.limit;
        sink_.unexplored = std::numeric_limits<float>::infinity();
    }

    [[nodiscard]] DistanceSink& sink() { return sink_; }

    void measure(FacePair faces) {
        const NearestPoints near = nearestPoints(a_.triangle(faces.a), transformed(a_T_b_, b_.triangle(faces.b)));
        if (near.distance > best_.distance || (near.distance == best_.distance && best_.faces < faces)) return;
        best_ = {near.distance, faces, near.onA, near.onB};
        // Not below what a float can say: a pair as near as this one must still be looked at.
        sink_.bound = std::min(sink_.bound, roundedUp(near.distance * unit_) - sink_.tolerance);
    }

    /// The nearest as it seems first: then most of the others are certainly farther.
    void decide() {
        std::uint32_t count = 0;
        for (std::uint32_t i = 0; i < sink_.count; ++i) {
            if (!(atLeast_[i] <= sink_.bound + sink_.tolerance)) continue;
            facesA_[count] = facesA_[i];
            facesB_[count++] = facesB_[i];
        }
        sink_.count = 0;
        if (count == 0) return;
        kernel::treeKernels().measure(viewA_, viewB_, map_, facesA_.data(), facesB_.data(), count, low_.data(),
                                      high_.data());
        const auto first =
            static_cast<std::uint32_t>(std::min_element(high_.begin(), high_.begin() + count) - high_.begin());
        const auto look = [&](std::uint32_t i) {
            if (!(low_[i] > best_.distance)) measure({facesA_[i], facesB_[i]});
        };
        look(first);
        for (std::uint32_t i = 0; i < count; ++i)
            if (i != first) look(i);
    }

    [[nodiscard]] const Distance& best() const { return best_; }

private:
    const TriangleMesh &a_, &b_;
    const kernel::MeshView viewA_, viewB_;
    const Affine3d& a_T_b_;
    const kernel::PairMap map_;
    double unit_;
    std::array<std::uint32_t, 256> facesA_, facesB_;
    std::array<float, 256> atLeast_;
    std::array<double, 256> low_, high_;  ///< of their distances
    DistanceSink sink_{};
    Distance best_;
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
    DistanceSink& sink = nearest.sink();
    const kernel::PairFrame frame = pairFrame(a, b, a_T_b);
    kernel::treeKernels().distance[static_cast<std::size_t>(shapeOf(a.options().volume))](
        a.storage().view(), b.storage().view(), frame, {0, 0}, sink);
    nearest.decide();
    work.boxTests = sink.nodeTests;
    work.triangleTests = sink.triangleTests;
    if (sink.exhausted) {
        const double left = std::max(0.0, static_cast<double>(sink.unexplored) / a.storage().unit);
        unknown.distance = std::min({left, nearest.best().distance, options.upperBound});
        return unknown;
    }
    return nearest.best().distance < options.upperBound ? nearest.best() : none;
}

}  // namespace tessera
