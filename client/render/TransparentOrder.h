/// The order in which what is transparent is drawn, back to front.
#pragma once

#include <vector>

#include "client/render/DrawList.h"
#include "client/render/SceneItems.h"

namespace tessera {

/// Triangles of all transparent things are sorted together, so that things that lie in each other, and the near and far
/// side of one, cover each other as they should; by the depth of their middles, so those that cross one another are
/// wrong within themselves, and large ones beside small ones may be.
///
/// One order for all tiles of a screen: keys depend on the screen's camera, the triangle and its node alone. Whether
/// triangles are sorted at all, on the whole scene.
class TransparentOrder {
public:
    /// Of a scene; above it whole things are sorted, by the middles of their boxes. Sorting costs 0.1 µs each.
    static constexpr std::uint64_t kMostTriangles = 200'000;

    struct Item {
        DrawItem drawn;  ///< as a whole
        const SceneItem* item;
        double depth;  ///< of its box's middle
    };
    /// `items` are those that are drawn. Appends to `list.transparent` what is drawn in turn: whole items, or triangles
    /// of one.
    void append(const RenderScene::Impl& scene, const ScreenCamera& camera, const std::vector<Item>& items,
                DrawList& list);

private:
    struct Piece {
        static constexpr std::uint32_t kWhole = 0xffffffffu;
        double depth;
        ObjectId node;
        std::uint32_t triangle;  ///< or kWhole
        std::uint32_t item;
    };
    void addTriangles(const Item& item, std::uint32_t index, const ScreenCamera& camera, ClusterBits hidden);

    std::vector<Piece> pieces_;
};

}  // namespace tessera
