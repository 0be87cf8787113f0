/// Whose boxes meet in this frame: boxes that hold each part wherever it may be in it.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/collision/neighbours/NeighbourFinder.h"
#include "server/collision/pipeline/Admission.h"
#include "server/collision/pipeline/FreeBodies.h"

namespace tessera {

/// What the interests of a part may ask of it, whatever the other part is.
struct PartTraits {
    bool obstructed = false;  ///< something may be in the way of its motion
    bool dynamic = false;     ///< when it touches on its way is of interest
    bool rollback = false;
    bool slides = false;      ///< a motion may be led along a surface
    bool distance = false;
};

/// Not thread-safe.
class Neighbourhood {
public:
    explicit Neighbourhood(Workers* workers) : finder_(makeNeighbourFinder({.workers = workers})) {}

    /// Once a frame, first: follows the handler's tables.
    void follow(const ObjectHandler& handler);
    [[nodiscard]] const PartTraits& traits(const ObjectHandler& handler, std::uint32_t part) const {
        return traits_[handler.interactions().groupOf[part]];
    }
    /// Of all parts that a transform (by number) carries together.
    [[nodiscard]] const PartTraits& traitsCarried(std::uint32_t transform) const { return carried_[transform]; }

    /// The pairs of parts of interest that may meet in this frame, ascending. `ways`: of transforms that are still to be moved.
    /// Parts within half the largest threshold of each other count where distances are asked for. Valid until the next call.
    [[nodiscard]] std::span<const NeighbourPair> find(ObjectHandler& handler, std::span<const Mover> ways, const FreeBodies& bodies,
                                                      double seconds);

private:
    [[nodiscard]] Box boxOf(const ObjectHandler& handler, std::uint32_t part, const WayLookup& wayOf, const FreeBodies& bodies,
                            double seconds, double margin, bool onTheWay) const;

    std::unique_ptr<NeighbourFinder> finder_;
    std::uint64_t generation_ = 0;
    bool fresh_ = true;
    double margin_ = 0, previousMargin_ = 0;
    std::vector<PartTraits> traits_;    // per group
    std::vector<PartTraits> carried_;   // per transform
    std::vector<Box> boxes_;            // per part, as the finder has them
    std::vector<std::uint32_t> grown_;  // parts whose boxes are larger than they are themselves
    std::vector<std::uint32_t> free_;   // of those: parts of free bodies
    std::vector<std::uint32_t> items_;
    std::vector<Box> moved_;
};

/// The way of a mover by its transform; movers ascending by transform.
[[nodiscard]] const Way* wayOf(std::span<const Mover> movers, ObjectId transform);

}  // namespace tessera
