#include "server/import/SavedObjects.h"

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

Expected<void> SavedObjects::place(LoadedFile& file, const Spot& spot) {
    std::unordered_map<ObjectId, std::uint64_t> triangles;  // of each Geometry
    std::vector<std::pair<ObjectId, std::string>> names;
    std::vector<ObjectId> drawn;  // the core of each node
    SavedOptions options;
    options.parent = spot.parent;
    options.firstId = draft_.nextId().value;
    options.maxObjects -= std::min(options.maxObjects, static_cast<std::size_t>(options.firstId - kFirstPlaceholder));
    options.maxDepth = draft_.options().maxDepth - spot.depth;
    options.look = [&](ObjectId id, const TypeInfo& type, void* object) -> Expected<void> {
        if (Expected<void> wanted = draft_.goOn(); !wanted) return wanted;
        if (id == spot.parent) return {};
        const Object seen(type, object);
        ++(seen.is<Node>() ? draft_.scene().nodes : draft_.scene().cores);
        if (seen.is<Node>()) {
            Node& node = *static_cast<Node*>(object);
            node.ofServer = false;  // whatever a file says: it is a person's
            draft_.noteControls(file, node.name);
            node.name = asOneLine(node.name);
            drawn.push_back(node.core);
            names.emplace_back(id, node.name);
        } else if (const Drawable drawable = drawableOf(seen)) {
            if (const auto* proxy = seen.as<ProxyGroup>()) draft_.noteNamed(file, proxy->file);
            if (const auto* geometry = seen.as<Geometry>(); geometry && geometry->primitive == Geometry::kPoints) {
                static_cast<Geometry*>(object)->pointRadius = file.pointRadius.value_or(geometry->pointRadius);
                file.hasPoints = true;
            }
            if (Expected<void> sound = drawable.check(); !sound) return sound;
            if (const FieldEntry* material = spot.paint.over ? findField(type, "material") : nullptr)
                material->store(object, spot.paint.over);
            triangles[id] = drawable.triangleCount();
            draft_.countDrawable(triangles[id]);
        } else if (const DistanceLOD* lod = seen.as<DistanceLOD>()) {
            return checkRanges(*lod);
        } else if (const Material* material = seen.as<Material>()) {
            return checkLayers(*material);
        } else if (seen.is<Camera>()) {
            auto& camera = *static_cast<Camera*>(object);
            camera.enabled = draft_.enablesCamera(file, spot.camerasEnabled, camera.enabled);
            if (const Expected<void> sound = checkStand({.worldUnitsPerMetre = camera.worldUnitsPerMetre}); !sound)
                return sound;
            if (camera.enabled) draft_.scene().hasCamera = true;
        } else if (const auto* held = seen.as<Inline>()) {
            draft_.noteNamed(file, held->file);
        } else if (const auto* movie = seen.as<Movie>()) {
            draft_.noteNamed(file, movie->file);
        }
        return {};
    };
    options.beside = fieldsBeside(file);
    Expected<SavedScene> saved = readSaved(asBytes(file.content.saved()), file.blobs, options, draft_.list());
    if (!saved) return failInFile(file.label, saved.error());
    parts_.push_back({&file, options.firstId, std::move(saved->places)});
    draft_.took(saved->created);
    for (const ObjectId core : drawn)
        if (const auto found = triangles.find(core); found != triangles.end())
            draft_.scene().triangles += found->second;
    const std::unordered_map<ObjectId, std::string> nameOf(names.begin(), names.end());
    for (const ObjectId top : saved->tops) nodes_.enter(top, nameOf.at(top), spot.placed);
    for (const std::string& text : saved->notes)
        draft_.note(failInFile(file.label, {ErrorCode::kBadInput, text}).value().message);
    for (const std::string& text : saved->mended) draft_.noteMended(file, text);
    keepLater(std::move(saved->later));
    return {};
}

void SavedObjects::keepBeside(const LoadedFile& file) {
    LaterParts later;
    later.ofFile = fieldsBeside(file);
    if (later.empty()) return;
    later.blobs = file.blobs;
    draft_.note(file.label + ": " + laterKeptText("fields beside what it saved"));
    keepLater(std::move(later));
}

void SavedObjects::keepLater(LaterParts later) {
    LaterParts& kept = draft_.scene().later;
    if (!later.empty() && files_.underWay().size() == 1 && kept.empty()) kept = std::move(later);
}

std::optional<tl::unexpected<Error>> SavedObjects::refusal(const Fault& fault) const {
    for (const Part& part : parts_) {
        const std::uint64_t place = fault.object.value - part.firstId;
        if (fault.object.value < part.firstId || place >= part.places.size()) continue;
        const std::string_view type = findType(fault.type)->name;
        return failInFile(part.file->label,
                          {ErrorCode::kBadInput, savedObjectText(part.places[place], type, fault.why.message)});
    }
    return std::nullopt;
}

}  // namespace tessera
