// What a scene file saved: any object of the table, taken over as it is.

#include <google/protobuf/unknown_field_set.h>

#include <algorithm>
#include <unordered_map>

#include "common/cores/Camera.h"
#include "common/cores/DistanceLOD.h"
#include "common/cores/Inline.h"
#include "common/cores/Movie.h"
#include "common/cores/ProxyGroup.h"
#include "common/drawable/Drawable.h"
#include "common/scene/ChildChoice.h"
#include "common/scene/MaterialParts.h"
#include "common/scenefile/SavedReader.h"
#include "common/wall/View.h"
#include "server/import/SceneAssembly.h"
#include "server/rules/NameCheck.h"

namespace tessera {
namespace {

/// What a newer version wrote in the file beside what is known.
std::string fieldsBeside(const LoadedFile& file) {
    std::string bytes;
    (void)file.content.GetReflection()->GetUnknownFields(file.content).SerializeToString(&bytes);
    return bytes;
}

}  // namespace

Expected<void> SceneAssembly::placeSaved(LoadedFile& file, const Spot& spot) {
    std::unordered_map<ObjectId, std::uint64_t> triangles;  // of each Geometry
    std::vector<std::pair<ObjectId, std::string>> names;
    std::vector<ObjectId> drawn;  // the core of each node
    SavedOptions options;
    options.parent = spot.parent;
    options.firstId = nextId_;
    options.maxObjects -= std::min(options.maxObjects, static_cast<std::size_t>(nextId_ - kFirstPlaceholder));
    options.maxDepth = options_.maxDepth - spot.depth;
    options.look = [&](ObjectId id, const TypeInfo& type, void* object) -> Expected<void> {
        if (id == spot.parent) return {};
        const Object seen(type, object);
        seen.is<Node>() ? ++result_.nodes : ++result_.cores;
        if (seen.is<Node>()) {
            Node& node = *static_cast<Node*>(object);
            node.ofServer = false;  // whatever a file says: it is a person's
            noteControls(file, node.name);
            node.name = asOneLine(node.name);
            drawn.push_back(node.core);
            names.emplace_back(id, node.name);
        } else if (const Drawable drawable = drawableOf(seen)) {
            if (const auto* proxy = seen.as<ProxyGroup>()) noteNamed(file, proxy->file);
            if (const auto* geometry = seen.as<Geometry>(); geometry && geometry->primitive == Geometry::kPoints) {
                static_cast<Geometry*>(object)->pointRadius = file.pointRadius.value_or(geometry->pointRadius);
                file.hasPoints = true;
            }
            if (Expected<void> sound = drawable.check(); !sound) return sound;
            if (const FieldEntry* material = spot.paint ? findField(type, "material") : nullptr) material->store(object, spot.paint);
            triangles[id] = drawable.triangleCount();
            ++result_.geometries;
            result_.trianglesStored += triangles[id];
        } else if (const DistanceLOD* lod = seen.as<DistanceLOD>()) {
            return checkRanges(*lod);
        } else if (const Material* material = seen.as<Material>()) {
            return checkLayers(*material);
        } else if (seen.is<Camera>()) {
            auto& camera = *static_cast<Camera*>(object);
            camera.enabled = enablesCamera(file, spot, camera.enabled);
            if (const Expected<void> sound = checkStand({.worldUnitsPerMetre = camera.worldUnitsPerMetre}); !sound) return sound;
            result_.hasCamera = result_.hasCamera || camera.enabled;
        } else if (const auto* held = seen.as<Inline>()) {
            noteNamed(file, held->file);
        } else if (const auto* movie = seen.as<Movie>()) {
            noteNamed(file, movie->file);
        }
        return {};
    };
    options.beside = fieldsBeside(file);
    Expected<SavedScene> saved = readSaved(asBytes(file.content.saved()), file.blobs, options, builder_);
    if (!saved) return failInFile(file.label, saved.error());
    saved_.push_back({&file, nextId_, std::move(saved->places)});
    nextId_ += saved->created;
    for (const ObjectId core : drawn)
        if (const auto found = triangles.find(core); found != triangles.end()) result_.triangles += found->second;
    const std::unordered_map<ObjectId, std::string> nameOf(names.begin(), names.end());
    for (const ObjectId top : saved->tops) (void)placed(top, nameOf.at(top), spot.placed);
    for (const std::string& text : saved->notes) note(failInFile(file.label, {ErrorCode::kBadInput, text}).value().message);
    for (const std::string& text : saved->mended) noteMended(file, text);
    keepLater(std::move(saved->later));
    return {};
}

void SceneAssembly::keepBeside(const LoadedFile& file) {
    LaterParts later;
    later.ofFile = fieldsBeside(file);
    if (later.empty()) return;
    later.blobs = file.blobs;
    note(file.label + ": " + laterKeptText("fields beside what it saved"));
    keepLater(std::move(later));
}

void SceneAssembly::keepLater(LaterParts later) {
    if (!later.empty() && importing_.size() == 1 && result_.later.empty()) result_.later = std::move(later);
}

}  // namespace tessera
