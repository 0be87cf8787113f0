/// What is grabbed stays below the ray: judged in the world by the scene's own transforms, not by the frame in which a
/// drag is worked out.
#include "common/cores/ComponentTransform.h"
#include "common/cores/SpotLight.h"
#include "server/manipulators/Drag.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>

#include "tests/property/Seeds.h"
#include "tests/unit/manipulators/ManipulatorScene.h"

namespace tessera {
namespace {

/// Those that are no lights'.
std::int64_t someKind(std::mt19937_64& random) {
    constexpr std::array kKinds{Manipulator::kMove,        Manipulator::kRotate,      Manipulator::kScale,
                                Manipulator::kTrackball,   Manipulator::kCenterball,  Manipulator::kTabBox,
                                Manipulator::kJack,        Manipulator::kTransformer, Manipulator::kHandleBox,
                                Manipulator::kTransformBox};
    return kKinds[random() % kKinds.size()];
}

/// A target of either type below up to three uneven parents, so that its world matrix is sheared.
void makeTarget(ManipulatorScene& stage, std::mt19937_64& random, bool component) {
    ObjectId parent = kRootNode;
    for (std::size_t depth = random() % 4; depth > 0; --depth)
        parent = stage.node(stage.transform(randomPose(random)), parent);
    const Pose pose = randomPose(random);
    if (component) {
        stage.core = stage.create(typeOf<ComponentTransform>());
        setField<&ComponentTransform::translation>(stage.edit, stage.core, pose.translation);
        setField<&ComponentTransform::rotation>(stage.edit, stage.core, pose.rotation);
        setField<&ComponentTransform::scale>(stage.edit, stage.core, pose.scale);
        setField<&ComponentTransform::center>(stage.edit, stage.core, randomVector(random, 1));
        setField<&ComponentTransform::scaleOrientation>(stage.edit, stage.core, randomRotation(random));
    } else {
        stage.core = stage.transform(pose);
    }
    stage.target = stage.node(stage.core, parent);
    stage.box(stage.target, Vec3d(uniform(random, 0.5, 3), uniform(random, 0.5, 3), uniform(random, 0.5, 3)));
}

/// A ray from outside to a point of one of the pieces: what it meets first may be another one. Not to a plane that it
/// sees from its side: those are not met.
Ray rayToPiece(const HandleSight& placed, std::mt19937_64& random) {
    while (true) {
        const HandlePiece& piece = placed.handles.pieces[random() % placed.handles.pieces.size()];
        const MeshArrays& shape = handleShape(piece.shape);
        const auto positions = shape.positions.as<float>();
        const auto indices = shape.indices.as<std::uint32_t>();
        const std::size_t triangle = random() % (indices.size() / 3);
        double u = uniform(random, 0.05, 0.9), v = uniform(random, 0.05, 0.9);
        if (u + v > 0.95) u = 0.5 * u, v = 0.5 * v;
        Vec3d at = Vec3d::Zero();
        const double weights[3] = {1 - u - v, u, v};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t index = indices[3 * triangle + k];
            at += weights[k] * Vec3d(positions[3 * index], positions[3 * index + 1], positions[3 * index + 2]);
        }
        const Vec3d world = placed.frame.world_T_frame * (piece.pose.matrix() * at);
        const double size = placed.frame.world_T_frame.linear().norm() * placed.frame.extent.maxCoeff();
        const Vec3d eye = world + uniform(random, 4, 20) * size * randomVector(random, 1).normalized();
        const Ray ray{eye, (world - eye) * uniform(random, 0.1, 10)};
        const Handle& handle = placed.handles.of[static_cast<std::size_t>(piece.handle - 1)];
        const Vec3d inFrame = (placed.frame.world_T_frame.linear().inverse() * ray.direction).normalized();
        if (handle.deed != HandleDeed::kMovePlane || std::abs(inFrame[handle.axis]) > 0.1001) return ray;
    }
}

double distanceToRay(const Ray& ray, const Vec3d& point) {
    return (point - ray.origin).cross(ray.direction.normalized()).norm();
}

/// Each step of the two matrices there and back may lose a few units in the last place of the largest number met, times
/// how much they stretch.
double boundOf(const ManipulatorScene& stage, const HandleSight& before, const Ray& ray) {
    const Affine3d world = worldTransform(stage.scene, stage.target);
    const Mat3d a = before.frame.world_T_frame.linear(), b = world.linear();
    const double stretch = a.norm() * a.inverse().norm() + b.norm() * b.inverse().norm();
    const double largest = world.translation().norm() + ray.origin.norm() +
                           before.frame.world_T_frame.translation().norm() + a.norm() * before.frame.extent.norm();
    return 1000 * std::numeric_limits<double>::epsilon() * stretch * stretch * largest;
}

/// The ray through a point near what was grabbed, from an eye near the first one.
Ray raySomewhereNear(const Ray& first, const Vec3d& grabbed, double size, std::mt19937_64& random) {
    const Vec3d eye = first.origin + randomVector(random, 0.2 * size);
    return {eye, grabbed + randomVector(random, size) - eye};
}

TEST(Drag, WhatIsGrabbedStaysBelowTheRay) {
    std::array<int, 9> judged{};
    forSeeds(1500, [&](std::mt19937_64& random) {
        ManipulatorScene stage;
        const std::int64_t kind = someKind(random);
        makeTarget(stage, random, kind == Manipulator::kCenterball || random() % 2 == 0);
        stage.manipulate(kind, stage.target);
        if (kind == Manipulator::kMove && random() % 2 == 0)
            setField<&Manipulator::world>(stage.edit, stage.manipulator, true);
        // Now and then of a size on the screen, of a few users: it is of the one whose ray it is.
        std::vector<float> sizes(random() % 4 == 0 ? 1 + random() % 8 : 0);
        for (float& size : sizes) size = static_cast<float>(uniform(random, 0.2, 4));
        if (!sizes.empty()) stage.seenAs(sizes);
        stage.apply();
        const PlacedManipulator all = stage.placed();
        ASSERT_EQ(all.sights(), std::max<std::size_t>(sizes.size(), 1));
        const std::size_t user = random() % all.sights();
        const HandleSight& before = all.seenBy(user);
        const Ray first = rayToPiece(before, random);
        std::vector<Vec3d> heads(all.sights());
        for (std::size_t i = 0; i < heads.size(); ++i)
            heads[i] = i == user ? first.origin : Vec3d(first.origin + randomVector(random, 1).normalized());
        stage.drags.headsAre(heads);
        const auto held = stage.drags.grab(stage.scene, stage.display, 1, first, {});
        ASSERT_TRUE(held) << held.error().message;
        ASSERT_TRUE(held->any) << "the ray was aimed at a piece";
        const Handle& handle = before.handles.of[static_cast<std::size_t>(held->handle - 1)];
        const Affine3d worldBefore = worldTransform(stage.scene, stage.target);
        const Vec3d material = worldBefore.inverse() * held->point;  // the thing's own point under the hand
        const double size = (before.frame.world_T_frame.linear() * before.frame.extent).norm();
        const Ray ray = raySomewhereNear(first, held->point, size, random);
        const auto list = stage.drags.drag(stage.scene, 1, ray, {});
        ASSERT_TRUE(list) << list.error().message;
        if (list->empty()) return;  // the ray says nothing: other tests look at that
        const double bound = boundOf(stage, before, ray) + boundOf(stage, before, first);
        const ObjectType fields = stage.scene.find(stage.core).info().type;
        for (const FieldColumn& column : list->columns) EXPECT_EQ(column.type, fields);
        stage.apply(*list);
        const Affine3d world = worldTransform(stage.scene, stage.target);
        const Vec3d now = world * material;
        const Vec3d frameOrigin = before.frame.world_T_frame.translation();
        const auto inFrame = [&](const Vec3d& p) { return Vec3d(before.frame.world_T_frame.inverse() * p); };
        const auto axisInWorld = [&](int axis) { return Vec3d(before.frame.world_T_frame.linear().col(axis)); };
        ++judged[static_cast<std::size_t>(handle.deed)];
        switch (handle.deed) {
            case HandleDeed::kMovePlane:
            case HandleDeed::kMoveFacing:
                EXPECT_LE(distanceToRay(ray, now), 100 * bound);  // 1/0.02, where the plane is nearly along the ray
                EXPECT_LE((world.linear() - worldBefore.linear()).norm(), bound) << "it only moves";
                break;
            case HandleDeed::kMoveAxis:
                EXPECT_LE((now - held->point).cross(axisInWorld(handle.axis).normalized()).norm(), bound)
                    << "along the axis alone";
                EXPECT_LE((world.linear() - worldBefore.linear()).norm(), bound);
                [[fallthrough]];
            case HandleDeed::kScaleAxis:
            case HandleDeed::kScaleAll: {
                // Of all points of its way it is the nearest to the ray, as the frame sees distances; unless a factor
                // is at its least.
                const Vec3d fixed = before.frame.world_T_frame * handle.fixed;
                if (handle.deed != HandleDeed::kMoveAxis) {
                    EXPECT_LE((world * (worldBefore.inverse() * fixed) - fixed).norm(), bound) << "what is fixed stays";
                    const Affine3d change = world * worldBefore.inverse();
                    if (change.linear().norm() < 0.2 || std::abs(change.linear().determinant()) < 2e-3) break;
                }
                const Vec3d origin = inFrame(ray.origin),
                            direction = (inFrame(ray.origin + ray.direction) - origin).normalized();
                const Vec3d p = inFrame(now);
                const Vec3d way = handle.deed == HandleDeed::kScaleAll
                                      ? Vec3d((inFrame(held->point) - handle.fixed).normalized())
                                      : Vec3d(Vec3d::Unit(handle.axis));
                const Vec3d away = (p - origin) - direction * direction.dot(p - origin);
                // Across both lines, or the two meet.
                const double tolerance = 100 * bound / before.frame.world_T_frame.linear().colwise().norm().minCoeff();
                EXPECT_LE(std::abs(away.dot(way)), tolerance * std::max(1.0, away.norm()) * 10);
                break;
            }
            case HandleDeed::kTurnRing: {
                const Vec3d axis = Vec3d::Unit(handle.axis), from = inFrame(held->point), to = inFrame(now);
                const Vec3d pivotNow = world * (worldBefore.inverse() * frameOrigin);
                EXPECT_LE((pivotNow - frameOrigin).norm(), bound) << "about the centre";
                const double tolerance = 100 * bound / before.frame.world_T_frame.linear().colwise().norm().minCoeff();
                EXPECT_NEAR(to.norm(), from.norm(), tolerance) << "in the frame it is a turn";
                EXPECT_NEAR(axis.dot(to), axis.dot(from), tolerance) << "about its axis";
                const Vec3d origin = inFrame(ray.origin),
                            direction = (inFrame(ray.origin + ray.direction) - origin).normalized();
                const Vec3d began = (inFrame(first.origin + first.direction) - inFrame(first.origin)).normalized();
                if (std::abs(began.dot(axis)) < 0.11) break;  // edge on: along the tangent
                const Vec3d meets = origin + direction * axis.dot(from - origin) / axis.dot(direction);
                const Vec3d toFlat = to - axis * axis.dot(to), meetsFlat = meets - axis * axis.dot(meets);
                EXPECT_LE(toFlat.normalized().cross(meetsFlat.normalized()).norm(),
                          100 * tolerance / std::min(1.0, meetsFlat.norm()))
                    << "the hand's own angle";
                EXPECT_GT(toFlat.dot(meetsFlat), 0);
                break;
            }
            case HandleDeed::kTurnBall: {
                const Vec3d from = inFrame(held->point), to = inFrame(now);
                const double tolerance = 100 * bound / before.frame.world_T_frame.linear().colwise().norm().minCoeff();
                EXPECT_NEAR(to.norm(), from.norm(), tolerance);
                const auto near = [&](const Ray& r) {
                    const Vec3d origin = inFrame(r.origin),
                                direction = (inFrame(r.origin + r.direction) - origin).normalized();
                    return Vec3d(origin - direction * direction.dot(origin)).norm();
                };
                // Where both rays meet the ball itself, not the sheet beside it, the very point is below the ray.
                const double radius = from.norm();
                if (radius < 0.25 * before.frame.extent.maxCoeff() || near(first) > 0.7 * radius ||
                    near(ray) > 0.7 * radius)
                    break;
                EXPECT_LE(distanceToRay(ray, now), 1000 * bound);
                break;
            }
            case HandleDeed::kMoveCenter: {
                EXPECT_LE((world.linear() - worldBefore.linear()).norm() +
                              (world.translation() - worldBefore.translation()).norm(),
                          100 * bound)
                    << "what it shows stays";
                const auto* moved = stage.scene.get<ComponentTransform>(stage.core);
                const Vec3d image = world * moved->center;
                EXPECT_LE((image - frameOrigin).cross(axisInWorld(handle.axis).normalized()).norm(), 100 * bound);
                break;
            }
            case HandleDeed::kOpenCone:
                break;
        }
    });
    if (std::getenv("TESSERA_SEED")) return;
    for (std::size_t deed = 0; deed < 8; ++deed)
        EXPECT_GT(judged[deed], 10) << "deed " << deed << " was hardly looked at";
}

TEST(Drag, ComingBackBringsEverythingBack) {
    forSeeds(300, [](std::mt19937_64& random) {
        ManipulatorScene stage;
        const std::int64_t kind = someKind(random);
        makeTarget(stage, random, kind == Manipulator::kCenterball || random() % 2 == 0);
        stage.manipulate(kind, stage.target);
        stage.apply();
        const PlacedManipulator before = stage.placed();
        const Ray first = rayToPiece(before, random);
        const Affine3d world = worldTransform(stage.scene, stage.target);
        const auto held = stage.drags.grab(stage.scene, stage.display, 1, first, {});
        ASSERT_TRUE(held && held->any);
        const double size = (before.frame.world_T_frame.linear() * before.frame.extent).norm();
        for (int i = 0; i < 5; ++i) {
            const auto list = stage.drags.drag(stage.scene, 1, raySomewhereNear(first, held->point, size, random), {});
            ASSERT_TRUE(list) << list.error().message;
            if (!list->empty()) stage.apply(*list);
        }
        const auto back = stage.drags.drag(stage.scene, 1, first, {});
        ASSERT_TRUE(back);
        if (!back->empty()) stage.apply(*back);
        const Affine3d now = worldTransform(stage.scene, stage.target);
        const Grab grab = *grabAt(before.handles.of[static_cast<std::size_t>(held->handle - 1)], before.frame,
                                  before.moved, first, (held->point - first.origin).norm() / first.direction.norm(), 0);
        if (!dragged(grab, first)) return;  // a ray along the axis says nothing, even where it began
        EXPECT_LE((now.matrix() - world.matrix()).norm(), 1e4 * boundOf(stage, before, first))
            << "the way between does not count";
    });
}

TEST(Drag, RaysThatSayNothingLeaveAllAsItIs) {
    ManipulatorScene stage;
    stage.core = stage.transform({});
    stage.target = stage.node(stage.core);
    stage.box(stage.target, Vec3d::Ones());
    stage.manipulate(Manipulator::kMove, stage.target);
    stage.apply();
    const PlacedManipulator placed = stage.placed();
    const Ray first{Vec3d(0.6, 0, 5), -Vec3d::UnitZ()};
    const std::optional<HandleHit> hit = hitOf(placed.handles, placed.frame.world_T_frame, first);
    ASSERT_TRUE(hit);
    ASSERT_EQ(hit->handle, 1);
    const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
    for (const HandleDeed deed :
         {HandleDeed::kMoveAxis, HandleDeed::kMovePlane, HandleDeed::kMoveFacing, HandleDeed::kTurnRing,
          HandleDeed::kTurnBall, HandleDeed::kScaleAxis, HandleDeed::kScaleAll, HandleDeed::kOpenCone}) {
        const int axis = deed == HandleDeed::kMovePlane || deed == HandleDeed::kTurnRing ? 2 : 0;
        const std::optional<Grab> grab =
            grabAt({.deed = deed, .axis = axis}, placed.frame, placed.moved, first, hit->t, 0);
        ASSERT_TRUE(grab);
        EXPECT_TRUE(dragged(*grab, {Vec3d(0.7, 0.1, 5), -Vec3d::UnitZ()})) << static_cast<int>(deed) << ": a good one";
        for (const Ray& ray : {Ray{Vec3d(0.6, 0, 5), Vec3d::UnitZ()},  // behind the eye
                               Ray{Vec3d(0, 0, 5), Vec3d::Zero()}, Ray{Vec3d(nan, 0, 5), -Vec3d::UnitZ()},
                               Ray{Vec3d(0, 0, 5), Vec3d(0, nan, -1)}, Ray{Vec3d(inf, 0, 5), -Vec3d::UnitZ()},
                               Ray{Vec3d(0, 0, 5), Vec3d(0, 0, -inf)}})
            EXPECT_FALSE(dragged(*grab, ray)) << static_cast<int>(deed);
    }
    const std::optional<Grab> along =
        grabAt({.deed = HandleDeed::kMoveAxis, .axis = 0}, placed.frame, placed.moved, first, hit->t, 0);
    EXPECT_FALSE(dragged(*along, {Vec3d(-5, 0.001, 0), Vec3d::UnitX()})) << "along the axis";
    const std::optional<Grab> beside =
        grabAt({.deed = HandleDeed::kMovePlane, .axis = 2}, placed.frame, placed.moved, first, hit->t, 0);
    EXPECT_FALSE(dragged(*beside, {Vec3d(-5, 0, 1), Vec3d(1, 0, -0.01)})) << "beside the plane";
    // Whatever the ray, what comes out is a pose that a Transform can say, and no farther than some million sizes.
    forSeeds(2000, [&](std::mt19937_64& random) {
        const auto wild = [&] { return Vec3d(randomVector(random, 1) * std::pow(10.0, uniform(random, -300, 300))); };
        const HandleDeed deed = static_cast<HandleDeed>(random() % 9);
        const std::optional<Grab> grab = grabAt({.deed = deed, .axis = static_cast<int>(random() % 3)}, placed.frame,
                                                placed.moved, first, hit->t, 0);
        const std::optional<Dragged> to = dragged(*grab, {wild(), wild()});
        if (!to) return;
        EXPECT_TRUE(to->pose.sound());
        EXPECT_GE(to->pose.scale.minCoeff(), 1e-3 * (1 - 1e-12)) << "it never turns inside out";
    });
}

/// Whoever presses and lets go has done nothing, and who comes back to the ray that grabbed has what was before.
TEST(Drag, NowhereIsNoEdit) {
    forSeeds(300, [](std::mt19937_64& random) {
        ManipulatorScene stage;
        const std::int64_t kind = someKind(random);
        makeTarget(stage, random, kind == Manipulator::kCenterball);
        stage.manipulate(kind, stage.target);
        stage.apply();
        const PlacedManipulator placed = stage.placed();
        const Ray first = rayToPiece(placed, random);
        const auto held = stage.drags.grab(stage.scene, stage.display, 1, first, {});
        ASSERT_TRUE(held && held->any);
        const auto nowhere = stage.drags.drag(stage.scene, 1, first, {});
        ASSERT_TRUE(nowhere) << nowhere.error().message;
        EXPECT_TRUE(nowhere->empty());
        if (kind == Manipulator::kCenterball) return;
        const Transform before = *stage.scene.get<Transform>(stage.core);
        for (const Ray& ray : {raySomewhereNear(first, held->point, 1, random), first})
            if (const auto list = stage.drags.drag(stage.scene, 1, ray, {}); list && !list->empty()) stage.apply(*list);
        const Transform& after = *stage.scene.get<Transform>(stage.core);
        EXPECT_EQ(after.translation, before.translation);
        EXPECT_LT((after.rotation.coeffs() - before.rotation.coeffs()).norm(), 1e-15)
            << "made a unit quaternion once more";
        EXPECT_EQ(after.scale, before.scale);
    });
}

/// Seen along z the planes across x and y are seen from their sides: whoever means an arrow behind them has it, and a
/// hand's width leads a hand's width.
TEST(Drag, PlanesSeenFromTheirSideAreNotTaken) {
    for (const std::int64_t kind : {Manipulator::kMove, Manipulator::kTabBox, Manipulator::kJack,
                                    Manipulator::kTransformer, Manipulator::kHandleBox, Manipulator::kTransformBox}) {
        ManipulatorScene stage;
        stage.core = stage.transform({});
        stage.target = stage.node(stage.core);
        stage.box(stage.target, Vec3d::Ones());
        stage.manipulate(kind, stage.target);
        stage.apply();
        const PlacedManipulator placed = stage.placed();
        int lines = 0, planes = 0;
        for (int y = -90; y <= 90; y += 3)
            for (int x = -90; x <= 90; x += 3) {
                const Ray ray{Vec3d(0.02 * x, 0.02 * y, 5), Vec3d(0.001 * x, 0.001 * y, -1)};
                const std::optional<HandleHit> hit = hitOf(placed.handles, placed.frame.world_T_frame, ray);
                if (!hit) continue;
                const Handle& handle = placed.handles.of[static_cast<std::size_t>(hit->handle - 1)];
                planes += handle.deed == HandleDeed::kMovePlane;
                lines += handle.deed == HandleDeed::kMoveAxis && handle.axis != 2;
                if (handle.deed == HandleDeed::kMovePlane) {
                    EXPECT_EQ(handle.axis, 2) << kind << ' ' << x << ' ' << y;
                    const std::optional<Grab> grab = grabAt(handle, placed.frame, placed.moved, ray, hit->t, 0);
                    const std::optional<Dragged> to =
                        dragged(*grab, {ray.origin + Vec3d(0.05, 0.05, 0), ray.direction});
                    ASSERT_TRUE(to);
                    EXPECT_LT(to->pose.translation.norm(), 0.1);
                }
            }
        if (kind == Manipulator::kMove) {
            EXPECT_GT(lines, 0);
            EXPECT_GT(planes, 0);
        }
    }
}

TEST(Drag, ThingsThatSnapGoInWholeSteps) {
    forSeeds(300, [](std::mt19937_64& random) {
        ManipulatorScene stage;
        Pose parent = randomPose(random);
        parent.scale =
            Vec3d::Constant(uniform(random, 0.3, 3));  // so that a step of the world is one in each direction
        stage.core = stage.transform({});
        stage.target = stage.node(stage.core, stage.node(stage.transform(parent)));
        stage.box(stage.target, Vec3d::Ones());
        const std::array<std::int64_t, 3> kinds{Manipulator::kMove, Manipulator::kRotate, Manipulator::kScale};
        const std::int64_t kind = kinds[random() % 3];
        stage.manipulate(kind, stage.target);
        const double snap = uniform(random, 0.05, 0.3);
        setField<&Manipulator::snap>(stage.edit, stage.manipulator, snap);
        stage.apply();
        const PlacedManipulator before = stage.placed();
        const Ray first = rayToPiece(before, random);
        const auto held = stage.drags.grab(stage.scene, stage.display, 1, first, {});
        ASSERT_TRUE(held && held->any);
        const auto list =
            stage.drags.drag(stage.scene, 1, raySomewhereNear(first, held->point, parent.scale.x(), random), {});
        ASSERT_TRUE(list);
        if (!list->empty()) stage.apply(*list);
        const Transform& now = *stage.scene.get<Transform>(stage.core);
        const auto isWhole = [&](double value) { EXPECT_NEAR(value / snap, std::round(value / snap), 1e-6); };
        if (kind == Manipulator::kMove)
            for (int i = 0; i < 3; ++i) isWhole(now.translation[i] * parent.scale.x());
        if (kind == Manipulator::kRotate) {  // a rotation does not tell whole turns, nor its sign
            const double angle = Eigen::AngleAxisd(now.rotation).angle();
            double least = 1;
            for (int turns = -8; turns <= 8; ++turns) {
                const double steps = (angle + 2 * std::numbers::pi * turns) / snap;
                least = std::min(least, std::abs(steps - std::round(steps)));
            }
            EXPECT_LT(least, 1e-6);
        }
        if (kind == Manipulator::kScale)
            for (int i = 0; i < 3; ++i)
                if (now.scale[i] != 1) isWhole(now.scale[i]);
    });
}

/// A box of 2 about the origin, seen along -Z: what Open Inventor's boxes do, and what stays where it is.
TEST(Drag, BoxesDoWhatTheirPartsSay) {
    struct Case {
        std::int64_t kind;
        Vec3d from, to;      // where the hand is, both seen from (…, …, 9)
        Vec3d stays, leads;  // a place of the box that stays, and one that goes with the hand
        HandleDeed deed;
    };
    const Vec3d corner(1, 1, 1), opposite(-1, -1, -1), side(1.3 + 0.02, 0, 0), other(-1, 0, 0);
    for (const Case& c : {Case{Manipulator::kHandleBox, Vec3d(1.03, 1.03, 0), Vec3d(1.53, 1.53, 0), opposite, corner,
                               HandleDeed::kScaleAll},
                          Case{Manipulator::kHandleBox, side, Vec3d(side + Vec3d(0.5, 0, 0)), other, Vec3d(1, 0, 0),
                               HandleDeed::kScaleAxis},
                          Case{Manipulator::kHandleBox, Vec3d(0.5, 0.5, 0), Vec3d(1, 0.7, 0), Vec3d::Zero(),
                               Vec3d(1, 0, 0), HandleDeed::kMovePlane},
                          Case{Manipulator::kTransformBox, Vec3d(1.03, 1.03, 0), Vec3d(1.53, 1.53, 0), Vec3d::Zero(),
                               corner, HandleDeed::kScaleAll},
                          Case{Manipulator::kTransformBox, Vec3d(1, 0.4, 0), Vec3d(1.5, 0.4, 0), Vec3d(0, 1, 0),
                               Vec3d(1, 0, 1), HandleDeed::kTurnRing},
                          Case{Manipulator::kTransformBox, Vec3d(0.5, 0.5, 0), Vec3d(1, 0.7, 0), Vec3d::Zero(),
                               Vec3d(1, 0, 0), HandleDeed::kMovePlane}}) {
        ManipulatorScene stage;
        stage.core = stage.transform({});
        stage.target = stage.node(stage.core);
        stage.box(stage.target, Vec3d::Constant(2));
        stage.manipulate(c.kind, stage.target);
        stage.apply();
        const auto held =
            stage.drags.grab(stage.scene, stage.display, 1, {Vec3d(c.from + Vec3d(0, 0, 9)), -Vec3d::UnitZ()}, {});
        ASSERT_TRUE(held && held->any) << c.kind;
        const Handle handle = stage.placed().handles.of[static_cast<std::size_t>(held->handle - 1)];
        EXPECT_EQ(handle.deed, c.deed) << c.kind << ' ' << c.from.transpose();
        const auto list = stage.drags.drag(stage.scene, 1, {Vec3d(c.to + Vec3d(0, 0, 9)), -Vec3d::UnitZ()}, {});
        ASSERT_TRUE(list && !list->empty()) << c.kind;
        stage.apply(*list);
        const Affine3d world = worldTransform(stage.scene, stage.target);
        const Vec3d led = world * c.leads - c.leads;
        if (c.deed == HandleDeed::kMovePlane) {
            EXPECT_LT((world * c.stays - (c.to - c.from)).norm(), 1e-9) << "all goes with the hand";
            continue;
        }
        EXPECT_LT((world * c.stays - c.stays).norm(), 1e-9) << c.kind << ' ' << c.from.transpose();
        EXPECT_GT(led.x(), 0.1) << c.kind << ' ' << c.from.transpose();
        EXPECT_TRUE(c.deed != HandleDeed::kTurnRing || (world * Vec3d::UnitY() - Vec3d::UnitY()).norm() < 1e-12)
            << "about the edge's own direction";
        EXPECT_TRUE(c.deed != HandleDeed::kScaleAxis || std::abs(world.linear()(1, 1) - 1) < 1e-12) << "along one axis";
    }
}

TEST(Drag, LightsTurnAndOpen) {
    ManipulatorScene stage;
    stage.core = stage.transform({.translation = Vec3d(0, 2, 0)});
    stage.target = stage.node(stage.core);
    const ObjectId light = stage.create(typeOf<SpotLight>());
    const ObjectId lamp = stage.node(light, stage.target);
    stage.manipulate(Manipulator::kSpotLight, lamp);
    setField<&Manipulator::size>(stage.edit, stage.manipulator, 2.0);
    stage.apply();
    const auto drag = [&](std::int64_t handle, const Vec3d& from, const Vec3d& to) {
        const auto held =
            stage.drags.grab(stage.scene, stage.display, 1, {Vec3d(from + Vec3d(0, 0, 8)), -Vec3d::UnitZ()}, {});
        ASSERT_TRUE(held && held->any);
        EXPECT_EQ(held->handle, handle);
        const auto list = stage.drags.drag(stage.scene, 1, {Vec3d(to + Vec3d(0, 0, 8)), -Vec3d::UnitZ()}, {});
        ASSERT_TRUE(list) << list.error().message;
        stage.apply(*list);
    };
    const double angle = std::numbers::pi / 4;
    const Vec3d ring(std::sin(angle), 2, -std::cos(angle));
    drag(3, ring, Vec3d(std::tan(0.3) * std::cos(angle), 2, -std::cos(angle)));
    EXPECT_NEAR(stage.scene.get<SpotLight>(light)->outerAngle, 0.3, 0.04)
        << "the hand's own angle, but for where in the ring's tube it was grabbed";
    drag(1, Vec3d(0, 2, 0), Vec3d(1, 3, 0));
    EXPECT_LT((stage.scene.get<Transform>(stage.core)->translation - Vec3d(1, 3, 0)).norm(), 1e-9) << "its place";
}

}  // namespace
}  // namespace tessera
