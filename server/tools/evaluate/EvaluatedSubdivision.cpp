#include "server/tools/evaluate/EvaluatedSubdivision.h"

#include "common/freeform/subdivision/LimitEvaluator.h"
#include "server/tools/evaluate/ObjControlMesh.h"

namespace tessera {
namespace {

class EvaluatedSubdivision final : public EvaluatedSurface {
public:
    EvaluatedSubdivision(SubdivisionTopology topology, ObjControlMesh file)
        : topology_(std::move(topology)), file_(std::move(file)), evaluator_(topology_) {}

    Expected<SurfacePoint> at(std::uint32_t face, double u, double v) override { return evaluator_.evaluate(file_.mesh.positions, {face, u, v}); }
    std::vector<std::string> notes() const override { return file_.notes; }

private:
    SubdivisionTopology topology_;
    ObjControlMesh file_;
    LimitEvaluator evaluator_;  // of the topology above
};

}  // namespace

Expected<std::unique_ptr<EvaluatedSurface>> loadSubdivision(std::string_view text, std::string_view file, SubdivisionScheme scheme) {
    Expected<ObjControlMesh> obj = parseObjControlMesh(text, file, scheme);
    if (!obj) return tl::unexpected(obj.error());
    Expected<SubdivisionTopology> topology = SubdivisionTopology::build(obj->mesh);
    if (!topology) return failWith(file, topology.error());
    return std::make_unique<EvaluatedSubdivision>(std::move(*topology), std::move(*obj));
}

}  // namespace tessera
