#include "tests/unit/bodies/Bin.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/cores/Environment.h"
#include "common/cores/Geometry.h"
#include "common/cores/Interest.h"
#include "common/cores/Motion.h"
#include "common/cores/Node.h"
#include "common/cores/Switch.h"
#include "common/cores/Transform.h"
#include "common/geometry/Mesh.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"

namespace tessera::test {

namespace {

constexpr int kBodies = 40;
/// Frames in which bodies fall asleep: they settle, and then lie still for half a second.
constexpr int kSettling = 100;

ObjectId addGeometry(ChangeListBuilder& list, ObjectId id, const Vec3d& size) {
    const MeshArrays arrays = makeBox(size).toArrays();
    list.create(id, typeOf<Geometry>());
    setField<&Geometry::positions>(list, id, arrays.positions);
    setField<&Geometry::indices>(list, id, arrays.indices);
    return id;
}

}  // namespace

Bin::Bin(std::uint64_t seed, BinOptions options)
    : random_(seed), options_(options), simulation_({.threads = options.threads, .collision = limits()}) {
    build();
    (void)simulation_.step(true, {});
    quiet_ = oneIn(random_, 4) ? 0 : kSettling;
}

double Bin::number(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1p-53);
}
Vec3d Bin::vector(double most) {
    const double x = number(-most, most), y = number(-most, most), z = number(-most, most);
    return {x, y, z};
}
Quatd Bin::turn() {
    const Vec3d axis = vector(1);
    const double w = number(-1, 1);
    return {w + 1e-3, axis.x(), axis.y(), axis.z()};
}
/// Numbers from the edges of what a field may hold, and beyond.
double Bin::extreme() {
    constexpr double kValues[] = {0, 1, -1, 1e-300, 1e-30, 1e-12, 1e-6, 1e6, 1e9, 1e12, 1e30, -1e12};
    return kValues[below(random_, std::size(kValues))];
}

ObjectId Bin::addNode(ChangeListBuilder& list, ObjectId parent, ObjectId core) {
    const ObjectId id{kFirstPlaceholder + placeholder_++};
    list.create(id, typeOf<Node>());
    if (core) setField<&Node::core>(list, id, core);
    list.place(id, parent);
    return id;
}

void Bin::addBody(ChangeListBuilder& list, ObjectId parent, const Vec3d& at) {
    const ObjectId transform{kFirstPlaceholder + placeholder_++};
    list.create(transform, typeOf<Transform>());
    setField<&Transform::translation>(list, transform, at);
    setField<&Transform::rotation>(list, transform, turn().normalized());
    const ObjectId node = addNode(list, parent, transform);
    const ObjectId shape = some(typeOf<Geometry>());
    (void)addNode(list, node, shape);
    if (oneIn(random_, 6)) (void)addNode(list, node, some(typeOf<Geometry>()));
    const ObjectId object{kFirstPlaceholder + placeholder_++};
    list.create(object, typeOf<CollisionObject>());
    setField<&CollisionObject::node>(list, object, node);
    setField<&CollisionObject::shape>(
        list, object,
        oneIn(random_, 5) ? std::int64_t{CollisionObject::kTriangles} : std::int64_t{CollisionObject::kHull});
    setField<&CollisionObject::mass>(list, object, number(0.3, 3));
    setField<&CollisionObject::restitution>(list, object, oneIn(random_, 2) ? 0.0 : 0.3);
    (void)addNode(list, kRootNode, object);
}

void Bin::build() {
    ChangeListBuilder shapes;
    for (const Vec3d& size : {Vec3d(0.3, 0.2, 0.25), Vec3d(0.2, 0.2, 0.2), Vec3d(0.6, 0.05, 0.1), Vec3d(0.3, 0.3, 0)})
        (void)addGeometry(shapes, ObjectId{kFirstPlaceholder + placeholder_++}, size);
    const ObjectId environment{kFirstPlaceholder + placeholder_++};
    shapes.create(environment, typeOf<Environment>());
    setField<&Environment::gravity>(shapes, environment, Vec3d(0, -9.81, 0));
    (void)addNode(shapes, kRootNode, environment);
    ASSERT_TRUE(simulation_.load({shapes.take()}));

    placeholder_ = 0;
    ChangeListBuilder list;
    const auto plate = [&](const Vec3d& size, const Vec3d& at) {
        const ObjectId transform{kFirstPlaceholder + placeholder_++};
        list.create(transform, typeOf<Transform>());
        setField<&Transform::translation>(list, transform, at);
        const ObjectId node = addNode(list, kRootNode, transform);
        (void)addNode(list, node, addGeometry(list, ObjectId{kFirstPlaceholder + placeholder_++}, size));
    };
    plate(Vec3d(3, 0.5, 3), Vec3d(0, -0.25, 0));
    for (const double side : {-1.0, 1.0}) {
        plate(Vec3d(0.2, 2, 3), Vec3d(1.5 * side, 1, 0));
        plate(Vec3d(3, 2, 0.2), Vec3d(0, 1, 1.5 * side));
    }
    const ObjectId cart{kFirstPlaceholder + placeholder_++}, choice{kFirstPlaceholder + placeholder_++};
    list.create(cart, typeOf<Transform>());
    list.create(choice, typeOf<Switch>());
    const ObjectId parents[] = {kRootNode, kRootNode, addNode(list, kRootNode, cart), addNode(list, kRootNode, choice)};
    for (int i = 0; i < kBodies; ++i)
        addBody(list, parents[below(random_, 4)],
                Vec3d(0.5 * (i % 5) - 1, 0.3 + 0.35 * (i / 20), 0.5 * (i / 5 % 4) - 0.75));
    const ObjectId interest{kFirstPlaceholder + placeholder_++};
    list.create(interest, typeOf<Interest>());
    setField<&Interest::object>(list, interest, kRootNode);
    setField<&Interest::response>(list, interest, std::int64_t{Interest::kBounce});
    (void)addNode(list, kRootNode, interest);
    ASSERT_TRUE(simulation_.load({list.take()}));
}

std::vector<ObjectId> Bin::all(ObjectType type) const {
    std::vector<ObjectId> out;
    for (const ObjectId id : scene().ids())
        if (typeOf(scene().find(id)) == type) out.push_back(id);
    return out;
}
ObjectId Bin::some(ObjectType type) {
    const std::vector<ObjectId> found = all(type);
    return found.empty() ? ObjectId() : found[below(random_, found.size())];
}

/// The bodies that there are.
void Bin::look() {
    things_.clear();
    for (const ObjectId id : all(typeOf<CollisionObject>())) {
        const ObjectId node = scene().get<CollisionObject>(id)->node;
        const Node* bearer = node ? scene().get<Node>(node) : nullptr;
        if (bearer != nullptr && scene().get<Transform>(bearer->core) != nullptr)
            things_.push_back({id, node, bearer->core});
    }
}
Bin::Thing Bin::anyThing() {
    return things_.empty() ? Thing() : things_[below(random_, things_.size())];
}
bool Bin::asleep(const Thing& thing) const {
    const CollisionObject& object = *scene().get<CollisionObject>(thing.object);
    return object.mass > 0 && object.velocity.isZero(0) && object.spin.isZero(0) &&
           scene().get<Node>(thing.node)->parent;
}
Vec3d Bin::seenFrom(const Thing& one, const Thing& other) const {
    const ObjectId above = scene().get<Node>(other.node)->parent;
    const Affine3d world = above ? worldTransform(scene(), above) : Affine3d(Affine3d::Identity());
    const Vec3d at = world.inverse() * worldTransform(scene(), one.node).translation();
    return at.allFinite() ? at : Vec3d(Vec3d::Zero());
}

void Bin::submit(Edit edit) {
    edit.ticket = ++edits_;
    frame_.push_back(std::move(edit));
}
void Bin::move(ObjectId node, const NodeMove& by) {
    submit(Edit{.move = by, .node = node});
}
void Bin::drag(const Thing& thing, const NodeMove& by, int frames) {
    drags_.push_back({thing.node, by, frames, ++gesture_});
}

FrameResult Bin::next() {
    frame_.clear();
    placeholder_ = 0;
    if (quiet_ > 0) {
        --quiet_;
    } else {
        if (busy_ == 0) busy_ = 2 + static_cast<int>(below(random_, 8));
        look();
        busyFrame();
        if (--busy_ == 0 && oneIn(random_, 3)) {
            placeholder_ = 0;
            tidyUp();
            quiet_ = kSettling;
        }
    }
    for (Drag& drag : drags_) {
        --drag.frames;
        if (scene().get<Node>(drag.node) != nullptr)
            submit(Edit{.gesture = {.id = drag.gesture}, .move = drag.by, .node = drag.node});
    }
    std::erase_if(drags_, [](const Drag& drag) { return drag.frames <= 0; });
    if (options_.lookAtAll) {
        ChangeListBuilder list;
        for (const ObjectId id : all(typeOf<CollisionObject>()))
            setField<&CollisionObject::friction>(list, id, scene().get<CollisionObject>(id)->friction);
        frame_.insert(frame_.begin(), Edit{.list = list.take(), .undoable = false});
    }
    FrameResult result = simulation_.step(false, std::move(frame_));
    frame_.clear();
    for (const EditOutcome& outcome : result.outcomes) refused_ += !outcome.result;
    return result;
}

void Bin::busyFrame() {
    for (std::size_t edits = 1 + below(random_, 40); edits > 0; --edits) {
        // Placeholders are those of one list.
        placeholder_ = 0;
        if (oneIn(random_, 3))
            meet();
        else
            editAny();
    }
}

void Bin::expectSound() const {
    const auto finite = [](const auto& numbers) { return numbers.allFinite(); };
    for (const ObjectId id : scene().ids()) {
        if (const auto* transform = scene().get<Transform>(id)) {
            ASSERT_TRUE(finite(transform->translation) && finite(transform->rotation.coeffs()) &&
                        finite(transform->scale))
                << '#' << id.value;
            ASSERT_GT(transform->rotation.norm(), 0) << '#' << id.value;
        }
        if (const auto* object = scene().get<CollisionObject>(id)) {
            ASSERT_TRUE(finite(object->velocity) && finite(object->spin)) << '#' << id.value;
            ASSERT_LE(object->velocity.cwiseAbs().maxCoeff(), CollisionObject::kFastest) << '#' << id.value;
            ASSERT_LE(object->spin.cwiseAbs().maxCoeff(), CollisionObject::kFastest) << '#' << id.value;
        }
    }
}

}  // namespace tessera::test
