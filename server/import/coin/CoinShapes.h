/// What a shape of Coin is made of: its triangles, lines and points, as Coin generates them.
#pragma once

#include <Inventor/actions/SoCallbackAction.h>

#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "common/geometry/Mesh.h"
#include "server/import/coin/CoinLook.h"

class SoNode;
class SoPrimitiveVertex;

namespace tessera {

class CoinShapes {
public:
    /// All shapes that `action` traverses come here. `room`: for so many triangles, lines and points of all.
    CoinShapes(SoCallbackAction& action, std::size_t room);

    struct Parts {
        std::vector<MeshData> meshes;  ///< triangles, lines, points, as far as there are any
        bool colored = false;          ///< corners have colours of their own: the material's is white
        std::optional<CoinLook> look;  ///< as it is where the first of it was made; none: nothing was
    };
    struct Wanted {
        bool textured = false;    ///< else it has no texture coordinates
        bool reversed = false;    ///< its triangles are seen from the other side
        bool rawNormals = false;  ///< of any length; triangles that are one point stay
        bool ownColors = false;   ///< corners have their own, though all be alike; transparency is the material's
    };
    /// Of one shape, in the action's state. kLimit: it is more than a mesh can hold, or than there is room for.
    [[nodiscard]] Expected<Parts> gather(SoNode& shape, const Wanted& wanted);

private:
    /// What one corner is; equal ones become one vertex.
    struct Corner {
        std::array<float, 3> position{}, normal{};
        std::array<float, 2> texcoord{};
        std::uint32_t color = 0;
        bool operator==(const Corner&) const = default;
    };
    struct CornerHash {
        std::size_t operator()(const Corner& corner) const;
    };
    struct Kind {
        std::unordered_map<Corner, std::uint32_t, CornerHash> numbers;
        std::vector<Corner> corners;
        std::vector<std::uint32_t> order;
    };

    std::uint32_t number(Kind& kind, const SoPrimitiveVertex& vertex, bool normals);
    [[nodiscard]] std::uint32_t colorOf(int material);
    void begin();
    [[nodiscard]] MeshData meshOf(Kind& kind, Primitive primitive) const;

    SoCallbackAction& action_;
    std::array<Kind, 3> kinds_;  ///< by Primitive
    std::vector<std::optional<std::uint32_t>> colors_;
    std::optional<CoinLook> look_;
    std::size_t taken_ = 0, room_;
    Wanted wanted_;
    bool colored_ = false, tooMany_ = false;
    std::optional<std::uint32_t> firstColor_;
};

}  // namespace tessera
