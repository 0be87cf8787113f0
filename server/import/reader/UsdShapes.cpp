// Points, curves and the simple shapes of USD.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/Compose.h"
#include "common/math/Srgb.h"
#include "server/import/reader/UsdMeshes.h"

namespace tessera {
namespace {

/// Few enough that a ball can be a glyph.
constexpr int kShapeSegments = 32;

double usdSize(const UsdComposedPrim& prim, std::string_view name, double otherwise, UsdRemarks& remarks) {
    const std::optional<UsdAttribute> attribute = prim.attribute(name);
    if (!attribute || !attribute->value) return otherwise;
    if (attribute->samples.size() > 1) remarks.add("shapes that change their size have the first", prim.path());
    const double said = attribute->value->number().value_or(std::nan(""));
    if (std::isfinite(said) && std::abs(said) < 1e12) return std::abs(said);
    remarks.add(fmt::format("sizes of shapes that are no number, or beyond 1e12, are as where none is said ({} {})",
                            name, otherwise),
                prim.path());
    return otherwise;
}

/// A ring of a shape that is turned about Y: its radius, height, and the normal there.
struct TurnedRing {
    double radius, y;
    Vec2d normal;  ///< outwards and upwards
};

/// Bands between pairs of rings, from below to above.
MeshData turnedAboutY(const std::vector<std::pair<TurnedRing, TurnedRing>>& bands) {
    MeshData data;
    for (const auto& [lower, upper] : bands) {
        const auto base = static_cast<std::uint32_t>(data.positions.size() / 3);
        for (int i = 0; i <= kShapeSegments; ++i) {
            const double angle = 2 * std::numbers::pi * i / kShapeSegments;
            for (const TurnedRing& ring : {lower, upper}) {
                const Vec3d out(std::cos(angle), 0, -std::sin(angle));
                const Vec3d at = ring.radius * out + ring.y * Vec3d::UnitY();
                const Vec3d normal = (ring.normal.x() * out + ring.normal.y() * Vec3d::UnitY()).normalized();
                for (int k = 0; k < 3; ++k) data.positions.push_back(static_cast<float>(at[k]));
                for (int k = 0; k < 3; ++k) data.normals.push_back(static_cast<float>(normal[k]));
            }
        }
        for (std::uint32_t i = 0; i < kShapeSegments; ++i) {
            const std::uint32_t a = base + 2 * i, b = a + 2, c = a + 1, d = a + 3;  // c and d above
            if (lower.radius > 0) data.indices.insert(data.indices.end(), {a, b, upper.radius > 0 ? d : c});
            if (upper.radius > 0) data.indices.insert(data.indices.end(), {a, d, c});
        }
    }
    return data;
}

MeshData makeFrustum(double bottom, double top, double height) {
    const Vec2d slant = Vec2d(height, bottom - top).normalized();
    return turnedAboutY({{{0, -height / 2, {0, -1}}, {bottom, -height / 2, {0, -1}}},
                         {{bottom, -height / 2, slant}, {top, height / 2, slant}},
                         {{top, height / 2, {0, 1}}, {0, height / 2, {0, 1}}}});
}

MeshData makeCone(double radius, double height) {
    return makeFrustum(radius, 0, height);
}

MeshData makeCapsule(double radius, double height) {
    std::vector<std::pair<TurnedRing, TurnedRing>> bands;
    constexpr int kRings = kShapeSegments / 4;
    const auto ring = [&](int i, double middle) {
        const double angle = std::numbers::pi / 2 * i / kRings;
        return TurnedRing{std::abs(i) == kRings ? 0 : radius * std::cos(angle),
                          middle + radius * std::sin(angle),
                          {std::cos(angle), std::sin(angle)}};
    };
    for (int i = -kRings; i < 0; ++i) bands.emplace_back(ring(i, -height / 2), ring(i + 1, -height / 2));
    bands.emplace_back(ring(0, -height / 2), ring(0, height / 2));
    for (int i = 0; i < kRings; ++i) bands.emplace_back(ring(i, height / 2), ring(i + 1, height / 2));
    return turnedAboutY(bands);
}

MeshData makePlane(double width, double length) {
    MeshData data;
    const auto w = static_cast<float>(width / 2), l = static_cast<float>(length / 2);
    data.positions = {-w, 0, l, w, 0, l, w, 0, -l, -w, 0, -l};
    for (int i = 0; i < 4; ++i) data.normals.insert(data.normals.end(), {0, 1, 0});
    data.texcoords = {0, 1, 1, 1, 1, 0, 0, 0};
    data.indices = {0, 1, 2, 0, 2, 3};
    return data;
}

}  // namespace

MeshData usdShape(const UsdComposedPrim& prim, UsdRemarks& remarks) {
    const std::string& type = prim.type();
    const auto size = [&](std::string_view name, double otherwise) { return usdSize(prim, name, otherwise, remarks); };
    const std::string axis = usdWord(prim, "axis", "Z");
    MeshData shape;
    bool known = true;
    if (type == "Cube") {
        if (const double edge = size("size", 2); edge > 0) return makeBox(Vec3d::Constant(edge));
    } else if (type == "Sphere") {
        if (const double radius = size("radius", 1); radius > 0) return makeSphere(radius, kShapeSegments);
    } else if (type == "Cylinder" || type == "Cone") {
        const double height = size("height", 2), radius = size("radius", 1);
        if (height > 0 && radius > 0)
            shape = type == "Cone" ? makeCone(radius, height) : makeCylinder(radius, height, kShapeSegments);
    } else if (type == "Cylinder_1") {
        const double height = size("height", 2), bottom = size("radiusBottom", 1), top = size("radiusTop", 1);
        if (height > 0 && std::max(bottom, top) > 0) shape = makeFrustum(bottom, top, height);
    } else if (type == "Capsule") {
        if (const double radius = size("radius", 0.5); radius > 0) shape = makeCapsule(radius, size("height", 1));
    } else if (type == "Capsule_1") {
        const double bottom = size("radiusBottom", 0.5), top = size("radiusTop", 0.5);
        if (bottom != top) remarks.add("capsules of two radii are as wide as at their bottom", prim.path());
        if (bottom > 0) shape = makeCapsule(bottom, size("height", 1));
    } else if (type == "Plane") {
        // Its width lies along X, or, where X is what it looks along, along Z.
        const double width = size("width", 2), length = size("length", 2);
        if (width > 0 && length > 0) shape = axis == "X" ? makePlane(length, width) : makePlane(width, length);
    } else {
        known = false;
    }
    if (shape.empty()) {
        remarks.add(
            known ? "shapes of no size are left out" : fmt::format("of type {}, which is not read, are left out", type),
            prim.path());
        return {};
    }
    // Ours stand along Y.
    if (axis == "Y") return shape;
    const Vec3d along = axis == "X" ? Vec3d::UnitX() : Vec3d::UnitZ();
    MeshData out;
    out.append(shape, composeTransform(Vec3d::Zero(), Quatd::FromTwoVectors(Vec3d::UnitY(), along), Vec3d::Ones()));
    return out;
}

std::vector<UsdPart> UsdMeshes::ofShape(const UsdComposedPrim& prim, const std::string& material) {
    MeshData shape = usdShape(prim, remarks_);
    if (shape.empty()) return {};
    const UsdLook look = lookOf(prim, material, true);
    setColors(prim, look, {0, shape.positions.size() / 3, 0}, shape);
    return added(prim, std::move(shape), look);
}

void UsdMeshes::setColors(const UsdComposedPrim& prim, const UsdLook& look, const UsdElements& elements,
                          MeshData& data) {
    if (look.colors.empty()) return;
    const std::optional<UsdPrimvar> colors =
        UsdPrimvar::of(prim, worn_.primvars, "primvars:" + look.colors, 3, elements, remarks_);
    const std::optional<UsdPrimvar> opacities =
        UsdPrimvar::of(prim, worn_.primvars, "primvars:displayOpacity", 1, elements, remarks_);
    if (!colors && !opacities) return;
    const auto byte = [](float share) {
        return static_cast<std::uint8_t>(
            std::lround(std::clamp(std::isfinite(share) ? share : 0.0F, 0.0F, 1.0F) * 255));
    };
    for (std::size_t v = 0; v < elements.vertices; ++v) {
        for (std::size_t i = 0; i < 3; ++i)
            data.colors.push_back(colors ? byte(srgbOfLinear(std::max(colors->at(0, v, v)[i], 0.0F))) : 255);
        data.colors.push_back(opacities ? byte(*opacities->at(0, v, v)) : 255);
    }
}

Expected<std::vector<UsdPart>> UsdMeshes::ofPoints(const UsdComposedPrim& prim, const std::string& material) {
    MeshData data;
    data.primitive = Primitive::kPoints;
    const std::optional<UsdAttribute> points = prim.attribute("points");
    if (points && points->value) data.positions = points->value->numbers<float>();
    data.positions.resize(data.positions.size() / 3 * 3);
    const UsdElements elements{1, data.positions.size() / 3, data.positions.size() / 3};
    if (const std::optional<UsdAttribute> widths = prim.attribute("widths"); widths && widths->value) {
        double sum = 0, count = 0;
        const std::vector<float> all = widths->value->numbers<float>();
        for (const float width : all)
            if (std::isfinite(width) && width > 0) sum += width, ++count;
        if (count > 0) data.pointRadius = std::min(0.5 * sum / count, 1e12);
        if (!all.empty() && std::ranges::min(all) != std::ranges::max(all))
            remarks_.add("points of several widths are shown as wide as they are on average", prim.path());
    }
    const UsdLook look = lookOf(prim, material, false);
    setColors(prim, look, elements, data);
    return added(prim, std::move(data), look);
}

}  // namespace tessera
