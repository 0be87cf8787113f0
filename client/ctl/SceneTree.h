/// The tree of nodes for people and programs.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string>

#include "common/application/SceneExcerpt.h"

namespace tessera {

/// One line per node, indented: name, core, where it is if it moves, id. `depth` levels below `node`; -1: all.
[[nodiscard]] std::string treeText(const SceneExcerpt& tree, ObjectId node, int depth);
/// The node with its fields, its core's fields and its children. `path`: the node's.
[[nodiscard]] nlohmann::ordered_json treeJson(const SceneExcerpt& tree, ObjectId node, const std::string& path,
                                              int depth);

}  // namespace tessera
