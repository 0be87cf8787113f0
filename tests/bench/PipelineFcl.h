/// The loop that a user of FCL writes: moving bodies against standing ones, a dynamic AABB tree over each, and OBB or
/// OBBRSS hierarchies for each pair whose boxes meet.
///
/// FCL's package is built for SSE2; what includes its headers must be compiled without flags for newer processors.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "common/math/Pose.h"
#include "server/collision/mesh/TriangleMesh.h"
#include "tests/bench/PipelineScene.h"
#include "tests/support/fcl/FclPeer.h"

namespace tessera {

class FclWorld {
public:
    explicit FclWorld(FclVolume volume = FclVolume::kObbRss);
    ~FclWorld();

    [[nodiscard]] std::uint32_t addModel(const TriangleMesh& mesh);
    /// Standing bodies are numbered after the moving ones.
    void addMover(std::uint32_t model);
    void addStanding(std::uint32_t model);
    void open();

    enum class Detail { kYesOrNo, kAllContacts };
    /// Moves all movers there (one pose each) and collides the two trees; of each pair the first contact, or all.
    void collide(std::span<const Pose> poses, Detail detail);
    /// Of the last `collide`.
    [[nodiscard]] const BodyPairs& touching() const;
    [[nodiscard]] std::size_t contacts() const;

    /// How far each mover gets from one pose to the other (fractions): conservative advancement over FCL's distance,
    /// against each standing body whose box meets that of the way, nearest end first found counting as the new end. FCL
    /// measures no distances with OBB.
    [[nodiscard]] std::vector<double> advance(std::span<const Pose> from, std::span<const Pose> to, double tolerance);
    [[nodiscard]] std::size_t distances() const;                                   ///< asked for in the last `advance`
    [[nodiscard]] double distanceAt(std::uint32_t mover, const Pose& pose) const;  ///< to the nearest standing body

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace tessera
