#include "server/import/reader/UsdReader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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
    if (nodes_ > limits_.maxNodes)
        return fail(ErrorCode::kLimit, fmt::format("the scene has more than {} nodes", limits_.maxNodes));
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

bool UsdReader::isLeftOut(const UsdComposedPrim& prim) {
    const std::string& type = prim.type();
    if (isNothingByItself(type)) return true;
    const std::string purpose = usdWord(prim, "purpose", "default");
    if (purpose == "guide" || purpose == "proxy") {
        remarks_.add(fmt::format("of purpose {} are hidden", purpose), prim.path());
        return true;
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
    if (transform.moves() && !inPrototype_) {
        Node* const node = above.make();
        node->set_name(prim.name());
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
        node->set_name(prim.name());
        return node;
    }
    return addPlacedNode(above.make, prim.name(), map);
}

Expected<void> UsdReader::addGeometry(const UsdComposedPrim& prim, const Above& inside, Node& node, bool ownNodes) {
    const Expected<std::vector<UsdPart>> parts = meshes_.parts(prim, inside.material);
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
            *content->mutable_subdivision_surface() = *part.surface;
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
    if (!prim.active() || isLeftOut(prim)) return {};
    if (above.depth > limits_.maxDepth)
        return fail(ErrorCode::kLimit, fmt::format("nodes are nested deeper than {} levels", limits_.maxDepth));
    if (Expected<void> counted = countNodes(1); !counted) return counted;
    Above inside = above;
    ++inside.depth;
    inside.parent_T_above = Affine3d::Identity();
    Node* const node = place(prim, above, inside.world_T_parent);
    inside.make = [node] { return node->add_node(); };
    if (const std::string bound = usdBoundMaterial(prim); !bound.empty() && !above.materialHolds) {
        inside.material = bound;
        const UsdValue* strength = prim.metadata("material:binding", "bindMaterialAs");
        inside.materialHolds =
            strength != nullptr && strength->word() != nullptr && *strength->word() == "strongerThanDescendants";
    }
    bool ownNodes = false;
    if (const std::optional<UsdAttribute> visibility = prim.attribute("visibility"); visibility && visibility->value) {
        addVisibility(prim, *visibility, *node);
        ownNodes = node->has_switch_();
    }
    if (prim.type() == "PointInstancer") return addInstances(prim, inside);
    if (isUsdGeometry(prim.type())) {
        if (Expected<void> done = addGeometry(prim, inside, *node, ownNodes); !done) return done;
    } else if (prim.type() == "Camera") {
        cameras_.push_back({std::make_shared<UsdComposedPrim>(prim), inside.world_T_parent, node});
    } else {
        const Expected<bool> light = addLight(prim, inside.world_T_parent, *node);
        if (!light) return tl::unexpected(light.error());
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
    if (Expected<void> done = walkChildren(**root, above); !done) return tl::unexpected(done.error());
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
    return UsdReader(stage, files, remarks, limits).read();
}

}  // namespace tessera
