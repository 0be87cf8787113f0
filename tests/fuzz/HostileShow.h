/// A running simulation and edits that nobody means: for fuzzing and for tests from seeds, which only differ in who
/// chooses.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "common/animation/MotionKeys.h"
#include "common/cores/Camera.h"
#include "common/cores/CollisionObject.h"
#include "common/cores/Environment.h"
#include "common/cores/Geometry.h"
#include "common/cores/Motion.h"
#include "common/cores/Transform.h"
#include "server/sim/frame/Simulation.h"
#include "server/sim/view/ViewSource.h"
#include "tests/unit/sim/SceneForTests.h"

namespace tessera::test {

/// 0 … n-1, for n of 1 and more.
using Choose = std::function<std::size_t(std::size_t)>;

/// /body, a box with mass that gravity pulls, driven by the motion whose keys are given, if any; a camera above it.
inline ChangeList bodyScene(const Vec3d& gravity, const Vec3d& velocity,
                            const std::vector<std::array<double, 4>>& keys = {}) {
    ListMaker make;
    const ObjectId place = make.transform(Vec3d::Zero());
    const ObjectId body = make.node("body", kRootNode, place);
    make.node("box", body, make.box(Vec3d::Ones()));
    const ObjectId object = make.create<CollisionObject>();
    setField<&CollisionObject::node>(make.builder, object, body);
    setField<&CollisionObject::mass>(make.builder, object, 1.0);
    setField<&CollisionObject::velocity>(make.builder, object, velocity);
    make.node("object", kRootNode, object);
    const ObjectId interest = make.create<Interest>();
    setField<&Interest::object>(make.builder, interest, body);
    setField<&Interest::response>(make.builder, interest, Interest::kBounce);
    make.node("interest", kRootNode, interest);
    const ObjectId surroundings = make.create<Environment>();
    setField<&Environment::gravity>(make.builder, surroundings, gravity);
    make.node("surroundings", kRootNode, surroundings);
    make.node("eye", make.node("stand", kRootNode, make.transform(Vec3d(0, 1, 5))), make.create<Camera>());
    if (!keys.empty()) {
        const ObjectId motion = make.motion(place, keys);
        setField<&Motion::mode>(make.builder, motion, Motion::kLoop);
        make.node("motion", kRootNode, motion);
    }
    return make.builder.take();
}

/// Up to three changes of what there is, with numbers from harmless to the largest there are.
inline ChangeList hostileEdit(const Aspect& scene, const Choose& choose) {
    constexpr std::array kNumbers = {0.0,
                                     -0.0,
                                     1.0,
                                     -1.0,
                                     0.5,
                                     2.0,
                                     1e-9,
                                     0.1,
                                     -0.3,
                                     3.0,
                                     10.0,
                                     1e-50,
                                     1e-160,
                                     1e-300,
                                     5e-324,
                                     1e3,
                                     1e6,
                                     -1e6,
                                     1e9,
                                     1e15,
                                     1e16,
                                     -1e30,
                                     1e49,
                                     1e60,
                                     1e150,
                                     -1e155,
                                     1e200,
                                     1e300,
                                     -1.7e308,
                                     std::numeric_limits<double>::max(),
                                     -std::numeric_limits<double>::max()};
    const auto number = [&] { return kNumbers[choose(choose(3) == 0 ? kNumbers.size() : 11)]; };
    const auto vector = [&] {
        const double x = number(), y = number();
        return Vec3d(x, y, number());
    };
    std::array<std::vector<ObjectId>, 8> ids;
    for (const ObjectId id : scene.ids()) {
        const Object object = scene.find(id);
        if (object.as<Node>()) ids[0].push_back(id);
        if (object.as<Transform>()) ids[1].push_back(id);
        if (object.as<CollisionObject>()) ids[2].push_back(id);
        if (object.as<Interest>()) ids[3].push_back(id);
        if (object.as<Environment>()) ids[4].push_back(id);
        if (object.as<Motion>()) ids[5].push_back(id);
        if (object.as<Geometry>()) ids[6].push_back(id);
        if (object.as<Camera>()) ids[7].push_back(id);
    }
    const auto any = [&](std::size_t kind) {
        return ids[kind].empty() ? ObjectId{} : ids[kind][choose(ids[kind].size())];
    };
    ListMaker make;
    ChangeListBuilder& list = make.builder;
    for (std::size_t edits = 1 + choose(3); edits > 0; --edits) {
        // One choice a statement: compilers differ in the order in which they work out what a call is given.
        ObjectId it;
        switch (choose(17)) {
            case 0:
                it = any(1);
                setField<&Transform::translation>(list, it, vector());
                break;
            case 1: {
                const double w = number(), x = number(), y = number();
                it = any(1);
                setField<&Transform::rotation>(list, it, Quatd(w, x, y, number()));
                break;
            }
            case 2:
                it = any(1);
                setField<&Transform::scale>(list, it, vector());
                break;
            case 3:
                it = any(2);
                setField<&CollisionObject::velocity>(list, it, vector());
                break;
            case 4:
                it = any(2);
                setField<&CollisionObject::spin>(list, it, vector());
                break;
            case 5:
                it = any(2);
                setField<&CollisionObject::mass>(list, it, number());
                break;
            case 6:
                it = any(3);
                setField<&Interest::response>(list, it, static_cast<std::int64_t>(choose(6)));
                break;
            case 7:
                it = any(3);
                setField<&Interest::mode>(list, it, static_cast<std::int64_t>(choose(4)));
                break;
            case 8:
                it = any(4);
                setField<&Environment::gravity>(list, it, vector());
                break;
            case 9:
                it = any(5);
                setField<&Motion::time>(list, it, number());
                break;
            case 10: {
                std::vector<double> keys;
                for (int key = 0; key < 2; ++key)
                    for (std::size_t k = 0; k < kScalarsPerKey; ++k) keys.push_back(number());
                if (keys[0] > keys[kScalarsPerKey]) std::swap(keys[0], keys[kScalarsPerKey]);
                it = any(5);
                setField<&Motion::keys>(list, it, Blob::of(std::span<const double>(keys)));
                break;
            }
            case 11: {  // another body
                it = any(0);
                const ObjectId body = make.node("", it, make.transform(vector()));
                make.node("", body, any(6));
                const ObjectId object = make.create<CollisionObject>();
                setField<&CollisionObject::node>(list, object, body);
                setField<&CollisionObject::mass>(list, object, std::abs(number()));
                setField<&CollisionObject::shape>(list, object, static_cast<std::int64_t>(choose(2)));
                make.node("", kRootNode, object);
                break;
            }
            case 12:
                it = any(0);
                list.place(it, any(0));
                break;
            case 13:
                list.detach(any(0));
                break;
            case 14: {
                const ObjectId node = any(0);
                list.detach(node);
                list.destroy(node);
                break;
            }
            case 15:
                it = any(7);
                setField<&Camera::worldUnitsPerMetre>(list, it, number());
                break;
            default:
                it = any(5);
                setField<&Motion::playing>(list, it, choose(2) == 0);
        }
    }
    return list.take();
}

struct HostileCounts {
    std::size_t taken = 0, refused = 0, undone = 0;
};

/// So many frames of it. Says what is wrong, or nothing: every list leads a replica along, undo leads back, and there
/// is always a view that can be drawn. That it returns at all is the rest of the promise.
inline std::string hostileShow(const Choose& choose, int frames, HostileCounts& counts,
                               const CollisionLimits& limits = {}) {
    Simulation simulation({.collision = limits});
    if (!simulation.load({bodyScene(Vec3d(0, -10, 0), Vec3d::Zero(), {{0, 0, 0, 0}, {1, 6, 0, 0}})}))
        return "the scene to begin with is refused";
    ViewSource source(wallOfOne(), "");
    source.update(simulation.scene(), nullptr);
    Aspect replica;
    if (!replica.apply(snapshot(simulation.scene()))) return "a snapshot is refused";
    for (int i = 0; i < frames; ++i) {
        std::vector<Edit> edits(1);
        constexpr Edit::Kind kKinds[] = {Edit::Kind::kUndo, Edit::Kind::kRedo, Edit::Kind::kChange, Edit::Kind::kChange,
                                         Edit::Kind::kChange};
        const Edit::Kind kind = edits[0].kind = kKinds[choose(5)];
        if (kind == Edit::Kind::kChange) edits[0].list = hostileEdit(simulation.scene(), choose);
        edits[0].gesture = {1, choose(3)};
        // Nothing but edits and what moves by itself changes a scene: what was done can always be taken back, and done
        // again, but where what moves by itself has come to stand there.
        const bool possible = kind == Edit::Kind::kChange || simulation.listOf(kind) != nullptr;
        const FrameResult frame = simulation.step(i == 0, std::move(edits), {});
        const bool done = frame.outcomes.front().result.has_value();
        const bool stands =
            !done && frame.outcomes.front().result.error().message.find(" stands where ") != std::string::npos;
        if (kind != Edit::Kind::kChange && done != possible && !stands) return "a step of the history is refused";
        ++(!done ? counts.refused : kind != Edit::Kind::kChange ? counts.undone : counts.taken);
        if (frame.commit.list) {
            if (const Expected<void> followed = replica.apply(*frame.commit.list); !followed)
                return "a replica refuses: " + followed.error().message;
            source.update(simulation.scene(), frame.commit.list.get());
        }
        if (replica.stateHash() != simulation.scene().stateHash()) return "a replica differs";
        if (const Expected<View> view = source.view(simulation.scene()); view && !checkStand(*view))
            return "a view that cannot be drawn";
    }
    return {};
}

}  // namespace tessera::test
