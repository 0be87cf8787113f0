/// Faces whose points an interpolator of coordinates moves, as meshes with morph targets.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/math/Box.h"
#include "server/import/coin/CoinMotion.h"
#include "server/import/coin/CoinShapes.h"
#include "server/import/reader/CountedNotes.h"

class SoNode;

namespace tessera {

/// What moves a mesh. At each key of the interpolator one target counts fully and no other does; between keys both
/// beside count in proportion, so that points are where it says (ISO/IEC 14772-1:1997, 4.6.8 and 6.13).
struct CoinMorph {
    std::size_t targets = 0;
    std::vector<float> positions, normals;  ///< what is added, target after target; no normals: they stay as they are
    std::vector<double> weights;            ///< of each key those of all targets
    Box bounds;                             ///< at rest and at all keys
};

class CoinMorphs {
public:
    CoinMorphs(CoinMotion& motion, CountedNotes& notes, std::size_t textBytes);

    /// Of a geometry whose Coordinate is held and moves, before anybody looks at its numbers. Whether its points can
    /// move; a note says why not. Points that the file gives to keys alone are in the Coordinate then.
    bool prepare(SoNode& geometry);

    struct Faces {
        MeshData mesh;  ///< triangles; empty: there are none
        bool colored = false;
        std::string lost;  ///< what could not be shown
        CoinMorph morph;   ///< without targets nothing moves
    };
    /// Of a geometry that was prepared, and whose numbers have been mended; `shape` bears it.
    Expected<Faces> gather(CoinShapes& shapes, SoNode& shape, SoNode& geometry, bool textured);

private:
    void standStill(const SoNode& geometry, const char* why);
    bool takeRoom(std::size_t times, std::size_t numbers);

    CoinMotion& motion_;
    CountedNotes& notes_;
    std::size_t room_;  ///< for so many points, corners and weights of all keys
    std::map<const SoNode*, bool> prepared_;
};

}  // namespace tessera
