/// The random edits.
#include <algorithm>
#include <limits>

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
#include "tests/unit/bodies/Bin.h"

namespace tessera::test {

/// A body that is, or from this frame on is to be, in a state; none where there is none.
Bin::Thing Bin::inState(BodyState state) {
    if (state != BodyState::kAsleep) return anyThing();
    std::vector<Thing> sleepers;
    for (const Thing& thing : things_)
        if (asleep(thing)) sleepers.push_back(thing);
    return sleepers.empty() ? Thing() : sleepers[below(random_, sleepers.size())];
}

/// Two bodies come together, each as what is drawn for it. Where neither moves by itself a third one runs into both.
void Bin::meet() {
    BodyState a = static_cast<BodyState>(below(random_, kBodyStates)),
              b = static_cast<BodyState>(below(random_, kBodyStates));
    if (b < a) std::swap(a, b);
    const Thing one = inState(a);
    if (!one.node) return editAny();
    const auto moves = [](BodyState s) {
        return s == BodyState::kHeld || s == BodyState::kMoved || s == BodyState::kAnimated;
    };
    Thing other = inState(b);
    if (!moves(a) && !moves(b)) {
        // The nearest one in the second state.
        double least = std::numeric_limits<double>::infinity();
        for (const Thing& thing : things_) {
            if (thing.node == one.node || (b == BodyState::kAsleep && !asleep(thing))) continue;
            const double apart =
                (worldTransform(scene(), thing.node).translation() - worldTransform(scene(), one.node).translation())
                    .norm();
            if (!(apart < least)) continue;
            least = apart;
            other = thing;
        }
    }
    if (!other.node || other.node == one.node) return editAny();
    lead(one, a, other);
    lead(other, b, one);
    if (!moves(a) && !moves(b)) lead(anyThing(), oneIn(random_, 2) ? BodyState::kMoved : BodyState::kHeld, one);
    ++meetings_[{a, b}];
}

/// Makes the body be in the state, and, where bodies move in it, come to the other one, or through it.
void Bin::lead(const Thing& thing, BodyState as, const Thing& to) {
    const Vec3d from = scene().get<Transform>(thing.transform)->translation, at = seenFrom(to, thing);
    const Vec3d goal = oneIn(random_, 2) ? at : Vec3d(from + number(1, 3) * (at - from));
    switch (as) {
        case BodyState::kAsleep:
            return;
        case BodyState::kHeld: {
            const int frames = 1 + static_cast<int>(below(random_, 12));
            NodeMove by{.translation = Vec3d((goal - from) / frames), .relative = true};
            if (oneIn(random_, 2)) by.rotation = turn();
            return drag(thing, by, frames + static_cast<int>(below(random_, 4)));
        }
        case BodyState::kMoved: {
            NodeMove by{.translation = goal};
            if (oneIn(random_, 3)) by.rotation = turn();
            return move(thing.node, by);
        }
        case BodyState::kAnimated:
            return animate(thing, goal);
        case BodyState::kStatic: {
            ChangeListBuilder list;
            if (oneIn(random_, 3))
                setField<&CollisionObject::kind>(list, thing.object, std::int64_t{CollisionObject::kStatic});
            else
                setField<&CollisionObject::mass>(list, thing.object, 0.0);
            return submit(list);
        }
        case BodyState::kRemoved:
            return remove(thing);
        case BodyState::kChanged:
            return change(thing);
    }
}

void Bin::remove(const Thing& thing) {
    ChangeListBuilder list;
    switch (below(random_, 5)) {
        case 0:
            setField<&CollisionObject::layers>(list, thing.object, std::int64_t{0});
            break;
        case 1:
            setField<&CollisionObject::node>(list, thing.object, ObjectId());
            break;
        case 2:  // for good, with all that it bears
            for (const ObjectId child : scene().get<Node>(thing.node)->children) {
                list.detach(child);
                if (scene().get<Node>(child)->children.empty()) list.destroy(child);
            }
            setField<&CollisionObject::node>(list, thing.object, ObjectId());
            list.detach(thing.node);
            list.destroy(thing.node);
            break;
        default:
            list.detach(thing.node);
    }
    submit(list);
}

void Bin::animate(const Thing& thing, const Vec3d& to) {
    const Transform& now = *scene().get<Transform>(thing.transform);
    const double seconds = oneIn(random_, 2) ? number(0.02, 0.1) : number(0.1, 1);
    std::vector<double> keys;
    const auto key = [&](double time, const Vec3d& place, const Quatd& turned) {
        for (const double v : {time, place.x(), place.y(), place.z(), turned.w(), turned.x(), turned.y(), turned.z(),
                               now.scale.x(), now.scale.y(), now.scale.z()})
            keys.push_back(v);
    };
    key(0, now.translation, now.rotation);
    key(seconds, to, oneIn(random_, 2) ? turn() : now.rotation);
    ChangeListBuilder list;
    ObjectId motion = some(typeOf<Motion>());
    if (!motion || all(typeOf<Motion>()).size() < 6) {
        motion = ObjectId{kFirstPlaceholder + placeholder_++};
        list.create(motion, typeOf<Motion>());
        (void)addNode(list, kRootNode, motion);
    }
    setField<&Motion::target>(list, motion, thing.transform);
    setField<&Motion::keys>(list, motion, Blob::of(std::span<const double>(keys)));
    setField<&Motion::mode>(list, motion, static_cast<std::int64_t>(below(random_, 3)));
    setField<&Motion::time>(list, motion, 0.0);
    setField<&Motion::playing>(list, motion, true);
    submit(list);
}

void Bin::change(const Thing& thing) {
    ChangeListBuilder list;
    const ObjectId id = thing.object;
    switch (below(random_, 10)) {
        case 0:
        case 1:
            setField<&CollisionObject::mass>(list, id, number(0.1, 5));
            break;
        case 2:
            setField<&CollisionObject::mass>(list, id, oneIn(random_, 5) ? extreme() : 0.0);
            break;
        case 3:
            setField<&CollisionObject::kind>(list, id, static_cast<std::int64_t>(below(random_, 3)));
            break;
        case 4:
            setField<&CollisionObject::kind>(list, id, std::int64_t{CollisionObject::kRigid});
            setField<&CollisionObject::mass>(list, id, number(0.1, 5));
            setField<&CollisionObject::layers>(list, id, std::int64_t{1});
            break;
        case 5:
            setField<&CollisionObject::shape>(list, id, static_cast<std::int64_t>(below(random_, 9)));
            break;
        case 6:
            setField<&CollisionObject::shape>(list, id, std::int64_t{CollisionObject::kHull});
            break;
        case 7:
            setField<&CollisionObject::division>(list, id, static_cast<std::int64_t>(below(random_, 3)));
            break;
        case 8:
            setField<&CollisionObject::friction>(list, id, oneIn(random_, 3) ? extreme() : number(0, 2));
            setField<&CollisionObject::restitution>(list, id, oneIn(random_, 3) ? extreme() : number(0, 1));
            break;
        default:
            for (const ObjectId child : scene().get<Node>(thing.node)->children)
                if (scene().get<Geometry>(scene().get<Node>(child)->core) != nullptr)
                    setField<&Node::core>(list, child, some(typeOf<Geometry>()));
    }
    submit(list);
}

void Bin::editAny() {
    const Thing thing = anyThing();
    if (!thing.node || oneIn(random_, 8)) return editSurroundings();
    if (oneIn(random_, 3)) return editTree(thing);
    if (oneIn(random_, 4)) return change(thing);
    editPlace(thing);
}

void Bin::editPlace(const Thing& thing) {
    ChangeListBuilder list;
    switch (below(random_, 9)) {
        case 0:  // exactly where another one is
            return move(thing.node, {.translation = seenFrom(anyThing(), thing)});
        case 1: {
            const Thing other = anyThing();
            return move(thing.node, {.translation = seenFrom(other, thing),
                                     .rotation = scene().get<Transform>(other.transform)->rotation});
        }
        case 2:
            return move(thing.node, {.translation = vector(1), .relative = true});
        case 3:
            return move(thing.node, {.translation = vector(oneIn(random_, 5) ? extreme() : 2)});
        case 4:
            return move(thing.node, {.rotation = turn(), .relative = oneIn(random_, 2)});
        case 5:
            return move(thing.node, {.scale = Vec3d(Vec3d::Constant(number(0.5, 2)))});
        case 6: {
            Vec3d scale = Vec3d::Ones();
            scale[static_cast<int>(below(random_, 3))] = oneIn(random_, 4) ? extreme() : number(0.5, 2);
            return move(
                thing.node,
                {.scale = oneIn(random_, 2) ? scale : Vec3d(Vec3d::Constant(oneIn(random_, 4) ? extreme() : 1))});
        }
        case 7:
            setField<&CollisionObject::velocity>(list, thing.object, vector(oneIn(random_, 8) ? 1e6 : 5));
            setField<&CollisionObject::spin>(list, thing.object, vector(oneIn(random_, 8) ? 1e6 : 20));
            return submit(list);
        default:  // back into the bin
            return move(thing.node, {.translation = Vec3d(number(-1, 1), number(0.2, 2), number(-1, 1)),
                                     .scale = Vec3d(Vec3d::Ones())});
    }
}

void Bin::editTree(const Thing& thing) {
    ChangeListBuilder list;
    const std::vector<ObjectId> nodes = all(typeOf<Node>());
    switch (below(random_, 8)) {
        case 0:  // in or on another one: it is carried
            list.place(thing.node, anyThing().node);
            break;
        case 1:
            list.place(thing.node, nodes[below(random_, nodes.size())]);
            break;
        case 2:
            list.place(thing.node, kRootNode);
            break;
        case 3:
            return remove(thing);
        case 4: {  // a copy, of the same place or of the very same Transform
            const ObjectId node =
                addNode(list, scene().get<Node>(thing.node)->parent ? scene().get<Node>(thing.node)->parent : kRootNode,
                        thing.transform);
            (void)addNode(list, node, some(typeOf<Geometry>()));
            const ObjectId object{kFirstPlaceholder + placeholder_++};
            list.create(object, typeOf<CollisionObject>());
            setField<&CollisionObject::node>(list, object, oneIn(random_, 3) ? thing.node : node);
            setField<&CollisionObject::mass>(list, object, number(0.3, 3));
            (void)addNode(list, kRootNode, object);
            break;
        }
        case 5:
            setField<&CollisionObject::node>(list, thing.object, nodes[below(random_, nodes.size())]);
            break;
        case 6: {  // two edits of one frame: gone, and there again
            ChangeListBuilder first;
            first.detach(thing.node);
            submit(first);
            list.place(thing.node, kRootNode);
            break;
        }
        default:
            if (things_.size() < 40)
                addBody(list, kRootNode, Vec3d(number(-1, 1), number(0.2, 2), number(-1, 1)));
            else
                list.place(thing.node, kRootNode);
    }
    submit(list);
}

void Bin::editSurroundings() {
    ChangeListBuilder list;
    switch (below(random_, 12)) {
        case 0:
            setField<&Environment::gravity>(list, some(typeOf<Environment>()),
                                            oneIn(random_, 2) ? Vec3d(0, -9.81, 0) : vector(10));
            break;
        case 1:
            setField<&Environment::gravity>(list, some(typeOf<Environment>()),
                                            oneIn(random_, 8) ? vector(extreme()) : Vec3d(0, -9.81, 0));
            break;
        case 2:
            setField<&Switch::choice>(list, some(typeOf<Switch>()),
                                      oneIn(random_, 2) ? std::int64_t{Switch::kNone} : std::int64_t{Switch::kAll});
            break;
        case 3:
            setField<&Interest::response>(list, some(typeOf<Interest>()), static_cast<std::int64_t>(below(random_, 6)));
            break;
        case 4:
            setField<&Interest::response>(list, some(typeOf<Interest>()), std::int64_t{Interest::kBounce});
            setField<&Interest::enabled>(list, some(typeOf<Interest>()), !oneIn(random_, 5));
            break;
        case 5:
            setField<&Interest::mode>(list, some(typeOf<Interest>()), static_cast<std::int64_t>(below(random_, 6)));
            break;
        case 6: {
            const ObjectId motion = some(typeOf<Motion>());
            if (!motion) return;
            setField<&Motion::playing>(list, motion, oneIn(random_, 2));
            setField<&Motion::time>(list, motion, number(0, 1));
            break;
        }
        case 7: {  // the plates too, and carts: whatever stands on them is carried
            const ObjectId node = some(typeOf<Node>());
            drags_.push_back({node, {.translation = vector(0.05), .relative = true}, 5, ++gesture_});
            return;
        }
        case 8: {  // another shape, of the same corners
            const ObjectId shape = some(typeOf<Geometry>());
            const Vec3d size = oneIn(random_, 5) ? Vec3d(0.2, 0, 0) : Vec3d(vector(0.4).cwiseAbs());
            setField<&Geometry::positions>(list, shape, makeBox(size).toArrays().positions);
            break;
        }
        default: {
            Edit step;
            step.kind = oneIn(random_, 3) ? Edit::Kind::kRedo : Edit::Kind::kUndo;
            return submit(std::move(step));
        }
    }
    submit(list);
}

void Bin::tidyUp() {
    ChangeListBuilder list;
    for (const ObjectId id : all(typeOf<Environment>())) setField<&Environment::gravity>(list, id, Vec3d(0, -9.81, 0));
    for (const ObjectId id : all(typeOf<Motion>())) setField<&Motion::playing>(list, id, false);
    for (const ObjectId id : all(typeOf<Interest>())) {
        setField<&Interest::enabled>(list, id, true);
        setField<&Interest::response>(list, id, std::int64_t{Interest::kBounce});
        setField<&Interest::mode>(list, id, std::int64_t{Interest::kPseudoDynamic});
    }
    const auto common = [](double x) { return x > 0.2 && x < 5; };
    for (const Thing& thing : things_) {
        const CollisionObject& object = *scene().get<CollisionObject>(thing.object);
        if (object.mass > 0 && !common(object.mass)) setField<&CollisionObject::mass>(list, thing.object, 1.0);
        const Transform& at = *scene().get<Transform>(thing.transform);
        if (!common(at.scale.x()) || !common(at.scale.y()) || !common(at.scale.z()))
            setField<&Transform::scale>(list, thing.transform, Vec3d(Vec3d::Ones()));
        if (!(at.translation.norm() < 3))
            setField<&Transform::translation>(list, thing.transform,
                                              Vec3d(number(-1, 1), number(0.2, 2), number(-1, 1)));
    }
    submit(list);
    drags_.clear();
}

}  // namespace tessera::test
