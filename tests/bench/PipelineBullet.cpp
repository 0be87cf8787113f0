#include "tests/bench/PipelineBullet.h"

#include <btBulletCollisionCommon.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>

namespace tessera {

namespace {

btTransform toBullet(const Pose& pose) {
    const Quatd& q = pose.rotation;
    const Vec3d& t = pose.translation;
    return btTransform(btQuaternion(btScalar(q.x()), btScalar(q.y()), btScalar(q.z()), btScalar(q.w())),
                       btVector3(btScalar(t.x()), btScalar(t.y()), btScalar(t.z())));
}

std::unique_ptr<btConvexHullShape> hullShape(const MeshArrays3& hull, double margin) {
    auto shape = std::make_unique<btConvexHullShape>();
    for (std::size_t v = 0; v < hull.positions.size(); v += 3)
        shape->addPoint(
            btVector3(btScalar(hull.positions[v]), btScalar(hull.positions[v + 1]), btScalar(hull.positions[v + 2])),
            false);
    shape->setMargin(btScalar(margin));
    shape->recalcLocalAabb();
    return shape;
}

/// Pools for ten thousand bodies, so that none of it is the heap's time.
btDefaultCollisionConstructionInfo largePools() {
    btDefaultCollisionConstructionInfo info;
    info.m_defaultMaxPersistentManifoldPoolSize = 100'000;
    info.m_defaultMaxCollisionAlgorithmPoolSize = 100'000;
    return info;
}

}  // namespace

struct BulletWorld::State {
    explicit State(double m) : margin(m) {}
    const double margin;
    btDefaultCollisionConfiguration configuration{largePools()};
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btCollisionWorld world{&dispatcher, &broadphase, &configuration};
    std::vector<std::unique_ptr<btConvexHullShape>> hulls;
    std::vector<std::unique_ptr<btCollisionObject>> bodies;
    std::vector<std::uint32_t> movers;
    std::vector<std::vector<btTransform>> frames;  // of the movers
};

BulletWorld::BulletWorld(double margin) : state_(std::make_unique<State>(margin)) {
    state_->world.setForceUpdateAllAabbs(false);
}

BulletWorld::~BulletWorld() {
    for (const auto& body : state_->bodies) state_->world.removeCollisionObject(body.get());
}

std::uint32_t BulletWorld::addHull(const MeshArrays3& hull) {
    state_->hulls.push_back(hullShape(hull, state_->margin));
    return static_cast<std::uint32_t>(state_->hulls.size() - 1);
}

void BulletWorld::addBody(std::uint32_t hull, const Pose& pose, bool moves) {
    auto body = std::make_unique<btCollisionObject>();
    body->setCollisionShape(state_->hulls[hull].get());
    body->setWorldTransform(toBullet(pose));
    body->setUserIndex(static_cast<int>(state_->bodies.size()));
    state_->world.addCollisionObject(body.get());
    body->forceActivationState(moves ? DISABLE_DEACTIVATION : ISLAND_SLEEPING);
    state_->bodies.push_back(std::move(body));
}

void BulletWorld::addFrames(const std::vector<std::vector<Pose>>& frames, const std::vector<std::uint32_t>& movers) {
    state_->movers = movers;
    for (const std::vector<Pose>& poses : frames) {
        std::vector<btTransform>& out = state_->frames.emplace_back();
        for (const std::uint32_t i : movers) out.push_back(toBullet(poses[i]));
    }
}

void BulletWorld::put(std::size_t frame) {
    const std::vector<btTransform>& poses = state_->frames[frame];
    for (std::size_t k = 0; k < poses.size(); ++k) state_->bodies[state_->movers[k]]->setWorldTransform(poses[k]);
}

void BulletWorld::detect() {
    state_->world.performDiscreteCollisionDetection();
}

BodyPairs BulletWorld::touching() const {
    BodyPairs pairs;
    for (int m = 0; m < state_->dispatcher.getNumManifolds(); ++m) {
        const btPersistentManifold& manifold = *state_->dispatcher.getManifoldByIndexInternal(m);
        bool touch = false;
        for (int i = 0; i < manifold.getNumContacts(); ++i)
            touch = touch || manifold.getContactPoint(i).getDistance() <= 0;
        if (!touch) continue;
        const auto a = static_cast<std::uint32_t>(manifold.getBody0()->getUserIndex());
        const auto b = static_cast<std::uint32_t>(manifold.getBody1()->getUserIndex());
        pairs.push_back(std::minmax({a, b}));
    }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

struct BulletDynamics::State {
    explicit State(double m) : margin(m) {}
    const double margin;
    btDefaultCollisionConfiguration configuration{largePools()};
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
    struct Ground {
        std::vector<btScalar> positions;
        std::vector<int> indices;
        std::unique_ptr<btTriangleIndexVertexArray> triangles;
        std::unique_ptr<btBvhTriangleMeshShape> shape;
    };
    std::vector<std::unique_ptr<Ground>> grounds;
    std::vector<std::unique_ptr<btConvexHullShape>> hulls;
    std::vector<std::unique_ptr<btRigidBody>> bodies;
};

BulletDynamics::BulletDynamics(const Vec3d& gravity, double margin) : state_(std::make_unique<State>(margin)) {
    state_->world.setGravity(btVector3(btScalar(gravity.x()), btScalar(gravity.y()), btScalar(gravity.z())));
    state_->world.setForceUpdateAllAabbs(false);
}

BulletDynamics::~BulletDynamics() {
    for (const auto& body : state_->bodies) state_->world.removeRigidBody(body.get());
}

std::uint32_t BulletDynamics::addHull(const MeshArrays3& hull) {
    state_->hulls.push_back(hullShape(hull, state_->margin));
    return static_cast<std::uint32_t>(state_->hulls.size() - 1);
}

void BulletDynamics::addGround(const MeshArrays3& mesh) {
    auto ground = std::make_unique<State::Ground>();
    ground->positions.assign(mesh.positions.begin(), mesh.positions.end());
    ground->indices.assign(mesh.indices.begin(), mesh.indices.end());
    ground->triangles = std::make_unique<btTriangleIndexVertexArray>(
        static_cast<int>(ground->indices.size() / 3), ground->indices.data(), static_cast<int>(3 * sizeof(int)),
        static_cast<int>(ground->positions.size() / 3), ground->positions.data(),
        static_cast<int>(3 * sizeof(btScalar)));
    ground->shape = std::make_unique<btBvhTriangleMeshShape>(ground->triangles.get(), true);
    auto body =
        std::make_unique<btRigidBody>(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, ground->shape.get()));
    body->setFriction(btScalar(0.5));
    body->setRestitution(btScalar(0.2));
    state_->world.addRigidBody(body.get());
    state_->bodies.push_back(std::move(body));
    state_->grounds.push_back(std::move(ground));
}

void BulletDynamics::addBody(std::uint32_t hull, const Pose& pose, double mass, const Vec3d& velocity) {
    btConvexHullShape* shape = state_->hulls[hull].get();
    btVector3 inertia;
    shape->calculateLocalInertia(btScalar(mass), inertia);
    btRigidBody::btRigidBodyConstructionInfo info(btScalar(mass), nullptr, shape, inertia);
    info.m_startWorldTransform = toBullet(pose);
    info.m_friction = btScalar(0.5);
    info.m_restitution = btScalar(0.2);
    state_->bodies.push_back(std::make_unique<btRigidBody>(info));
    state_->bodies.back()->setLinearVelocity(
        btVector3(btScalar(velocity.x()), btScalar(velocity.y()), btScalar(velocity.z())));
    state_->world.addRigidBody(state_->bodies.back().get());
}

void BulletDynamics::putToSleep() {
    for (const auto& body : state_->bodies)
        if (body->getLinearVelocity().isZero()) body->forceActivationState(ISLAND_SLEEPING);
}

void BulletDynamics::step(double seconds) {
    state_->world.stepSimulation(btScalar(seconds), 0);
}

std::size_t BulletDynamics::asleep() const {
    return static_cast<std::size_t>(std::count_if(state_->bodies.begin(), state_->bodies.end(), [](const auto& body) {
        return !body->isStaticObject() && !body->isActive();
    }));
}

std::size_t BulletDynamics::manifolds() const {
    return static_cast<std::size_t>(state_->dispatcher.getNumManifolds());
}

}  // namespace tessera
