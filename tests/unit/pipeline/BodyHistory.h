/// Random histories of free bodies: they come, go, fall asleep, are woken, held, carried and edited.
#pragma once

#include <random>
#include <vector>

#include "common/cores/CollisionObject.h"
#include "common/cores/Interest.h"
#include "common/cores/Switch.h"
#include "common/cores/Transform.h"
#include "tests/unit/pipeline/SceneMaker.h"

namespace tessera {

/// The same seed gives the same edits and wishes for the same results.
struct BodyHistory : SceneMaker {
    explicit BodyHistory(std::uint64_t seed, CollisionLimits limits = {}, Workers* workers = nullptr)
        : SceneMaker(limits, workers), random(seed) {
        gravity(Vec3d(0, -9.81, 0));
        floor = body(kRootNode, shapes::box(Vec3d(14, 1, 14)), Vec3d(0, -0.5, 0));
        ledge = body(kRootNode, shapes::box(Vec3d(2, 0.5, 2)), Vec3d(-4, 0.25, -4));
        cart = transform(Vec3d(0, 0, 0));
        cartNode = node(kRootNode, cart);
        pusher = body(kRootNode, shapes::box(Vec3d(1, 1, 1)), Vec3d(6, 0.6, 6));
        hidden = switchCore(Switch::kAll);
        hideable = node(kRootNode, hidden);
        geometries = {geometry(shapes::box(Vec3d(0.8, 0.5, 0.6))), geometry(shapes::box(Vec3d(0.5, 0.5, 0.5))),
                      geometry(shapes::sphere(0.3, 5, 7))};
        for (int i = 0; i < 16; ++i) create();
        Interest fields;
        fields.object = kRootNode;
        fields.response = Interest::kBounce;
        fields.mode = seed % 2 == 0 ? Interest::kPseudoDynamic : Interest::kStatic;
        law = interest(fields);
        fields.mode = Interest::kDistance;
        fields.object = floor.node;
        fields.threshold = 0.1;
        fields.response = Interest::kReport;
        watch = interest(fields);
    }

    struct Thing {
        ObjectId transform, node, shape, core;
    };
    double number(double low, double high) {
        return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
    }
    std::size_t below(std::size_t n) { return static_cast<std::size_t>(random() % n); }

    void create() {
        Thing thing;
        // Some on top of each other, so that groups of sleepers have several bodies.
        const double x = std::floor(number(-4, 4)) * 1.1, z = std::floor(number(-4, 4)) * 1.1;
        thing.transform = transform(Vec3d(x, number(0.4, 2.5), z));
        const ObjectId parents[] = {kRootNode, kRootNode, cartNode, hideable};
        thing.node = node(parents[below(4)], thing.transform);
        thing.shape = node(thing.node, geometries[below(geometries.size())]);
        if (below(5) == 0) (void)node(node(thing.node, transform(Vec3d(0, 0.4, 0))), geometries[1]);
        CollisionObject fields;
        fields.node = thing.node;
        fields.shape = below(4) == 0 ? CollisionObject::kTriangles : CollisionObject::kHull;
        fields.mass = number(0.5, 3);
        fields.restitution = below(2) == 0 ? 0 : 0.3;
        thing.core = object(fields);
        things.push_back(thing);
    }

    /// One edit of the scene, of whatever kind.
    void edit() {
        const std::size_t which = below(things.size());
        Thing thing = things[which];
        const bool stands =
            aspect.get<Transform>(thing.transform) != nullptr && aspect.get<Node>(thing.node) != nullptr;
        const std::size_t kind = below(22);
        ChangeListBuilder b;
        if (kind < 3) {
            create();
        } else if (kind < 5) {
            b.detach(thing.node);
            apply(b);
            if (below(2) == 0) things.erase(things.begin() + static_cast<std::ptrdiff_t>(which));
            if (things.size() < 4) create();
        } else if (kind == 5) {
            b.place(thing.node, below(2) == 0 ? kRootNode : cartNode);
            apply(b);
        } else if (kind < 9 && stands) {
            TentativeTransform t;
            t.transform = thing.transform;
            t.translation = at(thing.transform).translation + Vec3d(number(-1, 1), number(0, 1), number(-1, 1));
            t.rotation = at(thing.transform).rotation;
            commit(t);
        } else if (kind == 9) {
            set<CollisionObject>(thing.core, fieldId<&CollisionObject::velocity>,
                                 Vec3d(number(-1, 1), number(0, 4), 0));
        } else if (kind == 10) {
            set<CollisionObject>(thing.core, fieldId<&CollisionObject::mass>, below(2) == 0 ? 0.0 : number(0.5, 3));
        } else if (kind == 11) {
            set<CollisionObject>(thing.core, fieldId<&CollisionObject::friction>, number(0, 1));
        } else if (kind == 12) {
            setChoice(hidden, below(2) == 0 ? Switch::kNone : Switch::kAll);
        } else if (kind == 13) {
            TentativeTransform t;
            t.transform = below(2) == 0 ? ledge.transform : cart;
            t.translation = at(t.transform).translation + Vec3d(number(-0.5, 0.5), 0, number(-0.5, 0.5));
            commit(t);
        } else if (kind == 14) {
            b.place(ledge.node, aspect.get<Node>(ledge.node)->parent ? ObjectId{} : kRootNode);
            apply(b);
        } else if (kind == 15) {
            set<CollisionObject>(thing.core, fieldId<&CollisionObject::shape>,
                                 below(2) == 0 ? CollisionObject::kHull : CollisionObject::kTriangles);
        } else if (kind == 16) {
            b.set(thing.shape, typeOf<Node>(), fieldId<&Node::core>, toValue(geometries[below(geometries.size())]));
            apply(b);
        } else if (kind == 17 && below(4) == 0) {
            set<Interest>(law, fieldId<&Interest::response>, below(2) == 0 ? Interest::kSlide : Interest::kBounce);
        } else if (kind == 18 && below(3) == 0) {
            set<Interest>(watch, fieldId<&Interest::threshold>, number(0.05, 0.3));
        } else if (kind == 19 && below(4) == 0) {
            pipeline.sceneChanged(aspect, nullptr);
        } else if (kind == 20) {  // two edits before one step: it may have gone and come
            b.detach(thing.node);
            apply(b);
            b.place(thing.node, kRootNode);
            apply(b);
        } else if (kind == 21) {
            set<CollisionObject>(thing.core, fieldId<&CollisionObject::layers>, std::int64_t{below(2) == 0 ? 0 : 1});
        }
    }

    StepResult next() {
        ++frames;
        // Long enough apart that most fall asleep between edits.
        if (frames > 60 && below(25) == 0)
            for (std::size_t edits = 1 + below(3); edits > 0; --edits) edit();
        if (frames % 150 == 0) {
            kind_ = below(6);
            carried_ = things[below(things.size())].transform;
        }
        std::vector<TentativeTransform> wishes;
        const std::size_t phase = frames % 150;
        const auto wish = [&](ObjectId id, const Vec3d& by) {
            if (aspect.get<Transform>(id) == nullptr) return;
            wishes.push_back({.transform = id,
                              .translation = at(id).translation + by,
                              .rotation = at(id).rotation,
                              .source = below(2) == 0});
        };
        if (phase < 25 && frames > 150) {
            if (kind_ == 0) wish(cart, Vec3d(0.02, 0, 0.01));
            if (kind_ == 1) wish(floor.transform, Vec3d(0, phase < 12 ? -0.02 : 0.02, 0));
            if (kind_ == 2) wish(pusher.transform, Vec3d(-0.2, 0, -0.2));
            if (kind_ == 3) wish(carried_, Vec3d(0, 0.05, 0));
            if (kind_ == 4) wish(pusher.transform, Vec3d(0.2, 0, 0.2));
            if (kind_ == 5) wish(ledge.transform, Vec3d(0, 0, 0));
        }
        return frame(wishes);
    }

    std::mt19937_64 random;
    Body floor, ledge, pusher;
    ObjectId cart, cartNode, hidden, hideable, law, watch, carried_;
    std::vector<ObjectId> geometries;
    std::vector<Thing> things;
    std::size_t frames = 0, kind_ = 0;
};

}  // namespace tessera
