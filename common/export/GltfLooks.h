/// Materials and images as glTF 2.0 and its extensions have them.
#pragma once

#include <map>
#include <optional>
#include <tuple>

#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/export/ExportNotes.h"
#include "common/export/GltfParts.h"

namespace tessera {

/// Which texture coordinates a mesh has: a picture that asks for others is left out, as glTF forbids that.
struct GltfCoordinates {
    bool first = false, second = false;
    auto operator<=>(const GltfCoordinates&) const = default;
};

class GltfLooks {
public:
    GltfLooks(const Aspect& scene, GltfParts& parts, ExportNotes& notes)
        : scene_(scene), parts_(parts), notes_(notes) {}

    /// The place of a Material among the file's; of none that of Tessera's default. `node`: who wears it, for notes.
    [[nodiscard]] int material(ObjectId id, GltfCoordinates coordinates, ObjectId node);

private:
    [[nodiscard]] std::string describe(const Material& material, GltfCoordinates coordinates, ObjectId node);
    void describeReflection(const Material& material, JsonObject& pbr, JsonObject& extensions);
    /// Nothing: there is none, or it cannot be said.
    [[nodiscard]] std::optional<JsonObject> texture(ObjectId image, GltfCoordinates coordinates, ObjectId node);
    [[nodiscard]] std::optional<int> picture(const Image& image, ObjectId node);
    [[nodiscard]] int sampler(const Image& image);

    const Aspect& scene_;
    GltfParts& parts_;
    ExportNotes& notes_;
    std::map<std::pair<ObjectId, GltfCoordinates>, int> materials_;
    std::map<std::pair<int, int>, int> textures_;  ///< by picture and sampler
    std::map<std::string, int> samplers_;
    std::map<std::tuple<BlobId, std::int64_t, std::int64_t>, std::optional<int>> pictures_;
};

}  // namespace tessera
