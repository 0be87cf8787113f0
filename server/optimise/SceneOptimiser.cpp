#include "server/optimise/SceneOptimiser.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "common/cores/CollisionObject.h"
#include "common/cores/DistanceLOD.h"
#include "common/cores/Interest.h"
#include "common/cores/Material.h"
#include "common/cores/SurfaceParts.h"
#include "common/cores/Transform.h"
#include "common/drawable/Drawable.h"
#include "server/optimise/EqualObjects.h"
#include "server/optimise/MeshOrder.h"

namespace tessera {
namespace {

/// Who is named by whom, but for the plain ways from nodes to cores, materials and images.
class NamedObjects {
public:
    explicit NamedObjects(const Aspect& scene) {
        for (const ObjectId id : scene.ids()) {
            const Object object = scene.find(id);
            if (const Node* node = object.as<Node>()) {
                if (node->core) ++uses_[node->core];
                continue;
            }
            forEachRef(object, [&](ObjectId to) {
                if (const Object target = scene.find(to);
                    target && (target.is<Node>() || target.info().isCore || isDriving(object)))
                    named_.insert(to);
            });
        }
    }
    [[nodiscard]] bool contains(ObjectId id) const { return named_.contains(id); }
    /// Nodes with this core.
    [[nodiscard]] std::size_t uses(ObjectId core) const {
        const auto found = uses_.find(core);
        return found == uses_.end() ? 0 : found->second;
    }

private:
    /// Its references may lead to anything, whose fields it writes.
    static bool isDriving(const Object& object) { return object.is<KeyFrames>() || object.is<Movie>(); }
    std::unordered_set<ObjectId> named_;
    std::unordered_map<ObjectId, std::size_t> uses_;
};

bool isSoundMesh(const Geometry& mesh) {
    return mesh.primitive == Geometry::kTriangles && !mesh.indices.empty() && mesh.positions.resident() &&
           drawableOf(Object::of(mesh)).resident() && drawableOf(Object::of(mesh)).check();
}

/// Its look depends on the coordinates or the size of what bears it.
bool looksByNode(const Aspect& scene, ObjectId id) {
    const Material* material = id ? scene.get<Material>(id) : nullptr;
    if (!material) return false;
    for (const ObjectId layer : material->layers)
        if (const TextureLayer* image = scene.get<TextureLayer>(layer);
            image && image->source == TextureLayer::kPosition)
            return true;
    for (const ObjectId pass : material->passes)
        if (looksByNode(scene, pass)) return true;
    return material->program || material->coarser;
}

/// A mesh at one place that nothing moves against the node that stays above it.
struct StaticMesh {
    ObjectId node, core;
    Affine3d top_T_mesh;
    std::size_t transforms = 0;  ///< between the two
    bool alone = true;           ///< nothing else hangs below what is between
};

/// Translation, rotation and scales, where the map has no shear.
std::optional<Transform> transformOf(const Affine3d& map) {
    const Eigen::Matrix3d linear = map.linear();
    const Vec3d lengths = linear.colwise().norm();
    if (!(lengths.minCoeff() > 0) || !map.matrix().allFinite()) return std::nullopt;
    Eigen::Matrix3d turn = linear * lengths.cwiseInverse().asDiagonal();
    if ((turn.transpose() * turn - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > 1e-12) return std::nullopt;
    Transform transform;
    transform.scale = lengths;
    if (turn.determinant() < 0) {
        turn.col(0) *= -1;
        transform.scale.x() *= -1;
    }
    transform.rotation = Quatd(turn).normalized();
    transform.translation = map.translation();
    return transform;
}

/// Of the diagonal of what stands together: a box that is wider and higher than that may hide much.
constexpr double kOccluderShare = 1.0 / 16;

/// Turns and scales in all directions alike.
bool keepsAngles(const Eigen::Matrix3d& linear) {
    const Eigen::Matrix3d squares = linear.transpose() * linear;
    const double square = squares.trace() / 3;
    return (squares - square * Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= 1e-6 * square;
}

class StaticMerging {
public:
    StaticMerging(const Aspect& scene, const OptimiseOptions& options, const std::vector<ObjectId>& keep,
                  OptimiseCounts& counts)
        : scene_(scene), options_(options), counts_(counts), named_(scene), nextId_(scene.nextFreeId()) {
        for (const ObjectId node : keep) frozen_.insert(node);
        for (const ObjectId id : scene.ids()) {
            const CollisionObject* object = scene.get<CollisionObject>(id);
            if (object && object->node &&
                (object->division != CollisionObject::kWhole || object->shape != CollisionObject::kTriangles))
                frozen_.insert(object->node);
            // What of each mesh runs into itself is another question of one mesh made of several.
            if (const Interest* interest = scene.get<Interest>(id);
                interest && interest->mode == Interest::kSelf && interest->object)
                frozen_.insert(interest->object);
        }
    }

    ChangeList run() {
        (void)stays(kRootNode, false);
        for (const ObjectId top : tops_) mergeBelow(top);
        for (const ObjectId node : gone_) {
            list_.detach(node);
            list_.destroy(node);
        }
        return list_.take();
    }

private:
    static constexpr std::size_t kDeepest = 256;

    [[nodiscard]] bool isPlain(const Node& node) const {
        if (node.levels != 0) return false;
        if (!node.core) return true;
        const Object core = scene_.find(node.core);
        if (core.is<Group>() || core.is<Transform>() || core.is<ComponentTransform>()) return true;
        const Geometry* mesh = core.as<Geometry>();
        return mesh && isSoundMesh(*mesh);
    }

    /// Whether a node stays; what does and has others below that do not is a top. Depth is bounded by the scene's.
    bool stays(ObjectId id, bool chosen) {
        const Node& node = *scene_.get<Node>(id);
        if (frozen_.contains(id)) return true;
        const Object core = node.core ? scene_.find(node.core) : Object();
        const bool chooses = core && (core.is<Switch>() || core.is<DistanceLOD>());
        bool any = id == kRootNode || chosen || named_.contains(id) || (node.core && named_.contains(node.core)) ||
                   !isPlain(node);
        std::vector<ObjectId> going;
        for (const ObjectId child : node.children) {
            if (stays(child, chooses))
                any = true;
            else
                going.push_back(child);
        }
        if (!any) return false;
        if (!going.empty()) tops_.push_back(id);
        going_.insert(going.begin(), going.end());
        return true;
    }

    void collect(ObjectId id, const Affine3d& top_T_parent, std::size_t transforms, bool alone,
                 std::vector<StaticMesh>& to) {
        const Node& node = *scene_.get<Node>(id);
        const Object core = node.core ? scene_.find(node.core) : Object();
        Affine3d top_T_node = top_T_parent;
        if (core && core.info().place) {
            core.info().place(core.data(), top_T_parent, top_T_node);
            ++transforms;
        }
        if (core.is<Geometry>()) to.push_back({id, node.core, top_T_node, transforms, alone});
        for (const ObjectId child : node.children)
            collect(child, top_T_node, transforms, alone && node.children.size() == 1, to);
    }

    void mergeBelow(ObjectId top) {
        std::vector<StaticMesh> meshes;
        std::vector<ObjectId> roots;
        for (const ObjectId child : scene_.get<Node>(top)->children)
            if (going_.contains(child)) {
                roots.push_back(child);
                collect(child, Affine3d::Identity(), 0, true, meshes);
            }
        std::unordered_set<ObjectId> leaving;  // nodes of meshes that are elsewhere now
        if (options_.merge) mergeLike(top, meshes, leaving);
        if (options_.flatten)
            for (const StaticMesh& mesh : meshes)
                if (!leaving.contains(mesh.node) && mesh.transforms > 1 && mesh.alone &&
                    scene_.get<Node>(mesh.node)->children.empty())
                    flatten(top, mesh, leaving);
        for (const ObjectId root : roots) (void)prune(root, leaving);
    }

    [[nodiscard]] Box boxAtTop(const StaticMesh& mesh) const {
        return boundsOf(scene_.get<Geometry>(mesh.core)->positions.as<float>()).transformed(mesh.top_T_mesh);
    }

    /// Walls and floors: as a part of a mesh that reaches elsewhere they would hide little from a culler that draws the
    /// best occluders first.
    [[nodiscard]] static bool hidesMuch(const Box& box, double sceneDiagonal) {
        Vec3d size = box.size();
        std::sort(size.begin(), size.end());
        return size[1] >= kOccluderShare * sceneDiagonal;
    }

    /// By material and by which arrays there are.
    void mergeLike(ObjectId top, const std::vector<StaticMesh>& meshes, std::unordered_set<ObjectId>& leaving) {
        Box all;
        for (const StaticMesh& mesh : meshes) all.extend(boxAtTop(mesh));
        const double diagonal = all.size().norm();
        std::map<std::tuple<ObjectId, bool, bool, bool, bool, bool>, std::vector<const StaticMesh*>> like;
        for (const StaticMesh& mesh : meshes) {
            const Geometry& g = *scene_.get<Geometry>(mesh.core);
            const double flat = mesh.top_T_mesh.linear().determinant();
            if (!std::isfinite(flat) || flat == 0 || !mesh.top_T_mesh.matrix().allFinite() ||
                looksByNode(scene_, g.material))
                continue;
            if (hidesMuch(boxAtTop(mesh), diagonal)) continue;
            // Renderers weigh normals between corners by lengths that uneven scales give them, and a mesh has none to
            // keep them in.
            if (!g.normals.empty() && !keepsAngles(mesh.top_T_mesh.linear())) continue;
            // Large meshes that stand in many places stay one mesh in many places.
            if (triangles(g) * std::max<std::size_t>(1, named_.uses(mesh.core)) > options_.mostMergedTriangles)
                continue;
            like[{g.material, g.normals.empty(), g.colors.empty(), g.texcoords.empty(), g.texcoords1.empty(),
                  g.tangents.empty()}]
                .push_back(&mesh);
        }
        for (auto& [look, places] : like) {
            sortByPlace(places);
            for (std::size_t first = 0; first < places.size();) {
                std::size_t end = first, count = 0;
                for (; end < places.size(); ++end) {
                    const std::size_t more = triangles(*scene_.get<Geometry>(places[end]->core));
                    if (end > first && count + more > options_.mostMergedTriangles) break;
                    count += more;
                }
                if (end - first > 1) mergeInto(top, std::span(places).subspan(first, end - first), leaving);
                first = end;
            }
        }
    }

    [[nodiscard]] static std::size_t triangles(const Geometry& g) { return g.indices.sizeBytes() / 12; }

    /// Neighbours follow each other (a Morton order), so that what becomes one mesh lies together.
    void sortByPlace(std::vector<const StaticMesh*>& places) const {
        Box all;
        std::vector<std::pair<std::uint64_t, const StaticMesh*>> keyed;
        std::vector<Vec3d> centers;
        for (const StaticMesh* place : places) {
            centers.push_back(place->top_T_mesh *
                              boundsOf(scene_.get<Geometry>(place->core)->positions.as<float>()).center());
            all.extend(centers.back());
        }
        const Vec3d size = all.size().cwiseMax(1e-300);
        for (std::size_t i = 0; i < places.size(); ++i) {
            std::uint64_t key = 0;
            const Vec3d at = (centers[i] - all.lower).cwiseQuotient(size) * 1023.0;
            for (int bit = 9; bit >= 0; --bit)
                for (int axis = 0; axis < 3; ++axis)
                    key = key * 2 + (static_cast<std::uint64_t>(std::clamp(at[axis], 0.0, 1023.0)) >> bit & 1);
            keyed.emplace_back(key, places[i]);
        }
        std::ranges::stable_sort(keyed, {}, &std::pair<std::uint64_t, const StaticMesh*>::first);
        for (std::size_t i = 0; i < places.size(); ++i) places[i] = keyed[i].second;
    }

    void mergeInto(ObjectId top, std::span<const StaticMesh* const> places, std::unordered_set<ObjectId>& leaving) {
        std::vector<float> positions, normals, tangents;
        std::vector<std::byte> colors, texcoords, texcoords1;
        std::vector<std::uint32_t> indices;
        const auto add = [](std::vector<std::byte>& to, const Blob& from) {
            to.insert(to.end(), from.bytes().begin(), from.bytes().end());
        };
        for (const StaticMesh* place : places) {
            const Geometry& g = *scene_.get<Geometry>(place->core);
            const auto base = static_cast<std::uint32_t>(positions.size() / 3);
            const std::span<const float> at = g.positions.as<float>(), along = g.normals.as<float>();
            const Eigen::Matrix3d turn = place->top_T_mesh.linear().inverse().transpose();
            for (std::size_t i = 0; i < at.size(); i += 3) {
                const Vec3d p = place->top_T_mesh * Vec3d(at[i], at[i + 1], at[i + 2]);
                for (int axis = 0; axis < 3; ++axis) positions.push_back(static_cast<float>(p[axis]));
            }
            for (std::size_t i = 0; i < along.size(); i += 3) {
                const Vec3d n = turn * Vec3d(along[i], along[i + 1], along[i + 2]);
                const double size = n.norm();
                for (int axis = 0; axis < 3; ++axis)
                    normals.push_back(size > 0 ? static_cast<float>(n[axis] / size) : 0.0f);
            }
            const bool mirrored = place->top_T_mesh.linear().determinant() < 0;
            const std::span<const float> towardsU = g.tangents.as<float>();
            for (std::size_t i = 0; i < towardsU.size(); i += 4) {
                const Vec3d t = place->top_T_mesh.linear() * Vec3d(towardsU[i], towardsU[i + 1], towardsU[i + 2]);
                const double size = t.norm();
                for (int axis = 0; axis < 3; ++axis)
                    tangents.push_back(size > 0 ? static_cast<float>(t[axis] / size) : 0.0f);
                tangents.push_back(mirrored ? -towardsU[i + 3] : towardsU[i + 3]);
            }
            add(colors, g.colors);
            add(texcoords, g.texcoords);
            add(texcoords1, g.texcoords1);
            const std::span<const std::uint32_t> corners = g.indices.as<std::uint32_t>();
            for (std::size_t i = 0; i < corners.size(); i += 3)
                for (const std::size_t corner : {i, mirrored ? i + 2 : i + 1, mirrored ? i + 1 : i + 2})
                    indices.push_back(base + corners[corner]);
            leaving.insert(place->node);
        }
        Geometry whole;
        const auto blob = [](const auto& values) {
            return values.empty() ? Blob() : Blob::of(std::span(values.data(), values.size()));
        };
        whole.positions = blob(positions);
        whole.normals = blob(normals);
        whole.tangents = blob(tangents);
        whole.colors = blob(colors);
        whole.texcoords = blob(texcoords);
        whole.texcoords1 = blob(texcoords1);
        whole.indices = blob(indices);
        whole.material = scene_.get<Geometry>(places.front()->core)->material;
        // Coordinates that a float cannot hold would be no mesh; then all stays.
        if (!isSoundMesh(whole)) {
            for (const StaticMesh* place : places) leaving.erase(place->node);
            return;
        }
        if (options_.order) whole = tessera::ordered(whole, true);
        const ObjectId core = create(whole), node = newNode(fmt::format("merged {}", counts_.mergedInto), core);
        list_.place(node, top);
        counts_.merged += places.size();
        ++counts_.mergedInto;
    }

    void flatten(ObjectId top, const StaticMesh& mesh, std::unordered_set<ObjectId>& leaving) {
        const std::optional<Transform> one = transformOf(mesh.top_T_mesh);
        if (!one) return;
        const ObjectId at = newNode(scene_.get<Node>(mesh.node)->name, create(*one));
        list_.place(at, top);
        list_.place(newNode({}, mesh.core), at);
        leaving.insert(mesh.node);
        ++counts_.flattened;
    }

    /// Takes away what has nothing left below it; whether it did.
    bool prune(ObjectId id, const std::unordered_set<ObjectId>& leaving) {
        const Node& node = *scene_.get<Node>(id);
        bool empty = leaving.contains(id) || !(node.core && scene_.find(node.core).is<Geometry>());
        bool anyBelow = false;
        std::vector<ObjectId> below(node.children.begin(), node.children.end());
        const std::size_t before = gone_.size();
        for (const ObjectId child : below) anyBelow = !prune(child, leaving) || anyBelow;
        // Groups that never held anything stay as they are.
        if (gone_.size() == before && !leaving.contains(id)) return false;
        empty = empty && !anyBelow;
        if (empty)
            gone_.push_back(id);
        else if (leaving.contains(id))
            list_.set(id, typeOf<Node>(), fieldId<&Node::core>, ObjectId{});
        return empty;
    }

    template <typename T>
    ObjectId create(const T& value) {
        const ObjectId id{nextId_++};
        list_.create(id, typeOf<T>());
        setAllFields(list_, id, Object::of(value));
        return id;
    }
    ObjectId newNode(std::string name, ObjectId core) {
        const ObjectId id{nextId_++};
        list_.create(id, typeOf<Node>());
        if (!name.empty()) list_.set(id, typeOf<Node>(), fieldId<&Node::name>, std::move(name));
        list_.set(id, typeOf<Node>(), fieldId<&Node::core>, core);
        return id;
    }

    const Aspect& scene_;
    const OptimiseOptions& options_;
    OptimiseCounts& counts_;
    NamedObjects named_;
    std::uint64_t nextId_;
    ChangeListBuilder list_;
    std::unordered_set<ObjectId> frozen_, going_;
    std::vector<ObjectId> tops_, gone_;
};

/// Objects beside the tree that somebody used before, and nobody does now.
Expected<void> dropUnused(Aspect& scene, const std::unordered_set<ObjectId>& usedBefore) {
    for (;;) {
        ChangeListBuilder list;
        for (const ObjectId id : scene.ids())
            if (!scene.find(id).is<Node>() && scene.useCount(id) == 0 && usedBefore.contains(id)) list.destroy(id);
        if (list.empty()) return {};
        if (Expected<void> applied = scene.apply(list.take()); !applied) return applied;
    }
}

Expected<void> orderMeshes(Aspect& scene, OptimiseCounts& counts) {
    const NamedObjects named(scene);
    ChangeListBuilder list;
    for (const ObjectId id : scene.ids()) {
        const Geometry* mesh = scene.get<Geometry>(id);
        if (!mesh || named.contains(id) || !isSoundMesh(*mesh)) continue;
        const Geometry better = ordered(*mesh, false);
        if (better.positions == mesh->positions && better.indices == mesh->indices) continue;
        counts.verticesJoined += (mesh->positions.sizeBytes() - better.positions.sizeBytes()) / 12;
        ++counts.ordered;
        for (const FieldEntry& field : findType(Geometry::kType)->fields)
            if (field.kind == FieldKind::kBlob)
                list.set(id, typeOf<Geometry>(), field.id, field.load(Object::of(better)));
    }
    return list.empty() ? Expected<void>() : scene.apply(list.take());
}

Expected<void> addLevels(Aspect& scene, const std::unordered_set<ObjectId>& frozen, OptimiseCounts& counts) {
    constexpr std::size_t kFewest = 500, kWorthwhile = 2000;
    const NamedObjects named(scene);
    ChangeListBuilder list;
    std::uint64_t next = scene.nextFreeId();
    std::map<ObjectId, std::vector<ObjectId>> bearers;
    for (const ObjectId id : scene.ids()) {
        const Node* node = scene.get<Node>(id);
        if (node && node->core && node->children.empty() && !frozen.contains(id)) bearers[node->core].push_back(id);
    }
    const auto createWith = [&](const auto& value) {
        const ObjectId id{next++};
        list.create(id, typeOf(Object::of(value)));
        setAllFields(list, id, Object::of(value));
        return id;
    };
    for (const auto& [core, nodes] : bearers) {
        const Geometry* mesh = scene.get<Geometry>(core);
        if (!mesh || named.contains(core) || !isSoundMesh(*mesh) || mesh->indices.sizeBytes() / 12 < kWorthwhile)
            continue;
        const std::vector<CoarserMesh> coarser = coarserMeshes(*mesh, kFewest);
        const Box box = boundsOf(mesh->positions.as<float>());
        DistanceLOD lod;
        lod.measure = DistanceLOD::kSize;
        lod.center = box.center();
        lod.radius = 0.5 * box.size().norm();
        std::vector<double> ranges;
        std::vector<ObjectId> cores{core};
        for (const CoarserMesh& level : coarser) {
            // A sphere of D pixels has D / 2r pixels a unit: half a pixel of error at D = r / error.
            const double range = level.error > 0 ? lod.radius / level.error : 1e6;
            if (!ranges.empty() && !(range < ranges.back())) continue;
            ranges.push_back(range);
            cores.push_back(createWith(level.mesh));
        }
        if (ranges.empty()) continue;
        lod.ranges = Blob::of(std::span<const double>(ranges));
        const ObjectId choice = createWith(lod);
        for (const ObjectId node : nodes) {
            list.set(node, typeOf<Node>(), fieldId<&Node::core>, choice);
            for (const ObjectId level : cores) {
                const ObjectId child{next++};
                list.create(child, typeOf<Node>());
                list.set(child, typeOf<Node>(), fieldId<&Node::core>, level);
                list.place(child, node);
            }
        }
        ++counts.levelled;
        counts.levels += ranges.size();
    }
    return list.empty() ? Expected<void>() : scene.apply(list.take());
}

std::pair<std::size_t, std::size_t> countOf(const Aspect& scene) {
    std::size_t nodes = 0;
    for (const ObjectId id : scene.ids()) nodes += scene.find(id).is<Node>();
    return {nodes, scene.objectCount()};
}

void addBelow(const Aspect& scene, ObjectId id, std::unordered_set<ObjectId>& to) {
    std::vector<ObjectId> open{id};
    while (!open.empty()) {
        const ObjectId node = open.back();
        open.pop_back();
        to.insert(node);
        for (const ObjectId child : scene.get<Node>(node)->children) open.push_back(child);
    }
}

}  // namespace

Expected<OptimiseCounts> optimiseScene(Aspect& scene, const OptimiseOptions& options) {
    OptimiseCounts counts;
    std::tie(counts.nodesBefore, counts.objectsBefore) = countOf(scene);
    std::vector<ObjectId> keep;
    for (const std::string& path : options.keep) {
        const Expected<ObjectId> node = findNode(scene, path);
        if (!node) return tl::unexpected(node.error());
        keep.push_back(*node);
    }
    std::unordered_set<ObjectId> used, frozen;
    for (const ObjectId id : scene.ids())
        if (scene.useCount(id) > 0) used.insert(id);
    for (const ObjectId node : keep) addBelow(scene, node, frozen);

    if (options.share) {
        Expected<std::size_t> shared = shareEqualObjects(scene);
        if (!shared) return tl::unexpected(shared.error());
        counts.shared = *shared;
    }
    // Where something has gone, a chain of transforms may hold one mesh alone now. Each round has fewer nodes than the
    // one before.
    for (bool more = options.merge || options.flatten; more;) {
        const ChangeList list = StaticMerging(scene, options, keep, counts).run();
        more = !list.empty();
        if (Expected<void> applied = scene.apply(list); !applied) return tl::unexpected(applied.error());
    }
    if (Expected<void> dropped = dropUnused(scene, used); !dropped) return tl::unexpected(dropped.error());
    if (options.order)
        if (Expected<void> done = orderMeshes(scene, counts); !done) return tl::unexpected(done.error());
    if (options.share && options.order) {  // what was equal but for its order
        Expected<std::size_t> shared = shareEqualObjects(scene);
        if (!shared) return tl::unexpected(shared.error());
        counts.shared += *shared;
    }
    if (options.levels)
        if (Expected<void> done = addLevels(scene, frozen, counts); !done) return tl::unexpected(done.error());
    std::tie(counts.nodesAfter, counts.objectsAfter) = countOf(scene);
    return counts;
}

}  // namespace tessera
