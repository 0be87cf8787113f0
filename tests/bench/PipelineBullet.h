/// Bullet's collision world (detection only) and its dynamics world, as Debian ships them (single precision): the peers
/// of convex and of free bodies.
#pragma once

#include <memory>
#include <vector>

#include "common/math/Pose.h"
#include "tests/bench/PipelineScene.h"
#include "tests/support/Models.h"

namespace tessera {

/// What Bullet puts about every hull unless told otherwise (CONVEX_DISTANCE_MARGIN): its users have it.
inline constexpr double kBulletMargin = 0.04;

/// btCollisionWorld over a dynamic AABB tree.
class BulletWorld {
public:
    explicit BulletWorld(double margin = 0);
    ~BulletWorld();

    [[nodiscard]] std::uint32_t addHull(const MeshArrays3& hull);
    /// A body that will not move is put to sleep, so that Bullet looks neither at its box nor at pairs of its kind.
    void addBody(std::uint32_t hull, const Pose& pose, bool moves);
    /// To hand poses over in Bullet's own type costs nothing while time is taken.
    void addFrames(const std::vector<std::vector<Pose>>& frames, const std::vector<std::uint32_t>& movers);
    void put(std::size_t frame);
    /// Boxes, pairs, contacts.
    void detect();
    /// Bodies with a contact point that is no further apart than 0.
    [[nodiscard]] BodyPairs touching() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// btDiscreteDynamicsWorld with its usual solver: hulls that fall on triangles that stay.
class BulletDynamics {
public:
    explicit BulletDynamics(const Vec3d& gravity, double margin = kBulletMargin);
    ~BulletDynamics();

    [[nodiscard]] std::uint32_t addHull(const MeshArrays3& hull);
    void addGround(const MeshArrays3& mesh);
    void addBody(std::uint32_t hull, const Pose& pose, double mass, const Vec3d& velocity = Vec3d::Zero());
    /// All bodies but those that move.
    void putToSleep();
    void step(double seconds);
    [[nodiscard]] std::size_t asleep() const;
    [[nodiscard]] std::size_t manifolds() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace tessera
