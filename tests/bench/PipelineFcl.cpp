#include "tests/bench/PipelineFcl.h"

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include <algorithm>
#include <limits>

#include "common/cores/Volume.h"
#include "server/collision/query/TimeOfImpact.h"
#include "tests/support/Models.h"

#ifdef __SSE3__
#error "FCL's headers with flags for newer processors than its package is built for"
#endif

namespace tessera {

namespace {

using Model = fcl::CollisionGeometryd;
using Tree = fcl::DynamicAABBTreeCollisionManagerd;
using FclBody = fcl::CollisionObjectd;

template <typename Volume>
std::shared_ptr<Model> modelOf(const TriangleMesh& mesh) {
    const MeshArrays3 arrays = arraysOf(mesh);
    std::vector<fcl::Vector3d> vertices;
    for (std::size_t v = 0; v < arrays.positions.size(); v += 3)
        vertices.emplace_back(arrays.positions[v], arrays.positions[v + 1], arrays.positions[v + 2]);
    std::vector<fcl::Triangle> triangles;
    for (std::size_t i = 0; i < arrays.indices.size(); i += 3)
        triangles.emplace_back(arrays.indices[i], arrays.indices[i + 1], arrays.indices[i + 2]);
    auto model = std::make_shared<fcl::BVHModel<Volume>>();
    model->beginModel(static_cast<int>(triangles.size()), static_cast<int>(vertices.size()));
    model->addSubModel(vertices, triangles);
    model->endModel();
    model->computeLocalAABB();
    return model;
}

fcl::Transform3d toFcl(const Pose& pose) {
    fcl::Transform3d out = fcl::Transform3d::Identity();
    out.linear() = pose.rotation.toRotationMatrix();
    out.translation() = pose.translation;
    return out;
}

std::uint32_t numberOf(const FclBody* object) {
    return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(object->getUserData()));
}

}  // namespace

struct FclWorld::State {
    explicit State(FclVolume v) : volume(v) {}
    const FclVolume volume;
    std::vector<std::shared_ptr<Model>> models;
    std::vector<double> reaches;  // per model: the farthest vertex from its origin
    std::vector<std::uint32_t> moverModels;
    std::vector<std::unique_ptr<FclBody>> movers, standing;
    std::vector<FclBody*> moverPointers;
    Tree moverTree, standingTree;

    fcl::CollisionRequestd request;
    BodyPairs touching;
    std::size_t contacts = 0;
    std::size_t distances = 0;

    static bool collidePair(FclBody* a, FclBody* b, void* user) {
        State& state = *static_cast<State*>(user);
        fcl::CollisionResultd result;
        if (fcl::collide(a, b, state.request, result) > 0) {
            state.touching.push_back(std::minmax({numberOf(a), numberOf(b)}));
            state.contacts += result.numContacts();
        }
        return false;
    }

    static bool remember(FclBody* a, FclBody* b, void* user) {
        auto& [probe, met] = *static_cast<std::pair<FclBody*, std::vector<FclBody*>>*>(user);
        met.push_back(a == probe ? b : a);
        return false;
    }

    double distance(const Model& model, const Pose& pose, const FclBody& other) {
        ++distances;
        const fcl::DistanceRequestd wanted(false);
        fcl::DistanceResultd result;
        return std::max(0.0, fcl::distance(&model, toFcl(pose), other.collisionGeometry().get(), other.getTransform(),
                                           wanted, result));
    }
};

FclWorld::FclWorld(FclVolume volume) : state_(std::make_unique<State>(volume)) {}
FclWorld::~FclWorld() = default;

std::uint32_t FclWorld::addModel(const TriangleMesh& mesh) {
    double reach = 0;
    for (const Vec3d& p : mesh.positions()) reach = std::max(reach, p.norm());
    state_->models.push_back(state_->volume == FclVolume::kObb ? modelOf<fcl::OBBd>(mesh)
                                                               : modelOf<fcl::OBBRSSd>(mesh));
    state_->reaches.push_back(reach);
    return static_cast<std::uint32_t>(state_->models.size() - 1);
}

void FclWorld::addMover(std::uint32_t model) {
    state_->moverModels.push_back(model);
    state_->movers.push_back(std::make_unique<FclBody>(state_->models[model]));
    state_->moverPointers.push_back(state_->movers.back().get());
}

void FclWorld::addStanding(std::uint32_t model) {
    state_->standing.push_back(std::make_unique<FclBody>(state_->models[model]));
}

void FclWorld::open() {
    std::uintptr_t number = 0;
    std::vector<FclBody*> standing;
    for (const auto& mover : state_->movers) mover->setUserData(reinterpret_cast<void*>(number++));
    for (const auto& body : state_->standing) {
        body->setUserData(reinterpret_cast<void*>(number++));
        standing.push_back(body.get());
    }
    state_->standingTree.registerObjects(standing);
    state_->standingTree.setup();
    state_->moverTree.registerObjects(state_->moverPointers);
    state_->moverTree.setup();
}

void FclWorld::collide(std::span<const Pose> poses, Detail detail) {
    State& s = *state_;
    s.touching.clear();
    s.contacts = 0;
    s.request = detail == Detail::kYesOrNo ? fcl::CollisionRequestd(1, false)
                                           : fcl::CollisionRequestd(std::numeric_limits<std::size_t>::max() / 2, true);
    for (std::size_t i = 0; i < poses.size(); ++i) {
        s.movers[i]->setTransform(toFcl(poses[i]));
        s.movers[i]->computeAABB();
    }
    s.moverTree.update(s.moverPointers);
    s.moverTree.collide(&s.standingTree, &s, &State::collidePair);
    std::sort(s.touching.begin(), s.touching.end());
}

const BodyPairs& FclWorld::touching() const {
    return state_->touching;
}
std::size_t FclWorld::contacts() const {
    return state_->contacts;
}
std::size_t FclWorld::distances() const {
    return state_->distances;
}

std::vector<double> FclWorld::advance(std::span<const Pose> from, std::span<const Pose> to, double tolerance) {
    State& s = *state_;
    s.distances = 0;
    std::vector<double> out;
    std::pair<FclBody*, std::vector<FclBody*>> met;
    for (std::size_t i = 0; i < from.size(); ++i) {
        const std::uint32_t model = s.moverModels[i];
        const BodyMotion motion{from[i], to[i]};
        const double speed = (to[i].translation - from[i].translation).norm() +
                             from[i].rotation.angularDistance(to[i].rotation) * s.reaches[model];
        // A ball about the origin holds the part however it turns.
        const fcl::Vector3d size =
            (to[i].translation - from[i].translation).cwiseAbs() + Vec3d::Constant(2 * s.reaches[model]);
        FclBody way(std::make_shared<fcl::Boxd>(size));
        way.setTranslation(0.5 * (from[i].translation + to[i].translation));
        way.computeAABB();
        met.first = &way;
        met.second.clear();
        s.standingTree.collide(&way, &met, &State::remember);
        double end = 1;
        for (const FclBody* other : met.second) {
            double t = 0;
            while (speed > 0) {
                const double d = s.distance(*s.models[model], motion.at(t), *other);
                if (d <= tolerance) {
                    end = std::min(end, t);
                    break;
                }
                t += d / speed;
                if (t > end) break;
            }
        }
        out.push_back(end);
    }
    return out;
}

double FclWorld::distanceAt(std::uint32_t mover, const Pose& pose) const {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& body : state_->standing)
        least = std::min(least, state_->distance(*state_->models[state_->moverModels[mover]], pose, *body));
    return least;
}

}  // namespace tessera
