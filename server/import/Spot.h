/// Where in the new scene a node of a file is being placed, and what geometry there wears.
#pragma once

#include <cstddef>
#include <string>

#include "common/change/Value.h"

namespace tessera {

struct PlacedNode;  // PlacedNodes.h

/// Materials that geometry has though it does not name them.
struct Coating {
    std::string otherwise = {};  ///< of geometry that names none: an instance's, for what its definition leaves open
    ObjectId over = {};          ///< of all geometry, whatever it names: an import's

    /// The name that counts where geometry says this one; none where something is painted over it.
    [[nodiscard]] std::string nameFor(const std::string& said) const {
        return over ? std::string() : said.empty() ? otherwise : said;
    }
};

struct Spot {
    ObjectId parent;
    PlacedNode* placed = nullptr;  ///< the parent, as far as this import made it
    PlacedNode* top = nullptr;     ///< names are looked up no further out than this
    std::size_t depth = 0;
    bool camerasEnabled = true;
    bool exposes = true;  ///< ImportOptions::exposes
    Coating paint = {};
};

}  // namespace tessera
