/// Nodes by which tests of journals know what is there.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/cores/Geometry.h"
#include "common/cores/Node.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"

namespace tessera::test {

/// A node of this name at this place; every third has an array of its own.
inline ChangeList newNode(const std::string& name, double x) {
    ChangeListBuilder list;
    const ObjectId node{kFirstPlaceholder}, place{kFirstPlaceholder + 1}, shape{kFirstPlaceholder + 2};
    list.create(node, typeOf<Node>());
    list.create(place, typeOf<Transform>());
    list.set(place, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(x, 0, 0)));
    list.set(node, typeOf<Node>(), fieldId<&Node::name>, name);
    list.set(node, typeOf<Node>(), fieldId<&Node::core>, place);
    list.place(node, kRootNode);
    if (static_cast<int>(x) % 3 == 0) {
        const ObjectId below{kFirstPlaceholder + 3};
        const std::vector<float> corners{0, 0, 0, 1, 0, 0, 0, static_cast<float>(x + 1), 0};
        const std::vector<std::uint32_t> indices{0, 1, 2};
        list.create(shape, typeOf<Geometry>());
        list.set(shape, typeOf<Geometry>(), fieldId<&Geometry::positions>, Blob::of(std::span<const float>(corners)));
        list.set(shape, typeOf<Geometry>(), fieldId<&Geometry::indices>,
                 Blob::of(std::span<const std::uint32_t>(indices)));
        list.create(below, typeOf<Node>());
        list.set(below, typeOf<Node>(), fieldId<&Node::core>, shape);
        list.place(below, node);
    }
    return list.take();
}

}  // namespace tessera::test
