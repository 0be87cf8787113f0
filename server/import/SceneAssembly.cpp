#include "server/import/SceneAssembly.h"

#include <fmt/format.h>

#include <utility>

#include "common/math/Decompositions.h"
#include "common/wall/View.h"
#include "server/import/AssetFolders.h"
#include "server/import/ModelStand.h"
#include "server/rules/SceneRules.h"

namespace tessera {
namespace {

/// Where the content says it stands; of contents that do not, line 0.
proto::scene::Place placeOfContent(const proto::scene::Node& node) {
    if (node.has_interest()) return node.interest().at();
    if (node.has_collision_object()) return node.collision_object().at();
    if (node.has_animation()) return node.animation().at();
    if (node.has_skin()) return node.skin().at();
    return {};
}

/// Of the first enabled camera: where the wall would stand.
Expected<void> checkCamera(const PlacedNode& node, const proto::scene::Camera& camera) {
    Affine3d world_T_node = Affine3d::Identity();
    for (const PlacedNode* above = &node; above != nullptr; above = above->parent) {
        if (above->movesOtherwise) return {};  // then the server sees where it stands, in the first frame
        world_T_node = above->parent_T_node * world_T_node;
    }
    if (!world_T_node.matrix().allFinite())
        return fail(ErrorCode::kBadInput, "the camera's place in the world is not finite");
    View view;
    view.position = world_T_node.translation();
    view.orientation = Quatd(rotationOf(world_T_node)).normalized();
    if (camera.has_world_units_per_metre()) view.worldUnitsPerMetre = camera.world_units_per_metre();
    return checkStand(view);
}

}  // namespace

Expected<ImportedScene> SceneAssembly::take() {
    names_.noteDriven();
    files_.noteNoPoints();
    ImportedScene& scene = draft_.scene();
    scene.list = draft_.list().take();
    if (const Sound sound = checkRules(Aspect(), scene.list, {}); !sound) return refusal(sound.error());
    if (!scene.tops.empty()) scene.top = scene.tops.front();
    return std::move(scene);
}

tl::unexpected<Error> SceneAssembly::refusal(const Fault& fault) const {
    // Whatever an edit would be told: of a file it is a bad one.
    if (auto saved = saved_.refusal(fault)) return std::move(*saved);
    const std::string_view type = findType(fault.type)->name;
    const std::string where = draft_.whereWritten(fault.object);
    return failWith(where.empty() ? std::string(type) : fmt::format("{}: this {}", where, type),
                    {ErrorCode::kBadInput, fault.why.message});
}

Expected<void> SceneAssembly::add(const std::string& path, ObjectId parent) {
    const ImportOptions& options = draft_.options();
    const Expected<LoadedFile*> opened = files_.open(path);
    if (!opened) return tl::unexpected(opened.error());
    LoadedFile& file = **opened;

    // What this file's own names may refer to ends at this pretended node.
    PlacedNode* const top = nodes_.pretended();
    const bool takesView = options.camerasEnabled && !(options.placing && options.placing->isInMetres());
    Spot spot{.parent = parent, .placed = top, .top = top, .camerasEnabled = takesView, .exposes = options.exposes};
    // A scene's names end at the file's own nodes, whatever holds them.
    const bool several = file.content.node_size() != 1 || !file.content.saved().empty();
    const bool placedByUs =
        options.placing && (!file.hasOwnTops || options.placing->said() || (options.gathers && several));
    if (!file.hasOwnTops || placedByUs) {
        const ObjectId place = placedByUs ? draft_.create(standOf(draft_, file, *options.placing)) : ObjectId{};
        const Expected<PlacedNode*> node = nodes_.make(readName(stemOf(file.path), "model"), place, spot);
        if (!node) return failWith(path, node.error());
        if (placedByUs) draft_.scene().place = place;
        spot = Spot{.parent = (*node)->id,
                    .placed = *node,
                    .top = *node,
                    .depth = 1,
                    .camerasEnabled = takesView,
                    .exposes = options.exposes};
    }
    const std::size_t drawnBefore = draft_.drawn();
    const ImportedFiles::Within within(files_, file);
    const Expected<std::size_t> count = count_.of(file, spot.depth);
    if (!count) return tl::unexpected(count.error());
    if (!nodes_.hasRoomFor(*count)) return failWith(path, draft_.tooManyNodes());
    draft_.expect(*count);
    if (const Expected<void> done = placeFile(file, spot); !done) return done;
    if (!file.hasOwnTops && draft_.drawn() == drawnBefore) {
        // What was left away tells why.
        std::string why;
        int left = 3;
        for (const std::string& note : draft_.scene().notes)
            if (note.starts_with(file.label + ": ") && left-- > 0)
                why += (why.empty() ? ": " : "; ") + note.substr(file.label.size() + 2);
        return fail(ErrorCode::kBadInput, path + ": there is nothing in it that can be drawn" + why);
    }
    for (const PlacedNode* child : top->children) draft_.scene().tops.push_back(child->id);
    return {};
}

Expected<void> SceneAssembly::placeFile(LoadedFile& file, const Spot& spot) {
    const std::size_t namedBefore = names_.taken();
    AnimationParts::Outer outer = parts_.beginFile();
    for (const proto::scene::Node& node : file.content.node()) {
        // Of a model there is one for its lights, or its background; who takes it in says how all of it is shown.
        if (!file.isScene && node.has_environment()) {
            const bool meters = node.environment().metered();
            if (!spot.exposes)
                draft_.note(file.label + (meters ? ": as a part of something it sets no exposure"
                                                 : ": as a part of something it sets no background"));
            else if (meters)
                draft_.note(file.label + ": the wall meters its exposure (--exposure off: it does not)");
            if (!spot.exposes) continue;
        }
        if (Expected<void> done = placeNode(file, node, spot); !done) return done;
    }
    if (Expected<void> named = names_.resolve(namedBefore); !named) return named;
    if (Expected<void> named = parts_.endFile(file, std::move(outer)); !named) return named;
    if (!file.content.saved().empty()) return saved_.place(file, spot);
    saved_.keepBeside(file);
    return {};
}

Expected<void> SceneAssembly::placeNode(LoadedFile& file, const proto::scene::Node& node, const Spot& spot) {
    if (const Expected<void> wanted = draft_.goOn(); !wanted) return failWith(file.label, wanted.error());
    const std::string_view otherwise = ContentCores::nameFor(node);
    const auto in = [&](const Error& error) {
        return failWith(
            fmt::format("{}: node '{}'", placeText(file.label, placeOf(node)), readName(node.name(), otherwise)),
            error);
    };
    const bool hadCamera = draft_.scene().hasCamera;
    const Expected<ObjectId> core = contents_.make(file, node, spot);
    if (!core) {
        const proto::scene::Place at = placeOfContent(node);
        return at.line() > 0 ? failWith(placeText(file.label, at), core.error()) : in(core.error());
    }
    const bool firstCamera = draft_.scene().hasCamera && !hadCamera;

    ObjectId transform;
    bool evenScale = true;
    Affine3d parent_T_node = Affine3d::Identity();
    if (node.has_transform()) {
        const Expected<Transform> value = readTransform(node.transform());
        if (!value) return in(value.error());
        transform = draft_.create(*value);
        evenScale = value->scale == Vec3d::Constant(value->scale.x());
        parent_T_node = value->pose().matrix;
    }
    draft_.noteControls(file, node.name());
    const Expected<PlacedNode*> made =
        nodes_.make(readName(node.name(), otherwise), transform ? transform : *core, spot);
    if (!made) return in(made.error());
    PlacedNode& own = **made;
    own.transform = transform;
    own.evenScale = evenScale;
    own.content = *core;
    own.parent_T_node = parent_T_node;
    own.movesOtherwise = *core && ContentCores::moves(node);
    if (!file.isScene && node.has_environment())
        draft_.scene().exposures.insert(draft_.scene().exposures.end(), {own.id, *core});
    if (node.key() != 0) parts_.key(node.key(), &own);
    if (node.has_camera() && firstCamera)
        if (const Expected<void> stands = checkCamera(own, node.camera()); !stands) return in(stands.error());
    Spot below = spot;
    below.parent = own.id;
    below.placed = &own;
    ++below.depth;

    // A node has one core: content beside a transform goes into a node of its own below. Only what says something of
    // its children, a switch or another transform, must then hold them too.
    PlacedNode* bearer = &own;
    if (transform && *core) {
        const Expected<PlacedNode*> inner = nodes_.make(std::string(otherwise), *core, below);
        if (!inner) return in(inner.error());
        bearer = *inner;
        if (ContentCores::holdsChildren(node)) below.parent = bearer->id, below.placed = bearer, ++below.depth;
    }
    names_.take(file, node, *core, bearer, spot.top);
    parts_.take(file, node, *core, bearer, spot.top);
    if (node.has_import())
        if (Expected<void> done = placeImport(file, node, below); !done) return done;
    if (node.has_instance())
        if (Expected<void> done = placeInstance(file, node, below); !done) return done;

    for (const proto::scene::Node& child : node.node())
        if (Expected<void> done = placeNode(file, child, below); !done) return done;
    return {};
}

Expected<void> SceneAssembly::placeImport(LoadedFile& file, const proto::scene::Node& node, const Spot& spot) {
    const Expected<LoadedFile*> imported = files_.imported(file, node.import());
    if (!imported) return tl::unexpected(imported.error());
    Spot inside = spot;
    inside.top = spot.placed;
    inside.paint.otherwise.clear();  // the other file's materials are other ones
    if (!spot.paint.over && !node.material().empty()) {
        const Expected<ObjectId> paint = materials_.material(file, node.material());
        if (!paint) return failWith(placeText(file.label, placeOf(node)), paint.error());
        inside.paint.over = *paint;
    }
    inside.camerasEnabled = spot.camerasEnabled && node.import().cameras();
    inside.exposes = false;
    const ImportedFiles::Within within(files_, **imported);
    return placeFile(**imported, inside);
}

Expected<void> SceneAssembly::placeInstance(LoadedFile& file, const proto::scene::Node& instance, Spot spot) {
    const auto found = file.definitions.find(instance.instance());
    if (found == file.definitions.end())
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}: there is no definition '{}'", file.label, readName(instance.instance(), "")));
    if (!instance.material().empty()) spot.paint.otherwise = instance.material();
    for (const proto::scene::Node& node : found->second->node())
        if (Expected<void> done = placeNode(file, node, spot); !done) return done;
    return {};
}

}  // namespace tessera
