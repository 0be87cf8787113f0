#include "tests/bench/DeformingFcl.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>

#include "common/cores/Volume.h"

#ifdef __SSE3__
#error "FCL's headers with flags for newer processors than its package is built for"
#endif

namespace tessera {
namespace {

template <typename Volume>
class FclBody {
public:
    FclBody(const TriangleMesh& mesh, const std::vector<std::vector<Vec3d>>& frames) {
        for (const std::vector<Vec3d>& frame : frames) states_.emplace_back(frame.begin(), frame.end());
        std::vector<fcl::Triangle> triangles;
        for (std::uint32_t f = 0; f < mesh.faceCount(); ++f)
            triangles.emplace_back(mesh.vertexOf(f, 0), mesh.vertexOf(f, 1), mesh.vertexOf(f, 2));
        model_.beginModel(static_cast<int>(triangles.size()), static_cast<int>(mesh.vertexCount()));
        model_.addSubModel(states_.front(), triangles);
        model_.endModel();
    }
    void refit(std::size_t frame) {
        model_.beginReplaceModel();
        model_.replaceSubModel(states_[frame]);
        model_.endReplaceModel(true, true);
    }
    [[nodiscard]] const fcl::CollisionGeometryd* model() const { return &model_; }

private:
    fcl::BVHModel<Volume> model_;
    std::vector<std::vector<fcl::Vector3d>> states_;
};

template <typename Volume>
class FclBodies : public DeformingFclPair {
public:
    FclBodies(const TriangleMesh& a, const TriangleMesh& b, const std::vector<std::vector<Vec3d>>& framesA,
              const std::vector<std::vector<Vec3d>>& framesB)
        : a_(a, framesA), b_(b, framesB) {}
    void refit(std::size_t frame) override {
        a_.refit(frame);
        b_.refit(frame);
    }
    bool any(const Affine3d& a_T_b) override {
        fcl::Transform3d pose;
        pose.matrix() = a_T_b.matrix();
        fcl::CollisionResultd result;
        return fcl::collide(a_.model(), fcl::Transform3d::Identity(), b_.model(), pose,
                            fcl::CollisionRequestd(1, false), result) > 0;
    }

private:
    FclBody<Volume> a_, b_;
};

}  // namespace

std::unique_ptr<DeformingFclPair> deformingFclPair(DeformingFclVolume volume, const TriangleMesh& a,
                                                   const TriangleMesh& b,
                                                   const std::vector<std::vector<Vec3d>>& framesA,
                                                   const std::vector<std::vector<Vec3d>>& framesB) {
    switch (volume) {
        case DeformingFclVolume::kObb:
            return std::make_unique<FclBodies<fcl::OBBd>>(a, b, framesA, framesB);
        case DeformingFclVolume::kObbRss:
            return std::make_unique<FclBodies<fcl::OBBRSSd>>(a, b, framesA, framesB);
        case DeformingFclVolume::kAabb:
            break;
    }
    return std::make_unique<FclBodies<fcl::AABBd>>(a, b, framesA, framesB);
}

}  // namespace tessera
