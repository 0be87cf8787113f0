#include "tests/bench/CollisionBullet.h"

#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>

#include "tests/support/Models.h"

namespace tessera {

struct BulletGImpactModel::Shape {
    std::vector<btScalar> positions;
    std::vector<int> indices;
    std::unique_ptr<btTriangleIndexVertexArray> triangles;
    std::unique_ptr<btGImpactMeshShape> shape;
};

BulletGImpactModel::BulletGImpactModel(const TriangleMesh& mesh) : shape_(std::make_unique<Shape>()) {
    const MeshArrays3 arrays = arraysOf(mesh);
    shape_->positions.assign(arrays.positions.begin(), arrays.positions.end());
    shape_->indices.assign(arrays.indices.begin(), arrays.indices.end());
    shape_->triangles = std::make_unique<btTriangleIndexVertexArray>(
        static_cast<int>(shape_->indices.size() / 3), shape_->indices.data(), static_cast<int>(3 * sizeof(int)),
        static_cast<int>(shape_->positions.size() / 3), shape_->positions.data(),
        static_cast<int>(3 * sizeof(btScalar)));
    shape_->shape = std::make_unique<btGImpactMeshShape>(shape_->triangles.get());
}
BulletGImpactModel::~BulletGImpactModel() = default;
BulletGImpactModel::BulletGImpactModel(BulletGImpactModel&&) noexcept = default;

void BulletGImpactModel::build() {
    shape_->shape->updateBound();
}

}  // namespace tessera
