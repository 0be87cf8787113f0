// How many nodes a file comes to, before one of them is made: 1.9 kB of definitions that name each other twice are sixteen million.

#include <algorithm>

#include "server/import/SceneAssembly.h"

namespace tessera {
namespace {

using Content = proto::scene::Node::ContentCase;

/// As `placeNode` makes them: content beside a transform goes into a node of its own.
std::size_t ownNodes(const proto::scene::Node& node) {
    const Content content = node.content_case();
    const bool hasCore = content != Content::CONTENT_NOT_SET && content != Content::kImport && content != Content::kInstance;
    return node.has_transform() && hasCore ? 2 : 1;
}

}  // namespace

Expected<std::size_t> SceneAssembly::countNodes(LoadedFile& file, std::size_t depth) {
    if (file.nodesInAll) return *file.nodesInAll;
    // One that leads back to itself is refused where it is placed.
    file.nodesInAll = 0;
    const Expected<std::size_t> count = countNodes(file, file.content.node(), depth);
    file.nodesInAll = count ? std::optional(*count) : std::nullopt;
    return count;
}

Expected<std::size_t> SceneAssembly::countNodes(LoadedFile& file, const google::protobuf::RepeatedPtrField<proto::scene::Node>& nodes, std::size_t depth) {
    // Whatever is placed at this depth at least is placed there: what is too deep here is too deep.
    if (!nodes.empty() && depth >= options_.maxDepth) return failWith(file.label, tooDeep());
    std::size_t count = 0;
    const auto add = [&](std::size_t more) { count = std::min(count + more, options_.maxNodes + 1); };
    for (const proto::scene::Node& node : nodes) {
        add(ownNodes(node));
        Expected<std::size_t> below = countNodes(file, node.node(), depth + 1);
        if (!below) return below;
        add(*below);
        if (node.has_import()) {
            const Expected<LoadedFile*> imported = importedFile(file, node.import());
            if (!imported) continue;
            importing_.push_back((*imported)->path);
            below = countNodes(**imported, depth + 1);
            importing_.pop_back();
            if (!below) return below;
            add(*below);
        }
        if (node.has_instance()) {
            const auto definition = file.definitions.find(node.instance());
            if (definition == file.definitions.end()) continue;
            auto known = file.nodesOfDefinition.find(node.instance());
            if (known == file.nodesOfDefinition.end()) {
                below = countNodes(file, definition->second->node(), depth + 1);
                if (!below) return below;
                known = file.nodesOfDefinition.emplace(node.instance(), *below).first;
            }
            add(known->second);
        }
    }
    return count;
}

}  // namespace tessera
