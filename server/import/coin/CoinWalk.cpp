#include "server/import/coin/CoinWalk.h"

#include <Inventor/VRMLnodes/SoVRML.h>
#include <Inventor/VRMLnodes/SoVRMLNodes.h>
#include <Inventor/elements/SoComplexityElement.h>
#include <Inventor/elements/SoComplexityTypeElement.h>
#include <Inventor/elements/SoModelMatrixElement.h>
#include <Inventor/fields/SoSFNode.h>
#include <Inventor/misc/SoChildList.h>
#include <Inventor/nodekits/SoBaseKit.h>
#include <Inventor/nodes/SoNodes.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/Utf8.h"
#include "common/base/WrittenByTessera.h"
#include "server/import/coin/CoinNodes.h"
#include "server/import/reader/CameraStand.h"

namespace tessera {
namespace {

Affine3d affineOf(const SbMatrix& matrix) {
    Affine3d map = Affine3d::Identity();
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column) map(row, column) = matrix[column][row];
    return map;
}

bool isSound(const Affine3d& map) {
    return map.matrix().cwiseAbs().maxCoeff() <= 1e15;
}

/// What a small file may become; a large one a node for each of its bytes besides.
constexpr std::size_t kAlwaysNodes = 100'000;
/// The same of triangles, lines and points, and of an Extrusion's faces, which a few points are enough for.
constexpr std::size_t kAlwaysParts = 1'000'000, kPartsPerByte = 24, kAlwaysFaces = 400'000, kFacesPerByte = 4;

/// Kinds whose work is done elsewhere, or that show nothing by themselves.
bool isSilent(const SoNode& node) {
    return is<SoVRMLInterpolator>(node) || is<SoVRMLTimeSensor>(node) || is<SoVRMLWorldInfo>(node) ||
           is<SoInfo>(node) || is<SoLabel>(node) || is<SoCacheHint>(node) || is<SoTransparencyType>(node) ||
           is<SoVRMLAppearance>(node) || is<SoVRMLGeometry>(node) || is<SoPickStyle>(node);
}

/// Kinds that change what is seen or heard, and have nothing here that would.
bool isLost(const SoNode& node) {
    return is<SoVRMLFog>(node) || is<SoEnvironment>(node) || is<SoVRMLSound>(node) || is<SoVRMLAudioClip>(node) ||
           is<SoVRMLNavigationInfo>(node) || is<SoVRMLSensor>(node) || is<SoVRMLTouchSensor>(node) ||
           is<SoVRMLDragSensor>(node) || is<SoVRMLScript>(node) || is<SoClipPlane>(node) || is<SoTexture3>(node) ||
           is<SoTextureCubeMap>(node) || is<SoBumpMap>(node) || is<SoShaderProgram>(node) || is<SoImage>(node) ||
           is<SoMarkerSet>(node) || is<SoIndexedMarkerSet>(node) || is<SoVRMLMovieTexture>(node) ||
           is<SoNurbsSurface>(node) || is<SoNurbsCurve>(node) || is<SoIndexedNurbsSurface>(node) ||
           is<SoIndexedNurbsCurve>(node) || is<SoSceneTexture2>(node) || is<SoResetTransform>(node) ||
           is<SoPolygonOffset>(node);
}

struct FormatName : SoNode {
    static const char* of(const SoNode& node) { return (node.*(&FormatName::getFileFormatName))(); }
};

std::vector<std::string> stringsOf(const SoMFString& field) {
    std::vector<std::string> all;
    for (int i = 0; i < field.getNum(); ++i) all.emplace_back(field[i].getString());
    return all;
}

void setRotation(proto::scene::Rotation& to, const SbRotation& from) {
    float x = 0, y = 0, z = 0, w = 1;
    from.getValue(x, y, z, w);
    to.mutable_quaternion()->set_w(w);
    to.mutable_quaternion()->set_x(x);
    to.mutable_quaternion()->set_y(y);
    to.mutable_quaternion()->set_z(z);
}

}  // namespace

std::string kindOf(const SoNode& node) {
    std::string kind = FormatName::of(node);
    if (kind.starts_with("VRML")) kind.erase(0, 4);
    return kind.substr(0, 80);
}

CoinWalk::CoinWalk(const std::string& path, std::size_t textBytes, const ReadLimits& limits, CoinFiles& files,
                   PlainScene& scene)
    : limits_(limits),
      files_(files),
      scene_(scene),
      shapes_(action_, kAlwaysParts + kPartsPerByte * textBytes),
      motion_(scene, leftOut_),
      morphs_(motion_, leftOut_, textBytes),
      materials_(files, limits, motion_, scene),
      fileNow_{path},
      mostNodes_(std::min(limits.maxNodes, kAlwaysNodes + textBytes)),
      extrudedFaces_(kAlwaysFaces + kFacesPerByte * textBytes),
      movingNumbers_(kAlwaysParts + kPartsPerByte * textBytes) {}

Expected<void> CoinWalk::walk(SoNode& root) {
    root_ = &root;
    action_.addPreCallback(
        SoNode::getClassTypeId(),
        [](void* self, SoCallbackAction* action, const SoNode* node) {
            CoinWalk& walk = *static_cast<CoinWalk*>(self);
            if (node != walk.root_) return SoCallbackAction::CONTINUE;
            walk.root_ = nullptr;  // from here on the walk goes by itself
            // VRML has no word for it; rounder than Inventor's half.
            SoComplexityElement::set(action->getState(), 0.8f);
            SoComplexityTypeElement::set(action->getState(), SoComplexityTypeElement::OBJECT_SPACE);
            walk.readOwnNames(*node);
            std::set<std::string> names;
            Place top{[&] { return walk.scene_.file.add_node(); }, "", Affine3d::Identity(), &names, 1};
            walk.result_ = walk.visitChildren(const_cast<SoNode&>(*node), top);
            return SoCallbackAction::PRUNE;
        },
        this);
    action_.apply(&root);
    if (result_) finish();
    return result_;
}

void CoinWalk::readOwnNames(const SoNode& root) {
    const SoChildList* const children = root.getChildren();
    for (int i = 0; children != nullptr && i < children->getLength(); ++i) {
        const SoNode& child = *(*children)[i];
        if (!is<SoVRMLWorldInfo>(child)) continue;
        const std::vector<std::string> info = stringsOf(as<SoVRMLWorldInfo>(child).info);
        if (info.empty() || !isWrittenByTessera(info.front())) continue;
        scene_.file.set_by_tessera(true);
        for (const std::string& line : info)
            if (const std::size_t end = line.find('='); end != std::string::npos && isUtf8(line))
                ownNames_.emplace(line.substr(0, end), line.substr(end + 1));
    }
}

std::string CoinWalk::calledName(const SoNode& node) {
    constexpr std::size_t kShown = 40;
    const std::string_view said = node.getName().getString();
    if (said.size() > kLongestName)
        leftOut_.add(fmt::format("of a name what is beyond {} bytes is left out", kLongestName),
                     std::string(cutUtf8(nameOf(node), kShown)) + "…");
    const auto other = ownNames_.find(std::string(said));
    return other == ownNames_.end() ? nameOf(node) : other->second;
}

Expected<void> CoinWalk::visit(SoNode& node, Place& at) {
    if (at.depth > limits_.maxDepth)
        return fail(ErrorCode::kLimit, fmt::format("nodes are nested deeper than {} levels", limits_.maxDepth));
    if (!above_.insert(&node).second) {
        leaveOut("uses of a node inside itself", node);
        return {};
    }
    motion_.hold(node);
    Expected<void> done = visitKnown(node, at);
    above_.erase(&node);
    return done;
}

Expected<void> CoinWalk::visitKnown(SoNode& node, Place& at) {
    SoState& state = *action_.getState();
    if (is<SoVRMLShape>(node)) return addVrmlShape(static_cast<SoVRMLShape&>(node), at);
    if (is<SoVRMLTransform>(node)) return addTransform(static_cast<SoVRMLTransform&>(node), at);
    if (is<SoVRMLSwitch>(node) || is<SoSwitch>(node)) return addSwitch(node, at);
    if (is<SoVRMLLOD>(node) || is<SoLOD>(node) || is<SoLevelOfDetail>(node)) return addLevels(node, at);
    if (is<SoVRMLInline>(node)) return addFile(node, stringsOf(static_cast<SoVRMLInline&>(node).url), at);
    if (is<SoWWWInline>(node)) return addFile(node, {static_cast<SoWWWInline&>(node).name.getValue().getString()}, at);
    if (is<SoFile>(node)) return addFile(node, {static_cast<SoFile&>(node).name.getValue().getString()}, at);
    if (is<SoArray>(node) || is<SoMultipleCopy>(node)) return addCopies(node, at);
    if (is<SoVRMLLight>(node) || is<SoLight>(node)) return addLight(node, at);
    if (is<SoVRMLViewpoint>(node) || is<SoCamera>(node)) return addView(node, at);
    if (is<SoVRMLBackground>(node)) {
        addBackground(node);
        return {};
    }
    if (isLost(node)) {
        motion_.passOver(node);
        leaveOut(is<SoVRMLScript>(node) ? "Script (programs of files are not run)" : kindOf(node), node);
        return {};
    }
    if (isSilent(node)) return {};
    if (is<SoText2>(node) || is<SoText3>(node) || is<SoAsciiText>(node)) {
        const CoinLook look = lookOf(action_);
        return addText(node, {.look = look}, at);
    }
    if (is<SoShape>(node)) return addShape(node, at);
    if (is<SoTexture2>(node)) texture_ = &node;
    if (node.getTypeId().getName() == SbName("UnknownNode")) {
        leaveOut(kindOf(node), node);
        return {};
    }
    // Manipulators are what they move, and their handles are none of the scene.
    if (node.getChildren() != nullptr && !is<SoTransformation>(node)) {
        const bool keeps = is<SoSeparator>(node) || is<SoVRMLParent>(node) || is<SoBaseKit>(node);
        const SoNode* const texture = texture_;
        if (keeps || is<SoTransformSeparator>(node)) {
            const bool all = keeps;
            if (all) state.push();
            const SbMatrix before = SoModelMatrixElement::get(&state);
            Expected<void> done = addGroup(node, at);
            SoModelMatrixElement::set(&state, &node, before);
            if (all) state.pop();
            if (all) texture_ = texture;
            return done;
        }
        return addGroup(node, at);
    }
    action_.traverse(&node);
    return {};
}

Expected<void> CoinWalk::visitChildren(SoNode& node, Place& in) {
    const SoChildList* const children = node.getChildren();
    for (int i = 0; children != nullptr && i < children->getLength(); ++i)
        if (Expected<void> done = visit(*(*children)[i], in); !done) return done;
    return {};
}

Affine3d CoinWalk::modelMatrix() const {
    return affineOf(SoModelMatrixElement::get(action_.getState()));
}

void CoinWalk::resetModelMatrix() {
    SoModelMatrixElement::makeIdentity(action_.getState(), nullptr);
}

/// What its children change of the matrix goes on behind a group that keeps nothing.
Expected<void> CoinWalk::addGroup(SoNode& node, Place& at) {
    const SbMatrix outside = SoModelMatrixElement::get(action_.getState());
    Expected<Opened> opened = open(node, kindOf(node).c_str(), at);
    if (!opened) return tl::unexpected(opened.error());
    if (opened->node == nullptr) return {};
    opened->place.names = &opened->names;
    if (is<SoVRMLBillboard>(node)) {
        // A core of its own, below what places it.
        Message* const turned = opened->node->add_node();
        turned->set_name("billboard");
        const SbVec3f axis = static_cast<SoVRMLBillboard&>(node).axisOfRotation.getValue();
        if (axis == SbVec3f(0, 0, 0))
            turned->mutable_billboard()->set_point(true);
        else
            setVector(*turned->mutable_billboard()->mutable_axis(), axis);
        opened->place.make = [turned] { return turned->add_node(); };
        opened->place.path += "/billboard";
    }
    if (Expected<void> done = visitChildren(node, opened->place); !done) return done;
    SbMatrix inside = SoModelMatrixElement::get(action_.getState());
    SoModelMatrixElement::set(action_.getState(), &node, inside.multRight(outside));
    return {};
}

Expected<void> CoinWalk::addTransform(SoVRMLTransform& node, Place& at) {
    SoState& state = *action_.getState();
    const bool moves = motion_.hold(node);
    state.push();
    const bool centred =
        motion_.drives(node, "center") || motion_.drives(node, "scaleOrientation") ||
        node.center.getValue() != SbVec3f(0, 0, 0) ||
        (node.scaleOrientation.getValue() != SbRotation::identity() && node.scale.getValue() != SbVec3f(1, 1, 1));
    SbMatrix matrix;
    matrix.setTransform(node.translation.getValue(), node.rotation.getValue(), node.scale.getValue(),
                        node.scaleOrientation.getValue(), node.center.getValue());
    Expected<Opened> opened;
    if (!moves) {
        SoModelMatrixElement::mult(&state, &node, matrix);
        opened = open(node, "Transform", at);
    } else {
        // Its parts as they are: what moves replaces one of them, and leaves the others.
        const std::string name = calledName(node);
        opened = openMoving(node, name.empty() ? "Transform" : name, at);
        if (opened && opened->node != nullptr) {
            opened->place.world = opened->place.world * affineOf(matrix);
            if (centred) {
                proto::scene::ComponentTransform& parts = *opened->node->mutable_component_transform();
                opened->node->clear_transform();
                setVector(*parts.mutable_translation(), node.translation.getValue());
                setVector(*parts.mutable_center(), node.center.getValue());
                setRotation(*parts.mutable_rotation(), node.rotation.getValue());
                setRotation(*parts.mutable_scale_orientation(), node.scaleOrientation.getValue());
                parts.mutable_scale()->set_x(node.scale.getValue()[0]);
                parts.mutable_scale()->set_y(node.scale.getValue()[1]);
                parts.mutable_scale()->set_z(node.scale.getValue()[2]);
            } else {
                float x = 0, y = 0, z = 0, w = 1;
                node.rotation.getValue().getValue(x, y, z, w);
                const SbVec3f t = node.translation.getValue(), s = node.scale.getValue();
                setTransform(*opened->node->mutable_transform(), {t[0], t[1], t[2]}, Quatd(w, x, y, z),
                             {s[0], s[1], s[2]});
            }
            motion_.addTarget(node, *opened->node);
        }
        resetModelMatrix();
    }
    Expected<void> done;
    if (!opened) {
        done = tl::unexpected(opened.error());
    } else if (opened->node != nullptr) {
        opened->place.names = &opened->names;
        done = visitChildren(node, opened->place);
    }
    state.pop();
    return done;
}

/// SoArray and SoMultipleCopy: the children at several places.
Expected<void> CoinWalk::addCopies(SoNode& node, Place& at) {
    SoState& state = *action_.getState();
    std::vector<SbMatrix> places;
    if (is<SoMultipleCopy>(node)) {
        const SoMFMatrix& all = static_cast<SoMultipleCopy&>(node).matrix;
        for (int i = 0; i < all.getNum(); ++i) places.push_back(all[i]);
    } else {
        const auto& array = static_cast<SoArray&>(node);
        const std::array<int, 3> counts = {array.numElements1.getValue(), array.numElements2.getValue(),
                                           array.numElements3.getValue()};
        double all = 1;
        for (const int count : counts) all *= std::max(count, 0);
        if (all > static_cast<double>(limits_.maxNodes))
            return fail(ErrorCode::kLimit, fmt::format("the scene has more than {} nodes", limits_.maxNodes));
        // Where the first one is, of each axis: 0, half of the way back, all of it.
        const auto back = [&](int count) {
            return array.origin.getValue() == SoArray::FIRST    ? 0.0f
                   : array.origin.getValue() == SoArray::CENTER ? 0.5f * static_cast<float>(count - 1)
                                                                : static_cast<float>(count - 1);
        };
        for (int k = 0; k < counts[2]; ++k)
            for (int j = 0; j < counts[1]; ++j)
                for (int i = 0; i < counts[0]; ++i) {
                    SbMatrix place;
                    place.setTranslate(array.separation1.getValue() * (static_cast<float>(i) - back(counts[0])) +
                                       array.separation2.getValue() * (static_cast<float>(j) - back(counts[1])) +
                                       array.separation3.getValue() * (static_cast<float>(k) - back(counts[2])));
                    places.push_back(place);
                }
    }
    const SoNode* const texture = texture_;
    for (const SbMatrix& place : places) {
        state.push();
        SoModelMatrixElement::mult(&state, &node, place);
        Expected<void> done = addGroup(node, at);
        state.pop();
        texture_ = texture;
        if (!done) return done;
    }
    return {};
}

Expected<void> CoinWalk::addFile(SoNode& node, const std::vector<std::string>& names, Place& at) {
    std::string why = "it has no name";
    for (const std::string& name : names) {
        if (name.empty()) continue;
        const Expected<std::string> path = files_.find(name, fileNow_.back());
        if (!path) {
            why = fmt::format("'{}': {}", name.substr(0, 200), path.error().message);
            continue;
        }
        if (std::ranges::find(fileNow_, *path) != fileNow_.end()) {
            why = fmt::format("'{}': files take in each other in a circle", name.substr(0, 200));
            continue;
        }
        const Expected<SoSeparator*> root = files_.open(*path);
        if (!root) {
            why = fmt::format("'{}': {}", name.substr(0, 200), root.error().message);
            continue;
        }
        SoState& state = *action_.getState();
        const SoNode* const texture = texture_;
        state.push();
        fileNow_.push_back(*path);
        Expected<void> done;
        Expected<Opened> opened = open(node, path->substr(path->rfind('/') + 1).c_str(), at);
        if (!opened) done = tl::unexpected(opened.error());
        if (opened && opened->node != nullptr) {
            opened->place.names = &opened->names;
            done = visitChildren(**root, opened->place);
        }
        fileNow_.pop_back();
        state.pop();
        texture_ = texture;
        return done;
    }
    scene_.noteMissing(fmt::format("an Inline is left out: {}", why));
    return {};
}

Expected<CoinWalk::Opened> CoinWalk::open(const SoNode& node, const char* otherwise, Place& at) {
    const Affine3d map = modelMatrix();
    if (!isSound(map)) {
        leaveOut("what stands at no finite place, or beyond 1e15", node);
        return Opened{};
    }
    const std::string name = calledName(node);
    Expected<Opened> opened = openAt(name.empty() ? otherwise : name, map, at);
    resetModelMatrix();
    return opened;
}

Expected<CoinWalk::Opened> CoinWalk::openMoving(const SoNode& node, const std::string& name, Place& at) {
    if (modelMatrix().isApprox(Affine3d::Identity(), 0.0)) return openAt(name, Affine3d::Identity(), at);
    Expected<Opened> outer = open(node, name.c_str(), at);
    if (!outer || outer->node == nullptr) return outer;
    outer->place.names = &outer->names;
    return openAt(name, Affine3d::Identity(), outer->place);
}

Expected<CoinWalk::Opened> CoinWalk::openAt(const std::string& name, const Affine3d& map, Place& at) {
    if (at.depth >= limits_.maxDepth)
        return fail(ErrorCode::kLimit, fmt::format("nodes are nested deeper than {} levels", limits_.maxDepth));
    if (Expected<void> room = takeNode(); !room) return tl::unexpected(room.error());
    Opened opened;
    const std::string free = freeName(name, *at.names);
    opened.node = addPlacedNode(at.make, free, map);
    Message* const node = opened.node;
    opened.place = {[node] { return node->add_node(); },
                    at.path + "/" + free + (node->name() == free ? "" : "/" + node->name()), at.world * map, nullptr,
                    at.depth + 1};
    return opened;
}

Expected<void> CoinWalk::takeNode() {
    if (++nodes_ <= mostNodes_) return {};
    return fail(ErrorCode::kLimit,
                mostNodes_ == limits_.maxNodes
                    ? fmt::format("the scene has more than {} nodes", mostNodes_)
                    : fmt::format("nodes that are used again and again (USE) become more than {}", mostNodes_));
}

CoinWalk::Message* CoinWalk::make(const std::string& name, Place& at) {
    Message* const node = at.make();
    node->set_name(freeName(name, *at.names));
    return node;
}

std::string CoinWalk::freeName(const std::string& wanted, std::set<std::string>& names) const {
    if (scene_.file.by_tessera()) return wanted;
    if (names.insert(wanted).second) return wanted;
    constexpr std::size_t kNumber = 20;
    const std::string_view room = cutUtf8(wanted, kLongestName - kNumber);
    for (std::size_t number = names.size() + 1;; ++number)
        if (std::string name = fmt::format("{} {}", room, number); names.insert(name).second) return name;
}

void CoinWalk::leaveOut(const std::string& what, const SoNode& node) {
    leftOut_.add("left out: " + what, nameOf(node));
}

void CoinWalk::finish() {
    for (const View& view : views_) {
        const std::optional<CameraStand> stand = standOf(view.world, bounds_, view.perDistance, view.height);
        if (!stand) {
            scene_.note("a viewpoint shows nothing");
            continue;
        }
        setTransform(*view.wall->mutable_transform(), stand->offset, Quatd::Identity(), Vec3d::Ones());
        view.wall->mutable_camera()->set_world_units_per_metre(stand->unitsPerMetre);
        view.wall->mutable_camera()->set_disabled(&view != &views_.front());
    }
    if (views_.size() > 1)
        scene_.note(fmt::format(
            "of {} viewpoints the wall stands at the first; bookmarks (keys 1 to 9) go to the others", views_.size()));
    materials_.finish();
    motion_.finish([this](const SoNode& node) { return calledName(node); });
    leftOut_.writeTo(scene_);
}

}  // namespace tessera
