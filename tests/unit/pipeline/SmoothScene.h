/// A box beside a smooth surface that is looked at as itself.
#pragma once

#include "common/cores/SubdivisionSurface.h"
#include "common/drawable/NurbsArrays.h"
#include "common/freeform/nurbs/NurbsShapes.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {

struct SmoothScene : SceneMaker {
    Body box = body(kRootNode, shapes::box(Vec3d::Ones()), Vec3d(0.1, 2, 0.2));
    ObjectId surface, node_, object_, law;

    template <typename Core>
    SmoothScene(const Core& fields, CollisionObject object, std::int64_t response = Interest::kReport)
        : surface(ObjectId(aspect.nextFreeId())) {
        ChangeListBuilder b;
        b.create(surface, typeOf<Core>());
        for (const FieldEntry& field : findType(typeOf<Core>())->fields)
            b.set(surface, typeOf<Core>(), field.id, field.read(&fields));
        apply(b);
        node_ = node(kRootNode, surface);
        object.node = node_;
        object_ = this->object(object);
        Interest interest;
        interest.object = box.node;
        interest.against = node_;
        interest.response = response;
        interest.mode = Interest::kPseudoDynamic;
        law = this->interest(interest);
        interest.mode = Interest::kDistance;
        interest.threshold = 100;
        this->interest(interest);
    }
    void move(std::uint64_t first, std::span<const float> floats) {
        ChangeListBuilder b;
        b.setRange(surface, typeOf<SubdivisionSurface>(), fieldId<&SubdivisionSurface::points>, first * sizeof(float),
                   Blob::of(floats));
        ChangeList list = b.take();
        ASSERT_TRUE(resolveRanges(aspect, list));
        ASSERT_TRUE(aspect.apply(list));
        pipeline.sceneChanged(aspect, &list);
    }
    StepResult boxAt(const Vec3d& where) {
        commit({.transform = box.transform, .translation = where});
        return frame();
    }
    [[nodiscard]] TentativeTransform boxTo(const Vec3d& where) const {
        return {.transform = box.transform, .translation = where};
    }
};

inline CollisionObject smoothObject(std::int64_t kind, double error = 0) {
    CollisionObject object;
    object.kind = kind;
    object.shape = CollisionObject::kFreeform;
    object.error = error;
    return object;
}

inline NurbsSurfaceCore ballCore(double radius) {
    return coreOfSurface(sphereSurface(radius).value());
}

/// How far a box of size 1 that stands along the axes is from a ball around the origin.
inline double boxFromBall(const Vec3d& at, double radius) {
    return (at.cwiseAbs().array() - 0.5).max(0.0).matrix().norm() - radius;
}

}  // namespace tessera
