// When something first touches a height field.
#include <algorithm>

#include "server/collision/representation/BlockImpactBody.h"
#include "server/collision/representation/FieldParts.h"
#include "server/collision/representation/HeightFieldQueries.h"

namespace tessera {

namespace {

template <typename BodyA, typename BodyB>
Impact firstContact(const BodyA& a, const BodyB& b, QueryWork& work, const ImpactOptions& options) {
    if (!a.way.valid() || !b.way.valid() || !Thickness(options).valid()) return {.t = 0, .complete = false};
    return RigidImpactSearch(a, b, options, work).run();
}

Impact unknown() {
    return {.t = 0, .complete = false};
}

/// Faces on their way, with the numbers that they had.
struct Gathered {
    std::vector<double> start;
    std::vector<Vec3d> end;
    std::vector<std::uint32_t> faces, indices;

    void add(std::uint32_t face, const Triangle& from, const Triangle& to) {
        faces.push_back(face);
        for (std::size_t i = 0; i < 3; ++i) {
            indices.push_back(static_cast<std::uint32_t>(indices.size()));
            start.insert(start.end(), {from[i].x(), from[i].y(), from[i].z()});
            end.push_back(to[i]);
        }
    }
};

/// What a tree's triangles sweep; empty where an end position is none.
Box sweptBy(const TriangleMesh& mesh, std::span<const Vec3d> end) {
    Box box = mesh.bounds();
    for (const std::uint32_t vertex : mesh.indices()) box.extend(end[vertex]);
    return box;
}

bool valid(std::span<const Vec3d> end, std::size_t vertices) {
    return end.size() == vertices && std::ranges::all_of(end, [](const Vec3d& p) {
               return p.allFinite() && p.cwiseAbs().maxCoeff() <= TriangleMeshLimits{}.maxCoordinate;
           });
}

/// Those faces of a field that come near what is swept. Nothing where the work is exhausted.
std::optional<Gathered> gather(const HeightField& field, std::span<const Vec3d> end, const Box& swept,
                               QueryWork& work) {
    Gathered out;
    if (end.empty()) {
        std::vector<std::uint32_t> near;
        if (!facesNear(field, swept, work, near)) return std::nullopt;
        for (const std::uint32_t face : near) out.add(face, field.triangle(face), field.triangle(face));
        return out;
    }
    std::vector<Vec3d> endAt(std::size_t{field.columns().lines()} * field.rows().lines(), Vec3d::Zero());
    for (std::size_t vertex = 0; vertex < end.size(); ++vertex) endAt[field.placeOf(vertex)] = end[vertex];
    for (std::uint32_t face = 0; face < field.faceCount(); ++face) {
        const HeightField::Slot at = field.slotOf(face);
        const Triangle from = field.triangle(face);
        Triangle to;
        Box box;
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t corner = field.cornersOf(at.column, at.row, at.half)[i];
            to[i] = endAt[(std::size_t{at.row} + (corner >> 1U)) * field.columns().lines() + at.column + (corner & 1U)];
            box.extend(from[i]);
            box.extend(to[i]);
        }
        if (box.overlaps(swept)) out.add(face, from, to);
    }
    return out;
}

Impact betweenStates(const HeightField& field, std::span<const Vec3d> fieldEnd, const TriangleTree& tree,
                     std::span<const Vec3d> treeEnd, bool fieldIsA, QueryWork& work, const ImpactOptions& options) {
    if (!valid(treeEnd, tree.mesh().vertexCount()) || (!fieldEnd.empty() && !valid(fieldEnd, field.vertexCount())))
        return unknown();
    if (tree.storage().empty()) return {};
    Box swept = sweptBy(tree.mesh(), treeEnd);
    const double slack =
        2 * std::max(0.0, options.tolerance) + 1e-12 * reachOf(swept).cwiseMax(reachOf(field.bounds())).maxCoeff();
    if (slack < std::numeric_limits<double>::infinity()) {
        swept.lower.array() -= slack;
        swept.upper.array() += slack;
    }
    const std::optional<Gathered> near = gather(field, fieldEnd, swept, work);
    if (!near) return unknown();
    if (near->faces.empty()) return {};
    Expected<TriangleMesh> mesh = TriangleMesh::make(std::span<const double>(near->start), near->indices);
    if (!mesh) return unknown();
    const TriangleTree gathered(*std::move(mesh));
    Impact found = fieldIsA ? timeOfImpact(gathered, near->end, tree, treeEnd, work, options)
                            : timeOfImpact(tree, treeEnd, gathered, near->end, work, options);
    if (found.hit) {
        std::uint32_t& face = fieldIsA ? found.faces.a : found.faces.b;
        face = near->faces[face];
    }
    return found;
}

}  // namespace

Impact timeOfImpact(const HeightField& a, const BodyMotion& motionA, const TriangleTree& b, const BodyMotion& motionB,
                    QueryWork& work, const ImpactOptions& options) {
    if (b.storage().empty()) return {};
    const FieldParts parts(a);
    return firstContact(BlockImpactBody(parts, a.bounds(), motionA), TreeImpactBody(b, motionB), work, options);
}

Impact timeOfImpact(const TriangleTree& a, const BodyMotion& motionA, const HeightField& b, const BodyMotion& motionB,
                    QueryWork& work, const ImpactOptions& options) {
    if (a.storage().empty()) return {};
    const FieldParts parts(b);
    return firstContact(TreeImpactBody(a, motionA), BlockImpactBody(parts, b.bounds(), motionB), work, options);
}

Impact timeOfImpact(const HeightField& a, const BodyMotion& motionA, const HeightField& b, const BodyMotion& motionB,
                    QueryWork& work, const ImpactOptions& options) {
    const FieldParts partsA(a), partsB(b);
    return firstContact(BlockImpactBody(partsA, a.bounds(), motionA), BlockImpactBody(partsB, b.bounds(), motionB),
                        work, options);
}

Impact timeOfImpact(const HeightField& a, std::span<const Vec3d> endA, const TriangleTree& b,
                    std::span<const Vec3d> endB, QueryWork& work, const ImpactOptions& options) {
    return betweenStates(a, endA, b, endB, true, work, options);
}

Impact timeOfImpact(const TriangleTree& a, std::span<const Vec3d> endA, const HeightField& b,
                    std::span<const Vec3d> endB, QueryWork& work, const ImpactOptions& options) {
    return betweenStates(b, endB, a, endA, false, work, options);
}

}  // namespace tessera
