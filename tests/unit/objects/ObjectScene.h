/// A scene that grows by applied lists, each told to an object handler.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <span>
#include <vector>

#include "common/cores/CollisionObject.h"
#include "common/cores/Geometry.h"
#include "common/cores/Interest.h"
#include "common/cores/Switch.h"
#include "common/cores/Transform.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "server/collision/objects/ObjectHandler.h"

namespace tessera {

/// Triangles for tests.
struct Soup {
    std::vector<float> positions;
    std::vector<std::uint32_t> indices;

    void vertex(const Vec3d& p) {
        for (int i = 0; i < 3; ++i) positions.push_back(static_cast<float>(p[i]));
    }
    [[nodiscard]] Blob positionBlob() const { return Blob::of(std::span<const float>(positions)); }
    [[nodiscard]] Blob indexBlob() const { return Blob::of(std::span<const std::uint32_t>(indices)); }
};

inline Soup boxSoup(const Vec3d& size) {
    Soup soup;
    for (int i = 0; i < 8; ++i)
        soup.vertex(
            Vec3d((i & 1 ? 0.5 : -0.5) * size.x(), (i & 2 ? 0.5 : -0.5) * size.y(), (i & 4 ? 0.5 : -0.5) * size.z()));
    soup.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                    2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    return soup;
}

/// Two triangles in the plane z = 0.
inline Soup sheetSoup() {
    Soup soup;
    for (int i = 0; i < 4; ++i) soup.vertex(Vec3d(i & 1, i >> 1, 0));
    soup.indices = {0, 1, 3, 0, 3, 2};
    return soup;
}

class ObjectScene {
public:
    Aspect aspect;
    std::shared_ptr<ShapeCache> shapes = std::make_shared<ShapeCache>();
    ObjectHandler handler;

    explicit ObjectScene(HandlerLimits limits = {}) : handler(shapes, limits) { handler.update(aspect, nullptr); }

    void apply(ChangeListBuilder& builder) {
        const ChangeList list = builder.take();
        const Expected<void> applied = aspect.apply(list);
        ASSERT_TRUE(applied) << applied.error().message;
        handler.update(aspect, &list);
    }
    template <typename Core, typename Value>
    void set(ObjectId id, FieldId field, const Value& value) {
        ChangeListBuilder b;
        b.set(id, typeOf<Core>(), field, toValue(value));
        apply(b);
    }
    void place(ObjectId node, ObjectId parent) {
        ChangeListBuilder b;
        b.place(node, parent);
        apply(b);
    }
    [[nodiscard]] ObjectId fresh() const { return ObjectId(aspect.nextFreeId()); }

    ObjectId node(ObjectId parent, ObjectId core = {}) {
        ChangeListBuilder b;
        const ObjectId id = fresh();
        b.create(id, typeOf<Node>());
        if (core) b.set(id, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
        if (parent) b.place(id, parent);
        apply(b);
        return id;
    }
    ObjectId transform(const Vec3d& translation = Vec3d::Zero(), const Quatd& rotation = Quatd::Identity(),
                       const Vec3d& scale = Vec3d::Ones()) {
        ChangeListBuilder b;
        const ObjectId id = fresh();
        b.create(id, typeOf<Transform>());
        set(b, id, {translation, rotation, scale});
        apply(b);
        return id;
    }
    void move(ObjectId transformId, const Vec3d& translation, const Quatd& rotation = Quatd::Identity(),
              const Vec3d& scale = Vec3d::Ones()) {
        ChangeListBuilder b;
        set(b, transformId, {translation, rotation, scale});
        apply(b);
    }
    ObjectId geometry(const Soup& soup) {
        ChangeListBuilder b;
        const ObjectId id = fresh();
        b.create(id, typeOf<Geometry>());
        b.set(id, typeOf<Geometry>(), fieldId<&Geometry::positions>, soup.positionBlob());
        b.set(id, typeOf<Geometry>(), fieldId<&Geometry::indices>, soup.indexBlob());
        apply(b);
        return id;
    }
    ObjectId switchCore(std::int64_t choice) {
        ChangeListBuilder b;
        const ObjectId id = fresh();
        b.create(id, typeOf<Switch>());
        b.set(id, typeOf<Switch>(), fieldId<&Switch::choice>, toValue(choice));
        apply(b);
        return id;
    }
    /// An Interest with a node of its own at the root.
    ObjectId interest(const Interest& value) {
        ChangeListBuilder b;
        const ObjectId id = fresh();
        const ObjectType type = typeOf<Interest>();
        b.create(id, type);
        b.set(id, type, fieldId<&Interest::object>, toValue(value.object));
        b.set(id, type, fieldId<&Interest::against>, toValue(value.against));
        b.set(id, type, fieldId<&Interest::response>, toValue(value.response));
        b.set(id, type, fieldId<&Interest::enabled>, toValue(value.enabled));
        b.set(id, type, fieldId<&Interest::mode>, toValue(value.mode));
        b.set(id, type, fieldId<&Interest::detail>, toValue(value.detail));
        b.set(id, type, fieldId<&Interest::objectLayers>, toValue(value.objectLayers));
        b.set(id, type, fieldId<&Interest::againstLayers>, toValue(value.againstLayers));
        b.set(id, type, fieldId<&Interest::threshold>, toValue(value.threshold));
        b.set(id, type, fieldId<&Interest::show>, toValue(value.show));
        b.set(id, type, fieldId<&Interest::patience>, toValue(value.patience));
        apply(b);
        node(kRootNode, id);
        return id;
    }
    /// A CollisionObject with a node of its own at the root.
    ObjectId object(const CollisionObject& value) {
        ChangeListBuilder b;
        const ObjectId id = fresh();
        const ObjectType type = typeOf<CollisionObject>();
        b.create(id, type);
        b.set(id, type, fieldId<&CollisionObject::node>, toValue(value.node));
        b.set(id, type, fieldId<&CollisionObject::kind>, toValue(value.kind));
        b.set(id, type, fieldId<&CollisionObject::division>, toValue(value.division));
        b.set(id, type, fieldId<&CollisionObject::shape>, toValue(value.shape));
        b.set(id, type, fieldId<&CollisionObject::layers>, toValue(value.layers));
        b.set(id, type, fieldId<&CollisionObject::mass>, toValue(value.mass));
        b.set(id, type, fieldId<&CollisionObject::restitution>, toValue(value.restitution));
        b.set(id, type, fieldId<&CollisionObject::friction>, toValue(value.friction));
        b.set(id, type, fieldId<&CollisionObject::velocity>, toValue(value.velocity));
        b.set(id, type, fieldId<&CollisionObject::spin>, toValue(value.spin));
        apply(b);
        node(kRootNode, id);
        return id;
    }

    /// A Transform's node with a geometry's node below.
    struct Thing {
        ObjectId transform, node, geometry, shape;  ///< `shape` is the node that bears the geometry
    };
    Thing thing(ObjectId parent, const Vec3d& where = Vec3d::Zero(), const Soup& soup = boxSoup(Vec3d::Ones())) {
        Thing out;
        out.transform = transform(where);
        out.node = node(parent, out.transform);
        out.geometry = geometry(soup);
        out.shape = node(out.node, out.geometry);
        return out;
    }

    /// The part that a node is, or kNobody.
    [[nodiscard]] std::uint32_t part(ObjectId nodeId) const { return handler.partOf(nodeId); }
    [[nodiscard]] bool takesPart(ObjectId nodeId) const { return part(nodeId) != kNobody; }
    /// The body that a geometry's node belongs to. It must take part.
    [[nodiscard]] const Body& body(ObjectId nodeId) const {
        return handler.bodies()[handler.parts()[part(nodeId)].body];
    }
    /// Nothing where one of the two takes no part.
    [[nodiscard]] Relation relation(ObjectId a, ObjectId b) const {
        const std::uint32_t partA = part(a), partB = part(b);
        return partA == kNobody || partB == kNobody ? Relation{} : handler.relation(partA, partB);
    }
    [[nodiscard]] bool related(ObjectId a, ObjectId b) const { return relation(a, b).relevant; }

private:
    static void set(ChangeListBuilder& b, ObjectId id, const Transform& v) {
        b.set(id, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(v.translation));
        b.set(id, typeOf<Transform>(), fieldId<&Transform::rotation>, toValue(v.rotation));
        b.set(id, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(v.scale));
    }
};

}  // namespace tessera
