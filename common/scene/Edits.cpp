#include "common/scene/Edits.h"

#include <fmt/format.h>

#include <unordered_map>
#include <unordered_set>

#include "common/cores/Transform.h"
#include "common/scene/FieldTable.h"

namespace tessera {

namespace {

/// At most one more than `most`.
std::vector<ObjectId> subtree(const Aspect& aspect, ObjectId node, std::size_t most) {
    std::vector<ObjectId> nodes = {node};
    for (std::size_t i = 0; i < nodes.size(); ++i)
        for (const ObjectId child : aspect.get<Node>(nodes[i])->children) {
            if (nodes.size() > most) return nodes;
            nodes.push_back(child);
        }
    return nodes;
}

}  // namespace

Expected<ObjectId> movableNode(const Aspect& aspect, ObjectId node) {
    for (ObjectId at = node; at;) {
        const Node* here = aspect.get<Node>(at);
        if (here == nullptr) return fail(ErrorCode::kNotFound, fmt::format("there is no node #{}", at.value));
        if (aspect.coreOf<Transform>(*here) != nullptr) return at;
        at = here->parent;
    }
    return tl::unexpected(cannotBeMoved(pathOf(aspect, node)));
}

Error cannotBeMoved(std::string_view path) {
    return {ErrorCode::kRefused,
            fmt::format("{} cannot be moved: neither it nor any node above it holds a Transform", path)};
}

Expected<ChangeList> moveList(const Aspect& aspect, ObjectId node, const NodeMove& move) {
    const Expected<ObjectId> movable = movableNode(aspect, node);
    if (!movable) return tl::unexpected(movable.error());
    const ObjectId core = aspect.get<Node>(*movable)->core;
    return moveList(core, *aspect.get<Transform>(core), move);
}

Expected<void> checkMove(const NodeMove& move) {
    if (!move.translation && !move.rotation && !move.scale)
        return fail(ErrorCode::kUsage, "a move needs a translation, a rotation or a scale");
    const bool finite =
        (!move.translation || move.translation->allFinite()) && (!move.scale || move.scale->allFinite());
    if (!finite) return fail(ErrorCode::kUsage, "a move by a number that is not finite");
    if (move.rotation && !tellsRotation(move.rotation->squaredNorm()))
        return fail(ErrorCode::kUsage, "a rotation given by a quaternion that cannot be normalised");
    if (move.scale && (move.scale->array() == 0).any())
        return fail(ErrorCode::kUsage, "a scale of zero would flatten it");
    return {};
}

Expected<ChangeList> moveList(ObjectId core, const Transform& present, const NodeMove& move) {
    if (Expected<void> sound = checkMove(move); !sound) return tl::unexpected(sound.error());
    ChangeListBuilder edits;
    if (move.translation) {
        const Vec3d translation = move.relative ? Vec3d(present.translation + *move.translation) : *move.translation;
        edits.set(core, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(translation));
    }
    if (move.rotation) {
        const Quatd turn = move.rotation->normalized();
        const Quatd rotation = move.relative ? Quatd((turn * present.rotation).normalized()) : turn;
        edits.set(core, typeOf<Transform>(), fieldId<&Transform::rotation>, toValue(rotation));
    }
    if (move.scale) {
        const Vec3d scale = move.relative ? Vec3d(present.scale.cwiseProduct(*move.scale)) : *move.scale;
        if ((scale.array() == 0).any()) return fail(ErrorCode::kUsage, "a scale of zero would flatten it");
        edits.set(core, typeOf<Transform>(), fieldId<&Transform::scale>, toValue(scale));
    }
    return edits.take();
}

namespace {

/// Of these nodes, all that is below each among them, and what only they used.
ChangeList removalOfAll(const Aspect& aspect, std::vector<ObjectId> gone) {
    ChangeListBuilder edits;
    for (const ObjectId id : gone) edits.detach(id);

    // An object goes too when every use of it comes from what goes: users stand before what they use, so that each is
    // unused when its turn comes.
    std::unordered_set<ObjectId> going(gone.begin(), gone.end());
    std::unordered_map<ObjectId, std::size_t> usesGone;
    for (std::size_t i = 0; i < gone.size(); ++i) {
        forEachRef(aspect.find(gone[i]), [&](ObjectId to) {
            if (++usesGone[to] < aspect.useCount(to) || aspect.get<Node>(to) != nullptr) return;
            if (going.insert(to).second) gone.push_back(to);
        });
    }
    for (const ObjectId id : gone) edits.destroy(id);
    return edits.take();
}

}  // namespace

Expected<ChangeList> removalList(const Aspect& aspect, ObjectId node, std::size_t maxNodes) {
    if (node == kRootNode) return fail(ErrorCode::kRefused, "the root cannot be removed; remove what is below it");
    if (aspect.get<Node>(node) == nullptr)
        return fail(ErrorCode::kNotFound, fmt::format("there is no node #{}", node.value));
    std::vector<ObjectId> gone = subtree(aspect, node, maxNodes);
    if (gone.size() > maxNodes)
        return fail(ErrorCode::kLimit, fmt::format("more than {} nodes are below {}; remove it part by part", maxNodes,
                                                   pathOf(aspect, node)));
    return removalOfAll(aspect, std::move(gone));
}

ChangeList removalOf(const Aspect& aspect, std::span<const ObjectId> nodes) {
    std::vector<ObjectId> gone;
    for (const ObjectId node : nodes) {
        const std::vector<ObjectId> below = subtree(aspect, node, std::numeric_limits<std::size_t>::max());
        gone.insert(gone.end(), below.begin(), below.end());
    }
    return removalOfAll(aspect, std::move(gone));
}

}  // namespace tessera
