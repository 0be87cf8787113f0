#include "common/rays/BoundsAction.h"

#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "common/cores/InverseTransform.h"
#include "common/drawable/Drawable.h"
#include "common/drawable/VolumeShapes.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"
#include "common/scene/SideTable.h"

namespace tessera {
namespace {

constexpr double kBeyond = std::numeric_limits<double>::infinity();
Box everywhere() {
    return {Vec3d::Constant(-kBeyond), Vec3d::Constant(kBeyond)};
}
bool isEverywhere(const Box& box) {
    return !box.empty() && !(box.lower.allFinite() && box.upper.allFinite());
}
bool sameBox(const Box& a, const Box& b) {
    return (a.empty() && b.empty()) || (a.lower == b.lower && a.upper == b.upper);
}

/// As Box::transformed, and as much larger as any order of the same sums may differ by: a product of three numbers and
/// a sum of four, here and where the vertices are placed.
Box movedOutwards(const Box& box, const Affine3d& map) {
    if (box.empty()) return {};
    if (isEverywhere(box)) return everywhere();
    constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
    Box moved = box.transformed(map);
    const Vec3d farthest = box.lower.cwiseAbs().cwiseMax(box.upper.cwiseAbs());
    const Vec3d slack = kRounding * (map.linear().cwiseAbs() * farthest + map.translation().cwiseAbs());
    moved.lower -= slack;
    moved.upper += slack;
    return moved.lower.allFinite() && moved.upper.allFinite() ? moved : everywhere();
}

/// Around whatever a box becomes by turns about its origin.
Box turnedAnyWay(const Box& box) {
    if (box.empty()) return {};
    if (isEverywhere(box)) return everywhere();
    const double radius =
        box.lower.cwiseAbs().cwiseMax(box.upper.cwiseAbs()).norm() * (1 + 16 * std::numeric_limits<double>::epsilon());
    return std::isfinite(radius) ? Box{Vec3d::Constant(-radius), Vec3d::Constant(radius)} : everywhere();
}

/// The box around boxes of which one changes at a time: a tournament.
class Union {
public:
    [[nodiscard]] Box box() const { return tree_.size() > 1 ? tree_[1] : Box(); }
    [[nodiscard]] std::uint32_t add() {
        if (used_ == leaves()) grow();
        return used_++;
    }
    /// The last place takes this one's number; whoever had it moves.
    [[nodiscard]] std::uint32_t removeBySwap(std::uint32_t place, std::uint64_t& work) {
        const std::uint32_t last = --used_;
        if (last != place) put(place, tree_[leaves() + last], work);
        put(last, {}, work);
        return last;
    }
    void put(std::uint32_t place, const Box& box, std::uint64_t& work) {
        std::size_t at = leaves() + place;
        tree_[at] = box;
        ++work;
        while ((at /= 2) >= 1) {
            Box both = tree_[2 * at];
            both.extend(tree_[2 * at + 1]);
            ++work;
            if (sameBox(both, tree_[at])) return;
            tree_[at] = both;
        }
    }

private:
    [[nodiscard]] std::uint32_t leaves() const { return static_cast<std::uint32_t>(tree_.size() / 2); }
    void grow() {
        const std::uint32_t before = leaves(), now = before == 0 ? 1 : 2 * before;
        std::vector<Box> tree(2 * std::size_t{now});
        for (std::uint32_t i = 0; i < used_; ++i) tree[now + i] = tree_[before + i];
        for (std::size_t at = now; --at >= 1;) {
            tree[at] = tree[2 * at];
            tree[at].extend(tree[2 * at + 1]);
        }
        tree_ = std::move(tree);
    }
    std::vector<Box> tree_;  ///< the root is 1, the leaves are the second half
    std::uint32_t used_ = 0;
};

struct Bounded {
    ObjectId core, parent;
    std::uint32_t place = 0;  ///< in the parent's union
    Box box;                  ///< of all, in the coordinates of what is below
    Union below;
    std::vector<ObjectId> children;  ///< by place
};

/// As large as anything that a screen makes of it.
Box boundsAtAnyFineness(const Drawable& drawable) {
    Box box = drawable.bounds();
    if (box.empty() || !drawable.byScreen()) return box;
    // Triangles of 0 steps are so far from the surface at most, and finer ones no farther on their side.
    // Their vertices are rounded to floats.
    const double rounding =
        box.lower.cwiseAbs().cwiseMax(box.upper.cwiseAbs()).maxCoeff() * std::numeric_limits<float>::epsilon();
    const double off = 2 * drawable.deviation() + 2 * rounding;
    box.lower -= Vec3d::Constant(off);
    box.upper += Vec3d::Constant(off);
    return box;
}

}  // namespace

struct BoundsAction::Impl {
    SideTable<Bounded> nodes{{.created =
                                  [](ObjectId, const Object& object) {
                                      return object.is<Node>() ? std::optional<Bounded>(Bounded()) : std::nullopt;
                                  },
                              .destroyed = [this](ObjectId id, Bounded last) { forget(id, last); }}};
    std::unordered_map<ObjectId, std::set<ObjectId>> bearers;  ///< of every core that a node bears
    std::unordered_map<ObjectId, Box> drawn;                   ///< of drawable cores
    std::set<ObjectId> inverse;                                ///< nodes that stand in the world
    std::unordered_set<ObjectId> stale;  ///< their box, and with it where it lies in their parent's
    Work work;

    void forget(ObjectId id, const Bounded& last) {
        leave(id, last);
        if (const auto core = bearers.find(last.core); core != bearers.end()) {
            core->second.erase(id);
            if (core->second.empty()) bearers.erase(core);
        }
        inverse.erase(id);
        stale.erase(id);
    }
    void leave(ObjectId id, const Bounded& child) {
        Bounded* parent = child.parent ? nodes.find(child.parent) : nullptr;
        if (!parent || child.place >= parent->children.size() || parent->children[child.place] != id) return;
        const std::uint32_t last = parent->below.removeBySwap(child.place, work.boxes);
        const ObjectId moved = parent->children[last];
        parent->children[child.place] = moved;
        parent->children.pop_back();
        if (moved != id) nodes.find(moved)->place = child.place;
        stale.insert(child.parent);
    }
    void place(const Aspect& aspect, ObjectId id) {
        Bounded* child = nodes.find(id);
        if (!child) return;
        const ObjectId parent = aspect.get<Node>(id)->parent;
        if (child->parent == parent) return;
        leave(id, *child);
        child->parent = parent;
        stale.insert(id);
        Bounded* holder = parent ? nodes.find(parent) : nullptr;
        if (!holder) return;
        child->place = holder->below.add();
        holder->children.push_back(id);
    }
    void bear(const Aspect& aspect, ObjectId id) {
        Bounded* node = nodes.find(id);
        if (!node) return;
        const ObjectId core = aspect.get<Node>(id)->core;
        stale.insert(id);
        inverse.erase(id);
        if (core != node->core) {
            if (const auto old = bearers.find(node->core); old != bearers.end()) {
                old->second.erase(id);
                if (old->second.empty()) bearers.erase(old), drawn.erase(node->core);
            }
            node->core = core;
            if (core) bearers[core].insert(id);
        }
        if (core && aspect.find(core).is<InverseTransform>()) inverse.insert(id);
    }
    void touched(ObjectId core) {
        const auto nodesOfCore = bearers.find(core);
        if (nodesOfCore != bearers.end()) stale.insert(nodesOfCore->second.begin(), nodesOfCore->second.end());
    }
    [[nodiscard]] const Box& drawnBox(const Aspect& aspect, ObjectId core) {
        const auto [known, isNew] = drawn.try_emplace(core);
        if (isNew)
            if (const Drawable drawable = drawableOf(aspect, core)) {
                ++work.meshes;
                known->second = boundsAtAnyFineness(drawable);
                known->second.extend(boxOnScreens(aspect, core));
            }
        return known->second;
    }
    /// A node's box as its parent has it.
    [[nodiscard]] static Box inParent(const Aspect& aspect, ObjectId id, const Box& box) {
        const Node& node = *aspect.get<Node>(id);
        if (aspect.coreOf<InverseTransform>(node)) {
            const Affine3d world_T_parent = node.parent ? worldTransform(aspect, node.parent) : Affine3d::Identity();
            const Affine3d parent_T_world = world_T_parent.inverse();
            if (box.empty()) return box;
            if (!parent_T_world.matrix().allFinite()) return everywhere();
            // An inverse is off by as much as the map is uneven.
            const double condition = world_T_parent.linear().norm() * parent_T_world.linear().norm();
            Box moved = movedOutwards(box, parent_T_world);
            const double slack = 64 * std::numeric_limits<double>::epsilon() * condition *
                                 (moved.lower.cwiseAbs().cwiseMax(moved.upper.cwiseAbs()).maxCoeff() +
                                  parent_T_world.translation().cwiseAbs().maxCoeff());
            moved.lower -= Vec3d::Constant(slack);
            moved.upper += Vec3d::Constant(slack);
            return std::isfinite(slack) ? moved : everywhere();
        }
        return movedOutwards(box, placeNode(aspect, node, Affine3d::Identity()));
    }
    [[nodiscard]] std::size_t depthOf(ObjectId id) const {
        std::size_t depth = 0;
        for (const Bounded* node = nodes.find(id); node && node->parent; node = nodes.find(node->parent)) ++depth;
        return depth;
    }
    /// From the deepest up, as far as anything changes.
    void settle(const Aspect& aspect) {
        std::map<std::size_t, std::unordered_set<ObjectId>, std::greater<>> open;
        for (const ObjectId id : stale)
            if (nodes.find(id)) open[depthOf(id)].insert(id);
        stale.clear();
        while (!open.empty()) {
            const auto [depth, level] = *open.begin();
            open.erase(open.begin());
            for (const ObjectId id : level) {
                Bounded& node = *nodes.find(id);
                Box box = node.below.box();
                if (node.core) box.extend(drawnBox(aspect, node.core));
                if (node.core && aspect.find(node.core).is<Billboard>()) box = turnedAnyWay(box);
                ++work.boxes;
                node.box = box;
                Bounded* parent = node.parent ? nodes.find(node.parent) : nullptr;
                if (!parent) continue;
                const Box before = parent->below.box();
                parent->below.put(node.place, inParent(aspect, id, box), work.boxes);
                if (!sameBox(before, parent->below.box())) open[depth - 1].insert(node.parent);
            }
        }
    }
};

BoundsAction::BoundsAction() : impl_(std::make_unique<Impl>()) {}
BoundsAction::~BoundsAction() = default;
BoundsAction::BoundsAction(BoundsAction&&) noexcept = default;
BoundsAction& BoundsAction::operator=(BoundsAction&&) noexcept = default;

void BoundsAction::lookAnew(const Aspect& aspect) {
    const Work work = impl_->work;
    impl_ = std::make_unique<Impl>();
    impl_->work = work;
    impl_->nodes.lookAnew(aspect);
    for (const ObjectId id : aspect.ids())
        if (aspect.get<Node>(id)) impl_->bear(aspect, id), impl_->place(aspect, id);
    impl_->settle(aspect);
}

void BoundsAction::follow(const Aspect& aspect, const ChangeList& list) {
    Impl& impl = *impl_;
    bool moves = !list.placements.empty();
    for (const FieldColumn& column : list.columns) {
        const Effect effects = effectsOf(column);
        // A node that bears another core may stand elsewhere.
        moves = moves || effects & (Effect::kPose | Effect::kStructure);
        if (!(effects & (Effect::kPose | Effect::kShape))) continue;
        for (const ObjectId id : column.ids) {
            if (effects & Effect::kShape) impl.drawn.erase(id);
            impl.touched(id);
        }
    }
    for (const RangeEdit& range : list.ranges) {
        if (!(effectsOf(range.type, range.field) & Effect::kShape)) continue;
        impl.drawn.erase(range.object);
        impl.touched(range.object);
    }
    for (const ObjectId id : list.destructions) impl.drawn.erase(id);
    impl.nodes.follow(aspect, list);
    for (const Creation& creation : list.creations)
        if (creation.type == typeOf<Node>() && aspect.get<Node>(creation.id))
            impl.bear(aspect, creation.id), impl.place(aspect, creation.id);
    for (const FieldColumn& column : list.columns)
        if (column.type == typeOf<Node>() && column.field == fieldId<&Node::core>)
            for (const ObjectId id : column.ids) impl.bear(aspect, id);
    for (const Placement& placement : list.placements) impl.place(aspect, placement.node);
    if (moves) impl.stale.insert(impl.inverse.begin(), impl.inverse.end());
    impl.settle(aspect);
}

Box BoundsAction::box(ObjectId node) const {
    const Bounded* known = impl_->nodes.find(node);
    return known ? known->box : Box();
}

Sphere BoundsAction::sphere(ObjectId node) const {
    const Box around = box(node);
    if (around.empty()) return {};
    if (isEverywhere(around)) return {.center = Vec3d::Zero(), .radius = kBeyond};
    const Vec3d center = around.center();
    const Vec3d half = (around.upper - center).cwiseMax(center - around.lower);
    return {.center = center, .radius = half.norm() * (1 + 8 * std::numeric_limits<double>::epsilon())};
}

Box BoundsAction::worldBox(const Aspect& aspect, ObjectId node) const {
    if (!aspect.get<Node>(node)) return {};
    return movedOutwards(box(node), worldTransform(aspect, node));
}

const BoundsAction::Work& BoundsAction::work() const {
    return impl_->work;
}

}  // namespace tessera
