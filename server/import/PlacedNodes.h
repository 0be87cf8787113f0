/// The nodes of the new scene, as far as names must be found again.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "server/import/SceneDraft.h"
#include "server/import/Spot.h"

namespace tessera {

struct PlacedNode {
    ObjectId id;  ///< none: a pretended one, where names end
    std::string name;
    ObjectId transform = {};                        ///< its core, where that is a Transform
    ObjectId content = {};                          ///< the core of what it is besides: its own, or of a node below
    Affine3d parent_T_node = Affine3d::Identity();  ///< of its transform
    bool movesOtherwise = false;                    ///< by another core than a Transform
    bool evenScale = true;                          ///< that transform scales all axes alike
    PlacedNode* parent = nullptr;
    std::vector<PlacedNode*> children = {};

    /// The so-manieth child of a name, or null. Many children are looked up through a table that grows with them: each
    /// of ten thousand repeated nodes may name another one.
    [[nodiscard]] PlacedNode* child(std::string_view wanted, std::size_t which);

private:
    std::unordered_map<std::string_view, std::vector<PlacedNode*>> byName_ = {};
    std::size_t entered_ = 0;  ///< children that byName_ knows: their names stay
};

/// Not thread-safe. What it hands out stays as long as it does.
class PlacedNodes {
public:
    explicit PlacedNodes(SceneDraft& draft) : draft_(draft) {}

    /// Makes a node with this core and places it. Fails beyond the bounds of an import.
    Expected<PlacedNode*> make(std::string name, ObjectId core, const Spot& spot);
    /// One that is in the list already.
    PlacedNode* enter(ObjectId id, std::string name, PlacedNode* parent);
    /// None of the scene: above the nodes whose names a file may mean.
    PlacedNode* pretended() { return enter({}, {}, nullptr); }
    /// Whether `make` has room for so many more.
    [[nodiscard]] bool hasRoomFor(std::size_t more) const;

    /// By a name, a path, or "/" and a path from the top; "pillar[2]" is the third of that name. Nearest first: the
    /// node's own name, beside it and below, then farther out. Null: there is none below the top.
    [[nodiscard]] static PlacedNode* find(PlacedNode* from, PlacedNode* top, std::string_view name);

private:
    SceneDraft& draft_;
    std::vector<std::unique_ptr<PlacedNode>> nodes_;
    std::size_t made_ = 0;  ///< nodes that nobody saved
};

}  // namespace tessera
