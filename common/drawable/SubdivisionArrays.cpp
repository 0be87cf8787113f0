#include "common/drawable/SubdivisionArrays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>

#include "common/cores/SubdivisionSurface.h"
#include "common/drawable/ContentCache.h"
#include "common/drawable/SmoothSurface.h"
#include "common/freeform/subdivision/LimitReach.h"
#include "common/freeform/subdivision/LimitTessellation.h"

namespace tessera {
namespace {

const SubdivisionSurface& surfaceOf(const void* core) {
    return *static_cast<const SubdivisionSurface*>(core);
}

std::array<const Blob*, 7> topologyOf(const SubdivisionSurface& s) {
    return {&s.faceSizes, &s.faceVertices, &s.creases, &s.creaseSharpness, &s.corners, &s.cornerSharpness, &s.holes};
}

bool isNothing(const SubdivisionSurface& s) {
    const auto blobs = topologyOf(s);
    return s.points.empty() && std::all_of(blobs.begin(), blobs.end(), [](const Blob* blob) { return blob->empty(); });
}

bool isHere(const SubdivisionSurface& s) {
    const auto blobs = topologyOf(s);
    return (s.points.empty() || s.points.resident()) &&
           std::all_of(blobs.begin(), blobs.end(), [](const Blob* blob) { return blob->empty() || blob->resident(); });
}

/// Of all but where the points are and how fine the triangles.
Hash128 topologyKeyOf(const SubdivisionSurface& s) {
    std::array<Hash128, 10> parts{};
    parts[0] = {typeOf<SubdivisionSurface>().value, s.points.sizeBytes()};
    const auto blobs = topologyOf(s);
    for (std::size_t i = 0; i < blobs.size(); ++i) parts[1 + i] = blobs[i]->id();
    parts[8] = {static_cast<std::uint64_t>(s.scheme), static_cast<std::uint64_t>(s.boundary)};
    parts[9] = {static_cast<std::uint64_t>(s.creaseMethod), static_cast<std::uint64_t>(s.triangles)};
    return hash128(std::as_bytes(std::span(parts)));
}
/// Of all but where the points are.
Hash128 recipeOf(const SubdivisionSurface& s, const Fineness& fineness) {
    const std::array<Hash128, 3> parts{
        topologyKeyOf(s), Hash128{static_cast<std::uint64_t>(s.level + fineness.steps), 0}, fineness.levels.id()};
    return hash128(std::as_bytes(std::span(parts)));
}

Expected<ControlMesh> controlMeshOf(const SubdivisionSurface& s) {
    const auto whole = [](const Blob& blob, std::size_t each, const char* what) -> Expected<void> {
        if (blob.sizeBytes() % each == 0) return {};
        return fail(ErrorCode::kBadInput, std::string(what) + " has " + std::to_string(blob.sizeBytes()) +
                                              " bytes, which is no multiple of " + std::to_string(each));
    };
    const auto matching = [](const Blob& sharpness, std::size_t count, const char* what) -> Expected<void> {
        if (sharpness.empty() || sharpness.as<float>().size() == count) return {};
        return fail(ErrorCode::kBadInput, std::string(what) + " has " + std::to_string(sharpness.as<float>().size()) +
                                              " numbers for " + std::to_string(count));
    };
    const std::size_t creases = s.creases.sizeBytes() / 8, corners = s.corners.sizeBytes() / 4;
    for (const Expected<void>& good :
         {whole(s.points, 12, "points"), whole(s.faceSizes, 4, "faceSizes"), whole(s.faceVertices, 4, "faceVertices"),
          whole(s.creases, 8, "creases"), whole(s.creaseSharpness, 4, "creaseSharpness"),
          whole(s.corners, 4, "corners"), whole(s.cornerSharpness, 4, "cornerSharpness"), whole(s.holes, 4, "holes"),
          matching(s.creaseSharpness, creases, "creaseSharpness"),
          matching(s.cornerSharpness, corners, "cornerSharpness")})
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
        mesh.creases.push_back({ends[2 * i], ends[2 * i + 1],
                                s.creaseSharpness.empty() ? kInfiniteSharpness : s.creaseSharpness.as<float>()[i]});
    for (std::size_t i = 0; i < corners; ++i)
        mesh.corners.push_back(
            {vertices[i], s.cornerSharpness.empty() ? kInfiniteSharpness : s.cornerSharpness.as<float>()[i]});
    return mesh;
}

/// What all finenesses share, or why there is nothing.
struct SharedPlan {
    std::shared_ptr<const LimitPlan> plan;
    int finest = -1;  ///< level that no face goes beyond
    Error error;
    [[nodiscard]] std::size_t bytes() const { return plan ? plan->bytes() : 256; }
    /// Whoever uses one holds it.
    [[nodiscard]] bool inUse() const { return plan && plan.use_count() > 1; }
};
std::shared_ptr<const SharedPlan> sharedPlanOf(const SubdivisionSurface& s) {
    static ContentCache<SharedPlan> plans(kMostUnusedDerivedBytes);
    return plans.get(topologyKeyOf(s), [&]() -> SharedPlan {
        const Expected<ControlMesh> mesh = controlMeshOf(s);
        if (!mesh) return {.plan = {}, .error = mesh.error()};
        Expected<std::shared_ptr<const LimitPlan>> made = LimitPlan::build(*mesh);
        if (!made) return {.plan = {}, .error = made.error()};
        const int finest = (*made)->finestLevel(LimitTessellation::Limits().mostWeights);
        return {.plan = std::move(*made), .finest = finest, .error = {}};
    });
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

std::shared_ptr<const SubdivisionPlan> planOf(const SubdivisionSurface& s, const Fineness& fineness) {
    static ContentCache<SubdivisionPlan> plans(kMostUnusedDerivedBytes);
    return plans.get(recipeOf(s, fineness), [&]() -> SubdivisionPlan {
        const std::shared_ptr<const SharedPlan> shared = sharedPlanOf(s);
        if (!shared->plan) return {.tessellation = {}, .indices = {}, .error = shared->error};
        const auto refused = [](const char* why) {
            return SubdivisionPlan{.tessellation = {}, .indices = {}, .error = Error{ErrorCode::kBadInput, why}};
        };
        const std::int64_t level = s.level + fineness.steps;
        if (level < 0 || level > LimitTessellation::kFinestLevel) return refused("a level is from 0 to 6");
        std::vector<std::uint8_t> levels(shared->plan->topology().mesh().faceCount(), static_cast<std::uint8_t>(level));
        if (!fineness.levels.empty()) {
            const auto steps = fineness.levels.as<std::uint8_t>();
            if (steps.size() != levels.size()) return refused("a pattern is of another mesh");
            for (std::size_t f = 0; f < levels.size(); ++f) levels[f] = static_cast<std::uint8_t>(levels[f] + steps[f]);
        }
        Expected<std::shared_ptr<const LimitTessellation>> made = LimitTessellation::build(shared->plan, levels);
        if (!made) return {.tessellation = {}, .indices = {}, .error = made.error()};
        const Blob indices = Blob::of(std::span<const std::uint32_t>((*made)->indices()));
        return {.tessellation = std::move(*made), .indices = indices, .error = {}};
    });
}

/// So that no sum of theirs is infinite in floats.
constexpr float kFarthest = 1e30F;

Expected<void> checkPoints(std::span<const float> points) {
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!(std::abs(points[i]) <= kFarthest))
            return fail(ErrorCode::kBadInput, "control point " + std::to_string(i / 3) +
                                                  " has a coordinate that is not a number within 1e30");
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

std::optional<DerivedSource> sourceOf(const void* core, const Fineness& fineness) {
    const SubdivisionSurface& s = surfaceOf(core);
    if (isNothing(s) || !isHere(s)) return std::nullopt;
    return DerivedSource{recipeOf(s, fineness), s.points};
}

std::vector<std::uint32_t> pointsIn(const ByteRange& changed) {
    const ByteRange range = elementsOf(changed, 3 * sizeof(float));
    std::vector<std::uint32_t> points(range.end - range.begin);
    std::iota(points.begin(), points.end(), static_cast<std::uint32_t>(range.begin));
    return points;
}

DerivedMesh deriveSurface(const void* core, const Fineness& fineness, const EarlierMesh* earlier) {
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
    const std::vector<std::uint32_t> moved = pointsIn(earlier->changed);
    const auto before = earlier->mesh.arrays.positions.as<float>(),
               normalsBefore = earlier->mesh.arrays.normals.as<float>();
    std::vector<float> positions(before.begin(), before.end()), normals(normalsBefore.begin(), normalsBefore.end());
    const LimitTessellation::Range changed = tessellation.update(moved, points, positions, normals);
    out.arrays.positions = earlier->mesh.arrays.positions;
    out.arrays.normals = earlier->mesh.arrays.normals;
    if (changed.begin == changed.end) return out;
    const auto follow = [&](Blob& blob, const std::vector<float>& now) {
        const std::span<const float> part =
            std::span<const float>(now).subspan(3 * changed.begin, 3 * (changed.end - changed.begin));
        blob = *blob.withRange(3 * sizeof(float) * changed.begin, std::as_bytes(part));
    };
    follow(out.arrays.positions, positions);
    follow(out.arrays.normals, normals);
    return out;
}

/// Where each face can be and how far off it is, of some positions of the points. Found again by who looks at the next.
struct MeasuredSurface {
    std::vector<LimitReach> reaches;  ///< by control face
    std::shared_ptr<const ScreenParts> parts;
    [[nodiscard]] std::size_t bytes() const {
        return reaches.size() * sizeof(LimitReach) + (parts ? parts->bytes() : 0);
    }
    [[nodiscard]] bool inUse() const { return parts && parts.use_count() > 1; }
};

std::shared_ptr<const ScreenParts> partsFrom(const SubdivisionSurface& s, const SharedPlan& shared,
                                             const std::vector<LimitReach>& reaches) {
    const TaggedMesh& mesh = shared.plan->topology().mesh();
    auto out = std::make_shared<ScreenParts>();
    out->finest = static_cast<unsigned>(std::max<std::int64_t>(0, shared.finest - s.level));
    out->parts.resize(mesh.faceCount());
    out->groups.resize((mesh.faceCount() + ScreenParts::kGroup - 1) / ScreenParts::kGroup);
    for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
        if (!shared.plan->topology().hasSurface(f)) continue;
        ScreenParts::Part& part = out->parts[f];
        part.lower = reaches[f].lower;
        part.upper = reaches[f].upper;
        const auto levelAt = [&](std::int64_t steps) {
            return std::min<std::int64_t>(LimitPlan::kFinestLevel,
                                          std::max<std::int64_t>(s.level + steps, shared.plan->hasPolygons() ? 1 : 0));
        };
        for (std::size_t k = 0; k < ScreenParts::kSteps; ++k)
            part.deviation[k] = reaches[f].deviation[static_cast<std::size_t>(levelAt(static_cast<std::int64_t>(k)))];
        const std::uint32_t n = 1U << levelAt(0), size = mesh.faceSize(f);
        part.triangles = shared.plan->triangular() ? n * n : size * n * n / 2;
        part.rim = size * n;
        ScreenParts::Group& group = out->groups[f / ScreenParts::kGroup];
        group.box.extend(part.box());
        group.deviation = std::max(group.deviation, part.deviation[0]);
    }
    return out;
}

std::shared_ptr<const ScreenParts> partsOf(const void* core) {
    const SubdivisionSurface& s = surfaceOf(core);
    if (isNothing(s) || !isHere(s)) return nullptr;
    static ContentCache<MeasuredSurface> measured(kMostUnusedDerivedBytes / 4);
    const Hash128 recipe = recipeOf(s, {});
    const auto keyOfPoints = [&recipe](const BlobId& points) {
        const std::array<Hash128, 2> both{recipe, points};
        return hash128(std::as_bytes(std::span(both)));
    };
    const auto make = [&]() -> MeasuredSurface {
        const std::shared_ptr<const SharedPlan> shared = sharedPlanOf(s);
        const std::span<const float> points = s.points.as<float>();
        if (!shared->plan || !checkPoints(points)) return {};
        const SubdivisionTopology& topology = shared->plan->topology();
        // What has so many kinds of faces that the second level is too much is taken to be as fine as it gets.
        if (shared->finest < 2) return {.reaches = {}, .parts = std::make_shared<const ScreenParts>()};
        MeasuredSurface out;
        std::vector<std::uint32_t> faces;
        for (const Blob::Origin& origin : s.points.origins()) {
            const std::shared_ptr<const MeasuredSurface> known = measured.find(keyOfPoints(origin.id));
            if (!known || known->reaches.empty()) continue;
            out.reaches = known->reaches;
            for (const std::uint32_t p : topology.touchedBy(pointsIn({origin.begin, origin.end})))
                if (const std::uint32_t f = topology.ptexFace(p).face; faces.empty() || faces.back() != f)
                    faces.push_back(f);
            break;
        }
        if (out.reaches.empty()) {
            out.reaches.resize(topology.mesh().faceCount());
            faces.resize(out.reaches.size());
            std::iota(faces.begin(), faces.end(), 0U);
        }
        measureReaches(*shared->plan, faces, points, out.reaches);
        out.parts = partsFrom(s, *shared, out.reaches);
        return out;
    };
    return measured.get(keyOfPoints(s.points.id()), make)->parts;
}

unsigned finestOf(const void* core) {
    const std::shared_ptr<const SharedPlan> shared = sharedPlanOf(surfaceOf(core));
    return static_cast<unsigned>(std::max<std::int64_t>(0, shared->finest - surfaceOf(core).level));
}

double deviationOf(const void* core, unsigned steps) {
    const std::shared_ptr<const ScreenParts> parts = partsOf(core);
    float most = 0;
    if (parts)
        for (const ScreenParts::Part& part : parts->parts)
            most = std::max(most, part.deviation[std::min<std::size_t>(steps, ScreenParts::kSteps - 1)]);
    return static_cast<double>(most);
}

constexpr ScreenSteps kSubdivisionSteps{
    .finest = &finestOf,
    .screenError = [](const void* core) { return surfaceOf(core).screenError; },
    .deviation = &deviationOf,
    .seam = [](const void*) { return 0.0; },
    .copy = [](const void* core) -> std::shared_ptr<const void> {
        return std::make_shared<const SubdivisionSurface>(surfaceOf(core));
    },
    .parts = &partsOf,
};

std::shared_ptr<const SmoothSurface> smoothSubdivision(const void* core) {
    const SubdivisionSurface& s = surfaceOf(core);
    if (isNothing(s) || !checkSurface(core)) return nullptr;
    Expected<ControlMesh> mesh = controlMeshOf(s);
    if (!mesh || mesh->scheme == SubdivisionScheme::kBilinear) return nullptr;
    const std::span<const float> xyz = s.points.as<float>();
    for (std::size_t i = 0; i < mesh->positions.size(); ++i)
        mesh->positions[i] = Vec3d(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
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
