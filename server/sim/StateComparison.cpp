#include "server/sim/StateComparison.h"

#include <fmt/format.h>

#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

/// The smallest key whose hash differs, is missing or is too many in the replica.
std::optional<std::uint64_t> firstDifference(const std::map<std::uint64_t, std::uint64_t>& ours,
                                             const std::map<std::uint64_t, std::uint64_t>& theirs) {
    auto a = ours.begin();
    auto b = theirs.begin();
    while (a != ours.end() && b != theirs.end() && *a == *b) ++a, ++b;
    if (a == ours.end() && b == theirs.end()) return std::nullopt;
    if (a == ours.end()) return b->first;
    if (b == theirs.end()) return a->first;
    return std::min(a->first, b->first);
}

std::string describe(const Aspect& scene, ObjectId id, bool replicaHasIt, bool sceneHadIt) {
    std::string text = fmt::format("#{}", id.value);
    if (const Object* object = scene.find(id)) {
        text += fmt::format(" ({})", findType(typeOf(*object))->name);
        if (scene.get<Node>(id)) text.append(" ").append(pathOf(scene, id));
    }
    if (!replicaHasIt) return text.append(" is missing in the replica");
    if (!sceneHadIt) return text.append(" is in the replica only");
    return text.append(" differs");
}

}  // namespace

void StateComparison::begin(const std::string& host, const Aspect& scene) {
    Remembered remembered;
    for (const Aspect::LeafHash& leaf : scene.leafHashes()) {
        remembered.leaves.emplace(leaf.leaf, leaf.hash);
        for (const Aspect::ObjectHash& object : scene.objectHashes(leaf.leaf))
            remembered.objects.emplace(object.id.value, object.hash);
    }
    byHost_[host] = std::move(remembered);
}

StateComparison::Step StateComparison::compare(const server_action::HashesReceived& received, const Aspect& scene) {
    const auto found = byHost_.find(received.host);
    if (found == byHost_.end()) return {};
    const Remembered& ours = found->second;
    std::map<std::uint64_t, std::uint64_t> theirs;
    for (const HashEntry& entry : received.entries) theirs.emplace(entry.key, entry.hash);
    if (!received.objects) {
        const std::optional<std::uint64_t> leaf = firstDifference(ours.leaves, theirs);
        if (!leaf) return {};
        return {.queryLeaf = leaf, .finding = {}};
    }
    // The answer covers one leaf: compare within the ids of that leaf only.
    std::map<std::uint64_t, std::uint64_t> part;
    if (!received.entries.empty()) {
        const std::uint64_t first = received.entries.front().key / Aspect::kIdsPerLeaf * Aspect::kIdsPerLeaf;
        part.insert(ours.objects.lower_bound(first), ours.objects.lower_bound(first + Aspect::kIdsPerLeaf));
    }
    const std::optional<std::uint64_t> id = firstDifference(part, theirs);
    byHost_.erase(found);
    if (!id) return {};
    return {.queryLeaf = {}, .finding = describe(scene, ObjectId{*id}, theirs.contains(*id), part.contains(*id))};
}

}  // namespace tessera
