#include "server/manipulators/ManipulatorDisplay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "common/cores/CollisionObject.h"
#include "common/cores/DistanceLOD.h"
#include "common/cores/Geometry.h"
#include "common/cores/InverseTransform.h"
#include "common/cores/Material.h"
#include "common/cores/Transform.h"
#include "common/scene/Action.h"
#include "common/scene/ChildChoice.h"
#include "common/scene/Edits.h"
#include "common/scene/FieldTable.h"
#include "common/scene/ServerNodes.h"

namespace tessera {
namespace {

struct Paint {
    Vec4f baseColor;
    Vec3f emissive;
};
Paint paintOf(HandleColor color) {
    constexpr std::array<std::array<float, 3>, kHandleColors> kColors{
        {{0.9f, 0.08f, 0.08f}, {0.1f, 0.75f, 0.1f}, {0.12f, 0.25f, 1.0f}, {0.85f, 0.85f, 0.85f}, {1.0f, 0.8f, 0.0f}}};
    const auto& c = kColors[static_cast<std::size_t>(color)];
    return {.baseColor = {0.5f * c[0], 0.5f * c[1], 0.5f * c[2], 1.0f},
            .emissive = {0.6f * c[0], 0.6f * c[1], 0.6f * c[2]}};
}

/// The nodes of one manipulator's handles, as they stand in the scene.
struct HandleNodes {
    struct Piece {
        ObjectId transform, geometry;
    };
    ObjectId top, outer, inner;  ///< a node and two Transforms
    std::vector<Piece> pieces;
};

/// The only child of a node, with a core of this type.
template <typename Core>
const Node* only(const Aspect& scene, const Node& parent, ObjectId& core) {
    if (parent.children.size() != 1) return nullptr;
    const Node* child = scene.get<Node>(parent.children[0]);
    core = child->core;
    return scene.get<Core>(core) ? child : nullptr;
}

std::optional<ObjectId> topOf(const Aspect& scene, const Node& bearer) {
    for (std::size_t i = 0; i < bearer.children.size(); ++i) {
        const Node* child = scene.get<Node>(bearer.children[i]);
        if (child->ofServer && child->name == kHandlesName) return bearer.children[i];
    }
    return std::nullopt;
}

/// Of one sight after the other.
std::vector<const HandlePiece*> shownOf(const PlacedManipulator& placed) {
    std::vector<const HandlePiece*> shown;
    for (std::size_t sight = 0; sight < placed.sights(); ++sight)
        for (const HandlePiece& piece : placed.seenBy(sight).handles.pieces)
            if (piece.shown) shown.push_back(&piece);
    return shown;
}

/// Each user's child, as Node::levels says it.
std::int64_t levelsOf(std::size_t sights) {
    std::uint64_t levels = 0;
    for (std::size_t user = 0; user < kLevelUsers; ++user) levels |= std::uint64_t{user % sights} << (8 * user);
    return static_cast<std::int64_t>(levels);
}

/// What has a material of its own: pieces of one handle and one colour.
using HandleLook = std::pair<std::int64_t, HandleColor>;
HandleLook lookOf(const HandlePiece& piece) {
    return {piece.handle, piece.color};
}

/// Nothing where they are not what this kind has.
std::optional<HandleNodes> readNodes(const Aspect& scene, ObjectId top, const std::vector<const HandlePiece*>& shown,
                                     std::size_t sights) {
    if (!scene.coreOf<InverseTransform>(*scene.get<Node>(top))) return std::nullopt;
    HandleNodes found;
    found.top = top;
    ObjectId body;
    const Node* outer = only<Transform>(scene, *scene.get<Node>(top), found.outer);
    const Node* inner = outer ? only<Transform>(scene, *outer, found.inner) : nullptr;
    const Node* pieces = inner ? only<CollisionObject>(scene, *inner, body) : nullptr;
    if (!pieces) return std::nullopt;
    const CollisionObject* object = scene.get<CollisionObject>(body);
    if (object->layers != 0 || object->node != inner->children[0]) return std::nullopt;
    std::vector<ObjectId> nodes;
    if (sights == 1) {
        nodes.assign(pieces->children.begin(), pieces->children.end());
    } else {
        ObjectId choice;
        const Node* users = only<DistanceLOD>(scene, *pieces, choice);
        if (!users || users->levels != levelsOf(sights) || users->children.size() != sights) return std::nullopt;
        for (const ObjectId user : users->children) {
            const Node* one = scene.get<Node>(user);
            if (one->core || one->children.size() * sights != shown.size()) return std::nullopt;
            nodes.insert(nodes.end(), one->children.begin(), one->children.end());
        }
    }
    if (nodes.size() != shown.size()) return std::nullopt;
    std::map<HandleLook, ObjectId> materials;
    std::set<ObjectId> taken;
    for (std::size_t i = 0; i < shown.size(); ++i) {
        const Node* piece = scene.get<Node>(nodes[i]);
        if (!scene.coreOf<Transform>(*piece) || piece->children.size() != 1) return std::nullopt;
        const Node* leaf = scene.get<Node>(piece->children[0]);
        const Geometry* geometry = scene.coreOf<Geometry>(*leaf);
        const MeshArrays& shape = handleShape(shown[i]->shape);
        if (!geometry || !leaf->children.empty() || geometry->positions != shape.positions ||
            geometry->indices != shape.indices || !scene.get<Material>(geometry->material))
            return std::nullopt;
        const auto [known, fresh] = materials.try_emplace(lookOf(*shown[i]), geometry->material);
        if (fresh ? !taken.insert(geometry->material).second : known->second != geometry->material) return std::nullopt;
        found.pieces.push_back({piece->core, leaf->core});
    }
    return found;
}

/// What others have hung among handles, which is not taken away with them.
std::vector<ObjectId> foreignBelow(const Aspect& scene, ObjectId top) {
    const auto isOurs = [&](const Node& node) {
        if (node.name == "turn" || node.name == "piece") return scene.coreOf<Transform>(node) != nullptr;
        if (node.name == "pieces") return scene.coreOf<CollisionObject>(node) != nullptr;
        if (node.name == "users") return scene.coreOf<DistanceLOD>(node) != nullptr;
        if (node.name == "user") return !node.core;
        return node.name == "shape" && scene.coreOf<Geometry>(node) != nullptr;
    };
    std::vector<ObjectId> foreign, open{top};
    while (!open.empty()) {
        const Node* node = scene.get<Node>(open.back());
        open.pop_back();
        for (std::size_t i = 0; i < node->children.size(); ++i)
            (isOurs(*scene.get<Node>(node->children[i])) ? open : foreign).push_back(node->children[i]);
    }
    return foreign;
}

/// Only what differs from what is there.
void setPose(ChangeListBuilder& list, ObjectId id, const Transform& from, const Pose& to) {
    if (to.translation != from.translation) setField<&Transform::translation>(list, id, to.translation);
    if (to.rotation.coeffs() != from.rotation.coeffs()) setField<&Transform::rotation>(list, id, to.rotation);
    if (to.scale != from.scale) setField<&Transform::scale>(list, id, to.scale);
}

/// Two poses whose product it is.
std::pair<Pose, Pose> twoPoses(const Affine3d& place) {
    Pose outer{.translation = place.translation(), .rotation = Quatd::Identity(), .scale = Vec3d::Ones()}, inner;
    const Mat3d square = place.linear().transpose() * place.linear();
    const double length2 = square.trace() / 3;
    if ((square - length2 * Mat3d::Identity()).cwiseAbs().maxCoeff() <= 1e-12 * length2) {
        // A rotation and one factor: as such, so that it stays the same while nothing turns.
        const double factor = std::sqrt(length2) * (place.linear().determinant() < 0 ? -1 : 1);
        outer.rotation = Quatd(Mat3d(place.linear() / factor)).normalized();
        outer.scale = Vec3d::Constant(factor);
        return {outer, inner};
    }
    // The singular value decomposition: of the square, as what is decomposed can be inverted.
    // By Jacobi's rotations, in a fixed number of sweeps (Golub and Van Loan, Matrix Computations, 8.5).
    Mat3d diagonal = square, v = Mat3d::Identity();
    for (int sweep = 0; sweep < 12; ++sweep)
        for (const auto& [p, q] : {std::pair(0, 1), {0, 2}, {1, 2}}) {
            Eigen::JacobiRotation<double> rotation;
            rotation.makeJacobi(diagonal, p, q);
            diagonal.applyOnTheLeft(p, q, rotation.adjoint());
            diagonal.applyOnTheRight(p, q, rotation);
            v.applyOnTheRight(p, q, rotation);
        }
    Vec3d scale = diagonal.diagonal().cwiseMax(0).cwiseSqrt();
    if (v.determinant() < 0) v = -v;
    if (place.linear().determinant() < 0) scale = -scale;
    const Mat3d u = place.linear() * v * scale.cwiseInverse().asDiagonal();
    outer.rotation = Quatd(u).normalized();
    outer.scale = scale;
    inner.rotation = Quatd(Mat3d(v.transpose())).normalized();
    return {outer, inner};
}

/// Makes nodes and cores; fresh ones carry placeholders.
class Build {
public:
    Build(ChangeListBuilder& list, std::uint64_t& placeholders) : list_(list), placeholders_(placeholders) {}

    template <typename Core>
    ObjectId make() {
        const ObjectId id{kFirstPlaceholder + placeholders_++};
        list_.create(id, typeOf<Core>());
        return id;
    }
    ObjectId node(ObjectId parent, const char* name, ObjectId core) {
        const ObjectId id = make<Node>();
        setField<&Node::name>(list_, id, std::string(name));
        if (core) setField<&Node::core>(list_, id, core);
        list_.place(id, parent);
        return id;
    }
    ObjectId transform(const Pose& pose) {
        const ObjectId id = make<Transform>();
        setPose(list_, id, Transform(), pose);
        return id;
    }
    ObjectId material(HandleColor color) {
        const ObjectId id = make<Material>();
        const Paint paint = paintOf(color);
        setField<&Material::baseColor>(list_, id, paint.baseColor);
        setField<&Material::emissive>(list_, id, paint.emissive);
        setField<&Material::doubleSided>(list_, id, true);
        return id;
    }
    ObjectId geometry(HandleShape shape, ObjectId material) {
        const ObjectId id = make<Geometry>();
        const MeshArrays& arrays = handleShape(shape);
        setField<&Geometry::positions>(list_, id, arrays.positions);
        if (!arrays.normals.empty()) setField<&Geometry::normals>(list_, id, arrays.normals);
        setField<&Geometry::indices>(list_, id, arrays.indices);
        setField<&Geometry::material>(list_, id, material);
        return id;
    }

private:
    ChangeListBuilder& list_;
    std::uint64_t& placeholders_;
};

HandleColor shownColor(const HandlePiece& piece, std::int64_t held) {
    return piece.handle == held ? HandleColor::kHeld : piece.color;
}

void build(ChangeListBuilder& list, std::uint64_t& placeholders, ObjectId bearer, const PlacedManipulator& placed,
           const std::vector<const HandlePiece*>& shown, std::int64_t held) {
    Build made(list, placeholders);
    const auto [outer, inner] = twoPoses(placed.frame.world_T_frame);
    const ObjectId top = made.node(bearer, kHandlesName.data(), made.make<InverseTransform>());
    setField<&Node::ofServer>(list, top, true);
    const ObjectId below = made.node(made.node(top, "turn", made.transform(outer)), "turn", made.transform(inner));
    const ObjectId object = made.make<CollisionObject>();
    const ObjectId pieces = made.node(below, "pieces", object);
    setField<&CollisionObject::node>(list, object, pieces);
    setField<&CollisionObject::layers>(list, object, std::int64_t{0});
    ObjectId users;
    if (placed.sights() > 1) {
        users = made.node(pieces, "users", made.make<DistanceLOD>());
        setField<&Node::levels>(list, users, levelsOf(placed.sights()));
    }
    std::map<HandleLook, ObjectId> materials;
    ObjectId parent = pieces;
    for (std::size_t i = 0; i < shown.size(); ++i) {
        if (users && i % (shown.size() / placed.sights()) == 0) parent = made.node(users, "user", {});
        ObjectId& material = materials[lookOf(*shown[i])];
        if (!material) material = made.material(shownColor(*shown[i], held));
        made.node(made.node(parent, "piece", made.transform(shown[i]->pose)), "shape",
                  made.geometry(shown[i]->shape, material));
    }
}

/// While somebody holds a handle its pieces have a colour of their own. Materials stay: who has let go sees what was
/// there before, in the order in which it was drawn.
void paint(const Aspect& scene, ChangeListBuilder& list, const HandleNodes& nodes,
           const std::vector<const HandlePiece*>& shown, std::int64_t held) {
    for (std::size_t i = 0; i < shown.size(); ++i) {
        const ObjectId id = scene.get<Geometry>(nodes.pieces[i].geometry)->material;
        const Material* now = scene.get<Material>(id);
        const Paint wanted = paintOf(shownColor(*shown[i], held));
        if (now->baseColor != wanted.baseColor) setField<&Material::baseColor>(list, id, wanted.baseColor);
        if (now->emissive != wanted.emissive) setField<&Material::emissive>(list, id, wanted.emissive);
    }
}

}  // namespace

void ManipulatorDisplay::noteNode(const Aspect& scene, ObjectId id) {
    const Node* node = scene.get<Node>(id);
    if (node && scene.coreOf<Manipulator>(*node)) {
        bearers_[id] = node->core;
        left_.erase(id);
        return;
    }
    if (bearers_.erase(id) > 0) {
        contents_.erase(id);
        if (node) left_.insert(id);
    }
    // Handles whose bearer bears none, however that came about.
    if (!node) left_.erase(id);
    if (node && node->ofServer && node->name == kHandlesName && node->parent && !bearers_.contains(node->parent))
        left_.insert(node->parent);
}

void ManipulatorDisplay::sceneChanged(const Aspect& scene, const ChangeList* list) {
    if (!list) {
        bearers_.clear();
        left_.clear();
        contents_.clear();
        stale_ = true;
        for (const ObjectId id : scene.ids()) noteNode(scene, id);
        return;
    }
    for (const FieldColumn& column : list->columns)
        if (column.type == typeOf<Node>() && column.field == fieldId<&Node::core>)
            for (const ObjectId id : column.ids) noteNode(scene, id);
    if (bearers_.empty() && left_.empty()) return;
    for (const ObjectId id : list->destructions) noteNode(scene, id);
    forgetContents(*list);
    stale_ = true;
}

void ManipulatorDisplay::forgetContents(const ChangeList& list) {
    if (contents_.empty()) return;
    const bool tree = !list.placements.empty() || std::ranges::any_of(list.columns, [](const FieldColumn& column) {
        return column.type == typeOf<Node>();
    });
    if (tree) {
        contents_.clear();
        return;
    }
    for (auto it = contents_.begin(); it != contents_.end();) {
        const auto& cores = it->second.cores;
        const bool touched =
            std::ranges::any_of(list.columns,
                                [&](const FieldColumn& column) {
                                    return std::ranges::any_of(column.ids,
                                                               [&](ObjectId id) { return cores.contains(id); });
                                }) ||
            std::ranges::any_of(list.ranges, [&](const RangeEdit& range) { return cores.contains(range.object); });
        it = touched ? contents_.erase(it) : std::next(it);
    }
}

const Box& ManipulatorDisplay::contentOf(const Aspect& scene, ObjectId node, const MovedCore& moved) {
    const auto known = contents_.find(node);
    if (known != contents_.end() && known->second.of.node == moved.node && known->second.of.core == moved.core)
        return known->second.box;
    Content content{.of = moved, .box = contentBox(scene, moved), .cores = {}};
    Action action;
    action.visitHidden(true);
    action.onNode([&](const Visit& visit) {
        if (visit.core.as<Manipulator>()) return Descend::kPast;
        if (visit.node.core && visit.nodeId != moved.node) content.cores.insert(visit.node.core);
        return Descend::kInto;
    });
    action.run(scene, moved.node);
    return contents_.insert_or_assign(node, std::move(content)).first->second.box;
}

std::optional<ManipulatorDisplay::Stand> ManipulatorDisplay::standOf(const Aspect& scene, ObjectId node) {
    const auto bearer = bearers_.find(node);
    Stand stand{.manipulator = bearer == bearers_.end() ? nullptr : scene.get<Manipulator>(bearer->second),
                .moved = {},
                .frames = {}};
    if (!stand.manipulator) return std::nullopt;
    std::optional<MovedCore> moved = movedBy(scene, *stand.manipulator);
    if (!moved) return std::nullopt;
    stand.moved = *moved;
    const Box content = Manipulator::isLightKind(stand.manipulator->kind) ? Box() : contentOf(scene, node, *moved);
    for (std::size_t sight = 0; sight < sightsOf(*stand.manipulator); ++sight) {
        const HandleFrame& frame = stand.frames.emplace_back(frameOf(*stand.manipulator, *moved, content, sight));
        if (!frame.world_T_frame.matrix().allFinite() || !frame.extent.allFinite() ||
            !(frame.extent.maxCoeff() < 1e30) || !(frame.knob < 1e30))
            return std::nullopt;
    }
    return stand;
}

std::optional<Vec3d> ManipulatorDisplay::originOf(const Aspect& scene, ObjectId node) {
    const std::optional<Stand> stand = standOf(scene, node);
    return stand ? std::optional<Vec3d>(stand->frames.front().world_T_frame.translation()) : std::nullopt;
}

std::optional<PlacedManipulator> ManipulatorDisplay::place(const Aspect& scene, ObjectId node) {
    const std::optional<Stand> stand = standOf(scene, node);
    if (!stand) return std::nullopt;
    PlacedManipulator placed;
    placed.core = bearers_.at(node);
    placed.node = node;
    placed.moved = stand->moved;
    const double angle = outerAngleOf(scene, *stand->manipulator);
    for (const HandleFrame& frame : stand->frames) {
        HandleSight seen{.frame = frame,
                         .handles = handlesOf(stand->manipulator->kind, frame.extent, angle, frame.knob)};
        if (&frame == &stand->frames.front())
            static_cast<HandleSight&>(placed) = std::move(seen);
        else
            placed.others.push_back(std::move(seen));
    }
    return placed;
}

std::vector<PlacedManipulator> ManipulatorDisplay::placed(const Aspect& scene) {
    std::vector<PlacedManipulator> all;
    for (const auto& [node, core] : bearers_)
        if (std::optional<PlacedManipulator> one = place(scene, node)) all.push_back(std::move(*one));
    return all;
}

ChangeList ManipulatorDisplay::update(const Aspect& scene) {
    if (!std::exchange(stale_, false)) return {};
    ChangeListBuilder list;
    std::uint64_t placeholders = 0;
    std::vector<ObjectId> going;
    std::set<ObjectId> again;
    const auto takeAway = [&](ObjectId bearer, ObjectId top) {
        const std::vector<ObjectId> foreign = foreignBelow(scene, top);
        for (const ObjectId id : foreign) list.place(id, bearer);
        if (foreign.empty()) going.push_back(top);  // else once they are out of the way
        return foreign.empty();
    };
    for (const ObjectId bearer : left_)
        if (const Node* node = scene.get<Node>(bearer); node && !bearers_.contains(bearer))
            if (const std::optional<ObjectId> top = topOf(scene, *node); top && !takeAway(bearer, *top))
                again.insert(bearer);
    left_ = std::move(again);
    for (const auto& [bearer, core] : bearers_) {
        const std::optional<PlacedManipulator> wanted = place(scene, bearer);
        const std::optional<ObjectId> top = topOf(scene, *scene.get<Node>(bearer));
        const std::int64_t held = scene.get<Manipulator>(core)->held;
        if (!wanted) {
            if (top) takeAway(bearer, *top);
            continue;
        }
        const std::vector<const HandlePiece*> shown = shownOf(*wanted);
        const std::optional<HandleNodes> nodes = top ? readNodes(scene, *top, shown, wanted->sights()) : std::nullopt;
        if (!nodes) {
            if (top && !takeAway(bearer, *top)) continue;
            build(list, placeholders, bearer, *wanted, shown, held);
            continue;
        }
        const auto [outer, inner] = twoPoses(wanted->frame.world_T_frame);
        setPose(list, nodes->outer, *scene.get<Transform>(nodes->outer), outer);
        setPose(list, nodes->inner, *scene.get<Transform>(nodes->inner), inner);
        for (std::size_t i = 0; i < shown.size(); ++i)
            setPose(list, nodes->pieces[i].transform, *scene.get<Transform>(nodes->pieces[i].transform),
                    shown[i]->pose);
        paint(scene, list, *nodes, shown, held);
    }
    if (!going.empty()) {
        ChangeList removal = removalOf(scene, going);
        for (const Placement& placement : removal.placements)
            list.place(placement.node, placement.parent, placement.index);
        for (const ObjectId id : removal.destructions) list.destroy(id);
    }
    return list.take();
}

ChangeList ManipulatorDisplay::inTheWayOf(const Aspect& scene, const ChangeList& list) const {
    if ((bearers_.empty() && left_.empty()) || list.destructions.empty()) return {};
    const std::unordered_set<ObjectId> destroyed(list.destructions.begin(), list.destructions.end());
    std::vector<ObjectId> tops;
    for (const ObjectId id : list.destructions) {
        const Node* node = bearers_.contains(id) || left_.contains(id) ? scene.get<Node>(id) : nullptr;
        const std::optional<ObjectId> top = node ? topOf(scene, *node) : std::nullopt;
        if (top && !destroyed.contains(*top) && foreignBelow(scene, *top).empty()) tops.push_back(*top);
    }
    return tops.empty() ? ChangeList() : removalOf(scene, tops);
}

std::vector<Blob> ManipulatorDisplay::blobs() {
    std::vector<Blob> all;
    for (std::size_t i = 0; i < kHandleShapes; ++i) {
        const MeshArrays& shape = handleShape(static_cast<HandleShape>(i));
        for (const Blob& blob : {shape.positions, shape.normals, shape.indices})
            if (!blob.empty()) all.push_back(blob);
    }
    return all;
}

}  // namespace tessera
