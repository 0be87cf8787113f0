#include "common/drawable/SubdivisionArrays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "common/cores/SubdivisionSurface.h"
#include "common/drawable/ContentCache.h"
#include "common/drawable/SmoothSurface.h"
#include "common/freeform/subdivision/LimitTessellation.h"

namespace tessera {
namespace {

const SubdivisionSurface& surfaceOf(const void* core) { return *static_cast<const SubdivisionSurface*>(core); }

std::array<const Blob*, 7> topologyOf(const SubdivisionSurface& s) {
    return {&s.faceSizes, &s.faceVertices, &s.creases, &s.creaseSharpness, &s.corners, &s.cornerSharpness, &s.holes};
}

bool isNothing(const SubdivisionSurface& s) {
    const auto blobs = topologyOf(s);
    return s.points.empty() && std::all_of(blobs.begin(), blobs.end(), [](const Blob* blob) { return blob->empty(); });
}

bool isHere(const SubdivisionSurface& s) {
    const auto blobs = topologyOf(s);
    return (s.points.empty() || s.points.resident()) && std::all_of(blobs.begin(), blobs.end(), [](const Blob* blob) { return blob->empty() || blob->resident(); });
}

std::int64_t levelOf(const SubdivisionSurface& s, unsigned fineness) { return s.level + fineness; }

/// Of all but where the points are.
Hash128 recipeOf(const SubdivisionSurface& s, unsigned fineness) {
    std::array<Hash128, 11> parts{};
    parts[0] = {typeOf<SubdivisionSurface>().value, s.points.sizeBytes()};
    const auto blobs = topologyOf(s);
    for (std::size_t i = 0; i < blobs.size(); ++i) parts[1 + i] = blobs[i]->id();
    parts[8] = {static_cast<std::uint64_t>(s.scheme), static_cast<std::uint64_t>(s.boundary)};
    parts[9] = {static_cast<std::uint64_t>(s.creaseMethod), static_cast<std::uint64_t>(s.triangles)};
    parts[10] = {static_cast<std::uint64_t>(levelOf(s, fineness)), 0};
    return hash128(std::as_bytes(std::span(parts)));
}

Expected<ControlMesh> controlMeshOf(const SubdivisionSurface& s) {
    const auto whole = [](const Blob& blob, std::size_t each, const char* what) -> Expected<void> {
        if (blob.sizeBytes() % each == 0) return {};
        return fail(ErrorCode::kBadInput, std::string(what) + " has " + std::to_string(blob.sizeBytes()) + " bytes, which is no multiple of " + std::to_string(each));
    };
    const auto matching = [](const Blob& sharpness, std::size_t count, const char* what) -> Expected<void> {
        if (sharpness.empty() || sharpness.as<float>().size() == count) return {};
        return fail(ErrorCode::kBadInput, std::string(what) + " has " + std::to_string(sharpness.as<float>().size()) + " numbers for " + std::to_string(count));
    };
    const std::size_t creases = s.creases.sizeBytes() / 8, corners = s.corners.sizeBytes() / 4;
    for (const Expected<void>& good :
         {whole(s.points, 12, "points"), whole(s.faceSizes, 4, "faceSizes"), whole(s.faceVertices, 4, "faceVertices"), whole(s.creases, 8, "creases"),
          whole(s.creaseSharpness, 4, "creaseSharpness"), whole(s.corners, 4, "corners"), whole(s.cornerSharpness, 4, "cornerSharpness"), whole(s.holes, 4, "holes"),
          matching(s.creaseSharpness, creases, "creaseSharpness"), matching(s.cornerSharpness, corners, "cornerSharpness")})
        if (!good) return tl::unexpected(good.error());
    const auto numbers = [](const Blob& blob) {
        const auto values = blob.as<std::uint32_t>();
        return std::vector<std::uint32_t>(values.begin(), values.end());
    };
    ControlMesh mesh{.scheme = static_cast<SubdivisionScheme>(s.scheme),
                     .boundary = static_cast<BoundaryInterpolation>(s.boundary),
                     .creaseMethod = static_cast<CreaseMethod>(s.creaseMethod),
                     .triangles = static_cast<TriangleRule>(s.triangles)};
    mesh.positions.assign(s.points.sizeBytes() / 12, Vec3d::Zero());  // where they are is not the topology's
    mesh.faceSizes = numbers(s.faceSizes);
    mesh.faceVertices = numbers(s.faceVertices);
    mesh.holes = numbers(s.holes);
    const auto ends = s.creases.as<std::uint32_t>(), vertices = s.corners.as<std::uint32_t>();
    for (std::size_t i = 0; i < creases; ++i)
        mesh.creases.push_back({ends[2 * i], ends[2 * i + 1], s.creaseSharpness.empty() ? kInfiniteSharpness : s.creaseSharpness.as<float>()[i]});
    for (std::size_t i = 0; i < corners; ++i) mesh.corners.push_back({vertices[i], s.cornerSharpness.empty() ? kInfiniteSharpness : s.cornerSharpness.as<float>()[i]});
    return mesh;
}

/// What all positions of the points share, or why there is nothing.
struct SubdivisionPlan {
    std::shared_ptr<const LimitTessellation> tessellation;
    Blob indices;
    Error error;
    [[nodiscard]] std::size_t bytes() const { return tessellation ? tessellation->bytes() + indices.sizeBytes() : 256; }
    /// Whoever uses one holds it.
    [[nodiscard]] bool inUse() const { return false; }
};

std::shared_ptr<const SubdivisionPlan> planOf(const SubdivisionSurface& s, unsigned fineness) {
    static ContentCache<SubdivisionPlan> plans(kMostUnusedDerivedBytes);
    return plans.get(recipeOf(s, fineness), [&]() -> SubdivisionPlan {
        const Expected<ControlMesh> mesh = controlMeshOf(s);
        if (!mesh) return {.error = mesh.error()};
        Expected<std::shared_ptr<const LimitTessellation>> made = LimitTessellation::build(*mesh, static_cast<int>(levelOf(s, fineness)));
        if (!made) return {.error = made.error()};
        const Blob indices = Blob::of(std::span<const std::uint32_t>((*made)->indices()));
        return {.tessellation = std::move(*made), .indices = indices};
    });
}

/// So that no sum of theirs is infinite in floats.
constexpr float kFarthest = 1e30F;

Expected<void> checkPoints(std::span<const float> points) {
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!(std::abs(points[i]) <= kFarthest))
            return fail(ErrorCode::kBadInput, "control point " + std::to_string(i / 3) + " has a coordinate that is not a number within 1e30");
    return {};
}

Expected<void> checkSurface(const void* core) {
    const SubdivisionSurface& s = surfaceOf(core);
    if (isNothing(s)) return {};
    if (!isHere(s)) return fail(ErrorCode::kBadInput, "an array of the control mesh is not here");
    const std::shared_ptr<const SubdivisionPlan> plan = planOf(s, 0);
    if (!plan->tessellation) return tl::unexpected(plan->error);
    return checkPoints(s.points.as<float>());
}

std::optional<DerivedSource> sourceOf(const void* core, unsigned fineness) {
    const SubdivisionSurface& s = surfaceOf(core);
    if (isNothing(s) || !isHere(s)) return std::nullopt;
    return DerivedSource{recipeOf(s, fineness), s.points};
}

DerivedMesh deriveSurface(const void* core, unsigned fineness, const EarlierMesh* earlier) {
    const SubdivisionSurface& s = surfaceOf(core);
    const std::shared_ptr<const SubdivisionPlan> plan = planOf(s, fineness);
    if (!plan->tessellation || !checkPoints(s.points.as<float>())) return {};
    const LimitTessellation& tessellation = *plan->tessellation;
    const std::span<const float> points = s.points.as<float>();
    DerivedMesh out{.arrays = {.indices = plan->indices}, .plan = plan};
    if (!earlier) {
        std::vector<float> positions(3 * tessellation.vertexCount()), normals(positions.size());
        tessellation.evaluate(points, positions, normals);
        out.arrays.positions = Blob::of(std::span<const float>(positions));
        out.arrays.normals = Blob::of(std::span<const float>(normals));
        return out;
    }
    std::vector<std::uint32_t> moved;
    const ByteRange range = elementsOf(earlier->changed, 3 * sizeof(float));
    for (std::uint64_t p = range.begin; p < range.end; ++p) moved.push_back(static_cast<std::uint32_t>(p));
    const auto before = earlier->mesh.arrays.positions.as<float>(), normalsBefore = earlier->mesh.arrays.normals.as<float>();
    std::vector<float> positions(before.begin(), before.end()), normals(normalsBefore.begin(), normalsBefore.end());
    const LimitTessellation::Range changed = tessellation.update(moved, points, positions, normals);
    out.arrays.positions = earlier->mesh.arrays.positions;
    out.arrays.normals = earlier->mesh.arrays.normals;
    if (changed.begin == changed.end) return out;
    const auto follow = [&](Blob& blob, const std::vector<float>& now) {
        const std::span<const float> part = std::span<const float>(now).subspan(3 * changed.begin, 3 * (changed.end - changed.begin));
        blob = *blob.withRange(3 * sizeof(float) * changed.begin, std::as_bytes(part));
    };
    follow(out.arrays.positions, positions);
    follow(out.arrays.normals, normals);
    return out;
}

unsigned finestOf(const void* core) {
    return static_cast<unsigned>(std::max<std::int64_t>(0, SubdivisionSurface::kFinestLevel - surfaceOf(core).level));
}

double deviationOf(const void* core, unsigned fineness, const MeshArrays& arrays) {
    const SubdivisionSurface& s = surfaceOf(core);
    // Coarser ones are measured by those of level 2.
    constexpr std::int64_t kMeasured = 2;
    const std::int64_t level = levelOf(s, fineness);
    const auto measured = static_cast<unsigned>(std::max(level, kMeasured) - s.level);
    const std::shared_ptr<const SubdivisionPlan> plan = planOf(s, measured);
    const MeshArrays by = measured == fineness ? arrays : derivedArrays(kSubdivisionDerivation, core, measured);
    // What has so many faces that level 2 is too much is taken to be as fine as it gets.
    if (!plan->tessellation || by.positions.empty()) return 0;
    return plan->tessellation->deviation(by.positions.as<float>(), by.normals.as<float>(), static_cast<int>(level));
}

constexpr ScreenSteps kSubdivisionSteps{
    .finest = &finestOf,
    .screenError = [](const void* core) { return surfaceOf(core).screenError; },
    .deviation = &deviationOf,
    .seam = [](const void*) { return 0.0; },
    .copy = [](const void* core) -> std::shared_ptr<const void> { return std::make_shared<const SubdivisionSurface>(surfaceOf(core)); },
};

std::shared_ptr<const SmoothSurface> smoothSubdivision(const void* core) {
    const SubdivisionSurface& s = surfaceOf(core);
    if (isNothing(s) || !checkSurface(core)) return nullptr;
    Expected<ControlMesh> mesh = controlMeshOf(s);
    if (!mesh || mesh->scheme == SubdivisionScheme::kBilinear) return nullptr;
    const std::span<const float> xyz = s.points.as<float>();
    for (std::size_t i = 0; i < mesh->positions.size(); ++i) mesh->positions[i] = Vec3d(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
    return std::make_shared<const SmoothSurface>(SmoothSurface{std::move(*mesh)});
}

}  // namespace

constinit const Derivation kSubdivisionDerivation{
    .check = &checkSurface,
    .source = &sourceOf,
    .derive = &deriveSurface,
    .resident = [](const void* core) { return isHere(surfaceOf(core)); },
    .byScreen = &kSubdivisionSteps,
    .smooth = &smoothSubdivision,
};

}  // namespace tessera
