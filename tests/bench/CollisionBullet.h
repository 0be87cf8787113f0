/// Bullet's GImpact as Debian ships it: the peer of our build.
#pragma once

#include <memory>

#include "server/collision/mesh/TriangleMesh.h"

namespace tessera {

class BulletGImpactModel {
public:
    /// Takes the triangles; no tree yet.
    explicit BulletGImpactModel(const TriangleMesh& mesh);
    ~BulletGImpactModel();
    BulletGImpactModel(BulletGImpactModel&&) noexcept;
    /// Builds the tree (btGImpactQuantizedBvh). Once per model.
    void build();

private:
    struct Shape;
    std::unique_ptr<Shape> shape_;
};

}  // namespace tessera
