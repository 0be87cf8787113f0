/// Scenes made by hand, node by node, whatever their numbers are.
#pragma once

#include <gtest/gtest.h>

#include <limits>

#include "common/cores/Geometry.h"
#include "common/cores/Material.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"

namespace tessera {

class BuiltScene {
public:
    /// A core with these fields; of types without any.
    template <typename Core>
    ObjectId add(const Core& core) {
        const ObjectId id{next_++};
        list_.create(id, typeOf<Core>());
        const Object object = Object::of(core);
        for (const FieldEntry& field : object.info().fields)
            list_.set(id, typeOf<Core>(), field.id, field.load(object));
        return id;
    }
    ObjectId node(std::string_view name, ObjectId core = {}, ObjectId parent = kRootNode) {
        const ObjectId id{next_++};
        list_.create(id, typeOf<Node>());
        list_.set(id, typeOf<Node>(), fieldId<&Node::name>, std::string(name));
        if (core) list_.set(id, typeOf<Node>(), fieldId<&Node::core>, core);
        list_.place(id, parent);
        return id;
    }
    Aspect take(SceneLimits limits = {}) {
        Aspect scene(limits);
        const Expected<void> applied = scene.apply(list_.take());
        EXPECT_TRUE(applied) << (applied ? "" : applied.error().message);
        return scene;
    }

private:
    ChangeListBuilder list_;
    std::uint64_t next_ = kRootNode.value + 1;
};

template <typename T>
Blob blobOf(std::initializer_list<T> values) {
    return Blob::of(std::span<const T>(values.begin(), values.size()));
}

/// One triangle in the XY plane.
inline Geometry triangleGeometry() {
    Geometry geometry;
    geometry.positions = blobOf<float>({0, 0, 0, 1, 0, 0, 0, 1, 0});
    geometry.indices = blobOf<std::uint32_t>({0, 1, 2});
    return geometry;
}

}  // namespace tessera
