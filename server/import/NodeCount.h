/// How many nodes a file comes to, before one of them is made: 1.9 kB of definitions that name each other twice are
/// sixteen million.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>

#include "server/import/ImportedFiles.h"

namespace tessera {

/// Counts as `SceneAssembly` places. Each file and each definition is counted once. Not thread-safe.
class NodeCount {
public:
    NodeCount(const SceneDraft& draft, ImportedFiles& files) : draft_(draft), files_(files) {}

    /// Definitions and imports written out; never more than maxNodes + 1. Fails where nodes are nested too deep.
    /// Imports that fail count for nothing: who places them says why.
    Expected<std::size_t> of(LoadedFile& file, std::size_t depth);

private:
    using Nodes = google::protobuf::RepeatedPtrField<proto::scene::Node>;
    Expected<std::size_t> of(LoadedFile& file, const Nodes& nodes, std::size_t depth);
    Expected<std::size_t> ofDefinition(LoadedFile& file, const std::string& name, std::size_t depth);

    const SceneDraft& draft_;
    ImportedFiles& files_;
    std::map<const LoadedFile*, std::size_t> ofFile_;
    std::map<std::pair<const LoadedFile*, std::string>, std::size_t> ofDefinition_;
};

}  // namespace tessera
