#include "server/manipulators/HandleFrame.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "common/cores/ComponentTransform.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/PointLight.h"
#include "common/cores/SpotLight.h"
#include "common/cores/Transform.h"
#include "common/drawable/Drawable.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

/// Where a light stands: its beacon while that is there.
std::optional<ObjectId> standOf(const Aspect& scene, const Manipulator& manipulator, const Node& target) {
    ObjectId beacon;
    switch (manipulator.kind) {
        case Manipulator::kPointLight: {
            const PointLight* light = scene.coreOf<PointLight>(target);
            if (!light) return std::nullopt;
            beacon = light->beacon;
            break;
        }
        case Manipulator::kDirectionalLight: {
            const DirectionalLight* light = scene.coreOf<DirectionalLight>(target);
            if (!light) return std::nullopt;
            beacon = light->beacon;
            break;
        }
        default: {
            const SpotLight* light = scene.coreOf<SpotLight>(target);
            if (!light) return std::nullopt;
            beacon = light->beacon;
            break;
        }
    }
    return scene.get<Node>(beacon) ? beacon : manipulator.target;
}

bool isAttached(const Aspect& scene, ObjectId node) {
    while (node && node != kRootNode) {
        const Node* at = scene.get<Node>(node);
        if (!at) return false;
        node = at->parent;
    }
    return node == kRootNode;
}

double sizeSeen(const Manipulator& manipulator, std::size_t sight) {
    const auto i = static_cast<Eigen::Index>(sight % 4);
    return manipulator.pixels > 0 ? static_cast<double>(sight < 4 ? manipulator.sizes[i] : manipulator.moreSizes[i])
                                  : 0;
}

/// Neither squashed flat nor beyond what numbers can say.
bool usable(const Affine3d& place) {
    if (!place.matrix().allFinite()) return false;
    const Vec3d lengths = place.linear().colwise().norm().transpose();
    const double volume = std::abs(place.linear().determinant());
    return lengths.minCoeff() > 1e-100 && lengths.maxCoeff() < 1e100 && volume > 1e-9 * lengths.prod();
}

}  // namespace

std::optional<MovedCore> movedBy(const Aspect& scene, const Manipulator& manipulator) {
    const Node* node = manipulator.target ? scene.get<Node>(manipulator.target) : nullptr;
    if (!node) return std::nullopt;
    ObjectId at = manipulator.target;
    if (Manipulator::isLightKind(manipulator.kind)) {
        const std::optional<ObjectId> stand = standOf(scene, manipulator, *node);
        if (!stand) return std::nullopt;
        at = *stand;
        for (node = scene.get<Node>(at);
             node && !scene.coreOf<Transform>(*node) && !scene.coreOf<ComponentTransform>(*node);
             node = scene.get<Node>(at)) {
            at = node->parent;
            if (!at) return std::nullopt;
        }
        if (!node) return std::nullopt;
    }
    if (!isAttached(scene, at)) return std::nullopt;
    MovedCore moved;
    moved.node = at;
    moved.core = node->core;
    if (const Transform* transform = scene.coreOf<Transform>(*node)) {
        moved.pose = {.translation = transform->translation,
                      .rotation = transform->rotation.normalized(),
                      .scale = transform->scale};
    } else if (const ComponentTransform* about = scene.coreOf<ComponentTransform>(*node)) {
        moved.component = true;
        moved.center = about->center;
        moved.axes = about->scaleOrientation.normalized();
        moved.pose = {.translation = about->translation + about->center,
                      .rotation = (about->rotation.normalized() * moved.axes).normalized(),
                      .scale = about->scale};
    } else {
        return std::nullopt;
    }
    if (manipulator.kind == Manipulator::kCenterball && !moved.component) return std::nullopt;
    moved.world_T_parent = node->parent ? worldTransform(scene, node->parent) : Affine3d::Identity();
    if (!usable(moved.world_T_parent) || !moved.pose.sound()) return std::nullopt;
    return moved;
}

void writePose(ChangeListBuilder& list, const MovedCore& moved, const Pose& pose, const std::optional<Vec3d>& center) {
    const Vec3d c = center.value_or(moved.center);
    const Vec3d translation = pose.translation - c;
    const bool moves = translation != moved.pose.translation - moved.center;
    const bool turns = pose.rotation.coeffs() != moved.pose.rotation.coeffs();
    const bool scales = pose.scale != moved.pose.scale;
    if (moved.component) {
        if (moves) setField<&ComponentTransform::translation>(list, moved.core, translation);
        if (center && *center != moved.center) setField<&ComponentTransform::center>(list, moved.core, c);
        if (turns)
            setField<&ComponentTransform::rotation>(list, moved.core,
                                                    (pose.rotation * moved.axes.conjugate()).normalized());
        if (scales) setField<&ComponentTransform::scale>(list, moved.core, pose.scale);
        return;
    }
    if (moves) setField<&Transform::translation>(list, moved.core, translation);
    if (turns) setField<&Transform::rotation>(list, moved.core, pose.rotation);
    if (scales) setField<&Transform::scale>(list, moved.core, pose.scale);
}

Box contentBox(const Aspect& scene, const MovedCore& moved) {
    Affine3d world_T_y = moved.world_T_parent;
    world_T_y = world_T_y * moved.pose.matrix();
    if (!usable(world_T_y)) return {};
    const Affine3d y_T_world = world_T_y.inverse();
    Box bounds;
    std::unordered_map<MeshKey, Box, MeshKeyHash> local;
    Action action;
    action.onNode([&](const Visit& visit) {
        if (visit.core.as<Manipulator>()) return Descend::kPast;
        const Drawable drawable = drawableOf(scene, visit.node);
        if (!drawable) return Descend::kInto;
        const auto [it, isNew] = local.try_emplace(drawable.key());
        if (isNew) it->second = drawable.bounds();
        bounds.extend(it->second.transformed(y_T_world * visit.world_T_node));
        return Descend::kInto;
    });
    action.run(scene, moved.node);
    return bounds.lower.allFinite() && bounds.upper.allFinite() ? bounds : Box();
}

std::size_t sightsOf(const Manipulator& manipulator) {
    std::size_t count = 0;
    while (count < 8 && sizeSeen(manipulator, count) > 0) ++count;
    return std::max<std::size_t>(count, 1);
}

HandleFrame frameOf(const Manipulator& manipulator, const MovedCore& moved, const Box& content, std::size_t sight) {
    HandleFrame frame;
    frame.parent_R_frame = moved.pose.rotation;
    frame.pivot = moved.pose.translation;
    // A length of the world, along the parent's axes: their mean where they differ.
    const double stretch = std::cbrt(std::abs(moved.world_T_parent.linear().determinant()));
    const Vec3d scale = moved.pose.scale.cwiseAbs();
    constexpr double kLeast = 1e-12;
    const double seen = sizeSeen(manipulator, sight), size = seen > 0 ? seen : manipulator.size;
    if (isBoxKind(manipulator.kind) && !content.empty()) {
        frame.pivot = moved.pose.matrix() * content.center();
        frame.extent = 0.5 * content.size().cwiseProduct(scale);
        const double largest = std::max(frame.extent.maxCoeff(), kLeast);
        frame.extent = frame.extent.cwiseMax(0.01 * largest);
        if (seen > 0) frame.knob = std::max(0.5 * seen / stretch, kLeast);
    } else if (size > 0) {
        frame.extent = Vec3d::Constant(std::max(0.5 * size / stretch, kLeast));
    } else if (!content.empty() && !Manipulator::isLightKind(manipulator.kind)) {
        // Reaches out of the box, wherever in it the pivot is.
        const Vec3d reach = content.lower.cwiseAbs().cwiseMax(content.upper.cwiseAbs()).cwiseProduct(scale);
        frame.extent = Vec3d::Constant(std::max(1.8 * reach.maxCoeff(), kLeast));
    } else {
        frame.extent = Vec3d::Constant(0.5 / stretch);
    }
    const Vec3d origin = moved.world_T_parent * frame.pivot;
    if (manipulator.kind == Manipulator::kMove && manipulator.world) {
        frame.ofWorld = true;
        frame.extent *= stretch;
        frame.world_T_frame.linear() = Mat3d::Identity();
    } else {
        frame.world_T_frame.linear() = moved.world_T_parent.linear() * frame.parent_R_frame.toRotationMatrix();
    }
    frame.world_T_frame.translation() = origin;
    return frame;
}

double outerAngleOf(const Aspect& scene, const Manipulator& manipulator) {
    const Node* node = manipulator.kind == Manipulator::kSpotLight ? scene.get<Node>(manipulator.target) : nullptr;
    const SpotLight* light = node ? scene.coreOf<SpotLight>(*node) : nullptr;
    return light ? static_cast<double>(light->outerAngle) : 0;
}

}  // namespace tessera
