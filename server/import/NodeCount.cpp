#include "server/import/NodeCount.h"

#include <algorithm>

namespace tessera {
namespace {

/// Content beside a transform goes into a node of its own.
std::size_t ownNodes(const proto::scene::Node& node) {
    using Content = proto::scene::Node::ContentCase;
    const Content content = node.content_case();
    const bool hasCore =
        content != Content::CONTENT_NOT_SET && content != Content::kImport && content != Content::kInstance;
    return node.has_transform() && hasCore ? 2 : 1;
}

}  // namespace

Expected<std::size_t> NodeCount::of(LoadedFile& file, std::size_t depth) {
    // One that leads back to itself counts nothing there: it is refused where it is placed.
    if (const auto [known, isNew] = ofFile_.try_emplace(&file, 0); !isNew) return known->second;
    const Expected<std::size_t> count = of(file, file.content.node(), depth);
    if (count)
        ofFile_[&file] = *count;
    else
        ofFile_.erase(&file);
    return count;
}

Expected<std::size_t> NodeCount::of(LoadedFile& file, const Nodes& nodes, std::size_t depth) {
    const ImportOptions& options = draft_.options();
    // Whatever is placed at this depth at least is placed there: what is too deep here is too deep.
    if (!nodes.empty() && depth >= options.maxDepth) return failWith(file.label, draft_.tooDeep());
    std::size_t count = 0;
    const auto add = [&](std::size_t more) { count = std::min(count + more, options.maxNodes + 1); };
    for (const proto::scene::Node& node : nodes) {
        add(ownNodes(node));
        Expected<std::size_t> below = of(file, node.node(), depth + 1);
        if (!below) return below;
        add(*below);
        if (node.has_import()) {
            const Expected<LoadedFile*> imported = files_.imported(file, node.import());
            if (!imported) continue;
            const ImportedFiles::Within within(files_, **imported);
            below = of(**imported, depth + 1);
            if (!below) return below;
            add(*below);
        }
        if (node.has_instance()) {
            below = ofDefinition(file, node.instance(), depth + 1);
            if (!below) return below;
            add(*below);
        }
    }
    return count;
}

Expected<std::size_t> NodeCount::ofDefinition(LoadedFile& file, const std::string& name, std::size_t depth) {
    const auto definition = file.definitions.find(name);
    if (definition == file.definitions.end()) return 0;
    const std::pair<const LoadedFile*, std::string> key(&file, name);
    if (const auto known = ofDefinition_.find(key); known != ofDefinition_.end()) return known->second;
    const Expected<std::size_t> count = of(file, definition->second->node(), depth);
    if (count) ofDefinition_.emplace(key, *count);
    return count;
}

}  // namespace tessera
