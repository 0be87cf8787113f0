/// What is drawn at the nodes of a file, as cores: equal ones that nothing bends are one core.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>

#include "common/base/Hash.h"
#include "server/import/MaterialCores.h"
#include "server/text/Typesetter.h"

namespace tessera {

/// Each function makes or finds the core of a node, counts what it draws, and fails where a scene would not take it, or
/// where the surfaces of an import come to too many triangles. Not thread-safe.
class DrawnCores {
public:
    DrawnCores(SceneDraft& draft, MaterialCores& materials) : draft_(draft), materials_(materials) {}

    Expected<ObjectId> geometry(LoadedFile& file, const proto::scene::Geometry& message, const Coating& paint);
    /// One of its own for each place: each is bent by itself.
    Expected<ObjectId> deformation(LoadedFile& file, const proto::scene::Node& node, const Coating& paint);
    Expected<ObjectId> skin(LoadedFile& file, const proto::scene::Skin& message, const Coating& paint);
    /// By control points; a note says where nothing of it can be seen.
    Expected<ObjectId> surface(LoadedFile& file, const proto::scene::Node& node, const Coating& paint);
    Expected<ObjectId> text(LoadedFile& file, const proto::scene::Text& message, const Coating& paint);
    Expected<ObjectId> particles(LoadedFile& file, const proto::scene::Particles& message, const Coating& paint);
    Expected<ObjectId> glyphs(LoadedFile& file, const proto::scene::Glyphs& message, const Coating& paint);
    Expected<ObjectId> volume(LoadedFile& file, const proto::scene::Volume& message, const Coating& paint);

private:
    struct Core {
        ObjectId id;
        std::uint64_t triangles = 0;
    };
    /// Makes one, once: by all that the file says of it, its material, and what is painted over that. `read`: the
    /// message as a struct.
    template <typename Message, typename Read>
    Expected<Core> shared(LoadedFile& file, const Message& message, const Coating& paint, Read read);
    /// One whose triangles are derived, with its material. `said`: its name, or "".
    template <typename Surface>
    Expected<Core> derived(LoadedFile& file, Surface surface, const std::string& said, const Coating& paint);
    ObjectId counted(const Core& core);

    SceneDraft& draft_;
    MaterialCores& materials_;
    Typesetter typesetter_;
    std::uint64_t derivedTriangles_ = 0;      ///< while this import looked at its surfaces
    std::uint64_t mostDerivedTriangles_ = 0;  ///< of the largest file so far
    /// By mesh, or by what the file says; by material, and what is painted over it.
    std::map<std::tuple<const LoadedFile*, std::string, std::string, ObjectId>, Core> geometries_;
    std::map<std::tuple<const LoadedFile*, Hash128, std::string, ObjectId>, Core> surfaces_;
};

}  // namespace tessera
