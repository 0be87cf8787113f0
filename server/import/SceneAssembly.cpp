#include "server/import/SceneAssembly.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <utility>

#include "common/cores/Manipulator.h"
#include "common/scene/FieldTable.h"
#include "common/wall/View.h"
#include "server/import/AssetFolders.h"
#include "server/import/FlatCloud.h"
#include "server/import/TableCores.h"
#include "server/rules/NameCheck.h"
#include "server/rules/SceneRules.h"

namespace tessera {
namespace {

Error replaced() {
    return {ErrorCode::kRefused, "was replaced by a link while it was looked for"};
}

/// What the reader tells of a model's axes (proto/scene.proto).
constexpr std::uint32_t kSaysYUp = 2, kSaysZUp = 3;

/// Formats that say nothing of it, and come from where Z is up: parts to be made.
bool mostlyZUp(const std::string& path) {
    const std::string ending = path.substr(std::min(path.rfind('.'), path.size()));
    constexpr std::array<std::string_view, 2> kEndings = {".stl", ".off"};
    return std::ranges::any_of(kEndings, [&](std::string_view known) {
        return std::ranges::equal(ending, known, [](unsigned char a, char b) { return std::tolower(a) == b; });
    });
}

constexpr std::size_t kMaxFiles = 1000;
constexpr std::size_t kMaxNotes = 1000;

using Content = proto::scene::Node::ContentCase;

std::string_view contentName(Content content) {
    switch (content) {
        case Content::kGeometry:
            return "geometry";
        case Content::kSubdivisionSurface:
        case Content::kNurbsSurface:
            return "surface";
        case Content::kDirectionalLight:
        case Content::kPointLight:
        case Content::kSpotLight:
            return "light";
        case Content::kComponentTransform:
        case Content::kInverseTransform:
            return "transform";
        case Content::kCamera:
            return "camera";
        case Content::kSwitch:
            return "switch";
        case Content::kMaterialGroup:
            return "material_group";
        case Content::kDistanceLod:
            return "distance_lod";
        case Content::kBillboard:
            return "billboard";
        case Content::kMotion:
            return "motion";
        case Content::kEnvironment:
            return "environment";
        case Content::kAnimation:
            return "animation";
        case Content::kSkin:
            return "skin";
        case Content::kInterest:
            return "interest";
        case Content::kCollisionObject:
            return "collision_object";
        case Content::kCore:
            return "core";
        case Content::kManipulator:
            return "manipulator";
        case Content::kInline:
            return "inline";
        case Content::kProxyGroup:
            return "proxy_group";
        case Content::kApplicationData:
            return "application_data";
        case Content::kMovie:
            return "movie";
        default:
            return "node";
    }
}

/// Says something of what is below it, beside what the table of types knows: poses and choices.
bool isHolder(Content content) {
    return content == Content::kMaterialGroup || content == Content::kBillboard;
}

/// The names of the nodes that a light stands at, and that it lights; empty: its own, and everything.
struct LightNames {
    std::string_view beacon, scope;
};
LightNames lightNamesOf(const proto::scene::Node& node) {
    if (node.has_directional_light()) return {node.directional_light().beacon(), node.directional_light().scope()};
    if (node.has_point_light()) return {node.point_light().beacon(), node.point_light().scope()};
    return node.has_spot_light() ? LightNames{node.spot_light().beacon(), node.spot_light().scope()} : LightNames();
}

/// Where the content says it stands; of contents that do not, line 0.
proto::scene::Place placeOf(const proto::scene::Node& node) {
    if (node.has_interest()) return node.interest().at();
    if (node.has_collision_object()) return node.collision_object().at();
    if (node.has_animation()) return node.animation().at();
    if (node.has_skin()) return node.skin().at();
    return {};
}

proto::scene::Place placeOfNode(const proto::scene::Node& node) {
    proto::scene::Place place;
    place.set_line(static_cast<std::uint32_t>(node.at() >> 32));
    place.set_column(static_cast<std::uint32_t>(node.at()));
    return place;
}

std::string placeText(const std::string& label, const proto::scene::Place& at) {
    return at.line() > 0 ? fmt::format("{}:{}:{}", label, at.line(), at.column()) : label;
}

}  // namespace

SceneAssembly::SceneAssembly(const ImportOptions& options) : options_(options), nextId_(kFirstPlaceholder) {}
SceneAssembly::~SceneAssembly() = default;

Expected<ImportedScene> SceneAssembly::take() {
    noteDriven();
    noteNoPoints();
    result_.list = builder_.take();
    if (const Sound sound = checkRules(Aspect(), result_.list, {}); !sound) return refusal(sound.error());
    if (!result_.tops.empty()) result_.top = result_.tops.front();
    return std::move(result_);
}

tl::unexpected<Error> SceneAssembly::refusal(const Fault& fault) const {
    const std::string_view type = findType(fault.type)->name;
    // Whatever an edit would be told: of a file it is a bad one.
    for (const SavedPart& part : saved_)
        if (const std::uint64_t place = fault.object.value - part.firstId; fault.object.value >= part.firstId && place < part.places.size())
            return failInFile(part.file->label, {ErrorCode::kBadInput, savedObjectText(part.places[place], type, fault.why.message)});
    const auto written = writtenAt_.find(fault.object);
    return failWith(written == writtenAt_.end() ? std::string(type) : fmt::format("{}: this {}", written->second, type), {ErrorCode::kBadInput, fault.why.message});
}

ObjectId SceneAssembly::createObject(const Object& object) {
    const ObjectId id{nextId_++};
    builder_.create(id, typeOf(object));
    setAllFields(builder_, id, object);
    types_.resize(id.value - kFirstPlaceholder + 1);
    types_.back() = &object.info();
    if (object.is<Node>())
        ++result_.nodes;
    else
        ++result_.cores;
    return id;
}

void SceneAssembly::note(std::string text) {
    if (noted_.size() < kMaxNotes && noted_.insert(text).second) result_.notes.push_back(std::move(text));
}

void SceneAssembly::noteNamed(const LoadedFile& file, const std::string& path) {
    const std::string folder = folderOf(file.path);
    if (path.starts_with(kAssetScheme)) return;
    if (folder == "/")
        note(file.label + ": it lies in the root folder; what it names beside it is read where the server's --allow says so");
    else if (path.starts_with(folder + "/"))
        result_.named.push_back(path);
}

void SceneAssembly::noteNoPoints() {
    if (!options_.placing || !options_.placing->pointRadius || std::ranges::any_of(files_, [](const auto& file) { return file.second->hasPoints; })) return;
    for (const std::string& path : added_) note(path + ": point radius: the file has no points");
}

void SceneAssembly::noteMended(const LoadedFile& file, const std::string& what) {
    const std::string text = failInFile(file.label, {ErrorCode::kBadInput, what}).value().message;
    note(text);
    if (file.isScene && result_.mended.size() < kMaxNotes) result_.mended.push_back(text);
}

void SceneAssembly::noteControls(const LoadedFile& file, std::string_view name) {
    if (!isOneLine(name)) note(file.label + ": names of nodes have line breaks or other control characters: '?' stands for them");
}

Error SceneAssembly::tooManyNodes() const {
    return {ErrorCode::kLimit, fmt::format("the scene has more than {} nodes", options_.maxNodes)};
}

Error SceneAssembly::tooDeep() const {
    return {ErrorCode::kLimit, fmt::format("nodes are nested deeper than {} levels", options_.maxDepth)};
}

Expected<SceneAssembly::Placed*> SceneAssembly::newNode(std::string name, ObjectId core, const Spot& spot) {
    if (written_++ >= options_.maxNodes) return tl::unexpected(tooManyNodes());
    if (spot.depth >= options_.maxDepth) return tl::unexpected(tooDeep());
    Node node;
    node.name = name;
    node.core = core;
    const ObjectId id = create(node);
    builder_.place(id, spot.parent);
    return placed(id, std::move(name), spot.placed);
}

SceneAssembly::Placed* SceneAssembly::placed(ObjectId id, std::string name, Placed* parent) {
    Placed* const node = placed_.emplace_back(std::make_unique<Placed>()).get();
    node->id = id;
    node->name = std::move(name);
    node->parent = parent;
    if (parent != nullptr) parent->children.push_back(node);
    return node;
}

Expected<void> SceneAssembly::add(const std::string& path, ObjectId parent) {
    const bool isAsset = path.starts_with(kAssetScheme);
    const Expected<std::string> found =
        isAsset ? findAsset(std::string_view(path).substr(kAssetScheme.size()), options_.assetFolders) : path;
    if (!found) return failWith(path, found.error());
    const Expected<std::string> canonical = ordinaryFile(*found, options_.maxFileBytes);
    if (!canonical) return failWith(path, canonical.error());
    if ((options_.resolved || isAsset) && *canonical != *found) return failWith(path, replaced());
    Expected<LoadedFile*> file = load(*canonical, path);
    if (!file) return tl::unexpected(file.error());
    added_.push_back(path);

    // What this file's own names may refer to ends at this pretended node.
    placed_.push_back(std::make_unique<Placed>());
    Placed* top = placed_.back().get();
    const bool takesView = options_.camerasEnabled && !(options_.placing && options_.placing->isInMetres());
    Spot spot{parent, top, top, 0, takesView};
    // A scene's names end at the file's own nodes, whatever holds them.
    const bool several = (*file)->content.node_size() != 1 || !(*file)->content.saved().empty();
    const bool placedByUs = options_.placing && (!(*file)->isScene || options_.placing->said() || (options_.gathers && several));
    if (!(*file)->isScene || placedByUs) {
        const ObjectId place = placedByUs ? create(standOf(**file, *options_.placing)) : ObjectId{};
        const Expected<Placed*> node = newNode(readName(stemOf(*canonical), "model"), place, spot);
        if (!node) return failWith(path, node.error());
        if (placedByUs) result_.place = place;
        spot = Spot{(*node)->id, *node, *node, 1, takesView};
    }
    const std::size_t drawnBefore = drawn_;
    importing_ = {*canonical};
    const Expected<std::size_t> count = countNodes(**file, spot.depth);
    if (!count) return tl::unexpected(count.error());
    if (*count > options_.maxNodes - std::min(written_, options_.maxNodes)) return failWith(path, tooManyNodes());
    const Expected<void> done = placeFile(**file, spot);
    if (!done) return done;
    if (!(*file)->isScene && drawn_ == drawnBefore)
        return fail(ErrorCode::kBadInput, path + ": there is nothing in it that can be drawn");
    for (const Placed* child : top->children) result_.tops.push_back(child->id);
    return {};
}

bool SceneAssembly::enablesCamera(const LoadedFile& file, const Spot& spot, bool wanted) {
    if (wanted && !spot.camerasEnabled && options_.placing && options_.placing->isInMetres())
        note(fmt::format("{}: its cameras do not take the view, as it stands in metres before the wall; --camera NODE does", file.label));
    return wanted && spot.camerasEnabled;
}

Transform SceneAssembly::standOf(const LoadedFile& file, const Placing& placing) {
    Transform place;
    UpAxis up = placing.up;
    if (up == UpAxis::kOfFile) {
        const bool says = file.isScene || file.content.up_axis() == kSaysZUp || file.content.up_axis() == kSaysYUp;
        const bool flat = !says && !mostlyZUp(file.path) && isFlatCloud(file);
        const bool z = says ? file.content.up_axis() == kSaysZUp : flat || mostlyZUp(file.path);
        up = z ? UpAxis::kZ : UpAxis::kY;
        if (!says)
            note(fmt::format("{}: it does not say which way is up{}; {} is taken to be (--up {} says otherwise)", file.label,
                             flat ? ", and its points lie flat as if seen from above" : "", z ? "+Z" : "+Y", z ? "y" : "z"));
    }
    if (up == UpAxis::kZ) place.rotation = Quatd(std::sqrt(0.5), -std::sqrt(0.5), 0, 0);  // Z comes to Y
    if (placing.at && !placing.fit) place.translation = *placing.at;  // with `fit`: once it is known how large it is
    if (placing.scale) place.scale = Vec3d::Constant(*placing.scale);
    return place;
}

Expected<LoadedFile*> SceneAssembly::load(const std::string& canonicalPath, const std::string& label) {
    std::unique_ptr<LoadedFile>& known = files_[canonicalPath];
    if (!known) {
        if (const auto failed = failed_.find(canonicalPath); failed != failed_.end()) return tl::unexpected(failed->second);
        if (files_.size() > kMaxFiles)
            return fail(ErrorCode::kLimit, fmt::format("{}: the scene imports more than {} files", label, kMaxFiles));
        Expected<std::unique_ptr<LoadedFile>> loaded = loadFile(canonicalPath, label, options_, result_);
        if (!loaded) return tl::unexpected(failed_.emplace(canonicalPath, loaded.error()).first->second);
        known = std::move(*loaded);
    }
    return known.get();
}

Expected<void> SceneAssembly::placeFile(LoadedFile& file, const Spot& spot) {
    const std::size_t firstPending = pending_.size(), firstParts = pendingParts_.size();
    std::map<std::uint32_t, Placed*> outerKeys = std::exchange(keys_, {});
    for (const proto::scene::Node& node : file.content.node())
        if (Expected<void> done = placeNode(file, node, spot); !done) return done;
    if (Expected<void> named = resolvePending(firstPending); !named) return named;
    for (std::size_t i = firstParts; i < pendingParts_.size(); ++i)
        if (Expected<void> named = resolveParts(file, pendingParts_[i]); !named) return named;
    pendingParts_.resize(firstParts);
    keys_ = std::move(outerKeys);
    if (!file.content.saved().empty()) return placeSaved(file, spot);
    keepBeside(file);
    return {};
}

Expected<void> SceneAssembly::placeNode(LoadedFile& file, const proto::scene::Node& node, const Spot& spot) {
    const Content content = node.content_case();
    const auto in = [&](const Error& error) {
        return failWith(
            fmt::format("{}: node '{}'", placeText(file.label, placeOfNode(node)), readName(node.name(), contentName(content))), error);
    };
    const bool hadCamera = result_.hasCamera;
    Expected<ObjectId> core = contentCore(file, node, spot);
    const bool firstCamera = result_.hasCamera && !hadCamera;
    if (!core) {
        const proto::scene::Place at = placeOf(node);
        return at.line() > 0 ? failWith(placeText(file.label, at), core.error()) : in(core.error());
    }

    ObjectId transform;
    bool evenScale = true;
    Affine3d parent_T_node = Affine3d::Identity();
    if (node.has_transform()) {
        Expected<Transform> value = readTransform(node.transform());
        if (!value) return in(value.error());
        transform = create(*value);
        evenScale = value->scale == Vec3d::Constant(value->scale.x());
        parent_T_node = value->pose().matrix;
    }
    noteControls(file, node.name());
    Expected<Placed*> own = newNode(readName(node.name(), contentName(content)), transform ? transform : *core, spot);
    if (!own) return in(own.error());
    (*own)->transform = transform;
    (*own)->evenScale = evenScale;
    (*own)->content = *core;
    (*own)->parent_T_node = parent_T_node;
    (*own)->movesOtherwise = *core && tableTypeOf(node) && tableTypeOf(node)->pose;
    if (node.key() != 0) keys_[node.key()] = *own;
    if (content == Content::kCamera && firstCamera)
        if (const Expected<void> stands = checkCamera(**own, node.camera()); !stands) return in(stands.error());
    Spot below{(*own)->id, *own, spot.top, spot.depth + 1, spot.camerasEnabled, spot.material, spot.paint};

    // A node has one core: content beside a transform goes into a node of its own below. Only what says something of
    // its children, a switch or another transform, must then hold them too.
    Placed* holder = *own;
    if (transform && *core) {
        const Expected<Placed*> inner = newNode(std::string(contentName(content)), *core, below);
        if (!inner) return in(inner.error());
        holder = *inner;
        const TypeInfo* type = tableTypeOf(node);
        if (type && (type->pose || type->effects & Effect::kVisibility || isHolder(content)))
            below.parent = holder->id, below.placed = holder, ++below.depth;
    }
    if (content == Content::kMotion)
        pending_.push_back({PendingRef::Kind::kMotionTarget, *core, holder, spot.top, node.motion().target(),
                            placeText(file.label, node.motion().at())});
    if (content == Content::kAnimation || content == Content::kSkin)
        pendingParts_.push_back({.core = *core,
                                 .animation = node.has_animation() ? &node.animation() : nullptr,
                                 .skin = node.has_skin() ? &node.skin() : nullptr,
                                 .from = holder,
                                 .top = spot.top,
                                 .where = placeText(file.label, placeOf(node))});
    if (content == Content::kInterest) {
        const proto::scene::Interest& interest = node.interest();
        const std::string where = placeText(file.label, interest.at());
        pending_.push_back({PendingRef::Kind::kInterestObject, *core, holder, spot.top, interest.object(), where});
        if (!interest.against().empty())
            pending_.push_back(
                {PendingRef::Kind::kInterestAgainst, *core, holder, spot.top, interest.against(), where});
    }
    if (content == Content::kCollisionObject) {
        const proto::scene::CollisionObject& object = node.collision_object();
        const std::string where = placeText(file.label, object.at());
        pending_.push_back({PendingRef::Kind::kCollisionNode, *core, holder, spot.top, object.node(), where});
        pending_.back().free = object.mass() > 0;
        if (object.mass() > 0 && object.has_kind() && object.kind() != proto::scene::CollisionObject::RIGID)
            note(where + ": it is not RIGID, so its mass means nothing");
        else if (object.mass() > 0 && object.division() != proto::scene::CollisionObject::WHOLE)
            note(where + ": it is divided into several objects, so its mass means nothing");
    }
    if (content == Content::kManipulator) {
        isWritten(*core, placeText(file.label, placeOfNode(node)));
        pending_.push_back({PendingRef::Kind::kManipulatorTarget, *core, holder, spot.top, node.manipulator().target(), placeText(file.label, placeOfNode(node))});
        pending_.back().free = Manipulator::isLightKind(node.manipulator().kind());
    }
    const LightNames names = lightNamesOf(node);
    for (const auto& [kind, name] : {std::pair(PendingRef::Kind::kBeacon, names.beacon), {PendingRef::Kind::kScope, names.scope}})
        if (!name.empty()) pending_.push_back({kind, *core, holder, spot.top, std::string(name), placeText(file.label, placeOfNode(node)), false, tableTypeOf(node)->type});
    if (content == Content::kImport)
        if (Expected<void> done = placeImport(file, node, below); !done) return done;
    if (content == Content::kInstance)
        if (Expected<void> done = placeInstance(file, node, below); !done) return done;

    for (const proto::scene::Node& child : node.node())
        if (Expected<void> done = placeNode(file, child, below); !done) return done;
    return {};
}

Expected<LoadedFile*> SceneAssembly::importedFile(LoadedFile& file, const proto::scene::Import& import) {
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
    if (*path != *found) return failWith(where + ": " + readName(uri, ""), replaced());
    if (std::find(importing_.begin(), importing_.end(), *path) != importing_.end())
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}: {} imports itself ({} → {})", where, *path, fmt::join(importing_, " → "), *path));
    if (importing_.size() >= options_.maxImportDepth)
        return fail(ErrorCode::kLimit, fmt::format("{}: scene files import each other deeper than {} levels", where,
                                                   options_.maxImportDepth));

    Expected<LoadedFile*> imported = load(*path, uri);
    if (!imported) return failWith(where, imported.error());
    return imported;
}

Expected<void> SceneAssembly::placeImport(LoadedFile& file, const proto::scene::Node& node, const Spot& spot) {
    const proto::scene::Import& import = node.import();
    const Expected<LoadedFile*> imported = importedFile(file, import);
    if (!imported) return tl::unexpected(imported.error());
    Spot inside = spot;
    inside.top = spot.placed;
    inside.material.clear();  // the other file's materials are other ones
    if (!spot.paint && !node.material().empty()) {
        const Expected<ObjectId> paint = materialCore(file, node.material());
        if (!paint) return failWith(placeText(file.label, placeOfNode(node)), paint.error());
        inside.paint = *paint;
    }
    inside.camerasEnabled = spot.camerasEnabled && import.cameras();
    importing_.push_back((*imported)->path);
    const Expected<void> done = placeFile(**imported, inside);
    importing_.pop_back();
    return done;
}

Expected<void> SceneAssembly::placeInstance(LoadedFile& file, const proto::scene::Node& instance, Spot spot) {
    const auto found = file.definitions.find(instance.instance());
    if (found == file.definitions.end())
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}: there is no definition '{}'", file.label, readName(instance.instance(), "")));
    if (!instance.material().empty()) spot.material = instance.material();
    for (const proto::scene::Node& node : found->second->node())
        if (Expected<void> done = placeNode(file, node, spot); !done) return done;
    return {};
}

}  // namespace tessera
