// Geometry: what shapes are made of, once for all that use it, and where they stand.

#include <Inventor/VRMLnodes/SoVRML.h>
#include <Inventor/VRMLnodes/SoVRMLNodes.h>
#include <Inventor/elements/SoModelMatrixElement.h>
#include <Inventor/fields/SoSFNode.h>
#include <Inventor/lists/SoFieldList.h>
#include <Inventor/nodes/SoNodes.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/Hash.h"
#include "server/import/coin/CoinIndices.h"
#include "server/import/coin/CoinNodes.h"
#include "server/import/coin/CoinNormals.h"
#include "server/import/coin/CoinWalk.h"
#include "server/import/coin/VrmlExtrusion.h"
#include "server/import/reader/MovingParts.h"
#include "server/import/reader/SmoothNormals.h"
#include "server/import/reader/SoundParts.h"

namespace tessera {
namespace {

template <typename Number>
std::uint64_t hashOf(const std::vector<Number>& numbers, std::uint64_t seed) {
    return hash64(std::as_bytes(std::span(numbers)), seed + numbers.size());
}

Box boundsOf(const MeshData& mesh) {
    Box box;
    for (std::size_t i = 0; i + 2 < mesh.positions.size(); i += 3)
        box.extend(Vec3d(mesh.positions[i], mesh.positions[i + 1], mesh.positions[i + 2]));
    return box;
}

bool flag(const SoNode& node, const char* name, bool otherwise) {
    const SoField* const field = node.getField(name);
    return field != nullptr && field->isOfType(SoSFBool::getClassTypeId())
               ? static_cast<const SoSFBool*>(field)->getValue() != FALSE
               : otherwise;
}

/// As a file would say them.
std::string fieldsOf(const SoNode& node) {
    SoFieldList fields;
    std::string all;
    for (int i = 0; i < node.getFields(fields); ++i) {
        SbString said;
        fields[i]->get(said);
        all.append(1, ' ').append(said.getString());
    }
    return all;
}

std::string shapeName(const SoNode& shape) {
    const SoNode* const geometry = is<SoVRMLShape>(shape) ? as<SoVRMLShape>(shape).geometry.getValue() : nullptr;
    return kindOf(geometry != nullptr ? *geometry : shape);
}

/// Coin tells no colours of them.
CoinShapes::Parts pointsOf(const SoVRMLPointSet& set) {
    CoinShapes::Parts parts;
    MeshData mesh;
    mesh.primitive = Primitive::kPoints;
    const SoNode* const coord = set.coord.getValue();
    if (coord == nullptr || !is<SoVRMLCoordinate>(*coord)) return parts;
    const SoMFVec3f& points = as<SoVRMLCoordinate>(*coord).point;
    for (int i = 0; i < points.getNum(); ++i)
        mesh.positions.insert(mesh.positions.end(), {points[i][0], points[i][1], points[i][2]});
    parts.colored = hasColors(set);
    if (parts.colored) {
        const SoMFColor& colors = as<SoVRMLColor>(*set.color.getValue()).color;  // as many as points: CoinIndices
        for (int i = 0; i < points.getNum(); ++i) {
            for (int c = 0; c < 3; ++c)
                mesh.colors.push_back(
                    static_cast<std::uint8_t>(std::lround(255 * std::clamp(colors[i][c], 0.0f, 1.0f))));
            mesh.colors.push_back(255);
        }
    }
    if (!mesh.empty()) parts.meshes.push_back(std::move(mesh));
    return parts;
}

}  // namespace

void CoinWalk::noteWrong(const SoNode& node, const std::string& what) {
    const std::string name = nameOf(node);
    scene_.noteMissing(fmt::format("{}{}: {}", kindOf(node), name.empty() ? "" : " '" + name + "'", what));
}

/// Equal arrays are one mesh, whoever uses them.
std::string CoinWalk::meshName(MeshData mesh) {
    std::uint64_t hash = hashOf(mesh.positions, static_cast<std::uint64_t>(mesh.primitive));
    hash = hashOf(mesh.normals, hash);
    hash = hashOf(mesh.texcoords, hash);
    hash = hashOf(mesh.colors, hash);
    hash = hashOf(mesh.indices, hash);
    hash = hashOf(mesh.lines, hash);
    hash ^= static_cast<std::uint64_t>(std::lround(64 * mesh.lineWidth));
    std::string name = "mesh " + toHex(hash);
    const auto [place, isNew] = meshes_.try_emplace(name, boundsOf(mesh));
    if (isNew) scene_.addModelMesh(name, std::move(mesh), limits_);
    return name;
}

Expected<void> CoinWalk::addVrmlShape(SoVRMLShape& shape, Place& at) {
    SoNode* const geometry = shape.geometry.getValue();
    SoNode* const appearance = shape.appearance.getValue();
    if (geometry == nullptr) return {};
    if (const auto known = shared_.find(&shape); known != shared_.end()) return placeParts(shape, known->second, at);
    CoinMaterials::Wanted wanted{.vrml2 = true, .from = fileNow_.back()};
    if (appearance != nullptr) {
        motion_.hold(*appearance);
        for (const char* part : {"material", "texture", "textureTransform"})
            if (SoNode* const node = nodeIn(*appearance, part); node != nullptr) {
                const bool moves = motion_.hold(*node);
                if (std::string_view(part) == "material") {
                    wanted.source = node;
                    wanted.moves = moves;
                } else if (moves) {
                    motion_.leaveOut(*node);
                }
            }
        if (SoNode* const texture = nodeIn(*appearance, "texture"); texture != nullptr) {
            if (is<SoVRMLMovieTexture>(*texture))
                leaveOut("MovieTexture", *texture);
            else if (materials_.hasPicture(*texture, fileNow_.back()))
                wanted.texture = texture;
        }
    }
    const bool pointsMove = holdGeometry(*geometry);
    if (!is<SoVRMLGeometry>(*geometry)) {
        leaveOut(kindOf(*geometry) + " as a geometry", *geometry);
        return {};
    }
    if (const std::string wrong = mendVrmlIndices(*geometry); !wrong.empty()) noteWrong(*geometry, wrong);
    SoState& state = *action_.getState();
    state.push();
    if (appearance != nullptr) action_.traverse(appearance);
    CoinLook look = lookOf(action_);
    const SbMatrix texture = wanted.texture != nullptr ? action_.getTextureMatrix() : SbMatrix::identity();
    state.pop();
    const bool lit = appearance != nullptr && wanted.source != nullptr;
    if (!lit) {
        look = CoinLook{};
        look.diffuse.setOnes();
    }
    look.unlit = !lit;
    look.backFaces = !flag(*geometry, "solid", true);
    look.lineWidth = look.pointSize = 1;
    wanted.look = look;
    if (is<SoVRMLText>(*geometry)) return addText(*geometry, wanted, at);
    // One geometry may be of many shapes.
    std::string key(reinterpret_cast<const char*>(texture.getValue()), sizeof(SbMat));
    const bool replaces = wanted.texture != nullptr && materials_.replacesColors(*wanted.texture, fileNow_.back());
    key.push_back(replaces ? 'r' : wanted.texture != nullptr ? 't' : ' ');
    const SoNode* which = geometry;
    if (is<SoVRMLSphere>(*geometry) || is<SoVRMLBox>(*geometry) || is<SoVRMLCone>(*geometry) ||
        is<SoVRMLCylinder>(*geometry)) {
        // Of these all that say the same are one.
        which = nullptr;
        key += kindOf(*geometry) + fieldsOf(*geometry);
    }
    const auto [made, isNew] = made_.try_emplace({which, std::move(key)});
    if (isNew && pointsMove) {
        Expected<Made> moving = makeMoving(shape, *geometry, wanted.texture != nullptr, replaces);
        if (!moving) return tl::unexpected(moving.error());
        made->second = std::move(*moving);
    } else if (isNew) {
        Expected<CoinShapes::Parts> parts = partsOf(shape, *geometry, wanted.texture != nullptr, texture);
        if (!parts) return tl::unexpected(parts.error());
        for (MeshData& mesh : parts->meshes)
            if (replaces && mesh.primitive == Primitive::kTriangles) {
                mesh.colors.clear();
                parts->colored = false;
            }
        made->second = nameMeshes(*geometry, std::move(*parts), wanted.look);
    }
    return placeParts(shape, shared_[&shape] = nameParts(made->second, wanted), at);
}

bool CoinWalk::holdGeometry(SoNode& geometry) {
    bool pointsMove = false;
    for (const char* part : {"coord", "color", "normal", "texCoord", "fontStyle"}) {
        SoNode* const node = nodeIn(geometry, part);
        if (node == nullptr || !motion_.hold(*node)) continue;
        if (std::string_view(part) == "coord" && motion_.pointsOf(*node) != nullptr)
            pointsMove = morphs_.prepare(geometry);
        else if (std::string_view(part) == "normal" && pointsMove)
            scene_.note("a NormalInterpolator is left out: normals are made anew of points that move");
        else
            motion_.leaveOut(*node);
        motion_.passOver(*node);
    }
    if (motion_.hold(geometry)) motion_.leaveOut(geometry);
    return pointsMove;
}

Expected<CoinWalk::Made> CoinWalk::makeMoving(SoVRMLShape& shape, SoNode& geometry, bool textured, bool replaces) {
    Expected<CoinMorphs::Faces> faces = morphs_.gather(shapes_, shape, geometry, textured);
    if (!faces) return tl::unexpected(faces.error());
    if (!faces->lost.empty()) scene_.noteMissing(faces->lost);
    if (replaces) faces->mesh.colors.clear();
    Made made{.colored = faces->colored && !replaces, .meshes = {}};
    if (faces->mesh.empty()) return made;
    CoinMorph& morph = faces->morph;
    const SoNode* const coordinate = nodeIn(geometry, "coord");
    std::optional<CoinMotion::Track> track;
    if (morph.targets > 0) track = motion_.weightsOf(*coordinate, morph.targets, morph.weights);
    if (!track) {
        made.meshes.push_back({.name = meshName(std::move(faces->mesh)), .morph = nullptr});
        return made;
    }
    auto kept = std::make_shared<Morph>();
    kept->track = std::move(*track);
    kept->numbers = faces->mesh.positions.size() / 3 + morph.targets;
    kept->skin.set_morph_positions_blob(scene_.addBlob(bytesOfNumbers(morph.positions)));
    kept->skin.set_morph_normals_blob(scene_.addBlob(bytesOfNumbers(morph.normals)));
    for (std::size_t t = 0; t < morph.targets; ++t) kept->skin.add_weight(0);
    // Its vertices have their order, as its targets do.
    const std::string name = fmt::format("moving mesh {}", ++skins_);
    meshes_.emplace(name, morph.bounds);
    scene_.addMesh(name, std::move(faces->mesh));
    made.meshes.push_back({.name = name, .morph = std::move(kept)});
    return made;
}

void CoinWalk::addGeometry(const Part& part, Message& node) {
    if (part.morph != nullptr && part.morph->numbers > movingNumbers_)
        scene_.note("geometry whose points move is used so often that some of it stands still");
    else if (part.morph != nullptr) {
        movingNumbers_ -= part.morph->numbers;
        proto::scene::Skin& skin = *node.mutable_skin();
        skin = part.morph->skin;
        skin.set_mesh(part.mesh);
        skin.set_material(part.material);
        return motion_.addTarget(part.morph->track, node);
    }
    node.mutable_geometry()->set_mesh(part.mesh);
    node.mutable_geometry()->set_material(part.material);
}

Expected<CoinShapes::Parts> CoinWalk::partsOf(SoVRMLShape& shape, SoNode& geometry, bool textured,
                                              const SbMatrix& texture) {
    CoinShapes::Parts parts;
    if (is<SoVRMLPointSet>(geometry)) {
        parts = pointsOf(as<SoVRMLPointSet>(geometry));
    } else if (is<SoVRMLExtrusion>(geometry)) {
        Expected<MeshData> mesh = meshOfExtrusion(as<SoVRMLExtrusion>(geometry), textured, texture, extrudedFaces_);
        if (mesh && !mesh->indices.empty()) parts.meshes.push_back(std::move(*mesh));
        if (!mesh) noteWrong(geometry, mesh.error().message + ": it is left out");
    } else {
        const PlainNormals plain(geometry);
        return gather(
            shape, {.textured = textured, .reversed = !flag(geometry, "ccw", true), .ownColors = hasColors(geometry)},
            plain);
    }
    return parts;
}

Expected<CoinShapes::Parts> CoinWalk::gather(SoNode& shape, const CoinShapes::Wanted& wanted,
                                             const PlainNormals& plain) {
    Expected<CoinShapes::Parts> parts = shapes_.gather(shape, wanted);
    for (std::size_t i = 0; parts && plain.creaseAngle() && i < parts->meshes.size(); ++i)
        if (MeshData& mesh = parts->meshes[i]; mesh.primitive == Primitive::kTriangles)
            setSmoothNormals(mesh, *plain.creaseAngle());
    return parts;
}

Expected<void> CoinWalk::addShape(SoNode& shape, Place& at) {
    const bool textured = texture_ != nullptr && materials_.hasPicture(*texture_, fileNow_.back());
    const CoinLook look = lookOf(action_);
    if (look.drawStyle == SoDrawStyle::INVISIBLE) return {};
    SoState& state = *action_.getState();
    state.push();
    if (const std::string wrong = mendIndices(shape, action_); !wrong.empty()) noteWrong(shape, wrong);
    Expected<CoinShapes::Parts> parts =
        gather(shape, {.textured = textured, .reversed = look.clockwise}, PlainNormals(shape, action_));
    state.pop();
    if (!parts) return tl::unexpected(parts.error());
    CoinMaterials::Wanted wanted{
        .look = parts->look ? *parts->look : look, .texture = textured ? texture_ : nullptr, .from = fileNow_.back()};
    wanted.look.drawStyle = look.drawStyle;
    return placeParts(shape, nameParts(nameMeshes(shape, std::move(*parts), wanted.look), wanted), at);
}

CoinWalk::Made CoinWalk::nameMeshes(const SoNode& shape, CoinShapes::Parts parts, const CoinLook& look) {
    Made made{.colored = parts.colored, .meshes = {}};
    const std::string called = nameOf(shape);
    for (MeshData& mesh : parts.meshes) {
        const bool strokes = mesh.primitive != Primitive::kTriangles;
        if (mesh.primitive == Primitive::kLines) mesh.lineWidth = std::clamp(look.lineWidth, 1.0f, 64.0f);
        const std::string what = fmt::format("{}{}", kindOf(shape), called.empty() ? "" : " '" + called + "'");
        if (const std::string lost = keepSoundParts(mesh, what); !lost.empty()) scene_.noteMissing(lost);
        if (!mesh.empty()) made.meshes.push_back({meshName(std::move(mesh)), strokes, nullptr});
    }
    return made;
}

CoinWalk::Parts CoinWalk::nameParts(const Made& made, CoinMaterials::Wanted wanted) {
    Parts named;
    wanted.colored = made.colored;
    for (const Made::Mesh& mesh : made.meshes) {
        CoinMaterials::Wanted own = wanted;
        // Lines stay lines when others are drawn as their edges.
        own.strokes = mesh.strokes;
        if (mesh.strokes) own.texture = nullptr;
        named.push_back({mesh.name, materials_.name(own), mesh.morph});
    }
    return named;
}

Expected<void> CoinWalk::placeParts(const SoNode& shape, const Parts& parts, Place& at) {
    if (parts.empty()) {
        leaveOut(fmt::format("{} that shows nothing", shapeName(shape)), shape);
        return {};
    }
    std::string name = calledName(shape);
    if (name.empty()) name = shapeName(shape);
    Place* in = &at;
    Expected<Opened> opened;
    const Affine3d map = modelMatrix();
    if (parts.size() > 1 || !map.isApprox(Affine3d::Identity(), 0.0)) {
        const SbMatrix before = SoModelMatrixElement::get(action_.getState());
        opened = open(shape, name.c_str(), at);
        SoModelMatrixElement::set(action_.getState(), nullptr, before);
        if (!opened) return tl::unexpected(opened.error());
        if (opened->node == nullptr) return {};
        opened->place.names = &opened->names;
        in = &opened->place;
    }
    for (const Part& part : parts) {
        if (Expected<void> room = takeNode(); !room) return room;
        addGeometry(part, *make(name, *in));
        extendBounds(meshes_.at(part.mesh), in->world);
    }
    return {};
}

}  // namespace tessera
