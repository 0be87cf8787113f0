/// What the interests in two parts want to be told of them.
#pragma once

#include "server/collision/pipeline/EventBook.h"
#include "server/collision/pipeline/PairMemory.h"

namespace tessera {

/// Of a pair, by its number, from now on, where it rests.
void noteResting(EventBook& book, const ObjectHandler& handler, std::uint32_t number, const PairState& pair,
                 const Relation& relation);

enum class Moment : std::uint8_t { kAtEnd, kOnTheWay };
/// In this step alone. `when`: time, point and normal. What happens on the way is told to those who want to know when.
void appendEvents(const ObjectHandler& handler, std::uint32_t partA, std::uint32_t partB, PairEvent when, Moment moment,
                  std::vector<EventBook::Touching>& out);

}  // namespace tessera
