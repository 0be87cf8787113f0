#include "tests/support/fcl/FclPeer.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <algorithm>
#include <limits>

#include "common/cores/Volume.h"
#include "tests/support/Models.h"

#ifdef __SSE3__
#error "FCL's headers with flags for newer processors than its package is built for"
#endif

namespace tessera {

namespace {

std::vector<fcl::Vector3d> verticesOf(const std::vector<double>& positions) {
    std::vector<fcl::Vector3d> out;
    for (std::size_t v = 0; v < positions.size(); v += 3)
        out.emplace_back(positions[v], positions[v + 1], positions[v + 2]);
    return out;
}

template <typename Volume>
std::unique_ptr<fcl::BVHModel<Volume>> modelOf(const TriangleMesh& mesh) {
    const MeshArrays3 arrays = arraysOf(mesh);
    std::vector<fcl::Triangle> triangles;
    for (std::size_t i = 0; i < arrays.indices.size(); i += 3)
        triangles.emplace_back(arrays.indices[i], arrays.indices[i + 1], arrays.indices[i + 2]);
    auto model = std::make_unique<fcl::BVHModel<Volume>>();
    model->beginModel(static_cast<int>(triangles.size()), static_cast<int>(arrays.positions.size() / 3));
    model->addSubModel(verticesOf(arrays.positions), triangles);
    model->endModel();
    return model;
}

fcl::Transform3d toFcl(const Affine3d& m) {
    fcl::Transform3d out;
    out.matrix() = m.matrix();
    return out;
}

constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max() / 2;

}  // namespace

struct FclPair::Models {
    std::unique_ptr<fcl::CollisionGeometryd> a, b;

    std::size_t collide(const Affine3d& a_T_b, std::size_t most, bool contacts) const {
        const fcl::CollisionRequestd request(most, contacts);
        fcl::CollisionResultd result;
        return fcl::collide(a.get(), fcl::Transform3d::Identity(), b.get(), toFcl(a_T_b), request, result);
    }
};

FclPair::FclPair(const TriangleMesh& a, const TriangleMesh& b, FclVolume volume) : models_(std::make_unique<Models>()) {
    if (volume == FclVolume::kObb) {
        models_->a = modelOf<fcl::OBBd>(a);
        models_->b = modelOf<fcl::OBBd>(b);
    } else {
        models_->a = modelOf<fcl::OBBRSSd>(a);
        models_->b = modelOf<fcl::OBBRSSd>(b);
    }
}
FclPair::~FclPair() = default;
FclPair::FclPair(FclPair&&) noexcept = default;

bool FclPair::any(const Affine3d& a_T_b) const {
    return models_->collide(a_T_b, 1, false) > 0;
}

std::size_t FclPair::all(const Affine3d& a_T_b) const {
    return models_->collide(a_T_b, kNoLimit, false);
}

std::size_t FclPair::contacts(const Affine3d& a_T_b) const {
    return models_->collide(a_T_b, kNoLimit, true);
}

double FclPair::distance(const Affine3d& a_T_b) const {
    const fcl::DistanceRequestd request(true);
    fcl::DistanceResultd result;
    const double found =
        fcl::distance(models_->a.get(), fcl::Transform3d::Identity(), models_->b.get(), toFcl(a_T_b), request, result);
    return std::max(found, 0.0);
}

struct FclDeformingModel::Model {
    std::unique_ptr<fcl::BVHModel<fcl::KDOP<double, 18>>> bvh;
    std::vector<std::vector<fcl::Vector3d>> states;
};

FclDeformingModel::FclDeformingModel(const TriangleMesh& mesh) : model_(std::make_unique<Model>()) {
    model_->bvh = modelOf<fcl::KDOP<double, 18>>(mesh);
}
FclDeformingModel::~FclDeformingModel() = default;

void FclDeformingModel::prepare(const std::vector<std::vector<double>>& states) {
    for (const std::vector<double>& positions : states) model_->states.push_back(verticesOf(positions));
}

void FclDeformingModel::refit(std::size_t state) {
    model_->bvh->beginReplaceModel();
    model_->bvh->replaceSubModel(model_->states[state]);
    model_->bvh->endReplaceModel(true, true);
}

std::size_t fclObbBytes(const TriangleMesh& mesh) {
    const auto model = modelOf<fcl::OBBd>(mesh);
    return sizeof(fcl::OBBd) * static_cast<std::size_t>(model->getNumBVs()) +
           sizeof(fcl::Triangle) * static_cast<std::size_t>(model->num_tris) +
           sizeof(fcl::Vector3d) * static_cast<std::size_t>(model->num_vertices) + sizeof(*model);
}

}  // namespace tessera
