#include "server/collision/pairwise/CollisionShape.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <vector>

#include "server/collision/pairwise/ConservativeBox.h"
#include "server/collision/representation/BallPairs.h"
#include "server/collision/spherical_bezier/StarShape.h"

namespace tessera {

std::shared_ptr<CollisionShape> CollisionShape::ofTriangles(TriangleMesh mesh, const TreeOptions& trees) {
    return std::shared_ptr<CollisionShape>(
        new CollisionShape(Representation::kTriangles, std::make_shared<TriangleMesh>(std::move(mesh)), trees));
}

std::shared_ptr<CollisionShape> CollisionShape::ofHull(const TriangleMesh& mesh, const TreeOptions& trees) {
    // A hull of n points has fewer than 2 n faces: a mesh may have as many.
    Expected<ConvexHull> hull = ConvexHull::make(mesh, {.maxPoints = TriangleMeshLimits().maxTriangles / 2});
    if (!hull || hull->dimension() < 3) return nullptr;
    std::vector<double> positions;
    positions.reserve(3 * hull->vertices().size());
    for (const Vec3d& v : hull->vertices()) positions.insert(positions.end(), {v.x(), v.y(), v.z()});
    std::vector<std::uint32_t> indices;
    indices.reserve(3 * hull->faces().size());
    for (const ConvexHull::Face& face : hull->faces()) indices.insert(indices.end(), face.begin(), face.end());
    Expected<TriangleMesh> surface = TriangleMesh::make(std::span<const double>(positions), indices);
    TESSERA_CHECK(surface.has_value(), "a hull's own faces are a mesh");
    auto shape = std::shared_ptr<CollisionShape>(
        new CollisionShape(Representation::kHull, std::make_shared<TriangleMesh>(std::move(*surface)), trees));
    shape->hull_ = std::move(*hull);
    shape->setBall();
    return shape;
}

Expected<std::shared_ptr<CollisionShape>> CollisionShape::ofHeightField(const TriangleMesh& mesh,
                                                                        const TreeOptions& trees,
                                                                        const TriangleMeshLimits& limits) {
    // So that it is a mesh, too: of three corners of its own for each face.
    if (mesh.faceCount() > limits.maxVertices / 3)
        return fail(ErrorCode::kLimit, std::to_string(mesh.faceCount()) + " faces, at most " +
                                           std::to_string(limits.maxVertices / 3) + " in a height field");
    Expected<HeightField> field = HeightField::recognise(mesh);
    if (!field) return tl::unexpected(field.error());
    auto shape = std::shared_ptr<CollisionShape>(new CollisionShape(Representation::kHeightField, nullptr, trees));
    shape->field_ = std::move(*field);
    return shape;
}

Expected<std::shared_ptr<CollisionShape>> CollisionShape::ofPoints(std::span<const Vec3d> points, double radius,
                                                                   const TreeOptions& trees) {
    // So that it is a mesh, too.
    const TriangleMeshLimits limits;
    Expected<PointSet> made = PointSet::make(
        points, radius, {.maxPoints = limits.maxTriangles / 8, .maxCoordinate = 0.5 * limits.maxCoordinate});
    if (!made) return tl::unexpected(made.error());
    auto shape = std::shared_ptr<CollisionShape>(new CollisionShape(Representation::kPoints, nullptr, trees));
    shape->points_ = std::move(*made);
    return shape;
}

Expected<std::shared_ptr<CollisionShape>> CollisionShape::ofCover(TriangleMesh&& mesh, unsigned level,
                                                                  const TreeOptions& trees) {
    Expected<BallCover> cover = coverOf(mesh, coverRadius(mesh.bounds(), level));
    if (!cover) return tl::unexpected(cover.error());
    Expected<PointSet> points = PointSet::make(cover->centres, cover->radius);
    if (!points) return tl::unexpected(points.error());
    auto shape = std::shared_ptr<CollisionShape>(
        new CollisionShape(Representation::kPoints, std::make_shared<TriangleMesh>(std::move(mesh)), trees));
    shape->points_ = std::move(*points);
    shape->coveredFaces_ = std::move(cover->faces);
    return shape;
}

std::shared_ptr<CollisionShape> CollisionShape::ofSphericalField(TriangleMesh mesh, const TreeOptions& trees) {
    auto shape = std::shared_ptr<CollisionShape>(
        new CollisionShape(Representation::kSpherical, std::make_shared<TriangleMesh>(std::move(mesh)), trees));
    shape->spherical_.emplace(shape->tree(VolumeKind::kObb));
    return shape;
}

Expected<std::shared_ptr<CollisionShape>> CollisionShape::ofDistanceField(TriangleMesh&& mesh, double error,
                                                                          const TreeOptions& trees) {
    auto shape = std::shared_ptr<CollisionShape>(
        new CollisionShape(Representation::kDistanceField, std::make_shared<TriangleMesh>(std::move(mesh)), trees));
    Expected<DistanceLattice> lattice = DistanceLattice::make(shape->tree(VolumeKind::kObb), {.error = error});
    if (!lattice) {
        mesh = std::move(*shape->mesh_);
        return tl::unexpected(lattice.error());
    }
    shape->lattice_ = std::move(*lattice);
    return shape;
}

Expected<std::shared_ptr<CollisionShape>> CollisionShape::ofSphericalBezier(TriangleMesh&& mesh,
                                                                            const TreeOptions& trees) {
    const std::optional<Vec3d> centre = starCentreOf(mesh);
    if (!centre)
        return fail(ErrorCode::kBadInput, "it is not star-shaped: no place sees all of its faces from the same side");
    auto shape = std::shared_ptr<CollisionShape>(
        new CollisionShape(Representation::kSphericalBezier, std::make_shared<TriangleMesh>(std::move(mesh)), trees));
    shape->bezier_ = std::make_unique<SphericalBezierBound>(
        *shape->mesh_, SphericalBezierOptions{.levels = kSphericalBezierLevels, .centre = centre});
    return shape;
}

const SphericalBezierBound* CollisionShape::sphericalBezier() const {
    if (!bezier_) return nullptr;
    std::call_once(*bezierCurrent_, [&] {
        if (bezierMovedEnd_ == bezierMovedFirst_) return;
        std::vector<Vec3d> moved;
        moved.reserve(bezierMovedEnd_ - bezierMovedFirst_);
        const MeshPositions positions = mesh_->positions();
        for (std::size_t v = bezierMovedFirst_; v < bezierMovedEnd_; ++v) moved.push_back(positions[v]);
        const Expected<void> followed = bezier_->move(bezierMovedFirst_, moved);
        TESSERA_CHECK(followed.has_value(), "what a mesh takes, its bound takes");
        bezierMovedFirst_ = bezierMovedEnd_ = 0;
    });
    return bezier_.get();
}

std::shared_ptr<CollisionShape> CollisionShape::ofFreeform(FreeformShape surface, TriangleMesh drawn, double error,
                                                           const TreeOptions& trees) {
    auto shape = std::shared_ptr<CollisionShape>(
        new CollisionShape(Representation::kFreeform, std::make_shared<TriangleMesh>(std::move(drawn)), trees));
    shape->freeformError_ = error;
    shape->setSmoothSurface(std::move(surface));
    return shape;
}

void CollisionShape::setSmoothSurface(FreeformShape surface) {
    TESSERA_CHECK(representation_ == Representation::kFreeform, "triangles are of no smooth surface");
    smooth_ = std::make_unique<FreeformShape>(std::move(surface));
    followSmooth();
}

void CollisionShape::followSmooth() {
    smoothBounds_ = mesh_->bounds();
    smoothBounds_.extend(smooth_->bounds());
}

Expected<void> CollisionShape::moveControlPoints(std::size_t first, std::span<const Vec3d> positions) {
    TESSERA_CHECK(smooth_ && smooth_->subdivision(), "only subdivision surfaces have control points that move");
    const std::size_t count = smooth_->subdivision()->positions.size();
    Expected<void> moved;
    if (first == 0 && positions.size() == count) {
        moved = smooth_->move(positions);
    } else {
        std::vector<std::uint32_t> points(positions.size());
        std::iota(points.begin(), points.end(), static_cast<std::uint32_t>(first));
        moved = smooth_->move(points, positions);
    }
    if (moved) followSmooth();
    return moved;
}

const FreeformShape& CollisionShape::freeform() const {
    if (smooth_) return *smooth_;
    std::call_once(*asFreeformCurrent_, [&] {
        if (asFreeform_ && !hull_) {
            const MeshPositions now = mesh().positions();
            const Expected<void> moved = asFreeform_->move(std::vector<Vec3d>(now.begin(), now.end()));
            TESSERA_CHECK(moved.has_value(), "what a mesh takes, its copy takes");
            return;
        }
        Expected<FreeformShape> made = hull_ ? FreeformShape::ofHull(*hull_) : FreeformShape::ofTriangles(mesh());
        TESSERA_CHECK(made.has_value(), "shapes have faces");
        asFreeform_ = std::make_unique<FreeformShape>(std::move(*made));
    });
    return *asFreeform_;
}

namespace {

struct Soup {
    std::vector<double> positions;
    std::vector<std::uint32_t> indices;

    std::uint32_t add(const Vec3d& p) {
        positions.insert(positions.end(), {p.x(), p.y(), p.z()});
        return static_cast<std::uint32_t>(positions.size() / 3 - 1);
    }
};

Soup facesOf(const HeightField& field) {
    Soup out;
    out.positions.reserve(9 * field.faceCount());
    for (std::uint32_t face = 0; face < field.faceCount(); ++face)
        for (const Vec3d& p : field.triangle(face)) out.indices.push_back(out.add(p));
    return out;
}

Soup octahedraOf(const PointSet& points) {
    Soup out;
    out.positions.reserve(18 * points.size());
    out.indices.reserve(24 * points.size());
    for (std::uint32_t number = 0; number < points.size(); ++number) {
        const Vec3d at = points.point(number);
        const auto first = static_cast<std::uint32_t>(out.positions.size() / 3);
        for (int axis = 0; axis < 3; ++axis)
            for (const double side : {points.radius(), -points.radius()}) out.add(at + side * Vec3d::Unit(axis));
        for (std::uint32_t octant = 0; octant < 8; ++octant) {
            const std::uint32_t x = first + (octant & 1U), y = first + 2 + (octant >> 1U & 1U),
                                z = first + 4 + (octant >> 2U);
            // Each mirror turns the corners round.
            const bool even = std::popcount(octant) % 2 == 0;
            out.indices.insert(out.indices.end(), {x, even ? y : z, even ? z : y});
        }
    }
    return out;
}

}  // namespace

const TriangleMesh& CollisionShape::mesh() const {
    if (!field_ && (!points_ || isCover())) return *mesh_;
    std::call_once(meshMade_, [&] {
        const Soup soup = field_ ? facesOf(*field_) : octahedraOf(*points_);
        Expected<TriangleMesh> made = TriangleMesh::make(std::span<const double>(soup.positions), soup.indices);
        TESSERA_CHECK(made.has_value(), "what a field or a set of points accepts is a mesh");
        mesh_ = std::make_shared<TriangleMesh>(std::move(*made));
    });
    return *mesh_;
}

/// A small ball around the hull: its centre goes towards the farthest vertex in ever shorter steps (Badoiu and
/// Clarkson, Smaller core-sets for balls, SODA 2003).
void CollisionShape::setBall() {
    constexpr int kSteps = 64;
    const std::span<const Vec3d> points = hull_->vertices();
    const auto farthest = [&](const Vec3d& centre) {
        std::size_t best = 0;
        for (std::size_t i = 1; i < points.size(); ++i)
            if ((points[i] - centre).squaredNorm() > (points[best] - centre).squaredNorm()) best = i;
        return best;
    };
    Vec3d centre = hull_->bounds().center();
    ballCentre_ = centre;
    ballRadius_ = (points[farthest(centre)] - centre).stableNorm();
    for (int step = 1; step <= kSteps; ++step) {
        centre += (points[farthest(centre)] - centre) / (step + 1);
        const double radius = (points[farthest(centre)] - centre).stableNorm();
        if (!(radius < ballRadius_)) continue;
        ballCentre_ = centre;
        ballRadius_ = radius;
    }
    // So that rounding leaves no point outside.
    ballRadius_ *= 1 + 1e-14;
}

const TriangleTree& CollisionShape::tree(VolumeKind kind) const {
    LazyTree& lazy = trees_[static_cast<std::size_t>(kind)];
    std::call_once(*lazy.current, [&] {
        if (lazy.tree) {
            follow(*lazy.tree, lazy.movedFirst, lazy.movedEnd - lazy.movedFirst);
            lazy.movedFirst = lazy.movedEnd = 0;
            return;
        }
        (void)mesh();
        TreeOptions options = options_;
        options.volume = kind;
        lazy.tree = std::make_unique<TriangleTree>(mesh_, options);
        lazy.made = true;
    });
    return *lazy.tree;
}

const DeformingSurface& CollisionShape::groups() const {
    if (deformingGroups_) return *deformingGroups_;
    TESSERA_CHECK(hasGroups(), "of what moves the groups are its own");
    std::call_once(groupsMade_, [&] { restingGroups_ = std::make_unique<DeformingSurface>(mesh()); });
    return *restingGroups_;
}

const TriangleTree& CollisionShape::centreTree() const {
    TESSERA_CHECK(isCover(), "only covers have balls that fit a surface");
    std::call_once(*centreTree_.current, [&] {
        std::vector<double> positions;
        std::vector<std::uint32_t> indices;
        positions.reserve(3 * points_->size());
        indices.reserve(3 * points_->size());
        for (std::uint32_t ball = 0; ball < points_->size(); ++ball) {
            const Vec3d centre = points_->point(ball);
            positions.insert(positions.end(), {centre.x(), centre.y(), centre.z()});
            indices.insert(indices.end(), {ball, ball, ball});
        }
        Expected<TriangleMesh> centres = TriangleMesh::make(std::span<const double>(positions), indices);
        TESSERA_CHECK(centres.has_value(),
                      "centres lie in the box of a mesh, or where a map of one that is a mesh takes them");
        centreTree_.tree = std::make_unique<TriangleTree>(std::move(*centres), TreeOptions{.volume = kAutomaticVolume});
    });
    return *centreTree_.tree;
}

const SurfaceTopology& CollisionShape::topology() const {
    std::call_once(*topologyLookedAt_, [&] {
        if (!topology_ || !topology_->holds(mesh())) topology_ = std::make_unique<SurfaceTopology>(mesh());
    });
    return *topology_;
}

Box CollisionShape::boxIn(const Affine3d& world) const {
    return hull_ ? boxAround(world, bounds(), ballCentre_, ballRadius_) : boxAround(world, bounds());
}

std::shared_ptr<const CollisionShape> CollisionShape::placed(const Affine3d& map) const {
    std::optional<PointSet> balls;
    if (points_) {
        std::vector<Vec3d> moved;
        moved.reserve(points_->size());
        for (std::uint32_t number = 0; number < points_->size(); ++number)
            moved.push_back(map * points_->point(number));
        const double radius = points_->radius() * largestStretch(map.linear());
        if (!isCover()) {
            const auto made = ofPoints(moved, radius, options_);
            return made ? *made : nullptr;
        }
        Expected<PointSet> made = PointSet::make(moved, radius);
        if (!made) return nullptr;
        balls = std::move(*made);
    }
    TriangleMesh mesh = this->mesh();
    std::vector<Vec3d> positions;
    positions.reserve(mesh.vertexCount());
    for (const Vec3d p : mesh.positions()) positions.push_back(map * p);
    if (!mesh.move(positions)) return nullptr;
    if (hull_) return ofHull(mesh, options_);
    if (smooth_) {
        Expected<FreeformShape> surface = smooth_->placed(map);
        return surface ? ofFreeform(std::move(*surface), std::move(mesh), freeformError_, options_) : nullptr;
    }
    if (!balls) return ofTriangles(std::move(mesh), options_);
    auto shape = std::shared_ptr<CollisionShape>(
        new CollisionShape(Representation::kPoints, std::make_shared<TriangleMesh>(std::move(mesh)), options_));
    shape->points_ = std::move(balls);
    shape->coveredFaces_ = coveredFaces_;
    return shape;
}

void CollisionShape::checkDeforms() const {
    TESSERA_CHECK(representation_ == Representation::kTriangles || smooth_ || bezier_, "only triangles deform");
}

Expected<void> CollisionShape::move(std::span<const Vec3d> positions) {
    checkDeforms();
    if (positions.size() != mesh_->vertexCount()) return mesh_->move(positions);  // which says so
    return move(0, positions);
}

Expected<void> CollisionShape::move(std::size_t first, std::span<const Vec3d> positions) {
    checkDeforms();
    const bool all = first == 0 && positions.size() == mesh_->vertexCount();
    if (Expected<void> moved = all ? mesh_->move(positions) : mesh_->move(first, positions); !moved) return moved;
    if (topology_) topologyLookedAt_ = std::make_unique<std::once_flag>();
    if (asFreeform_) asFreeformCurrent_ = std::make_unique<std::once_flag>();
    if (smooth_) followSmooth();
    if (bezier_ && !positions.empty()) {
        const bool isBehind = bezierMovedEnd_ > bezierMovedFirst_;
        if (!isBehind) bezierCurrent_ = std::make_unique<std::once_flag>();
        bezierMovedFirst_ = isBehind ? std::min(bezierMovedFirst_, first) : first;
        bezierMovedEnd_ = std::max(bezierMovedEnd_, first + positions.size());
    }
    moveGroups(first, positions);
    for (LazyTree& lazy : trees_) {
        if (!lazy.tree) continue;
        if (!deformingGroups_ && lazy.movedEnd == 0) {
            follow(*lazy.tree, first, positions.size());
            continue;
        }
        // When it is asked for.
        if (lazy.movedEnd == 0) {
            lazy.current = std::make_unique<std::once_flag>();
            lazy.movedFirst = first;
        }
        lazy.movedFirst = std::min(lazy.movedFirst, first);
        lazy.movedEnd = std::max(lazy.movedEnd, first + positions.size());
    }
    return {};
}

void CollisionShape::follow(TriangleTree& tree, std::size_t first, std::size_t count) {
    tree.refitted(first, count);
    if (tree.decay() > TriangleTree::kRebuildAbove) tree.rebuild();
}

/// After the mesh.
void CollisionShape::moveGroups(std::size_t first, std::span<const Vec3d> positions) {
    movedVertices_ += positions.size();
    if (restingGroups_) deformingGroups_ = std::move(restingGroups_);
    if (deformingGroups_) {
        const bool asked =
            std::ranges::any_of(trees_, [](const LazyTree& lazy) { return lazy.tree && lazy.movedEnd == 0; });
        movesWithTrees_ = asked ? movesWithTrees_ + 1 : 0;
        if (movesWithTrees_ >= kMovesWithTrees) {
            deformingGroups_.reset();
            return;
        }
        const Expected<void> moved = deformingGroups_->move(first, positions);
        TESSERA_CHECK(moved.has_value(), "what a mesh takes, its groups take");
        return;
    }
    // Once, and where this is not the first time.
    const bool worthIt =
        movesWithTrees_ < kMovesWithTrees && movedVertices_ >= kMovesBeforeGroups * mesh_->vertexCount();
    if (worthIt) deformingGroups_ = std::make_unique<DeformingSurface>(*mesh_);
}

std::size_t CollisionShape::memoryBytes() const {
    std::size_t bytes = (mesh_ ? mesh_->memoryBytes() : 0) + (hull_ ? hull_->memoryBytes() : 0) +
                        (field_ ? field_->memoryBytes() : 0) + (points_ ? points_->memoryBytes() : 0) +
                        coveredFaces_.capacity() * sizeof(std::uint32_t) +
                        (spherical_ ? spherical_->memoryBytes() : 0) + (lattice_ ? lattice_->memoryBytes() : 0) +
                        (bezier_ ? bezier_->memoryBytes() : 0);
    for (const LazyTree& lazy : trees_)
        if (lazy.tree) bytes += lazy.tree->memoryBytes() - mesh_->memoryBytes();
    for (const auto* groups : {deformingGroups_.get(), restingGroups_.get()})
        if (groups != nullptr) bytes += groups->memoryBytes();
    if (centreTree_.tree) bytes += centreTree_.tree->memoryBytes();
    for (const auto* surface : {smooth_.get(), asFreeform_.get()})
        if (surface != nullptr) bytes += surface->memoryBytes();
    return bytes;
}

VolumeKind commonVolume(const CollisionShape& a, const CollisionShape& b) {
    if (a.volume() == b.volume()) return a.volume();
    if (a.deforms() != b.deforms()) return (a.deforms() ? a : b).volume();
    return (a.faceCount() >= b.faceCount() ? a : b).volume();
}

}  // namespace tessera
