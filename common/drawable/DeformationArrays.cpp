#include "common/drawable/DeformationArrays.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <string>

#include "common/cores/Deformation.h"
#include "common/drawable/ContentCache.h"
#include "common/freeform/lattice/Lattice.h"

namespace tessera {
namespace {

const Deformation& deformationOf(const void* core) {
    return *static_cast<const Deformation*>(core);
}

MeshArrays atRest(const Deformation& d) {
    return {.positions = d.positions,
            .normals = d.normals,
            .colors = d.colors,
            .texcoords = d.texcoords,
            .indices = d.indices,
            .texcoords1 = d.texcoords1,
            .lines = {},
            .tangents = d.tangents};
}

/// All but the last are in the recipe.
std::array<const Blob*, 8> blobsOf(const Deformation& d) {
    return {&d.positions, &d.normals,    &d.colors,   &d.texcoords,
            &d.indices,   &d.texcoords1, &d.tangents, &d.controlPoints};
}

bool allHere(const Deformation& d) {
    const auto blobs = blobsOf(d);
    return std::ranges::all_of(blobs, [](const Blob* blob) { return blob->empty() || blob->resident(); });
}

bool holdsNothing(const Deformation& d) {
    return d.positions.empty() && d.indices.empty();
}

/// Of all but where the control points are.
Hash128 recipeOf(const Deformation& d) {
    std::array<Hash128, 14> parts{};
    parts[0] = {typeOf<Deformation>().value, d.controlPoints.sizeBytes()};
    const auto blobs = blobsOf(d);
    for (std::size_t i = 0; i < 7; ++i) parts[1 + i] = blobs[i]->id();
    parts[8] = {static_cast<std::uint64_t>(d.pointsX), static_cast<std::uint64_t>(d.pointsY)};
    parts[9] = {static_cast<std::uint64_t>(d.pointsZ), static_cast<std::uint64_t>(d.degreeX)};
    parts[10] = {static_cast<std::uint64_t>(d.degreeY), static_cast<std::uint64_t>(d.degreeZ)};
    for (Eigen::Index i = 0; i < 3; ++i)
        parts[static_cast<std::size_t>(11 + i)] = {std::bit_cast<std::uint64_t>(d.lower[i]),
                                                   std::bit_cast<std::uint64_t>(d.upper[i])};
    return hash128(std::as_bytes(std::span(parts)));
}

/// What all positions of the control points share, or why there is nothing.
struct DeformationPlan {
    std::optional<Lattice> lattice;  ///< control points at rest
    Error error;
    [[nodiscard]] std::size_t bytes() const { return 256 + (lattice ? lattice->controlPoints().size_bytes() : 0); }
    /// Whoever uses one holds it.
    [[nodiscard]] bool inUse() const { return false; }
};

Expected<Lattice> latticeOf(const Deformation& d) {
    if (const Expected<void> mesh = checkMesh(atRest(d)); !mesh) return failWith("the mesh at rest", mesh.error());
    const auto axis = [](std::int64_t degree, std::int64_t points) {
        return LatticeAxis{static_cast<unsigned>(degree), static_cast<unsigned>(points)};
    };
    if (!d.lower.allFinite() || !d.upper.allFinite())
        return fail(ErrorCode::kBadInput, "the volume has a corner that is no number");
    if (!((d.upper - d.lower).minCoeff() > 0))
        return fail(ErrorCode::kBadInput, "the volume's upper corner is not above its lower one along each axis");
    Expected<Lattice> lattice =
        Lattice::make(LatticeVolume::of({d.lower, d.upper}),
                      {axis(d.degreeX, d.pointsX), axis(d.degreeY, d.pointsY), axis(d.degreeZ, d.pointsZ)});
    if (!lattice) return lattice;
    const std::size_t wanted = lattice->controlPoints().size() * 12;
    if (!d.controlPoints.empty() && d.controlPoints.sizeBytes() != wanted)
        return fail(ErrorCode::kBadInput, "controlPoints has " + std::to_string(d.controlPoints.sizeBytes()) +
                                              " bytes; " + std::to_string(d.pointsX) + " x " +
                                              std::to_string(d.pointsY) + " x " + std::to_string(d.pointsZ) +
                                              " points of three floats have " + std::to_string(wanted));
    return lattice;
}

std::shared_ptr<const DeformationPlan> planOf(const Deformation& d) {
    static ContentCache<DeformationPlan> plans(std::size_t{1} << 24);
    return plans.get(recipeOf(d), [&]() -> DeformationPlan {
        Expected<Lattice> lattice = latticeOf(d);
        if (!lattice) return {.lattice = std::nullopt, .error = lattice.error()};
        return {.lattice = std::move(*lattice), .error = {}};
    });
}

/// So that no sum of theirs is infinite in floats.
constexpr float kFarthestControl = 1e30F;

Expected<void> checkControls(std::span<const float> points) {
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!(std::abs(points[i]) <= kFarthestControl))
            return fail(ErrorCode::kBadInput, "control point " + std::to_string(i / 3) +
                                                  " has a coordinate that is not a number within 1e30");
    return {};
}

Expected<void> checkDeformation(const void* core) {
    const Deformation& d = deformationOf(core);
    if (holdsNothing(d) && d.controlPoints.empty()) return {};
    if (!allHere(d)) return fail(ErrorCode::kBadInput, "an array of the deformation is not here");
    const std::shared_ptr<const DeformationPlan> plan = planOf(d);
    if (!plan->lattice) return tl::unexpected(plan->error);
    return checkControls(d.controlPoints.as<float>());
}

std::optional<DerivedSource> sourceOfDeformation(const void* core, const Fineness&) {
    const Deformation& d = deformationOf(core);
    if (holdsNothing(d) || !allHere(d)) return std::nullopt;
    return DerivedSource{recipeOf(d), d.controlPoints};
}

/// The part of the volume that these control points move, in parameters.
Box movedPart(const Lattice& lattice, std::size_t first, std::size_t end) {
    Box part;
    for (std::size_t i = first; i < end; ++i) {
        const Box support = lattice.support(i);
        part.extend(support.lower);
        part.extend(support.upper);
    }
    // As Lattice::contains counts what is on the volume's faces.
    part.lower.array() -= 1e-9;
    part.upper.array() += 1e-9;
    return part;
}

/// Along the surface as it stands deformed: by the Jacobian itself. Where that mirrors, normals stay on their side, and
/// so the tangent's side is the other one. What is crushed stays as at rest.
void deformTangents(const Lattice& lattice, std::span<const float> places, std::span<const float> from,
                    std::span<float> to) {
    for (std::size_t i = 0; 3 * i < places.size(); ++i) {
        const Mat3d jacobian = lattice.place(Vec3d(places[3 * i], places[3 * i + 1], places[3 * i + 2])).jacobian;
        const Vec3d moved = jacobian * Vec3d(from[4 * i], from[4 * i + 1], from[4 * i + 2]);
        const double length = moved.norm();
        for (std::size_t k = 0; k < 3; ++k)
            to[4 * i + k] = length > 1e-100 && std::isfinite(length)
                                ? static_cast<float>(moved[static_cast<Eigen::Index>(k)] / length)
                                : from[4 * i + k];
        to[4 * i + 3] = jacobian.determinant() < 0 ? -from[4 * i + 3] : from[4 * i + 3];
    }
}

DerivedMesh deriveDeformation(const void* core, const Fineness&, const EarlierMesh* earlier) {
    const Deformation& d = deformationOf(core);
    const std::shared_ptr<const DeformationPlan> plan = planOf(d);
    if (!plan->lattice || !checkControls(d.controlPoints.as<float>())) return {};
    DerivedMesh out{.arrays = atRest(d), .plan = plan};
    if (d.controlPoints.empty()) return out;
    Lattice lattice = *plan->lattice;
    const std::span<const float> numbers = d.controlPoints.as<float>();
    std::vector<Vec3d> controls(numbers.size() / 3);
    for (std::size_t i = 0; i < controls.size(); ++i)
        controls[i] = Vec3d(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
    if (!lattice.setControlPoints(0, controls)) return {};
    const std::span<const float> from = d.positions.as<float>(), normalsFrom = d.normals.as<float>(),
                                 tangentsFrom = d.tangents.as<float>();
    const auto deform = [&](std::size_t first, std::size_t count) {
        const auto part = from.subspan(3 * first, 3 * count);
        std::vector<float> positions(3 * count), normals(normalsFrom.empty() ? 0 : 3 * count),
            tangents(tangentsFrom.empty() ? 0 : 4 * count);
        if (normals.empty())
            lattice.deform(part, positions);
        else
            lattice.deform(part, normalsFrom.subspan(3 * first, 3 * count), positions, normals);
        if (!tangents.empty()) deformTangents(lattice, part, tangentsFrom.subspan(4 * first, 4 * count), tangents);
        const auto put = [&](Blob& array, const std::vector<float>& values, std::size_t each) {
            if (values.empty()) return;
            array = earlier ? *array.withRange(each * sizeof(float) * first, std::as_bytes(std::span(values)))
                            : Blob::of(std::span(values));
        };
        put(out.arrays.positions, positions, 3);
        put(out.arrays.normals, normals, 3);
        put(out.arrays.tangents, tangents, 4);
    };
    const std::size_t vertices = from.size() / 3;
    if (!earlier) {
        deform(0, vertices);
        return out;
    }
    const ByteRange range = elementsOf(earlier->changed, 3 * sizeof(float));
    const Box part = movedPart(lattice, range.begin, range.end);
    std::size_t first = vertices, end = 0;
    for (std::size_t i = 0; i < vertices; ++i) {
        if (!part.contains(lattice.parameters(Vec3d(from[3 * i], from[3 * i + 1], from[3 * i + 2])))) continue;
        first = std::min(first, i);
        end = i + 1;
    }
    out.arrays.positions = earlier->mesh.arrays.positions;
    out.arrays.normals = earlier->mesh.arrays.normals;
    out.arrays.tangents = earlier->mesh.arrays.tangents;
    if (first < end) deform(first, end - first);
    return out;
}

}  // namespace

Expected<Blob> controlPointsAtRest(const Deformation& deformation) {
    const Expected<Lattice> lattice = latticeOf(deformation);
    if (!lattice) return tl::unexpected(lattice.error());
    std::vector<float> numbers;
    for (const Vec3d& point : lattice->controlPoints())
        for (const double coordinate : point) numbers.push_back(static_cast<float>(coordinate));
    return Blob::of(std::span<const float>(numbers));
}

constinit const Derivation kDeformationDerivation{
    .check = &checkDeformation,
    .source = &sourceOfDeformation,
    .derive = &deriveDeformation,
    .resident = [](const void* core) { return allHere(deformationOf(core)); },
};

}  // namespace tessera
