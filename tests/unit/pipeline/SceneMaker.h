/// Scenes for the pipeline's tests: an aspect that grows by applied lists, each told to the pipeline.
#pragma once

#include <gtest/gtest.h>

#include "common/cores/CollisionObject.h"
#include "common/cores/Environment.h"
#include "common/cores/Geometry.h"
#include "common/cores/Interest.h"
#include "common/cores/Switch.h"
#include "common/cores/Transform.h"
#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "server/collision/pipeline/CollisionPipeline.h"
#include "tests/unit/collision/Shapes.h"

namespace tessera {

class SceneMaker {
public:
    Aspect aspect;
    CollisionPipeline pipeline;

    explicit SceneMaker(CollisionLimits limits = {}, Workers* workers = nullptr) : pipeline(limits, workers) {
        pipeline.sceneChanged(aspect, nullptr);
    }

    void apply(ChangeListBuilder& builder) {
        const ChangeList list = builder.take();
        const auto applied = aspect.apply(list);
        ASSERT_TRUE(applied) << applied.error().message;
        pipeline.sceneChanged(aspect, &list);
    }

    ObjectId node(ObjectId parent, ObjectId core = {}) {
        ChangeListBuilder b;
        const ObjectId id = fresh();
        b.create(id, typeOf<Node>());
        if (core) b.set(id, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
        b.place(id, parent);
        apply(b);
        return id;
    }
    ObjectId transform(const Vec3d& translation, const Quatd& rotation = Quatd::Identity(),
                       const Vec3d& scale = Vec3d::Ones()) {
        ChangeListBuilder b;
        const ObjectId id = fresh();
        b.create(id, typeOf<Transform>());
        set(b, id, {id, translation, rotation, scale});
        apply(b);
        return id;
    }
    ObjectId geometry(const shapes::Soup& soup) {
        ChangeListBuilder b;
        const ObjectId id = fresh();
        b.create(id, typeOf<Geometry>());
        b.set(id, typeOf<Geometry>(), fieldId<&Geometry::positions>, Blob::of(std::span<const float>(soup.positions)));
        b.set(id, typeOf<Geometry>(), fieldId<&Geometry::indices>,
              Blob::of(std::span<const std::uint32_t>(soup.indices)));
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
    /// Also gives the interest its node.
    ObjectId interest(ObjectId object, ObjectId against = {}, std::int64_t response = Interest::kStop) {
        ChangeListBuilder b;
        const ObjectId id = fresh();
        b.create(id, typeOf<Interest>());
        b.set(id, typeOf<Interest>(), fieldId<&Interest::object>, toValue(object));
        b.set(id, typeOf<Interest>(), fieldId<&Interest::against>, toValue(against));
        b.set(id, typeOf<Interest>(), fieldId<&Interest::response>, toValue(response));
        apply(b);
        node(kRootNode, id);
        return id;
    }
    /// Every field of an interest. Also gives it its node.
    ObjectId interest(const Interest& fields) {
        ChangeListBuilder b;
        const ObjectId id = fresh();
        b.create(id, typeOf<Interest>());
        setAll(b, id, Object::of(fields));
        apply(b);
        node(kRootNode, id);
        return id;
    }
    /// Also gives it its node.
    ObjectId object(const CollisionObject& fields) {
        ChangeListBuilder b;
        const ObjectId id = fresh();
        b.create(id, typeOf<CollisionObject>());
        setAll(b, id, Object::of(fields));
        apply(b);
        node(kRootNode, id);
        return id;
    }
    void gravity(const Vec3d& value) {
        ChangeListBuilder b;
        const ObjectId id = fresh();
        b.create(id, typeOf<Environment>());
        b.set(id, typeOf<Environment>(), fieldId<&Environment::gravity>, toValue(value));
        apply(b);
        node(kRootNode, id);
    }
    template <typename Core, typename Value>
    void set(ObjectId id, FieldId field, const Value& value) {
        ChangeListBuilder b;
        b.set(id, typeOf<Core>(), field, toValue(value));
        apply(b);
    }
    /// Takes a node without children out of the scene.
    void destroy(ObjectId nodeId) {
        ChangeListBuilder b;
        b.detach(nodeId);
        b.destroy(nodeId);
        apply(b);
    }
    void setChoice(ObjectId switchId, std::int64_t choice) {
        ChangeListBuilder b;
        b.set(switchId, typeOf<Switch>(), fieldId<&Switch::choice>, toValue(choice));
        apply(b);
    }
    void commit(const TentativeTransform& value) {
        ChangeListBuilder b;
        set(b, value.transform, value);
        apply(b);
    }

    /// A step whose values are committed, as the frame loop does.
    StepResult frame(const std::vector<TentativeTransform>& wanted = {}, const std::vector<Reply>& replies = {}) {
        StepResult result = pipeline.step(aspect, wanted, replies);
        ChangeListBuilder b;
        for (const TentativeTransform& t : result.accepted) set(b, t.transform, t);
        for (const BodyVelocity& v : result.velocities) {
            b.set(v.core, typeOf<CollisionObject>(), fieldId<&CollisionObject::velocity>, toValue(v.velocity));
            b.set(v.core, typeOf<CollisionObject>(), fieldId<&CollisionObject::spin>, toValue(v.spin));
        }
        apply(b);
        return result;
    }
    [[nodiscard]] const Transform& at(ObjectId transformId) const { return *aspect.get<Transform>(transformId); }

    struct Body {
        ObjectId transform, node, shape;  ///< `shape` bears the geometry
    };
    Body body(ObjectId parent, const shapes::Soup& soup, const Vec3d& where,
              const Quatd& rotation = Quatd::Identity()) {
        Body out;
        out.transform = transform(where, rotation);
        out.node = node(parent, out.transform);
        out.shape = node(out.node, geometry(soup));
        return out;
    }

private:
    static void setAll(ChangeListBuilder& b, ObjectId id, const Object& object) {
        const TypeInfo& type = object.info();
        for (const FieldEntry& info : type.fields) b.set(id, type.type, info.id, info.load(object));
    }
    ObjectId fresh() const { return ObjectId(aspect.nextFreeId()); }
    static void set(ChangeListBuilder& b, ObjectId id, const TentativeTransform& v) {
        b.set(id, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(v.translation));
        b.set(id, typeOf<Transform>(), fieldId<&Transform::rotation>, toValue(v.rotation));
        b.set(id, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(v.scale));
    }
};

}  // namespace tessera
