#include "server/import/coin/CoinShapes.h"

#include <Inventor/SoPrimitiveVertex.h>
#include <Inventor/elements/SoLazyElement.h>
#include <Inventor/nodes/SoShape.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/base/Hash.h"

namespace tessera {
namespace {

/// Beyond, a mesh would be refused.
constexpr std::size_t kMostCorners = std::size_t{3} * 32'000'000;

Vec3f partsOfColor(const SbColor& color) {
    return {color[0], color[1], color[2]};
}

std::uint32_t byteOf(float value) {
    return static_cast<std::uint32_t>(std::lround(std::clamp(value, 0.0f, 1.0f) * 255.0f));
}

}  // namespace

CoinLook lookOf(const SoCallbackAction& action) {
    CoinLook look;
    SbColor ambient, diffuse, specular, emission;
    action.getMaterial(ambient, diffuse, specular, emission, look.shininess, look.transparency);
    look.diffuse = partsOfColor(diffuse);
    look.specular = partsOfColor(specular);
    look.emissive = partsOfColor(emission);
    look.unlit = action.getLightModel() == SoLightModel::BASE_COLOR;
    look.lineWidth = action.getLineWidth();
    look.pointSize = action.getPointSize();
    look.drawStyle = action.getDrawStyle();
    look.backFaces =
        action.getShapeType() != SoShapeHints::SOLID || action.getVertexOrdering() == SoShapeHints::UNKNOWN_ORDERING;
    look.clockwise = action.getVertexOrdering() == SoShapeHints::CLOCKWISE;
    return look;
}

std::size_t CoinShapes::CornerHash::operator()(const Corner& corner) const {
    return hash64(std::as_bytes(std::span(&corner, 1)));
}

CoinShapes::CoinShapes(SoCallbackAction& action, std::size_t room) : action_(action), room_(room) {
    const SoType all = SoShape::getClassTypeId();
    action.addTriangleCallback(
        all,
        [](void* self, SoCallbackAction*, const SoPrimitiveVertex* a, const SoPrimitiveVertex* b,
           const SoPrimitiveVertex* c) {
            CoinShapes& shapes = *static_cast<CoinShapes*>(self);
            Kind& kind = shapes.kinds_[static_cast<std::size_t>(Primitive::kTriangles)];
            shapes.begin();
            const bool isOnePoint = a->getPoint() == b->getPoint() && b->getPoint() == c->getPoint();
            if (shapes.tooMany_ || (isOnePoint && !shapes.wanted_.rawNormals)) return;
            for (const SoPrimitiveVertex* v : {a, b, c}) kind.order.push_back(shapes.number(kind, *v, true));
        },
        this);
    action.addLineSegmentCallback(
        all,
        [](void* self, SoCallbackAction*, const SoPrimitiveVertex* a, const SoPrimitiveVertex* b) {
            CoinShapes& shapes = *static_cast<CoinShapes*>(self);
            Kind& kind = shapes.kinds_[static_cast<std::size_t>(Primitive::kLines)];
            shapes.begin();
            if (shapes.tooMany_ || a->getPoint() == b->getPoint()) return;
            for (const SoPrimitiveVertex* v : {a, b}) kind.order.push_back(shapes.number(kind, *v, false));
        },
        this);
    action.addPointCallback(
        all,
        [](void* self, SoCallbackAction*, const SoPrimitiveVertex* a) {
            CoinShapes& shapes = *static_cast<CoinShapes*>(self);
            Kind& kind = shapes.kinds_[static_cast<std::size_t>(Primitive::kPoints)];
            shapes.begin();
            if (!shapes.tooMany_) kind.order.push_back(shapes.number(kind, *a, false));
        },
        this);
}

void CoinShapes::begin() {
    if (!look_) look_ = lookOf(action_);
    if (++taken_ > std::min(kMostCorners / 3, room_)) tooMany_ = true;
}

std::uint32_t CoinShapes::colorOf(int material) {
    const SoLazyElement* const lazy = SoLazyElement::getInstance(action_.getState());
    // A number beyond the colours is a fault of the file, and Coin does not look.
    const auto last = static_cast<std::size_t>(std::max(lazy->getNumDiffuse(), 1) - 1);
    const std::size_t index = std::min(static_cast<std::size_t>(std::max(material, 0)), last);
    if (index >= colors_.size()) colors_.resize(last + 1);
    std::optional<std::uint32_t>& color = colors_[index];
    if (!color) {
        const SbColor& diffuse = SoLazyElement::getDiffuse(action_.getState(), static_cast<int>(index));
        const int transparencies = std::max(lazy->getNumTransparencies(), 1);
        const int which = std::min(static_cast<int>(index), transparencies - 1);
        const float transparency = wanted_.ownColors ? 0.0f : SoLazyElement::getTransparency(action_.getState(), which);
        color =
            byteOf(diffuse[0]) << 24 | byteOf(diffuse[1]) << 16 | byteOf(diffuse[2]) << 8 | byteOf(1.0f - transparency);
    }
    return *color;
}

std::uint32_t CoinShapes::number(Kind& kind, const SoPrimitiveVertex& vertex, bool normals) {
    Corner corner;
    const SbVec3f& p = vertex.getPoint();
    // Adding 0 makes one of both zeros, which are equal and would not be the same bytes.
    corner.position = {p[0] + 0.0f, p[1] + 0.0f, p[2] + 0.0f};
    if (normals) {
        SbVec3f n = vertex.getNormal();
        const float length = n.length();
        // Such a one lights as it likes.
        if (!wanted_.rawNormals) n = length > 1e-20f && std::isfinite(length) ? n / length : SbVec3f(0, 1, 0);
        corner.normal = {n[0] + 0.0f, n[1] + 0.0f, n[2] + 0.0f};
    }
    if (wanted_.textured) {
        SbVec4f t = vertex.getTextureCoords();
        action_.getTextureMatrix().multVecMatrix(t, t);
        const float w = t[3] != 0 ? t[3] : 1.0f;
        corner.texcoord = {t[0] / w + 0.0f, 1.0f - t[1] / w + 0.0f};
        for (float& x : corner.texcoord)
            if (!std::isfinite(x)) x = 0;
    }
    corner.color = colorOf(vertex.getMaterialIndex());
    if (!firstColor_) firstColor_ = corner.color;
    colored_ = colored_ || wanted_.ownColors || corner.color != *firstColor_;
    const auto [place, isNew] = kind.numbers.try_emplace(corner, static_cast<std::uint32_t>(kind.corners.size()));
    if (isNew) kind.corners.push_back(corner);
    return place->second;
}

MeshData CoinShapes::meshOf(Kind& kind, Primitive primitive) const {
    MeshData mesh;
    mesh.primitive = primitive;
    // What appears twice in a list of points is one point.
    for (const Corner& corner : kind.corners) {
        mesh.positions.insert(mesh.positions.end(), corner.position.begin(), corner.position.end());
        if (primitive == Primitive::kTriangles)
            mesh.normals.insert(mesh.normals.end(), corner.normal.begin(), corner.normal.end());
        if (wanted_.textured && primitive == Primitive::kTriangles)
            mesh.texcoords.insert(mesh.texcoords.end(), corner.texcoord.begin(), corner.texcoord.end());
        if (colored_)
            for (const int shift : {24, 16, 8, 0})
                mesh.colors.push_back(static_cast<std::uint8_t>(corner.color >> shift));
    }
    if (primitive == Primitive::kTriangles) {
        mesh.indices = std::move(kind.order);
        if (wanted_.reversed)
            for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3)
                std::swap(mesh.indices[i], mesh.indices[i + 2]);
    } else if (primitive == Primitive::kLines) {
        mesh.lines = std::move(kind.order);
    }
    return mesh;
}

Expected<CoinShapes::Parts> CoinShapes::gather(SoNode& shape, const Wanted& wanted) {
    kinds_ = {};
    colors_.clear();
    look_.reset();
    firstColor_.reset();
    taken_ = 0;
    wanted_ = wanted;
    colored_ = tooMany_ = false;
    action_.traverse(&shape);
    if (tooMany_ && taken_ > room_)
        return fail(ErrorCode::kLimit,
                    "its shapes, used again and again, become more triangles than there is room for");
    if (tooMany_) return fail(ErrorCode::kLimit, "it has a shape of more triangles than a scene can hold");
    room_ -= taken_;
    Parts parts;
    parts.colored = colored_;
    parts.look = look_;
    for (const Primitive primitive : {Primitive::kTriangles, Primitive::kLines, Primitive::kPoints}) {
        Kind& kind = kinds_[static_cast<std::size_t>(primitive)];
        if (!kind.corners.empty()) parts.meshes.push_back(meshOf(kind, primitive));
    }
    kinds_ = {};
    return parts;
}

}  // namespace tessera
