#include "server/collision/objects/ShapeCache.h"

#include <array>

#include "common/drawable/ContentCache.h"
#include "common/drawable/SmoothSurface.h"
#include "common/geometry/Points.h"

namespace tessera {

namespace {

bool resident(const MeshArrays& arrays) {
    return arrays.positions.resident() && (arrays.kind == MeshKind::kPoints || arrays.indices.resident());
}

std::optional<TriangleMesh> meshOf(std::span<const float> positions, std::span<const std::uint32_t> indices) {
    Expected<TriangleMesh> mesh = TriangleMesh::make(positions, indices);
    if (!mesh || mesh->faceCount() == 0) return std::nullopt;
    return std::move(*mesh);
}

std::optional<TriangleMesh> meshOf(const MeshArrays& arrays) {
    if (!resident(arrays)) return std::nullopt;
    if (arrays.kind == MeshKind::kPoints) {
        const std::optional<MeshData> octahedra = octahedraOf(arrays);
        return octahedra ? meshOf(octahedra->positions, octahedra->indices) : std::nullopt;
    }
    // Whole elements only: a ragged tail makes the arrays malformed.
    if (arrays.positions.sizeBytes() % sizeof(float) != 0 || arrays.indices.sizeBytes() % sizeof(std::uint32_t) != 0)
        return std::nullopt;
    return meshOf(arrays.positions.as<float>(), arrays.indices.as<std::uint32_t>());
}

/// As they are shown.
std::shared_ptr<const CollisionShape> pointsOf(const MeshArrays& arrays) {
    if (!checkMesh({.positions = arrays.positions,
                    .indices = arrays.indices,
                    .kind = MeshKind::kPoints,
                    .pointRadius = arrays.pointRadius}))
        return nullptr;
    const std::span<const float> xyz = arrays.positions.as<float>();
    if (xyz.empty()) return nullptr;
    std::vector<Vec3d> places;
    places.reserve(xyz.size() / 3);
    for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) places.emplace_back(xyz[i], xyz[i + 1], xyz[i + 2]);
    const auto made = CollisionShape::ofPoints(places, shownRadius(arrays));
    return made ? *made : nullptr;
}

bool coverable(const ShapeChoice& choice) {
    return !choice.representation || choice.representation == Representation::kTriangles ||
           choice.representation == Representation::kHeightField;
}

ShapeChoice withoutLevel(ShapeChoice choice) {
    choice.level = 0;
    return choice;
}

/// Of its faces, and of its surface where that is another thing.
std::size_t trianglesOf(const CollisionShape& shape) {
    return shape.faceCount() + (shape.isCover() ? shape.mesh().faceCount() : 0);
}

constexpr double kUsualFreeformError = 1e-4;

std::shared_ptr<CollisionShape> freeformOf(TriangleMesh& mesh, const ShapeChoice& choice, const Drawable& drawable,
                                           const TreeOptions& trees) {
    std::optional<FreeformShape> surface = drawable ? smoothShapeOf(drawable) : std::nullopt;
    if (!surface) return nullptr;
    return CollisionShape::ofFreeform(std::move(*surface), std::move(mesh),
                                      choice.error > 0 ? choice.error : kUsualFreeformError, trees);
}

}  // namespace

std::optional<MeshData> octahedraOf(const MeshArrays& points) {
    const MeshArrays places{.positions = points.positions,
                            .indices = points.indices,
                            .kind = MeshKind::kPoints,
                            .pointRadius = points.pointRadius};
    if (!checkMesh(places)) return std::nullopt;
    return trianglesOfPoints(places);
}

namespace {

/// The first body of a control mesh: later ones share its topology and the plans of its neighbourhoods, most of what
/// making one takes.
struct FirstOfMesh {
    std::optional<FreeformShape> shape;
    [[nodiscard]] std::size_t bytes() const {
        constexpr std::size_t kPerFace = 2'000;  // the topology and, at worst, plans of its own
        return shape ? shape->memoryBytes() + kPerFace * shape->faceCount() : 64;
    }
    [[nodiscard]] bool inUse() const { return false; }
};

std::optional<FreeformShape> smoothShapeOf(const ControlMesh& mesh, const Hash128& recipe) {
    constexpr std::size_t kMostBytes = std::size_t{1} << 26;
    static ContentCache<FirstOfMesh> firsts(kMostBytes);
    const std::shared_ptr<const FirstOfMesh> first = firsts.get(recipe, [&]() -> FirstOfMesh {
        Expected<FreeformShape> made = FreeformShape::ofSubdivision(mesh);
        return {made ? std::optional(std::move(*made)) : std::nullopt};
    });
    // What is wrong with some points may be right with others.
    if (!first->shape) {
        Expected<FreeformShape> made = FreeformShape::ofSubdivision(mesh);
        return made ? std::optional(std::move(*made)) : std::nullopt;
    }
    if (first->shape->subdivision()->positions == mesh.positions) return first->shape;
    Expected<FreeformShape> made = first->shape->withPositions(mesh.positions);
    return made ? std::optional(std::move(*made)) : std::nullopt;
}

}  // namespace

std::optional<FreeformShape> smoothShapeOf(const Drawable& drawable) {
    const std::shared_ptr<const SmoothSurface> smooth = drawable.smoothSurface();
    if (!smooth) return std::nullopt;
    const auto* mesh = std::get_if<ControlMesh>(&smooth->surface);
    const std::size_t faces =
        mesh ? mesh->faceSizes.size() : std::get<NurbsSurface>(smooth->surface).definition().points.size();
    if (faces > kMostFreeformFaces) return std::nullopt;
    if (mesh)
        if (const std::optional<DerivedSource> source = drawable.source()) return smoothShapeOf(*mesh, source->recipe);
    Expected<FreeformShape> made =
        mesh ? FreeformShape::ofSubdivision(*mesh) : FreeformShape::ofNurbs({std::get<NurbsSurface>(smooth->surface)});
    return made ? std::optional(std::move(*made)) : std::nullopt;
}

std::shared_ptr<const CollisionShape> ShapeCache::shape(const MeshArrays& arrays, const ShapeChoice& choice,
                                                        const Drawable& drawable) {
    // What is not here yet may come: nothing is remembered about it.
    if (!resident(arrays)) return nullptr;
    const bool points = arrays.kind == MeshKind::kPoints;
    Hash128 smooth;
    const bool freeform = choice.representation == Representation::kFreeform;
    if (freeform && drawable)
        if (const std::optional<DerivedSource> source = drawable.source()) {
            const std::array<Hash128, 2> both{source->recipe, source->points.id()};
            smooth = hash128(std::as_bytes(std::span(both)));
        }
    const Key key{arrays.positions.id(), arrays.indices.id(), arrays.kind, arrays.pointRadius, choice, smooth};
    if (choice.level > 0 && (points || !coverable(choice) || uncovered_.contains(key)))
        return shape(arrays, withoutLevel(choice));
    if (const auto known = shapes_.find(key); known != shapes_.end()) return known->second;
    std::shared_ptr<const CollisionShape> made;
    if (points && (!choice.representation || choice.representation == Representation::kPoints)) {
        made = pointsOf(arrays);
    } else if (std::optional<TriangleMesh> mesh = meshOf(arrays)) {
        const TreeOptions trees{.volume = choice.volume.value_or(kAutomaticVolume)};
        const std::optional<Representation> wanted = choice.representation;
        if (choice.level > 0) {
            const auto cover = CollisionShape::ofCover(std::move(*mesh), choice.level, trees);
            if (cover) return shapes_[key] = *cover;
            uncovered_.insert(key);
            return shape(arrays, withoutLevel(choice));
        }
        if (wanted == Representation::kDistanceField || (!wanted && choice.error > 0))
            if (const auto field = CollisionShape::ofDistanceField(std::move(*mesh), choice.error, trees))
                made = *field;
        if (freeform) made = freeformOf(*mesh, choice, drawable, trees);
        if (wanted == Representation::kSphericalBezier)
            if (const auto patches = CollisionShape::ofSphericalBezier(std::move(*mesh), trees)) made = *patches;
        if (made) return shapes_[key] = std::move(made);
        if (wanted == Representation::kHull)
            made = CollisionShape::ofHull(*mesh, trees);
        else if (wanted == Representation::kSpherical)
            made = CollisionShape::ofSphericalField(std::move(*mesh), trees);
        else if (wanted == Representation::kHeightField || (!wanted && mesh->faceCount() >= kAutomaticFieldFaces))
            if (const auto field = CollisionShape::ofHeightField(*mesh, trees)) made = *field;
        if (!made && wanted != Representation::kHull) made = CollisionShape::ofTriangles(std::move(*mesh), trees);
        // Now, rather than in the frame in which something first comes near.
        if (made && made->heightField() == nullptr) (void)made->tree();
    }
    return shapes_[key] = std::move(made);
}

bool ShapeCache::isMade(const MeshArrays& arrays) const {
    if (!resident(arrays)) return true;  // nothing is made of it
    const auto known = shapes_.find(keyOf(arrays));
    return known != shapes_.end() && (!known->second || known->second->hasTree());
}

UnmadeShape ShapeCache::unmade(const MeshArrays& arrays) const {
    const auto known = shapes_.find(keyOf(arrays));
    return {arrays, known == shapes_.end() ? nullptr : known->second};
}

std::size_t UnmadeShape::faceCount() const {
    constexpr std::size_t kOfAPoint = 8;
    return arrays.kind == MeshKind::kPoints ? kOfAPoint * (arrays.positions.sizeBytes() / (3 * sizeof(float)))
                                            : arrays.indices.sizeBytes() / (3 * sizeof(std::uint32_t));
}

std::shared_ptr<const CollisionShape> ShapeCache::make(const UnmadeShape& unmade) {
    ShapeCache own;
    std::shared_ptr<const CollisionShape> shape = unmade.shape ? unmade.shape : own.shape(unmade.arrays);
    if (shape) (void)shape->tree();
    return shape;
}

void ShapeCache::put(const UnmadeShape& unmade, std::shared_ptr<const CollisionShape> made) {
    shapes_.try_emplace(keyOf(unmade.arrays), std::move(made));
}

bool ShapeCache::drop(const Key& key) {
    const auto known = shapes_.find(key);
    if (known == shapes_.end()) return true;
    if (known->second.use_count() > 2) return false;
    shapes_.erase(known);
    return true;
}

std::shared_ptr<CollisionShape> ShapeCache::ownShape(const MeshArrays& arrays, const ShapeChoice& choice,
                                                     const Drawable& drawable) {
    std::optional<TriangleMesh> mesh = meshOf(arrays);
    if (!mesh) return nullptr;
    const TreeOptions trees{.volume = choice.volume.value_or(kAutomaticDeformingVolume)};
    std::shared_ptr<CollisionShape> made;
    if (asksForSmooth(choice)) made = freeformOf(*mesh, choice, drawable, trees);
    const bool smooth = made != nullptr;
    if (choice.representation == Representation::kSphericalBezier)
        if (const auto patches = CollisionShape::ofSphericalBezier(std::move(*mesh), trees)) made = *patches;
    if (!made) made = CollisionShape::ofTriangles(std::move(*mesh), trees);
    made->setDeforms();
    if (smooth) return made;  // whose trees few ask for
    (void)made->tree();
    return made;
}

Box ShapeCache::bounds(const MeshArrays& arrays) {
    if (!arrays.positions.resident()) return {};
    const auto [place, isNew] = bounds_.try_emplace({arrays.positions.id(), arrays.kind, arrays.pointRadius});
    if (isNew) {
        const std::span<const float> xyz = arrays.positions.as<float>();
        for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) {
            const Vec3d p(xyz[i], xyz[i + 1], xyz[i + 2]);
            if (p.allFinite()) place->second.extend(p);
        }
        if (arrays.kind == MeshKind::kPoints) place->second = boundsOfPoints(place->second, arrays.pointRadius);
    }
    return place->second;
}

bool ShapeCache::forgetIdleShapes() {
    std::size_t idle = 0;
    for (const auto& [key, shape] : shapes_)
        if (shape.use_count() == 1) idle += trianglesOf(*shape);
    if (idle <= maxIdleTriangles_) return false;
    std::erase_if(shapes_, [](const auto& entry) { return entry.second.use_count() <= 1; });
    return true;
}

void ShapeCache::forgetIdle() {
    if (!forgetIdleShapes()) return;
    bounds_.clear();
    uncovered_.clear();
}

}  // namespace tessera
