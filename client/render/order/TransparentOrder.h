/// The order in which what is transparent is drawn, back to front.
#pragma once

#include <array>
#include <vector>

#include "client/render/DrawList.h"
#include "client/render/scene/SceneItems.h"

namespace tessera {

/// Things whose boxes meet, and those that meet them, are a group. Groups are drawn one after the other, by the depth
/// of the middles of their boxes; within one the triangles of all are sorted together, by the depth of their own
/// middles. So things that lie in each other, and the near and far side of one, cover each other as they should;
/// triangles that cross one another are wrong within themselves, and large ones beside small ones may be. Slices of one
/// volume are in their right order at every pixel, whatever else is between them.
///
/// One order for all tiles of a screen: groups, and whether triangles are sorted at all, are the whole scene's; keys
/// depend on them, the screen's camera, the triangle and its node alone.
class TransparentOrder {
public:
    /// Of a scene, particles counted, two each; above it whole things are sorted, by the middles of their boxes, and
    /// particles among those of their own core.
    static constexpr std::uint64_t kMostTriangles = 200'000;

    struct Item {
        DrawItem drawn;      ///< as a whole
        std::uint32_t item;  ///< of the scene
        double depth;        ///< of its box's middle
    };
    /// `items` are those that are drawn. Appends to `list.transparent` what is drawn in turn: whole items, or triangles
    /// of one.
    void append(const RenderScene::Impl& scene, const ScreenCamera& camera, const std::vector<Item>& items,
                DrawList& list);

private:
    struct Piece {
        static constexpr std::uint32_t kWhole = 0xffffffffu;
        double groupDepth;
        ObjectId group;  ///< its first node
        double depth;
        ObjectId node;
        /// Of slices: from the first plane on, whether it lies on the side of it where the eye is not, in it, or on the
        /// eye's: two bits each.
        std::array<std::uint64_t, 2> sides;
        std::uint32_t triangle;  ///< or kWhole
        std::uint32_t item;
    };
    void findGroups(const RenderScene::Impl& scene);
    void addBalls(const RenderMesh& mesh, const Item& item, Piece piece, const ScreenCamera& camera);
    void addParticles(const RenderMesh& mesh, const Item& item, Piece piece, const ScreenCamera& camera);
    void addSlices(const RenderMesh& mesh, const Item& item, Piece piece, const ScreenCamera& camera);
    void addTriangles(const RenderMesh& mesh, const Item& item, Piece piece, const ScreenCamera& camera,
                      ClusterBits hidden);

    std::vector<Piece> pieces_;
    // Of the scene, until something transparent is another.
    struct Group {
        Box box;
        ObjectId first;  ///< of its nodes, the one with the least id
    };
    std::uint64_t changes_ = 0;
    std::vector<Group> groups_;
    std::vector<std::uint32_t> groupOf_;  ///< by item
};

}  // namespace tessera
