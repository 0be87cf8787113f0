#include "common/rays/IntersectAction.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "common/cores/Switch.h"
#include "common/drawable/Drawable.h"
#include "common/geometry/Points.h"
#include "common/rays/HitDetails.h"
#include "common/rays/PickTree.h"
#include "common/rays/RayTree.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"
#include "common/scene/Search.h"

namespace tessera {

namespace {

template <typename Value>
std::span<const Value> valuesOf(const Blob& blob) {
    return {reinterpret_cast<const Value*>(blob.bytes().data()), blob.sizeBytes() / sizeof(Value)};
}

/// Null where it has nothing that a ray could meet.
std::shared_ptr<const RayTree> treeOf(const MeshArrays& arrays) {
    if (!checkMesh(arrays)) return nullptr;
    Expected<RayTree> tree = fail(ErrorCode::kFailed, "");
    if (arrays.kind == MeshKind::kPoints) {
        const MeshData balls = trianglesOfPoints(arrays);
        tree = RayTree::build(balls.positions, balls.indices);
    } else if (arrays.indices.sizeBytes() > 0) {
        tree = RayTree::build(valuesOf<float>(arrays.positions), valuesOf<std::uint32_t>(arrays.indices));
    }
    if (!tree || tree->faceCount() == 0) return nullptr;
    return std::make_shared<const RayTree>(std::move(*tree));
}

}  // namespace

struct IntersectAction::Impl {
    /// One mesh, however many show it.
    struct SharedMesh {
        std::size_t uses = 0;
        bool made = false;
        std::shared_ptr<const RayTree> tree;  ///< null as long as it is not made, and where nothing can be met
    };
    /// One node that shows a drawable.
    struct Shown {
        ObjectId node, core;
        Affine3d world = Affine3d::Identity();
        MeshKey key;
    };

    PickTree places;
    std::vector<Shown> shown;  ///< by item of `places`
    std::vector<std::uint32_t> unused;
    std::unordered_map<ObjectId, std::uint32_t> itemOf;  ///< by node
    struct Known {
        ObjectId core, parent;
    };
    std::unordered_map<ObjectId, Known> known;                           ///< all nodes below the root
    std::unordered_map<ObjectId, std::unordered_set<ObjectId>> holders;  ///< by core
    std::unordered_map<MeshKey, SharedMesh, MeshKeyHash> meshes;
    Work work;

    void takeItem(ObjectId node) {
        const auto found = itemOf.find(node);
        if (found == itemOf.end()) return;
        const std::uint32_t item = found->second;
        places.take(item);
        const auto mesh = meshes.find(shown[item].key);
        if (--mesh->second.uses == 0) meshes.erase(mesh);
        unused.push_back(item);
        itemOf.erase(found);
    }
    void forget(ObjectId node) {
        takeItem(node);
        const auto before = known.find(node);
        if (before == known.end()) return;
        if (const auto held = holders.find(before->second.core); held != holders.end()) {
            held->second.erase(node);
            if (held->second.empty()) holders.erase(held);
        }
        known.erase(before);
    }
    void putItem(const Aspect& aspect, const Visit& visit) {
        const Drawable drawable = drawableOf(visit.core);
        if (!drawable || !visit.world_T_node.matrix().allFinite() || isFlattened(visit.world_T_node)) return;
        const MeshArrays arrays = drawable.arrays();
        if (triangleCount(arrays) == 0) return;
        const Box bounds = shownBounds(arrays);
        const Box box = bounds.empty() ? Box() : bounds.transformed(visit.world_T_node);
        if (box.empty() || !box.lower.allFinite() || !box.upper.allFinite()) return;
        std::uint32_t item = static_cast<std::uint32_t>(shown.size());
        if (unused.empty()) {
            shown.emplace_back();
        } else {
            item = unused.back();
            unused.pop_back();
        }
        const Node& node = *aspect.get<Node>(visit.nodeId);
        shown[item] = {visit.nodeId, node.core, visit.world_T_node, keyOf(arrays)};
        ++meshes[shown[item].key].uses;
        itemOf[visit.nodeId] = item;
        places.put(item, box);
    }
    /// A node and all below it, whatever was known of them.
    void lookBelow(const Aspect& aspect, ObjectId top) {
        Action every;
        every.visitHidden(true);
        every.onNode([&](const Visit& visit) {
            ++work.nodesLookedAt;
            forget(visit.nodeId);
            return Descend::kInto;
        });
        every.run(aspect, top);
        ObjectId highest = top;
        while (const ObjectId parent = aspect.get<Node>(highest)->parent) highest = parent;
        if (highest != kRootNode) return;  // it is nowhere
        Action held;
        held.visitHidden(true);
        held.onNode([&](const Visit& visit) {
            known[visit.nodeId] = {visit.node.core, visit.node.parent};
            if (visit.node.core) holders[visit.node.core].insert(visit.nodeId);
            return Descend::kInto;
        });
        held.run(aspect, top);
        if (!isShown(aspect, top)) return;
        Action seen;
        seen.onNode([&](const Visit& visit) {
            putItem(aspect, visit);
            return Descend::kInto;
        });
        seen.run(aspect, top);
    }

    [[nodiscard]] const RayTree* tree(const Aspect& aspect, const Shown& at) {
        SharedMesh& mesh = meshes.at(at.key);
        if (!mesh.made) {
            mesh.made = true;
            ++work.treesMade;
            mesh.tree = treeOf(drawableOf(aspect, at.core).arrays());
        }
        return mesh.tree.get();
    }
    /// visit(shown, its tree, the ray in its own coordinates), nearest boxes first, as long as they begin before
    /// `limit`. t is the same there: the map is affine.
    template <typename Visitor>
    void forNear(const Aspect& aspect, const Ray& ray, const double& limit, const Visitor& visit) {
        const auto wanted = [&](const Box& box) { return meetsBox(box, ray, limit); };
        const auto nearness = [&](const Box& box) { return (box.center() - ray.origin).dot(ray.direction); };
        places.forItems(wanted, nearness, [&](std::uint32_t item) {
            const Shown& at = shown[item];
            const Affine3d local = at.world.inverse();
            if (!local.matrix().allFinite()) return;
            if (const RayTree* mesh = tree(aspect, at))
                visit(at, *mesh, Ray{local * ray.origin, local.linear() * ray.direction});
        });
    }
    [[nodiscard]] Intersection intersectionOf(const Aspect& aspect, const Ray& ray, const Shown& at,
                                              const TriangleHit& hit) const {
        Intersection out{.t = hit.t, .node = at.node, .face = hit.face, .point = ray.origin + hit.t * ray.direction};
        const std::optional<HitDetails> details =
            detailsOf(drawableOf(aspect, at.core).arrays(), at.world, hit.face, out.point);
        if (!details) return out;
        out.normal = details->normal;
        out.weights = {hit.weights[0], hit.weights[1], hit.weights[2]};
        out.texcoord = details->texcoord;
        return out;
    }
};

namespace {

Expected<void> checkRay(const Ray& ray, double maxT) {
    if (!ray.origin.allFinite() || !ray.direction.allFinite())
        return fail(ErrorCode::kUsage, "a ray whose numbers are not finite");
    if (ray.direction.isZero(0)) return fail(ErrorCode::kUsage, "a ray without a direction");
    if (!(maxT >= 0)) return fail(ErrorCode::kUsage, "a ray that ends before it begins");
    return {};
}

}  // namespace

IntersectAction::IntersectAction() : impl_(std::make_unique<Impl>()) {}
IntersectAction::~IntersectAction() = default;
IntersectAction::IntersectAction(IntersectAction&&) noexcept = default;
IntersectAction& IntersectAction::operator=(IntersectAction&&) noexcept = default;

void IntersectAction::lookAnew(const Aspect& aspect) {
    const Work before = impl_->work;
    impl_ = std::make_unique<Impl>();
    impl_->work = before;
    impl_->lookBelow(aspect, kRootNode);
}

void IntersectAction::follow(const Aspect& aspect, const ChangeList& list) {
    constexpr Effect kWhatCounts = Effect::kStructure | Effect::kVisibility | Effect::kPose | Effect::kShape;
    std::unordered_set<ObjectId> changed;
    const auto addHolders = [&](ObjectId core) {
        const auto held = impl_->holders.find(core);
        if (held != impl_->holders.end()) changed.insert(held->second.begin(), held->second.end());
    };
    // A Switch shows children by their place: whoever comes or goes may change which.
    const auto addSwitch = [&](ObjectId parent) {
        const Node* node = parent ? aspect.get<Node>(parent) : nullptr;
        if (node && aspect.coreOf<Switch>(*node)) changed.insert(parent);
    };
    for (const Placement& placement : list.placements) {
        changed.insert(placement.node);
        addSwitch(placement.parent);
        if (const auto before = impl_->known.find(placement.node); before != impl_->known.end())
            addSwitch(before->second.parent);
    }
    for (const FieldColumn& column : list.columns) {
        if (!(effectsOf(column) & kWhatCounts)) continue;
        for (const ObjectId id : column.ids)
            if (column.type == typeOf<Node>())
                changed.insert(id);
            else
                addHolders(id);
    }
    for (const RangeEdit& range : list.ranges) addHolders(range.object);
    for (const ObjectId id : list.destructions) impl_->forget(id);
    // What stands below another one that is looked at is looked at with it.
    for (const ObjectId id : changed) {
        const Node* node = aspect.get<Node>(id);
        if (!node) continue;
        bool below = false;
        for (ObjectId above = node->parent; above && !below; above = aspect.get<Node>(above)->parent)
            below = changed.contains(above);
        if (!below) impl_->lookBelow(aspect, id);
    }
}

Expected<std::optional<Intersection>> IntersectAction::nearest(const Aspect& aspect, const Ray& ray, double maxT) {
    if (const Expected<void> good = checkRay(ray, maxT); !good) return tl::unexpected(good.error());
    double limit = maxT;
    const Impl::Shown* best = nullptr;
    TriangleHit bestHit;
    impl_->forNear(aspect, ray, limit, [&](const Impl::Shown& at, const RayTree& tree, const Ray& local) {
        const std::optional<TriangleHit> hit = tree.nearest(local, limit);
        if (!hit || (best && (hit->t > bestHit.t || (hit->t == bestHit.t && best->node.value < at.node.value)))) return;
        best = &at;
        bestHit = *hit;
        limit = hit->t;
    });
    if (!best) return std::optional<Intersection>();
    return std::optional<Intersection>(impl_->intersectionOf(aspect, ray, *best, bestHit));
}

Expected<bool> IntersectAction::any(const Aspect& aspect, const Ray& ray, double maxT) {
    if (const Expected<void> good = checkRay(ray, maxT); !good) return tl::unexpected(good.error());
    double limit = maxT;  // below 0 once one is found: no box is wanted then
    impl_->forNear(aspect, ray, limit, [&](const Impl::Shown&, const RayTree& tree, const Ray& local) {
        if (limit >= 0 && tree.any(local, limit)) limit = -1;
    });
    return limit < 0;
}

Expected<std::vector<Intersection>> IntersectAction::all(const Aspect& aspect, const Ray& ray, double maxT,
                                                         std::size_t most) {
    if (const Expected<void> good = checkRay(ray, maxT); !good) return tl::unexpected(good.error());
    struct Found {
        const Impl::Shown* at;
        TriangleHit hit;
    };
    const auto before = [](const Found& a, const Found& b) {
        if (a.hit.t != b.hit.t) return a.hit.t < b.hit.t;
        return a.at->node != b.at->node ? a.at->node.value < b.at->node.value : a.hit.face < b.hit.face;
    };
    std::vector<Found> found;
    double limit = maxT;
    if (most > 0)
        impl_->forNear(aspect, ray, limit, [&](const Impl::Shown& at, const RayTree& tree, const Ray& local) {
            for (const TriangleHit& hit : tree.all(local, limit, most)) found.push_back({&at, hit});
            if (found.size() <= most) return;
            std::ranges::sort(found, before);
            found.resize(most);
            limit = found.back().hit.t;
        });
    std::ranges::sort(found, before);
    std::vector<Intersection> out;
    out.reserve(found.size());
    for (const Found& one : found) out.push_back(impl_->intersectionOf(aspect, ray, *one.at, one.hit));
    return out;
}

const IntersectAction::Work& IntersectAction::work() const {
    return impl_->work;
}

}  // namespace tessera
