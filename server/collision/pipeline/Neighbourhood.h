/// Whose boxes meet in this frame: boxes that hold each part wherever it may be in it.
#pragma once

#include <array>
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
    bool slides = false;  ///< a motion may be led along a surface
    double margin = 0;    ///< others that are nearer than this are to be found
};

/// Not thread-safe.
class Neighbourhood {
public:
    explicit Neighbourhood(Workers* workers) : finder_(makeNeighbourFinder({.workers = workers})) {}

    [[nodiscard]] const PartTraits& traits(const ObjectHandler& handler, std::uint32_t part) {
        return traitsOfGroup(handler, handler.interactions().groupOf[part]);
    }
    /// Of all parts that a transform (by number) carries together.
    [[nodiscard]] const PartTraits& traitsCarried(const ObjectHandler& handler, std::uint32_t transform);

    /// Brings the memory up to date: the pairs of parts of interest that may meet in this frame. `ways`: of transforms
    /// that are still to be moved. Parts nearer than the thresholds of interests in distances count. True where
    /// anything has moved, come, gone or been asked for since the last call.
    bool find(ObjectHandler& handler, std::span<const Mover> ways, FreeBodies& bodies, double seconds,
              PairMemory& memory);
    /// Of the handler, when `find` was called last.
    [[nodiscard]] std::uint64_t generation() const { return generation_; }
    /// Parts that have come, gone, moved or another shape, as the last `find` found.
    [[nodiscard]] std::span<const std::uint32_t> changed() const { return changed_; }
    /// Where parts have moved after `find`, in the same frame.
    void alsoMoved(std::span<const std::uint32_t> parts) { later_.insert(later_.end(), parts.begin(), parts.end()); }

private:
    [[nodiscard]] const PartTraits& traitsOfGroup(const ObjectHandler& handler, std::uint32_t group);
    [[nodiscard]] Box boxOf(const ObjectHandler& handler, std::uint32_t part, const WayLookup& wayOf,
                            const FreeBodies& bodies, double seconds, bool onTheWay);

    std::unique_ptr<NeighbourFinder> finder_;
    std::uint64_t generation_ = 0;
    /// Of a group: what it may meet asks of it, group by group, so that a change costs what has changed.
    struct Row {
        std::uint64_t version = 0;
        std::vector<std::uint8_t> asked;       // per other group: bits of what is asked
        std::array<std::uint32_t, 4> count{};  // per bit: of how many
        double margin = 0;
        PartTraits traits;
    };
    void ask(const RelationTable& relations, std::uint32_t group, std::uint32_t other, Row& row) const;
    struct Known {
        std::uint64_t version = 0, structure = 0;
        ObjectId transform;
        PartTraits traits;
    };
    std::vector<Row> traits_;           // per group
    std::vector<Known> carried_;        // per transform
    std::vector<Box> boxes_;            // per part, as the finder has them
    std::vector<std::uint32_t> grown_;  // parts whose boxes are larger than they are themselves
    std::vector<std::uint32_t> later_;
    std::vector<std::uint32_t> changed_;
    // Kept for their memory.
    std::vector<std::uint32_t> items_;
    std::vector<Box> moved_;
    std::vector<NeighbourPair> begun_, ended_;
};

/// The way of a mover by its transform; movers ascending by transform.
[[nodiscard]] const Way* wayOf(std::span<const Mover> movers, ObjectId transform);

}  // namespace tessera
