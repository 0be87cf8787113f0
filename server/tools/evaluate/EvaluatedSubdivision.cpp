#include "server/tools/evaluate/EvaluatedSubdivision.h"

#include <algorithm>
#include <optional>
#include <variant>

#include "common/freeform/PatchDistance.h"
#include "common/freeform/subdivision/LimitEvaluator.h"
#include "common/freeform/subdivision/PatchExtraction.h"
#include "server/tools/evaluate/ObjControlMesh.h"

namespace tessera {
namespace {

class EvaluatedSubdivision final : public EvaluatedSurface {
public:
    EvaluatedSubdivision(SubdivisionTopology topology, ObjControlMesh file)
        : topology_(std::move(topology)), file_(std::move(file)), evaluator_(topology_) {}

    Expected<SurfacePoint> at(std::uint32_t face, double u, double v) override {
        return evaluator_.evaluate(file_.mesh.positions, {face, u, v});
    }
    std::vector<std::string> notes() const override { return file_.notes; }

    /// By Bézier patches, each no farther from the surface than its error (PatchExtraction.h).
    Expected<NearestPoint> nearest(const Vec3d& place, double tolerance) override {
        if (file_.mesh.scheme != SubdivisionScheme::kCatmullClark)
            return fail(
                ErrorCode::kRefused,
                "nearest points are told of catmull-clark and nurbs: other schemes make no patches over squares");
        if (const Expected<void> made = makePatches(tolerance); !made) return tl::unexpected(made.error());
        const std::optional<ClosestPoint> found = closestPoint(beziers_, place, {.tolerance = 0.5 * tolerance});
        if (!found) return fail(ErrorCode::kRefused, "there is no point of a surface");
        const SurfacePatch& patch = patches_[found->patch];
        return NearestPoint{patch.ptex,
                            patch.u + patch.size * found->u,
                            patch.v + patch.size * found->v,
                            found->point,
                            found->distance,
                            found->error + worst_};
    }

private:
    Expected<void> makePatches(double tolerance) {
        if (madeFor_ == tolerance) return {};
        NeighbourhoodGraph graph(topology_);
        Expected<std::vector<SurfacePatch>> made =
            patchesOf(graph, file_.mesh.positions, {.tolerance = 0.5 * tolerance});
        if (!made) return tl::unexpected(made.error());
        patches_ = std::move(*made);
        beziers_.clear();
        worst_ = 0;
        for (const SurfacePatch& patch : patches_) {
            beziers_.push_back(std::get<BezierPatch>(patch.shape));
            worst_ = std::max(worst_, patch.error);
        }
        madeFor_ = tolerance;
        return {};
    }

    std::vector<SurfacePatch> patches_;
    std::vector<BezierPatch> beziers_;
    double worst_ = 0, madeFor_ = 0;
    SubdivisionTopology topology_;
    ObjControlMesh file_;
    LimitEvaluator evaluator_;  // of the topology above
};

}  // namespace

Expected<std::unique_ptr<EvaluatedSurface>> loadSubdivision(std::string_view text, std::string_view file,
                                                            SubdivisionScheme scheme) {
    Expected<ObjControlMesh> obj = parseObjControlMesh(text, file, scheme);
    if (!obj) return tl::unexpected(obj.error());
    Expected<SubdivisionTopology> topology = SubdivisionTopology::build(obj->mesh);
    if (!topology) return failWith(file, topology.error());
    return std::make_unique<EvaluatedSubdivision>(std::move(*topology), std::move(*obj));
}

}  // namespace tessera
