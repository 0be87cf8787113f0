#include "common/export/Selection.h"

#include <algorithm>

#include "common/cores/Billboard.h"
#include "common/cores/DistanceLOD.h"
#include "common/cores/Inline.h"
#include "common/cores/MaterialGroup.h"
#include "common/scene/Action.h"
#include "common/scene/ChildChoice.h"

namespace tessera {
namespace {

class Selector {
public:
    Selector(const Aspect& scene, ExportNotes& notes) : scene_(scene), notes_(notes) {}

    /// The nodes above the selection and its top, from the root's child down; empty: all is selected.
    Selection run(std::vector<ObjectId> way) {
        way_ = std::move(way);
        const Node& root = scene_.root();
        for (const ObjectId child : root.children)
            if (way_.empty() || child == way_.front()) add(child, SelectedNode::kNone, 0);
        return std::move(out_);
    }

private:
    void add(ObjectId id, std::size_t parent, std::size_t depth) {
        const Node& node = *scene_.get<Node>(id);
        if (node.ofServer) return;
        const std::size_t index = out_.nodes.size();
        SelectedNode made = {
            .id = id, .node = &node, .core = node.core ? scene_.find(node.core) : Object(), .parent = parent};
        made.isWay = depth + 1 < way_.size();
        if (parent != SelectedNode::kNone) {
            const SelectedNode& above = out_.nodes[parent];
            made.nearestMaterial = above.nearestMaterial, made.overMaterial = above.overMaterial;
            made.world_T_node = above.world_T_node;
        }
        made.world_T_node = placeNode(scene_, node, Affine3d(made.world_T_node));
        if (!canStand(made.world_T_node, id, notes_)) return;
        takeMaterials(made);
        const Object core = made.core;
        const bool isWay = made.isWay;
        out_.nodes.push_back(std::move(made));
        out_.byId.emplace(id, index);
        (parent == SelectedNode::kNone ? out_.tops : out_.nodes[parent].children).push_back(index);
        if (isWay) return add(way_[depth + 1], index, depth + 1);
        if (core.is<Billboard>()) notes_.add("billboards stand as they are, turned towards nobody", id);
        if (core.is<Inline>() && node.children.empty()) notes_.add("what an Inline would load is left out", id);
        addChildren(id, index, depth);
    }

    void addChildren(ObjectId id, std::size_t index, std::size_t depth) {
        const Node& node = *scene_.get<Node>(id);
        const Object core = out_.nodes[index].core;
        const auto seen = core ? seenChildren(core, node.children.size()) : std::nullopt;
        if (seen && seen->size() < node.children.size())
            notes_.add(core.is<DistanceLOD>() ? "of levels of detail the finest is written"
                                              : "what a Switch hides is left out",
                       id);
        std::size_t at = 0;
        for (const ObjectId child : node.children) {
            const std::size_t place = at++;
            if (seen && !std::ranges::binary_search(*seen, place)) continue;
            add(child, index, depth + 1);
        }
    }

    static void takeMaterials(SelectedNode& node) {
        const auto* group = node.core.as<MaterialGroup>();
        if (!group) return;
        if (group->protects) node.overMaterial = {};
        if (!group->material) return;
        if (!group->overrides)
            node.nearestMaterial = group->material;
        else if (!node.overMaterial)
            node.overMaterial = group->material;
    }

    const Aspect& scene_;
    ExportNotes& notes_;
    std::vector<ObjectId> way_;
    Selection out_;
};

}  // namespace

bool canStand(const Affine3d& place, ObjectId node, ExportNotes& notes) {
    const auto isWithin = [](const auto& numbers) {
        return numbers.allFinite() && numbers.cwiseAbs().maxCoeff() <= kUtmostPlace;
    };
    if (!isWithin(place.linear()) || !place.translation().allFinite())
        notes.add("nodes scaled beyond 1e15 are left out, with all below them (scale them and all above them less)",
                  node);
    else if (!isWithin(place.translation()))
        notes.add("nodes beyond 1e15 m are left out, with all below them (move them within 1e15 m)", node);
    else
        return true;
    return false;
}

Affine3d Selection::parent_T_node(const SelectedNode& node) const {
    if (node.parent == SelectedNode::kNone) return node.world_T_node;
    const NodePose pose = node.core && node.core.info().pose ? node.core.info().pose(node.core.data()) : NodePose();
    if (!pose.absolute) return pose.matrix;
    return nodes[node.parent].world_T_node.inverse(Eigen::Affine) * node.world_T_node;
}

Expected<Selection> selectNodes(const Aspect& scene, const std::string& under, ExportNotes& notes) {
    std::vector<ObjectId> way;
    if (!under.empty()) {
        const Expected<ObjectId> top = findNode(scene, under);
        if (!top) return tl::unexpected(top.error());
        for (ObjectId id = *top; id && id != kRootNode; id = scene.get<Node>(id)->parent) way.push_back(id);
        std::ranges::reverse(way);
    }
    return Selector(scene, notes).run(std::move(way));
}

}  // namespace tessera
