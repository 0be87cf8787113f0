/// Contents of nodes as cores: a table of kinds.
#pragma once

#include <string_view>

#include "server/import/DrawnCores.h"
#include "server/import/ImportedFiles.h"
#include "server/import/MovieCores.h"

namespace tessera {

/// A kind is a row: what it is called, and who makes it. What has no row is a type of the table, and made of what its
/// message says (TableCores.h). Not thread-safe.
class ContentCores {
public:
    ContentCores(SceneDraft& draft, const ImportedFiles& files, MaterialCores& materials)
        : draft_(draft), files_(files), materials_(materials), drawn_(draft, materials), movies_(draft, materials) {}

    /// The core that the node's content needs, or none. References by name are left to others.
    Expected<ObjectId> make(LoadedFile& file, const proto::scene::Node& node, const Spot& spot);
    /// Of a node without a name.
    [[nodiscard]] static std::string_view nameFor(const proto::scene::Node& node);
    /// Whether it says something of its children: then it must hold them, even where a transform stands beside it.
    [[nodiscard]] static bool holdsChildren(const proto::scene::Node& node);
    /// Whether it puts its node somewhere, as a Transform does.
    [[nodiscard]] static bool moves(const proto::scene::Node& node);

private:
    struct Asked {
        LoadedFile& file;
        const proto::scene::Node& node;
        const Spot& spot;
    };
    struct Kind;
    static const Kind* kindOf(const proto::scene::Node& node);
    Expected<ObjectId> nothing(const Asked& asked);
    Expected<ObjectId> ofTable(const Asked& asked);
    Expected<ObjectId> written(const Asked& asked);
    Expected<ObjectId> drawn(const Asked& asked);
    Expected<ObjectId> camera(const Asked& asked);
    Expected<ObjectId> choice(const Asked& asked);
    Expected<ObjectId> materialGroup(const Asked& asked);
    Expected<ObjectId> levels(const Asked& asked);
    Expected<ObjectId> billboard(const Asked& asked);
    Expected<ObjectId> motion(const Asked& asked);
    Expected<ObjectId> animation(const Asked& asked);
    Expected<ObjectId> inlined(const Asked& asked);
    Expected<ObjectId> applicationData(const Asked& asked);
    Expected<ObjectId> movie(const Asked& asked);
    Expected<ObjectId> surroundings(const Asked& asked);
    Expected<ObjectId> interest(const Asked& asked);
    Expected<ObjectId> collisionObject(const Asked& asked);

    SceneDraft& draft_;
    const ImportedFiles& files_;
    MaterialCores& materials_;
    DrawnCores drawn_;
    MovieCores movies_;
};

}  // namespace tessera
