/// What GL reads of each item's place: from draw items to records.
#pragma once

#include <span>
#include <vector>

#include "client/draw/shaders/Program.h"
#include "client/render/DrawList.h"
#include "client/render/ItemPlaces.h"

namespace tessera {

/// Kept from draw to draw for its memory.
class RecordMaker {
public:
    /// A record for each item, as its camera's eye has it: composed in double, then rounded. The same numbers wherever
    /// it is drawn.
    void make(std::span<const DrawItem* const> items, const ScreenCamera& camera, std::vector<ItemRecord>& records);

private:
    std::vector<places::Matrix> world_T_items_;
    std::vector<float*> rows_;
};

}  // namespace tessera
