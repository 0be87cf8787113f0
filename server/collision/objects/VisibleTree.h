/// The visible nodes of a scene in one row, and what collision needs to know of them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/scene/Aspect.h"
#include "server/collision/objects/IdTable.h"
#include "server/collision/objects/Place.h"

namespace tessera {

/// Places stand in document order, so that whatever is below a node is one range. A plain table: whoever owns it keeps
/// the poses up to date; everything else is as it was at the last `flatten`.
struct VisibleTree {
    struct GeometryPlace {
        std::uint32_t place = 0;
        ObjectId core;
    };

    std::vector<Place> places;
    std::vector<ObjectId> nodes;            ///< per place
    std::vector<GeometryPlace> geometries;  ///< ascending by place
    std::vector<ObjectId> interests;        ///< Interest cores in document order, each once
    std::vector<ObjectId> objects;          ///< CollisionObject cores, ascending, each once
    ObjectId environment;                   ///< the first Environment core
    IdTable switches;                       ///< Switch cores that are borne by a place

    /// Transform cores in the order of their first place; `placesOf` by the same number.
    std::vector<ObjectId> transforms;
    IdTable transformNumbers;

    void flatten(const Aspect& aspect);
    [[nodiscard]] std::span<const std::uint32_t> placesOf(std::uint32_t transform) const {
        return std::span(transformPlaces_)
            .subspan(transformFirst_[transform], transformFirst_[transform + 1] - transformFirst_[transform]);
    }
    /// The places of these nodes; Place::kNone for those that are hidden, detached or none.
    [[nodiscard]] std::vector<std::uint32_t> find(std::span<const ObjectId> nodeIds) const;

private:
    std::vector<std::uint32_t> transformFirst_, transformPlaces_;
};

}  // namespace tessera
