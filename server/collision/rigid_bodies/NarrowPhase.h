/// The contact points of the frame's encounters.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/rigid_bodies/ContactPoint.h"
#include "server/collision/rigid_bodies/FrameBodies.h"
#include "server/collision/rigid_bodies/SolidContacts.h"

namespace tessera::rigid {

struct FrameEncounter {
    std::uint32_t partA = 0, partB = 0;  ///< ranks, ascending
    ContactLaw law = ContactLaw::kBounce;
    SolidMemory memory;  ///< in: of the last frame; out: for the next
    // What was found.
    bool known = false;
    std::uint32_t batch = 0;
    std::uint32_t firstPoint = 0, points = 0;  ///< in the batch
    std::uint32_t firstFace = 0, faces = 0;    ///< of a solid and faces: those within reach; in the batch
    SolidGap parted;                           ///< of two solids, as the frame begins
    double nearest = 0;  ///< of a solid and faces: no face is nearer, or this is how far was looked
    double slack = 0;    ///< of others: how far was looked in every direction
};

/// Encounters that are looked at in one task, and what they gave. Kept from frame to frame for its memory.
struct EncounterBatch {
    std::vector<ContactPoint> points;
    std::vector<NearFace> within;
    std::vector<std::uint32_t> faces;  ///< of one encounter at a time
    ClipScratch scratch;
    QueryWork work;
    std::vector<QueryWork> each;
};

struct NarrowOptions {
    Vec3d gravity = Vec3d::Zero();
    double seconds = 0, slop = 0;
    std::uint64_t maxTestsPerEncounter = 0;
    Workers* workers = nullptr;
};

class NarrowPhase {
public:
    /// Forgets the frame before.
    void begin(const FrameBodies& frame, const NarrowOptions& options);
    /// Others have come into the frame.
    void follow(const FrameBodies::Ranks& ranks);
    /// May be called more than once in a frame; batches stay until the next begin(). Encounters whose work was
    /// exhausted are not `known`.
    void find(std::span<FrameEncounter> encounters, QueryWork& work);

    [[nodiscard]] std::span<const ContactPoint> pointsOf(const FrameEncounter& e) const {
        return std::span(batches_[e.batch].points).subspan(e.firstPoint, e.points);
    }
    [[nodiscard]] std::span<const NearFace> facesOf(const FrameEncounter& e) const {
        return std::span(batches_[e.batch].within).subspan(e.firstFace, e.faces);
    }
    [[nodiscard]] const PlacedSolid& solid(std::uint32_t part) const { return solids_[part]; }
    /// The length that rests in each other: slop of the smaller of two bodies.
    [[nodiscard]] double slopOf(const FrameBody& a, const FrameBody& b) const {
        return options_.slop * std::min(a.size, b.size);
    }

private:
    void placeSolids(std::span<const FrameEncounter> encounters);
    void look(FrameEncounter& encounter, EncounterBatch& batch, QueryWork& work) const;
    bool solidWithFaces(std::uint32_t solidPart, std::uint32_t facePart, FrameEncounter& encounter, double margin,
                        double slack, double fine, EncounterBatch& batch, QueryWork& work) const;
    [[nodiscard]] double turn(std::uint32_t part) const;
    [[nodiscard]] Vec3d approach(std::uint32_t partA, std::uint32_t partB) const;

    const FrameBodies* frame_ = nullptr;
    NarrowOptions options_;
    std::vector<EncounterBatch> batches_;
    std::size_t usedBatches_ = 0;
    std::vector<PlacedSolid> solids_;  ///< by part
    /// Views into it are handed out: what one call of find() places has its own.
    struct Room {
        std::vector<Vec3d> corners;
        std::vector<PlacedSide> sides;
        std::vector<PlacedEdge> edges;
    };
    std::vector<Room> rooms_;
    std::size_t usedRooms_ = 0;
};

}  // namespace tessera::rigid
