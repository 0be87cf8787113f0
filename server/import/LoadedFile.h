/// One imported file, read by the child, opened and indexed by name.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/Blob.h"
#include "common/change/Value.h"
#include "common/cores/Environment.h"
#include "common/cores/Geometry.h"
#include "common/cores/Transform.h"
#include "common/geometry/Mesh.h"
#include "proto/scene.pb.h"
#include "server/import/Importer.h"

namespace tessera {

struct LoadedFile {
    std::string path;                   ///< canonical
    std::string label;                  ///< as it was named, for messages
    std::uint64_t bytes = 0;            ///< of the file itself
    bool isScene = false;               ///< .tsct or .tsc
    bool hasOwnTops = false;            ///< as those have: its top-level nodes stand for themselves
    std::optional<double> pointRadius;  ///< of all its points, whatever it says
    bool hasPoints = false;             ///< among what was placed so far
    proto::scene::SceneFile content;
    std::vector<Blob> blobs;

    std::map<std::string, const proto::scene::Mesh*> meshes;
    std::map<std::string, const proto::scene::Material*> materials;
    std::map<std::string, const proto::scene::Image*> images;
    std::map<std::string, const proto::scene::Definition*> definitions;

    std::map<std::string, Geometry> checkedMeshes;
    std::optional<std::set<std::string>> films;  ///< names of images that Movies write, once somebody has asked

    /// The array with this number, counted from 1; 0: an empty handle.
    [[nodiscard]] Expected<Blob> blob(std::uint32_t number) const;
    /// A mesh, checked, without its material.
    [[nodiscard]] Expected<Geometry> mesh(const std::string& name);
    /// Whether a Movie of the file writes the image of that name.
    [[nodiscard]] bool isFilm(const std::string& name);
};

/// Runs the child on `path` (canonical) and opens its answer. Messages begin with `label`. What there is to say goes
/// into `result`: notes, faults.
[[nodiscard]] Expected<std::unique_ptr<LoadedFile>> loadFile(const std::string& path, const std::string& label,
                                                             const ImportOptions& options, ImportedScene& result);

/// "label: message", or "label:line:column: message" where the message begins with a place.
[[nodiscard]] tl::unexpected<Error> failInFile(const std::string& label, const Error& error);

/// "label:line:column", or the label alone where nobody said.
[[nodiscard]] std::string placeText(const std::string& label, const proto::scene::Place& at);
/// Of the node itself.
[[nodiscard]] proto::scene::Place placeOf(const proto::scene::Node& node);

// Plain-form values, checked: every number finite, every rotation a rotation.
[[nodiscard]] Expected<Quatd> readRotation(const proto::scene::Rotation& message);
[[nodiscard]] Expected<Transform> readTransform(const proto::scene::Transform& message);
[[nodiscard]] Expected<Environment> readEnvironment(const proto::scene::Environment& message);
/// Key frames as the Motion core stores them.
[[nodiscard]] Expected<Blob> readKeys(const proto::scene::Motion& message);
[[nodiscard]] Expected<Vec3f> readColor(const proto::scene::Color& message);
/// A node's name as it may be shown on a terminal.
[[nodiscard]] std::string readName(const std::string& name, std::string_view otherwise);

}  // namespace tessera
