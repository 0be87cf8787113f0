/// Scenes for measuring what one changed object costs the server's collisions: sceneChanged + step + pickNode, in µs.
#pragma once

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/cores/CollisionObject.h"
#include "common/cores/Environment.h"
#include "common/cores/Geometry.h"
#include "common/cores/Interest.h"
#include "common/cores/Switch.h"
#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"
#include "server/collision/pipeline/CollisionPipeline.h"

namespace tessera::edits {

/// What both scenes are made with.
class EditMaker {
protected:
    ObjectId create(ChangeListBuilder& b, ObjectType type) {
        const ObjectId id{next_++};
        b.create(id, type);
        return id;
    }
    ObjectId place(ChangeListBuilder& b, ObjectId parent, ObjectId core) {
        const ObjectId id = create(b, typeOf<Node>());
        if (core) b.set(id, typeOf<Node>(), fieldId<&Node::core>, toValue(core));
        b.place(id, parent);
        return id;
    }
    ObjectId box(ChangeListBuilder& b, const Vec3d& size) {
        std::vector<float> positions;
        for (int i = 0; i < 8; ++i)
            for (int a = 0; a < 3; ++a)
                positions.push_back(static_cast<float>((i >> a & 1) != 0 ? 0.5 * size[a] : -0.5 * size[a]));
        const std::vector<std::uint32_t> indices{0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                                 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
        const ObjectId id = create(b, typeOf<Geometry>());
        b.set(id, typeOf<Geometry>(), fieldId<&Geometry::positions>, Blob::of(std::span<const float>(positions)));
        b.set(id, typeOf<Geometry>(), fieldId<&Geometry::indices>, Blob::of(std::span<const std::uint32_t>(indices)));
        return id;
    }

    Aspect aspect_;

private:
    std::uint64_t next_ = kRootNode.value + 1;
};

/// Boxes a little apart from each other, a tenth of which overlap a neighbour; 100 objects, an interest in each. Few
/// touch: what a step tells costs what it tells, in a scene of any size.
class Things : EditMaker {
public:
    explicit Things(std::size_t count, std::size_t objects = 100, bool moving = false) {
        ChangeListBuilder b;
        box_ = box(b, Vec3d::Ones());
        hall_ = place(b, kRootNode, {});
        ObjectId group;
        std::size_t side = 1;
        while (side * side * side < count) ++side;
        for (std::size_t i = 0; i < count; ++i) {
            if (i % 100 == 0) group = place(b, hall_, {});
            const double shift = i % 10 == 5 ? 0.4 : 0;
            const Vec3d where(1.3 * static_cast<double>(i % side) + shift, 1.3 * static_cast<double>(i / side % side),
                              1.3 * static_cast<double>(i / side / side));
            nodes_.push_back(thing(b, group, where, transforms_));
        }
        for (std::size_t i = 0; i < objects; ++i) {
            (void)object(b, nodes_[i * count / objects]);
            if (moving) movers_.push_back(transforms_[i * count / objects]);
        }
        choice_ = create(b, typeOf<Switch>());
        switched_ = place(b, hall_, choice_);
        (void)thing(b, switched_, Vec3d(-3, 0, 0), transforms_);
        extra_ = thing(b, hall_, Vec3d(-6, 0, 0), transforms_);
        object_ = object(b, extra_);
        apply(b, nullptr);
        for (int i = 0; i < 3; ++i) step();
    }

    using Make = std::function<void(ChangeListBuilder&, Things&, int)>;
    /// µs of each of so many edits. What they leave is the same in a scene of any size: what is picked stays.
    std::vector<double> times(const Make& make, int edits) {
        std::vector<double> times;
        for (int i = 0; i < edits; ++i) {
            ChangeListBuilder b;
            make(b, *this, i);
            const ChangeList list = b.take();
            if (!list.empty() && !aspect_.apply(list)) std::exit(2);
            const auto start = std::chrono::steady_clock::now();
            if (!list.empty()) pipeline_.sceneChanged(aspect_, &list);
            step();
            (void)pipeline_.pickNode(aspect_, {Vec3d(-6, 0.1, 9), Vec3d(0, 0, -1)});
            times.push_back(
                std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
        }
        // Many are an edit and its way back, which cost different things.
        for (std::size_t i = 0; i + 1 < times.size(); i += 2) times[i / 2] = (times[i] + times[i + 1]) / 2;
        times.resize(times.size() / 2);
        return times;
    }

    static std::vector<std::pair<std::string, Make>> edits() {
        const ObjectType objects = typeOf<CollisionObject>(), interests = typeOf<Interest>();
        return {
            {"nothing", [](auto&, auto&, int) {}},
            {"an empty node", [](auto& b, auto& s, int) { s.place(b, s.hall_, {}); }},
            {"a geometry more",
             [](auto& b, auto& s, int) { (void)s.thing(b, s.hall_, Vec3d(-20, 2 * s.far_++, 0), s.added_); }},
            {"moved",
             [](auto& b, auto& s, int i) {
                 b.set(s.transforms_[7], typeOf<Transform>(), fieldId<&Transform::translation>,
                       toValue(Vec3d(3 + 0.01 * i, 2, 2)));
             }},
            {"moved far",
             [](auto& b, auto& s, int i) {
                 b.set(s.transforms_[static_cast<std::size_t>(100 + 11 * i % 800) % s.nodes_.size()],
                       typeOf<Transform>(), fieldId<&Transform::translation>,
                       toValue(Vec3d(-40 - 2.0 * i, s.far_++, 0)));
             }},
            {"elsewhere in the tree",
             [](auto& b, auto& s, int i) { b.place(s.nodes_[5], i % 2 == 0 ? s.hall_ : s.switched_); }},
            {"switched",
             [](auto& b, auto& s, int i) {
                 b.set(s.choice_, typeOf<Switch>(), fieldId<&Switch::choice>,
                       toValue(std::int64_t{i % 2 == 0 ? Switch::kNone : Switch::kAll}));
             }},
            {"in other layers",
             [=](auto& b, auto& s, int i) {
                 b.set(s.object_.core, objects, fieldId<&CollisionObject::layers>, toValue(std::int64_t{1 + i % 2}));
             }},
            {"an object and its interest",
             [](auto& b, auto& s, int) {
                 (void)s.object(b, s.thing(b, s.hall_, Vec3d(-30, 2 * s.far_++, 0), s.added_));
             }},
            {"another response",
             [=](auto& b, auto& s, int i) {
                 b.set(s.object_.interest, interests, fieldId<&Interest::response>, toValue(std::int64_t{i % 2}));
             }},
            {"an interest off and on",
             [=](auto& b, auto& s, int i) {
                 b.set(s.object_.interest, interests, fieldId<&Interest::enabled>, toValue(i % 2 == 0));
             }},
            {"deformed",
             [](auto& b, auto& s, int i) {
                 std::vector<float> positions;
                 for (int k = 0; k < 8; ++k)
                     for (int a = 0; a < 3; ++a)
                         positions.push_back(((k >> a & 1) != 0 ? 0.5f : -0.5f) + 0.001f * static_cast<float>(i));
                 b.set(s.own_, typeOf<Geometry>(), fieldId<&Geometry::positions>,
                       Blob::of(std::span<const float>(positions)));
             }},
            {"out of the tree and back",
             [](auto& b, auto& s, int i) { b.place(s.nodes_[9], i % 2 == 0 ? ObjectId{} : s.hall_); }},
        };
    }

private:
    struct Made {
        ObjectId core, interest;
    };
    /// What moves is swung by a little, and nothing of it is committed.
    void step() {
        std::vector<TentativeTransform> wishes;
        for (const ObjectId id : movers_) {
            const Transform& now = *aspect_.get<Transform>(id);
            wishes.push_back({.transform = id,
                              .translation = now.translation + Vec3d::Constant(1e-3),
                              .rotation = now.rotation,
                              .scale = now.scale});
        }
        (void)pipeline_.step(aspect_, wishes);
    }
    void apply(ChangeListBuilder& b, const ChangeList*) {
        own_ = create(b, typeOf<Geometry>());
        const ObjectId kept = own_;
        place(b, extra_, kept);
        if (const auto applied = aspect_.apply(b.take()); !applied) {
            std::fprintf(stderr, "%s\n", applied.error().message.c_str());
            std::exit(2);
        }
        pipeline_.sceneChanged(aspect_, nullptr);
        ChangeListBuilder arrays;
        const Geometry& box = *aspect_.get<Geometry>(box_);
        arrays.set(own_, typeOf<Geometry>(), fieldId<&Geometry::positions>, box.positions);
        arrays.set(own_, typeOf<Geometry>(), fieldId<&Geometry::indices>, box.indices);
        arrays.set(object_.core, typeOf<CollisionObject>(), fieldId<&CollisionObject::kind>,
                   toValue(std::int64_t{CollisionObject::kDeforming}));
        const ChangeList list = arrays.take();
        if (!aspect_.apply(list)) std::exit(2);
        pipeline_.sceneChanged(aspect_, &list);
    }
    ObjectId thing(ChangeListBuilder& b, ObjectId parent, const Vec3d& where, std::vector<ObjectId>& transforms) {
        transforms.push_back(create(b, typeOf<Transform>()));
        b.set(transforms.back(), typeOf<Transform>(), fieldId<&Transform::translation>, toValue(where));
        const ObjectId node = place(b, parent, transforms.back());
        place(b, node, box_);
        return node;
    }
    Made object(ChangeListBuilder& b, ObjectId node) {
        const Made made{create(b, typeOf<CollisionObject>()), create(b, typeOf<Interest>())};
        b.set(made.core, typeOf<CollisionObject>(), fieldId<&CollisionObject::node>, toValue(node));
        b.set(made.interest, typeOf<Interest>(), fieldId<&Interest::object>, toValue(node));
        place(b, kRootNode, made.core);
        place(b, kRootNode, made.interest);
        return made;
    }

    CollisionPipeline pipeline_;
    ObjectId box_, own_, hall_, choice_, switched_, extra_;
    Made object_;
    std::vector<ObjectId> nodes_, transforms_, added_, movers_;
    double far_ = 0;
};

/// Each thing an object with an interest of its own in it.
class Objects : public Things {
public:
    explicit Objects(std::size_t count) : Things(count, count) {}
};

/// And all of them are on their way in every frame.
class MovingObjects : public Things {
public:
    explicit MovingObjects(std::size_t count) : Things(count, count, true) {}
};

/// Boxes asleep on plates of a hundred, a little apart from each other; each is a free body. Until one has come to rest
/// again nothing else is measured.
class Bodies : EditMaker {
public:
    explicit Bodies(std::size_t count) {
        ChangeListBuilder b;
        ballast_ = box(b, Vec3d::Ones());
        const ObjectId plate = box(b, Vec3d(15, 1, 15)), down = create(b, typeOf<Environment>());
        b.set(down, typeOf<Environment>(), fieldId<&Environment::gravity>, toValue(Vec3d(0, -9.81, 0)));
        place(b, kRootNode, down);
        thing(b, Vec3d(-200, -0.5, 0), box(b, Vec3d(370, 1, 10)));
        std::size_t side = 1;
        while (100 * side * side < count) ++side;
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t of = i / 100, k = i % 100;
            const Vec3d corner(20.0 * static_cast<double>(of % side), 0, 20.0 * static_cast<double>(of / side));
            if (k == 0) thing(b, corner + Vec3d(6.75, -0.5, 6.75), plate);
            add(b, corner + Vec3d(1.5 * static_cast<double>(k % 10), 0.499, 1.5 * static_cast<double>(k / 10)));
        }
        const ObjectId interest = create(b, typeOf<Interest>());
        b.set(interest, typeOf<Interest>(), fieldId<&Interest::object>, toValue(kRootNode));
        b.set(interest, typeOf<Interest>(), fieldId<&Interest::response>, toValue(Interest::kBounce));
        // Of a pseudo-dynamic one each step tells of all pairs that stay in touch.
        b.set(interest, typeOf<Interest>(), fieldId<&Interest::mode>, toValue(Interest::kStatic));
        place(b, kRootNode, interest);
        if (!aspect_.apply(b.take())) std::exit(2);
        pipeline_.sceneChanged(aspect_, nullptr);
        rest();
    }

    using Make = std::function<void(ChangeListBuilder&, Bodies&, std::size_t)>;
    std::vector<double> times(const Make& make, int edits) {
        std::vector<double> times;
        for (int i = 0; i < edits; ++i) {
            ChangeListBuilder b;
            make(b, *this, static_cast<std::size_t>(37 * i + 11) % (made_.size() - 50));
            const ChangeList list = b.take();
            if (const auto applied = aspect_.apply(list); !applied) {
                std::fprintf(stderr, "%s\n", applied.error().message.c_str());
                std::exit(2);
            }
            const auto start = std::chrono::steady_clock::now();
            pipeline_.sceneChanged(aspect_, &list);
            const StepResult result = pipeline_.step(aspect_, {});
            times.push_back(
                std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
            commit(result);
            rest();
        }
        return times;
    }
    static std::vector<std::pair<std::string, Make>> edits() {
        const ObjectType objects = typeOf<CollisionObject>();
        return {
            {"a sleeper moved",
             [](auto& b, auto& s, std::size_t i) {
                 const Vec3d where = s.aspect_.template get<Transform>(s.made_[i].transform)->translation;
                 b.set(s.made_[i].transform, typeOf<Transform>(), fieldId<&Transform::translation>,
                       toValue(Vec3d(where + Vec3d(0, 0.01, 0))));
             }},
            {"woken",
             [=](auto& b, auto& s, std::size_t i) {
                 b.set(s.made_[i].core, objects, fieldId<&CollisionObject::velocity>, toValue(Vec3d(0, 0.1, 0)));
             }},
            {"a free body more",
             [](auto& b, auto& s, std::size_t) { s.add(b, Vec3d(-20 - 1.5 * s.more_++, 0.499, 0)); }},
            {"one less",
             [](auto& b, auto& s, std::size_t) {
                 b.detach(s.made_.back().node);
                 s.made_.pop_back();
             }},
        };
    }

private:
    struct Made {
        ObjectId transform, node, core;
    };
    Made thing(ChangeListBuilder& b, const Vec3d& where, ObjectId geometry) {
        Made made;
        made.transform = create(b, typeOf<Transform>());
        b.set(made.transform, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(where));
        made.node = place(b, kRootNode, made.transform);
        place(b, made.node, geometry);
        return made;
    }
    void add(ChangeListBuilder& b, const Vec3d& where) {
        Made made = thing(b, where, ballast_);
        made.core = create(b, typeOf<CollisionObject>());
        const ObjectType type = typeOf<CollisionObject>();
        b.set(made.core, type, fieldId<&CollisionObject::node>, toValue(made.node));
        b.set(made.core, type, fieldId<&CollisionObject::mass>, toValue(1.0));
        b.set(made.core, type, fieldId<&CollisionObject::restitution>, toValue(0.0));
        b.set(made.core, type, fieldId<&CollisionObject::shape>, toValue(CollisionObject::kHull));
        place(b, kRootNode, made.core);
        made_.push_back(made);
    }
    void commit(const StepResult& result) {
        ChangeListBuilder b;
        for (const TentativeTransform& t : result.accepted) {
            b.set(t.transform, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(t.translation));
            b.set(t.transform, typeOf<Transform>(), fieldId<&Transform::rotation>, toValue(t.rotation));
        }
        for (const BodyVelocity& v : result.velocities) {
            b.set(v.core, typeOf<CollisionObject>(), fieldId<&CollisionObject::velocity>, toValue(v.velocity));
            b.set(v.core, typeOf<CollisionObject>(), fieldId<&CollisionObject::spin>, toValue(v.spin));
        }
        const ChangeList list = b.take();
        if (list.empty()) return;
        if (!aspect_.apply(list)) std::exit(2);
        pipeline_.sceneChanged(aspect_, &list);
    }
    void rest() {
        for (int frames = 0; frames < 400; ++frames) {
            const StepResult result = pipeline_.step(aspect_, {});
            commit(result);
            if (result.counters.asleep == result.counters.freeBodies && result.counters.handedOver == 0) return;
        }
        const StepResult last = pipeline_.step(aspect_, {});
        std::fprintf(stderr, "bench_edits: of %zu bodies %zu sleep\n", last.counters.freeBodies, last.counters.asleep);
        std::exit(2);
    }

    CollisionPipeline pipeline_{
        {.maxContacts = 10}};  // listing them costs the same in any scene, and more than the rest
    ObjectId ballast_;
    std::vector<Made> made_;
    int more_ = 0;
};

}  // namespace tessera::edits
