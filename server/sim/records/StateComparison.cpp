#include "server/sim/records/StateComparison.h"

#include <algorithm>

#include <fmt/format.h>

#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

/// In the order of keys, each once: hosts are not believed.
std::vector<HashEntry> sorted(std::span<const HashEntry> entries) {
    std::vector<HashEntry> all(entries.begin(), entries.end());
    std::ranges::stable_sort(all, {}, &HashEntry::key);
    all.erase(
        std::unique(all.begin(), all.end(), [](const HashEntry& a, const HashEntry& b) { return a.key == b.key; }),
        all.end());
    return all;
}

/// The smallest key whose hash differs, is missing or is too many in the replica. Both ascending.
std::optional<std::uint64_t> firstDifference(std::span<const HashEntry> ours, std::span<const HashEntry> theirs) {
    const auto [a, b] = std::ranges::mismatch(ours, theirs);
    if (a == ours.end() && b == theirs.end()) return std::nullopt;
    if (a == ours.end()) return b->key;
    if (b == theirs.end()) return a->key;
    return std::min(a->key, b->key);
}

bool holds(std::span<const HashEntry> entries, std::uint64_t key) {
    return std::ranges::binary_search(entries, key, {}, &HashEntry::key);
}

std::string describe(const Aspect& scene, ObjectId id, bool replicaHasIt, bool sceneHadIt) {
    std::string text = fmt::format("#{}", id.value);
    if (const Object object = scene.find(id)) {
        text += fmt::format(" ({})", object.info().name);
        if (object.is<Node>()) text.append(" ").append(pathOf(scene, id));
    }
    if (!replicaHasIt) return text.append(" is missing in the replica");
    if (!sceneHadIt) return text.append(" is in the replica only");
    return text.append(" differs");
}

}  // namespace

StateComparison::Step StateComparison::leaves(const Aspect& scene, std::span<const HashEntry> theirs) {
    std::vector<HashEntry> ours;
    for (const Aspect::LeafHash& leaf : scene.leafHashes()) ours.push_back({leaf.leaf, leaf.hash});
    const std::optional<std::uint64_t> leaf = firstDifference(ours, sorted(theirs));
    if (!leaf) return {.finding = "no object differs; only the hash that it said of them all is wrong"};
    leaf_ = *leaf;
    ours_.clear();
    for (const Aspect::ObjectHash& object : scene.objectHashes(leaf_)) ours_.push_back({object.id.value, object.hash});
    return {.queryLeaf = leaf_};
}

StateComparison::Step StateComparison::objects(const Aspect& scene, std::span<const HashEntry> theirs) const {
    std::vector<HashEntry> ofLeaf = sorted(theirs);
    std::erase_if(ofLeaf, [&](const HashEntry& entry) { return entry.key / Aspect::kIdsPerLeaf != leaf_; });
    const std::optional<std::uint64_t> id = firstDifference(ours_, ofLeaf);
    if (!id) return {.finding = "it says that objects differ, and then that none does"};
    return {.finding = describe(scene, ObjectId{*id}, holds(ofLeaf, *id), holds(ours_, *id)), .named = true};
}

}  // namespace tessera
