#include "server/import/SceneAssembly.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/scene/FieldTable.h"
#include "server/import/AssetFolders.h"

namespace tessera {
namespace {

constexpr std::uint32_t kMaxImageSide = 16384;
constexpr std::size_t kMaxFiles = 1000;
constexpr std::string_view kAssetScheme = "asset://";

using Content = proto::scene::Node::ContentCase;

std::string_view contentName(Content content) {
    switch (content) {
        case Content::kGeometry:
            return "geometry";
        case Content::kDirectionalLight:
        case Content::kPointLight:
            return "light";
        case Content::kCamera:
            return "camera";
        case Content::kSwitch:
            return "switch";
        case Content::kMotion:
            return "motion";
        case Content::kEnvironment:
            return "environment";
        case Content::kInterest:
            return "interest";
        default:
            return "node";
    }
}

std::string placeText(const std::string& label, const proto::scene::Place& at) {
    return at.line() > 0 ? fmt::format("{}:{}:{}", label, at.line(), at.column()) : label;
}

}  // namespace

struct SceneAssembly::Placed {
    ObjectId id;
    std::string name;
    ObjectId transform;  ///< its core, where that is a Transform
    Placed* parent = nullptr;
    std::vector<Placed*> children;
};

struct SceneAssembly::Spot {
    ObjectId parent;
    Placed* placed = nullptr;  ///< the parent, as far as this import made it
    Placed* top = nullptr;     ///< names are looked up no further out than this
    std::size_t depth = 0;
    bool camerasEnabled = true;
};

struct SceneAssembly::PendingRef {
    enum class Kind { kMotionTarget, kInterestObject, kInterestAgainst };
    Kind kind;
    ObjectId core;
    Placed* from;
    Placed* top;
    std::string name;
    std::string where;  ///< file:line:column
};

SceneAssembly::SceneAssembly(const ImportOptions& options) : options_(options), nextId_(kFirstPlaceholder) {}
SceneAssembly::~SceneAssembly() = default;

ImportedScene SceneAssembly::take() {
    result_.list = builder_.take();
    if (!result_.tops.empty()) result_.top = result_.tops.front();
    return std::move(result_);
}

void SceneAssembly::set(ObjectId id, const Object& object) {
    const TypeInfo* type = findType(typeOf(object));
    TESSERA_CHECK(type != nullptr, "a core type is missing from the field table");
    const Object fresh = type->make();
    for (const FieldInfo& info : type->fields) {
        const FieldValue value = info.load(object);
        if (value != info.load(fresh)) builder_.set(id, type->type, info.id, value);
    }
}

ObjectId SceneAssembly::create(const Object& object) {
    const ObjectId id{nextId_++};
    builder_.create(id, typeOf(object));
    set(id, object);
    if (std::holds_alternative<Node>(object))
        ++result_.nodes;
    else
        ++result_.cores;
    return id;
}

Expected<SceneAssembly::Placed*> SceneAssembly::newNode(std::string name, ObjectId core, const Spot& spot) {
    if (result_.nodes >= options_.maxNodes)
        return fail(ErrorCode::kLimit, fmt::format("the scene has more than {} nodes", options_.maxNodes));
    if (spot.depth >= options_.maxDepth)
        return fail(ErrorCode::kLimit, fmt::format("nodes are nested deeper than {} levels", options_.maxDepth));
    Node node;
    node.name = name;
    node.core = core;
    const ObjectId id = create(node);
    builder_.place(id, spot.parent);
    placed_.push_back(std::make_unique<Placed>(Placed{id, std::move(name), ObjectId{}, spot.placed, {}}));
    if (spot.placed != nullptr) spot.placed->children.push_back(placed_.back().get());
    return placed_.back().get();
}

Expected<void> SceneAssembly::add(const std::string& path, ObjectId parent) {
    const Expected<std::string> canonical = ordinaryFile(path, options_.maxFileBytes);
    if (!canonical) return failWith(path, canonical.error());
    Expected<LoadedFile*> file = load(*canonical, path);
    if (!file) return tl::unexpected(file.error());

    // What this file's own names may refer to ends at this pretended node.
    placed_.push_back(std::make_unique<Placed>());
    Placed* top = placed_.back().get();
    Spot spot{parent, top, top, 0, true};
    if (!(*file)->isScene) {
        const Expected<Placed*> node = newNode(readName(stemOf(*canonical), "model"), ObjectId{}, spot);
        if (!node) return failWith(path, node.error());
        spot = Spot{(*node)->id, *node, *node, 1, true};
    }
    const std::uint64_t trianglesBefore = result_.triangles;
    importing_ = {*canonical};
    const Expected<void> done = placeFile(**file, spot);
    if (!done) return done;
    if (!(*file)->isScene && result_.triangles == trianglesBefore)
        return fail(ErrorCode::kBadInput, path + ": there are no triangles in it");
    for (const Placed* child : top->children) result_.tops.push_back(child->id);
    return {};
}

Expected<LoadedFile*> SceneAssembly::load(const std::string& canonicalPath, const std::string& label) {
    std::unique_ptr<LoadedFile>& known = files_[canonicalPath];
    if (!known) {
        if (files_.size() > kMaxFiles)
            return fail(ErrorCode::kLimit, fmt::format("{}: the scene imports more than {} files", label, kMaxFiles));
        Expected<std::unique_ptr<LoadedFile>> loaded = loadFile(canonicalPath, label, options_, result_.notes);
        if (!loaded) return tl::unexpected(loaded.error());
        known = std::move(*loaded);
    }
    return known.get();
}

Expected<void> SceneAssembly::placeFile(LoadedFile& file, const Spot& spot) {
    const std::size_t firstPending = pending_.size();
    for (const proto::scene::Node& node : file.content.node())
        if (Expected<void> done = placeNode(file, node, spot); !done) return done;
    return resolvePending(firstPending);
}

Expected<void> SceneAssembly::placeNode(LoadedFile& file, const proto::scene::Node& node, const Spot& spot) {
    const Content content = node.content_case();
    const auto in = [&](const Error& error) {
        return failWith(fmt::format("{}: node '{}'", file.label, readName(node.name(), "")), error);
    };
    Expected<ObjectId> core = contentCore(file, node, spot);
    if (!core) return in(core.error());

    ObjectId transform;
    if (node.has_transform()) {
        Expected<Transform> value = readTransform(node.transform());
        if (!value) return in(value.error());
        transform = create(*value);
    }
    Expected<Placed*> own = newNode(readName(node.name(), contentName(content)), transform ? transform : *core, spot);
    if (!own) return in(own.error());
    (*own)->transform = transform;
    Spot below{(*own)->id, *own, spot.top, spot.depth + 1, spot.camerasEnabled};

    // A node has one core: content beside a transform goes into a node of its own below. Only a switch must then hold
    // the children too.
    Placed* holder = *own;
    if (transform && *core) {
        const Expected<Placed*> inner = newNode(std::string(contentName(content)), *core, below);
        if (!inner) return in(inner.error());
        holder = *inner;
        if (content == Content::kSwitch)
            below = Spot{holder->id, holder, spot.top, below.depth + 1, spot.camerasEnabled};
    }
    if (content == Content::kGeometry)
        result_.triangles += file.geometryCores.at({node.geometry().mesh(), node.geometry().material()}).triangles;

    if (content == Content::kMotion)
        pending_.push_back({PendingRef::Kind::kMotionTarget, *core, holder, spot.top, node.motion().target(),
                            placeText(file.label, node.motion().at())});
    if (content == Content::kInterest) {
        const proto::scene::Interest& interest = node.interest();
        const std::string where = placeText(file.label, interest.at());
        pending_.push_back({PendingRef::Kind::kInterestObject, *core, holder, spot.top, interest.object(), where});
        if (!interest.against().empty())
            pending_.push_back(
                {PendingRef::Kind::kInterestAgainst, *core, holder, spot.top, interest.against(), where});
    }
    if (content == Content::kImport)
        if (Expected<void> done = placeImport(file, node.import(), below); !done) return done;
    if (content == Content::kInstance)
        if (Expected<void> done = placeInstance(file, node.instance(), below); !done) return in(done.error());

    for (const proto::scene::Node& child : node.node())
        if (Expected<void> done = placeNode(file, child, below); !done) return done;
    return {};
}

Expected<void> SceneAssembly::placeImport(LoadedFile& file, const proto::scene::Import& import, const Spot& spot) {
    const std::string where = placeText(file.label, import.at());
    if (!file.isScene) return fail(ErrorCode::kBadInput, where + ": a model file may not import others");
    const std::string& uri = import.uri();
    const Expected<std::string> found =
        uri.compare(0, kAssetScheme.size(), kAssetScheme) == 0
            ? findAsset(std::string_view(uri).substr(kAssetScheme.size()), options_.assetFolders)
            : findBeside(uri, folderOf(file.path));
    if (!found) return failWith(where, found.error());
    const Expected<std::string> path = ordinaryFile(*found, options_.maxFileBytes);
    if (!path) return failWith(where + ": " + readName(uri, ""), path.error());
    if (std::find(importing_.begin(), importing_.end(), *path) != importing_.end())
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}: {} imports itself ({} → {})", where, *path, fmt::join(importing_, " → "), *path));
    if (importing_.size() >= options_.maxImportDepth)
        return fail(ErrorCode::kLimit, fmt::format("{}: scene files import each other deeper than {} levels", where,
                                                   options_.maxImportDepth));

    Expected<LoadedFile*> imported = load(*path, uri);
    if (!imported) return failWith(where, imported.error());
    Spot inside = spot;
    inside.top = spot.placed;
    inside.camerasEnabled = spot.camerasEnabled && import.cameras();
    importing_.push_back(*path);
    const Expected<void> done = placeFile(**imported, inside);
    importing_.pop_back();
    return done;
}

Expected<void> SceneAssembly::placeInstance(LoadedFile& file, const std::string& definition, const Spot& spot) {
    const auto found = file.definitions.find(definition);
    if (found == file.definitions.end())
        return fail(ErrorCode::kBadInput, fmt::format("there is no definition '{}'", readName(definition, "")));
    for (const proto::scene::Node& node : found->second->node())
        if (Expected<void> done = placeNode(file, node, spot); !done) return done;
    return {};
}

Expected<ObjectId> SceneAssembly::contentCore(LoadedFile& file, const proto::scene::Node& node, const Spot& spot) {
    switch (node.content_case()) {
        case Content::CONTENT_NOT_SET:
        case Content::kImport:
        case Content::kInstance:
            return ObjectId{};
        case Content::kGeometry:
            return geometryCore(file, node.geometry());
        case Content::kDirectionalLight: {
            const proto::scene::DirectionalLight& message = node.directional_light();
            DirectionalLight light;
            if (message.has_color()) {
                const Expected<Vec3f> color = readColor(message.color());
                if (!color) return tl::unexpected(color.error());
                light.color = *color;
            }
            if (message.has_intensity()) light.intensity = message.intensity();
            if (!(light.intensity >= 0 && std::isfinite(light.intensity)))
                return fail(ErrorCode::kBadInput, "a light's intensity must not be negative");
            return create(light);
        }
        case Content::kPointLight: {
            const proto::scene::PointLight& message = node.point_light();
            PointLight light;
            if (message.has_color()) {
                const Expected<Vec3f> color = readColor(message.color());
                if (!color) return tl::unexpected(color.error());
                light.color = *color;
            }
            if (message.has_intensity()) light.intensity = message.intensity();
            light.range = message.range();
            if (!(light.intensity >= 0 && std::isfinite(light.intensity) && light.range >= 0 &&
                  std::isfinite(light.range)))
                return fail(ErrorCode::kBadInput, "a light's intensity and range must not be negative");
            return create(light);
        }
        case Content::kCamera: {
            Camera camera;
            if (node.camera().has_world_units_per_metre())
                camera.worldUnitsPerMetre = node.camera().world_units_per_metre();
            if (!(camera.worldUnitsPerMetre > 1e-9 && camera.worldUnitsPerMetre < 1e12))
                return fail(ErrorCode::kBadInput, "a camera's world_units_per_metre must be above zero");
            camera.enabled = spot.camerasEnabled && !node.camera().disabled() ? 1 : 0;
            if (camera.enabled != 0) result_.hasCamera = true;
            return create(camera);
        }
        case Content::kSwitch: {
            Switch choice;
            if (node.switch_().has_choice()) choice.choice = node.switch_().choice();
            if (choice.choice < Switch::kNone)
                return fail(ErrorCode::kBadInput,
                            "a switch's choice is a child's number from 0, -1 (all) or -2 (none)");
            return create(choice);
        }
        case Content::kMotion: {
            const Expected<Blob> keys = readKeys(node.motion());
            if (!keys) return tl::unexpected(keys.error());
            Motion motion;
            motion.keys = *keys;
            motion.mode = std::clamp<std::int64_t>(node.motion().mode(), Motion::kOnce, Motion::kPingPong);
            motion.playing = node.motion().paused() ? 0 : 1;
            return create(motion);
        }
        case Content::kEnvironment: {
            const Expected<Environment> environment = readEnvironment(node.environment());
            if (!environment) return tl::unexpected(environment.error());
            return create(*environment);
        }
        case Content::kInterest: {
            Interest interest;
            interest.response =
                node.interest().response() == proto::scene::Interest::REPORT ? Interest::kReport : Interest::kStop;
            interest.enabled = node.interest().disabled() ? 0 : 1;
            return create(interest);
        }
        default:
            return fail(ErrorCode::kBadInput, "it is not in plain form (shapes are made into meshes by the reader)");
    }
}

Expected<ObjectId> SceneAssembly::geometryCore(LoadedFile& file, const proto::scene::Geometry& geometry) {
    LoadedFile::GeometryCore& core = file.geometryCores[{geometry.mesh(), geometry.material()}];
    if (core.id) return core.id;
    Expected<MeshArrays> arrays = file.mesh(geometry.mesh());
    if (!arrays) return tl::unexpected(arrays.error());
    Geometry value;
    value.positions = std::move(arrays->positions);
    value.normals = std::move(arrays->normals);
    value.colors = std::move(arrays->colors);
    value.texcoords = std::move(arrays->texcoords);
    value.indices = std::move(arrays->indices);
    if (!geometry.material().empty()) {
        const Expected<ObjectId> material = materialCore(file, geometry.material());
        if (!material) return material;
        value.material = *material;
    }
    core.triangles = value.indices.sizeBytes() / (3 * sizeof(std::uint32_t));
    core.id = create(value);
    ++result_.geometries;
    result_.trianglesStored += core.triangles;
    return core.id;
}

Expected<ObjectId> SceneAssembly::materialCore(LoadedFile& file, const std::string& name) {
    if (const auto known = file.materialCores.find(name); known != file.materialCores.end()) return known->second;
    const auto found = file.materials.find(name);
    if (found == file.materials.end())
        return fail(ErrorCode::kBadInput, fmt::format("there is no material '{}'", readName(name, "")));
    Expected<Material> material = readMaterial(*found->second);
    if (!material) return failWith(fmt::format("material '{}'", readName(name, "")), material.error());
    if (const std::string& image = found->second->base_color_image(); !image.empty()) {
        const Expected<ObjectId> core = imageCore(file, image);
        if (!core) return core;
        material->baseColorImage = *core;
    }
    return file.materialCores[name] = create(*material);
}

Expected<ObjectId> SceneAssembly::imageCore(LoadedFile& file, const std::string& name) {
    if (const auto known = file.imageCores.find(name); known != file.imageCores.end()) return known->second;
    const auto found = file.images.find(name);
    if (found == file.images.end())
        return fail(ErrorCode::kBadInput, fmt::format("there is no image '{}'", readName(name, "")));
    const proto::scene::Image& message = *found->second;
    const Expected<Blob> pixels = file.blob(message.pixels_blob());
    if (!pixels) return failWith(fmt::format("image '{}'", readName(name, "")), pixels.error());
    const std::uint64_t width = message.width_px(), height = message.height_px();
    if (width == 0 || height == 0 || width > kMaxImageSide || height > kMaxImageSide ||
        pixels->sizeBytes() != width * height * 4)
        return fail(ErrorCode::kBadInput, fmt::format("image '{}': {} bytes are not {} × {} pixels", readName(name, ""),
                                                      pixels->sizeBytes(), width, height));
    Image image;
    image.pixels = *pixels;
    image.widthPx = static_cast<std::int64_t>(width);
    image.heightPx = static_cast<std::int64_t>(height);
    return file.imageCores[name] = create(image);
}

namespace {

struct Step {
    std::string_view name;
    std::size_t which = 0;  ///< among equal names
};

/// "pillar[2]" → {"pillar", 2}
Step readStep(std::string_view text) {
    if (text.size() > 2 && text.back() == ']') {
        if (const std::size_t open = text.rfind('['); open != std::string_view::npos) {
            std::size_t which = 0;
            const char* last = text.data() + text.size() - 1;
            const auto [end, error] = std::from_chars(text.data() + open + 1, last, which);
            if (error == std::errc() && end == last) return {text.substr(0, open), which};
        }
    }
    return {text, 0};
}

template <typename PlacedNode>
PlacedNode* childNamed(const PlacedNode* node, std::string_view stepText) {
    const Step step = readStep(stepText);
    std::size_t seen = 0;
    for (PlacedNode* child : node->children)
        if (child->name == step.name && seen++ == step.which) return child;
    return nullptr;
}

template <typename PlacedNode>
PlacedNode* descend(PlacedNode* node, std::string_view path) {
    while (node != nullptr && !path.empty()) {
        const std::size_t slash = path.find('/');
        node = childNamed(node, path.substr(0, slash));
        path = slash == std::string_view::npos ? std::string_view() : path.substr(slash + 1);
    }
    return node;
}

}  // namespace

Expected<void> SceneAssembly::resolvePending(std::size_t from) {
    for (std::size_t i = from; i < pending_.size(); ++i) {
        const PendingRef& ref = pending_[i];
        Placed* found = nullptr;
        if (ref.name.empty()) {
            found = ref.from;
            while (found != ref.top && !found->transform) found = found->parent;
            if (found == ref.top) found = nullptr;
        } else if (ref.name.front() == '/') {
            found = descend(ref.top, std::string_view(ref.name).substr(1));
        } else {
            for (Placed* outer = ref.from; found == nullptr && outer != nullptr && outer != ref.top;
                 outer = outer->parent)
                if (outer->parent != nullptr) found = descend(outer->parent, ref.name);
        }
        const std::string shown = readName(ref.name, "");
        if (ref.kind == PendingRef::Kind::kMotionTarget) {
            if (found == nullptr || !found->transform)
                return fail(ErrorCode::kBadInput,
                            ref.name.empty()
                                ? fmt::format("{}: this motion has no transform at or above it to move", ref.where)
                            : found != nullptr
                                ? fmt::format("{}: the motion's target '{}' has no transform", ref.where, shown)
                                : fmt::format("{}: there is no node '{}' for this motion to move", ref.where, shown));
            builder_.set(ref.core, typeOf<Motion>(), field::kMotionTarget, toValue(found->transform));
            continue;
        }
        if (found == nullptr || ref.name.empty())
            return fail(ErrorCode::kBadInput,
                        ref.name.empty()
                            ? fmt::format("{}: this interest names no object", ref.where)
                            : fmt::format("{}: there is no node '{}' for this interest", ref.where, shown));
        const bool object = ref.kind == PendingRef::Kind::kInterestObject;
        builder_.set(ref.core, typeOf<Interest>(), object ? field::kInterestObject : field::kInterestAgainst,
                     toValue(found->id));
    }
    pending_.erase(pending_.begin() + static_cast<std::ptrdiff_t>(from), pending_.end());
    return {};
}

}  // namespace tessera
