#include "server/import/reader/UsdReader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/Utf8.h"
#include "common/base/WrittenByTessera.h"
#include "common/confine/Confinement.h"
#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/ReadScene.h"

namespace tessera {
namespace {

/// As USD has it where a file does not say.
constexpr double kCentimetre = 0.01;

/// Types that are shapes, whether they are read here or named.
bool isUsdGeometry(const std::string& type) {
    static const std::set<std::string> kTypes = {
        "Mesh",    "Points",    "BasisCurves", "Cube",       "Sphere",      "Cylinder",      "Cylinder_1", "Cone",
        "Capsule", "Capsule_1", "Plane",       "NurbsPatch", "NurbsCurves", "HermiteCurves", "TetMesh",    "Volume"};
    return kTypes.contains(type);
}

/// Of a purpose that is not to be seen in a picture.
bool isUsdHelper(const std::string& purpose) {
    return purpose == "guide" || purpose == "proxy";
}

/// Whether it shines besides what it is.
bool usdIsLight(const UsdComposedPrim& prim) {
    const UsdValue* schemas = prim.metadata("apiSchemas");
    const UsdValue::Words* names = schemas != nullptr ? schemas->words() : nullptr;
    return names != nullptr && std::ranges::any_of(*names, [](const std::string& name) {
               return name == "MeshLightAPI" || name == "LightAPI";
           });
}

/// What holds others, or is looked at elsewhere.
bool isUsdGroup(const std::string& type) {
    static const std::set<std::string> kTypes = {"", "Xform", "Scope", "SkelRoot", "Camera", "PointInstancer"};
    return kTypes.contains(type);
}

/// What people call it, which may be more than an identifier can say.
std::string usdShownName(const UsdComposedPrim& prim) {
    const UsdValue* said = prim.metadata("displayName");
    const std::string* word = said != nullptr ? said->word() : nullptr;
    return word != nullptr && !word->empty() && isUtf8(*word) ? *word : prim.name();
}

bool isByTessera(const UsdStage& stage) {
    const UsdValue* data = stage.metadata("customLayerData");
    const UsdValue::Dictionary* said = data != nullptr ? data->dictionary() : nullptr;
    if (said == nullptr) return false;
    const auto creator = said->find("creator");
    return creator != said->end() && creator->second.word() != nullptr && isWrittenByTessera(*creator->second.word());
}

/// What says how others look or move, and is nothing by itself.
bool isNothingByItself(const std::string& type) {
    static const std::set<std::string> kTypes = {"Material",       "Shader",        "NodeGraph",     "GeomSubset",
                                                 "RenderSettings", "RenderProduct", "RenderVar",     "LightFilter",
                                                 "BlendShape",     "SkelAnimation", "PhysicsScene",  "Backdrop",
                                                 "OpenVDBAsset",   "Field3DAsset",  "CollisionGroup"};
    return kTypes.contains(type) || type.starts_with("Physics");
}

}  // namespace

Expected<void> UsdReader::countNodes(std::size_t nodes) {
    nodes_ += nodes;
    if (nodes_ > limits_.nodesOf(bytesGranted())) return fail(ErrorCode::kLimit, limits_.tooManyNodes(bytesGranted()));
    return {};
}

Expected<void> UsdReader::setStage() {
    const UsdValue* up = stage_.metadata("upAxis");
    const bool z = up != nullptr && up->word() != nullptr && (*up->word() == "Z" || *up->word() == "z");
    scene_.file.set_up_axis(z ? 3 : 2);  // proto/scene.proto
    const UsdValue* unit = stage_.metadata("metersPerUnit");
    metersPerUnit_ = unit == nullptr ? kCentimetre : unit->number().value_or(0);
    if (!(metersPerUnit_ >= 1e-9 && metersPerUnit_ <= 1e9)) {
        scene_.note(fmt::format("its unit is {} metres, which is none: metres are taken", metersPerUnit_));
        metersPerUnit_ = 1;
    } else if (unit == nullptr) {
        scene_.note("it does not say its unit: centimetres are taken, as USD has it (--scale 100: metres)");
    }
    return {};
}

Expected<bool> UsdReader::showsBelow(const UsdComposedPrim& prim, std::size_t depth) {
    if (depth > limits_.maxDepth) return false;
    for (const std::string& name : prim.childNames()) {
        const Expected<UsdStage::Prim> child = stage_.child(prim, name);
        if (!child) return tl::unexpected(child.error());
        if ((*child)->specifier() != UsdPrim::Specifier::kDef || !(*child)->active()) continue;
        if (!isUsdHelper(usdWord(**child, "purpose", "guide"))) return true;
        const Expected<bool> below = showsBelow(**child, depth + 1);
        if (!below || *below) return below;
    }
    return false;
}

Expected<bool> UsdReader::holdsLooksAlone(const UsdComposedPrim& prim) {
    const std::vector<std::string> names = prim.childNames();
    for (const std::string& name : names) {
        const Expected<UsdStage::Prim> child = stage_.child(prim, name);
        if (!child) return tl::unexpected(child.error());
        if (!isNothingByItself((*child)->type())) return false;
    }
    return !names.empty();
}

Expected<bool> UsdReader::isLeftOut(const UsdComposedPrim& prim, Above& inside) {
    const std::string& type = prim.type();
    if (isNothingByItself(type)) return true;
    if (type == "Scope") {
        const Expected<bool> looks = holdsLooksAlone(prim);
        if (!looks || *looks) return looks;
    }
    inside.purpose = usdWord(prim, "purpose", inside.purpose.c_str());
    if (isUsdHelper(inside.purpose)) {
        const Expected<bool> shown = showsBelow(prim, inside.depth);
        if (!shown) return shown;
        if (!*shown || isUsdGeometry(type))
            remarks_.add(fmt::format("of purpose {} are hidden", inside.purpose), prim.path());
        if (!*shown) return true;
    }
    if (type == "Skeleton") {
        remarks_.add("skeletons are left out; meshes stand as they are at rest", prim.path());
        return true;
    }
    return false;
}

UsdReader::Node* UsdReader::place(const UsdComposedPrim& prim, const Above& above, Affine3d& world_T_prim) {
    const UsdTransform transform(prim, remarks_);
    Affine3d before = above.parent_T_above;
    world_T_prim = above.world_T_parent * transform.at();
    if (transform.resetsStack()) {
        // Where it stands does not follow those above: what they do is taken back.
        const Affine3d world_T_above = above.world_T_parent * above.parent_T_above.inverse();
        if (std::abs(world_T_above.linear().determinant()) > 1e-300) {
            const Affine3d units(Eigen::Scaling(metersPerUnit_));
            before = world_T_above.inverse() * units;
            world_T_prim = units * transform.at();
        } else {
            remarks_.add("transforms that leave out singular ones above stand below them", prim.path());
        }
    }
    if (transform.resetsStack() && above.moves)
        remarks_.add("prims that leave out the transforms above follow what of these moves", prim.path());
    if (transform.moves() && !inPrototype_) {
        Node* const node = above.make();
        node->set_name(usdShownName(prim));
        addKeys(prim, transform, before, *node);
        return node;
    }
    if (transform.moves()) remarks_.add("prototypes that move stand still", prim.path());
    Affine3d map = before * transform.at();
    if (!map.matrix().allFinite() || map.matrix().cwiseAbs().maxCoeff() > 1e15) {
        remarks_.add("transforms beyond 1e15 are left out", prim.path());
        map = Affine3d::Identity();
        world_T_prim = above.world_T_parent;
    }
    if (map.matrix() == Affine3d::Identity().matrix()) {
        Node* const node = above.make();
        node->set_name(usdShownName(prim));
        return node;
    }
    return addPlacedNode(above.make, usdShownName(prim), map);
}

/// As it is, equal ones become one core; of very many as instances of a definition of its own.
void UsdReader::placeSurface(const UsdPart& part, Node& node) {
    const auto [known, isNew] = surfaces_.try_emplace(part.surface.get());
    const std::size_t bytes = part.surface->ByteSizeLong();
    if (isNew || bytes <= surfaceBytes_) {
        if (!isNew) surfaceBytes_ -= bytes;
        *node.mutable_subdivision_surface() = *part.surface;
        return;
    }
    if (known->second.empty()) {
        proto::scene::Definition& definition = *scene_.file.add_definition();
        known->second = fmt::format("surface {}", surfaces_.size());
        definition.set_name(known->second);
        Node& inside = *definition.add_node();
        inside.set_name("surface");
        *inside.mutable_subdivision_surface() = *part.surface;
    }
    node.set_instance(known->second);
}

Expected<void> UsdReader::addGeometry(const UsdComposedPrim& prim, const Above& inside, Node& node, bool ownNodes) {
    const Expected<std::vector<UsdPart>> parts =
        meshes_.parts(prim, {inside.material, inside.materialHolds, inside.primvars.get()});
    if (!parts) return tl::unexpected(parts.error());
    for (const std::string_view schema : {"skel:skeleton", "skel:blendShapeTargets"})
        if (!prim.targets(std::string(schema)).empty())
            remarks_.add(schema == "skel:skeleton" ? "meshes with a skeleton stand as they are at rest"
                                                   : "blend shapes are left out",
                         prim.path());
    for (std::size_t i = 0; i < parts->size(); ++i) {
        const UsdPart& part = (*parts)[i];
        Node* content = &node;
        if (ownNodes || parts->size() > 1) {
            content = inside.make();
            content->set_name(fmt::format("part {}", i));
            if (Expected<void> counted = countNodes(1); !counted) return counted;
        }
        if (part.surface) {
            placeSurface(part, *content);
        } else {
            content->mutable_geometry()->set_mesh(part.mesh);
            content->mutable_geometry()->set_material(part.material);
        }
        bounds_.extend(part.bounds.transformed(inside.world_T_parent));
    }
    return {};
}

Expected<void> UsdReader::walkChildren(const UsdComposedPrim& prim, const Above& above) {
    for (const std::string& name : prim.childNames()) {
        const Expected<UsdStage::Prim> child = stage_.child(prim, name);
        if (!child) return tl::unexpected(child.error());
        if ((*child)->specifier() != UsdPrim::Specifier::kDef) continue;
        if (Expected<void> done = walk(**child, above); !done) return done;
    }
    return {};
}

Expected<void> UsdReader::walk(const UsdComposedPrim& prim, const Above& above) {
    if (!prim.active()) return {};
    if (above.depth > limits_.maxDepth)
        return fail(ErrorCode::kLimit, fmt::format("nodes are nested deeper than {} levels", limits_.maxDepth));
    Above inside = above;
    const Expected<bool> leftOut = isLeftOut(prim, inside);
    if (!leftOut) return tl::unexpected(leftOut.error());
    if (*leftOut) return {};
    if (Expected<void> counted = countNodes(1); !counted) return counted;
    ++inside.depth;
    inside.parent_T_above = Affine3d::Identity();
    Node* const node = place(prim, above, inside.world_T_parent);
    inside.moves = above.moves || node->key() != 0;
    inside.make = [node] { return node->add_node(); };
    if (const std::string bound = usdBoundMaterial(prim); !bound.empty() && !above.materialHolds) {
        inside.material = bound;
        const UsdValue* strength = prim.metadata("material:binding", "bindMaterialAs");
        inside.materialHolds =
            strength != nullptr && strength->word() != nullptr && *strength->word() == "strongerThanDescendants";
    }
    if (usdHasCollections(prim)) remarks_.add("materials that are bound to collections are left out", prim.path());
    bool ownNodes = false;
    if (const std::optional<UsdAttribute> visibility = prim.attribute("visibility"); visibility && visibility->value) {
        addVisibility(prim, *visibility, *node);
        ownNodes = node->has_switch_();
        inside.hidden = inside.hidden || (ownNodes && visibility->samples.size() < 2);
    }
    if (prim.metadata("clips") != nullptr) remarks_.add("value clips are left out", prim.path());
    if (prim.type() == "PointInstancer") {
        inside.primvars = usdInheritedBelow(prim, above.primvars, remarks_);
        return addInstances(prim, inside, *node, ownNodes);
    }
    if (isUsdGeometry(prim.type())) {
        if (isUsdHelper(inside.purpose)) return walkChildren(prim, inside);
        if (Expected<void> done = addGeometry(prim, inside, *node, ownNodes); !done) return done;
        if (usdIsLight(prim)) remarks_.add("meshes that are lights, too, light nothing", prim.path());
    } else if (prim.type() == "Camera") {
        cameras_.push_back({std::make_shared<UsdComposedPrim>(prim), inside.world_T_parent, node});
    } else {
        const Expected<bool> light = addLight(prim, inside, *node, ownNodes);
        if (!light) return tl::unexpected(light.error());
        if (!*light && !isUsdGroup(prim.type()))
            remarks_.add(fmt::format("of type {}, which is not read, are left out", prim.type()), prim.path());
        inside.primvars = usdInheritedBelow(prim, above.primvars, remarks_);
    }
    return walkChildren(prim, inside);
}

Expected<PlainScene> UsdReader::read() {
    if (Expected<void> done = setStage(); !done) return tl::unexpected(done.error());
    const Expected<UsdStage::Prim> root = stage_.root();
    if (!root) return tl::unexpected(root.error());
    Above above;
    above.make = [this] { return scene_.file.add_node(); };
    above.parent_T_above = Affine3d(Eigen::Scaling(metersPerUnit_));
    above.world_T_parent = above.parent_T_above;
    Expected<UsdStage::Prim> top = *root;
    // Of our own files all is below one prim that is named after the file, as USD wants it, and says nothing else.
    if (const std::vector<std::string> names = (*root)->childNames(); isByTessera(stage_) && names.size() == 1) {
        const Expected<UsdStage::Prim> only = stage_.child(**root, names.front());
        if (!only) return tl::unexpected(only.error());
        const std::set<std::string> said = (*only)->propertyNames();
        if ((*only)->specifier() == UsdPrim::Specifier::kDef && (*only)->active() && (*only)->type() == "Xform" &&
            said.empty()) {
            scene_.file.set_by_tessera(true);
            top = *only;
        }
    }
    if (Expected<void> done = walkChildren(**top, above); !done) return tl::unexpected(done.error());
    addCameras();
    addAnimation();
    for (const Light& light : lights_) light_.add(light.intensity, light.falloff, light.at, bounds_);
    if (!dome_) light_.addExposure(scene_);
    materials_.finish();
    for (std::string& line : remarks_.lines()) scene_.note(std::move(line));
    return std::move(scene_);
}

Expected<PlainScene> readUsd(const std::string& path, const ReadLimits& limits) {
    const std::size_t slash = std::max<std::size_t>(path.rfind('/'), 1);
    const FolderFiles folder(path.substr(0, slash), limits.maxFileBytes);
    UsdRemarks remarks;
    const auto readFile = [&](const std::string& name) -> Expected<Bytes> {
        const Expected<FolderFiles::Found> found = folder.find(name);
        if (!found) return tl::unexpected(found.error());
        if (!found->note.empty()) remarks.add("files that are elsewhere", found->note);
        return folder.readFound(*found);
    };
    const UsdLayerLimits layerLimits{.maxDepth = limits.maxDepth, .maxSpecs = limits.maxNodes};
    UsdFiles files(readFile, layerLimits);
    UsdStage stage(files, remarks);
    if (Expected<void> opened = stage.open(path.substr(path.rfind('/') + 1)); !opened)
        return tl::unexpected(opened.error());
    std::vector<UsdChoice> choices;
    for (const std::string& said : limits.variants) {
        const std::size_t set = said.find(':'), name = said.find('=', set == std::string::npos ? 0 : set);
        if (!said.starts_with('/') || set == std::string::npos || name == std::string::npos)
            return fail(ErrorCode::kUsage,
                        fmt::format("--variant {}: it has to be PRIM:SET=NAME, as /Chair:color=red", said));
        choices.push_back({said.substr(0, set), said.substr(set + 1, name - set - 1), said.substr(name + 1)});
    }
    if (Expected<void> chosen = stage.choose(choices); !chosen) return tl::unexpected(chosen.error());
    return UsdReader(stage, files, remarks, limits).read();
}

}  // namespace tessera
