#include "client/deform/ControlPoints.h"

#include <optional>
#include <unordered_set>

#include <fmt/format.h>

#include "common/cores/Deformation.h"
#include "common/cores/NurbsSurface.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

struct PointArray {
    FieldId field;
    bool isDouble = false;
    Blob bytes;
};

/// Nothing where the object has no control points.
std::optional<PointArray> pointArrayOf(const Object& object) {
    if (const auto* surface = object.as<SubdivisionSurface>())
        return PointArray{fieldId<&SubdivisionSurface::points>, false, surface->points};
    if (const auto* surface = object.as<NurbsSurfaceCore>())
        return PointArray{fieldId<&NurbsSurfaceCore::points>, true, surface->points};
    if (const auto* lattice = object.as<Deformation>())
        return PointArray{fieldId<&Deformation::controlPoints>, false, lattice->controlPoints};
    return {};
}

template <typename Number>
std::vector<Vec3d> pointsOf(std::span<const Number> numbers) {
    std::vector<Vec3d> points;
    points.reserve(numbers.size() / 3);
    for (std::size_t i = 0; i + 2 < numbers.size(); i += 3)
        points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
    return points;
}

template <typename Number>
Blob blobOf(std::span<const Vec3d> points) {
    std::vector<Number> numbers;
    numbers.reserve(3 * points.size());
    for (const Vec3d& point : points)
        for (int i = 0; i < 3; ++i) numbers.push_back(static_cast<Number>(point[i]));
    return Blob::of(std::span<const Number>(numbers));
}

}  // namespace

Expected<std::vector<ControlPoints>> controlPointsBelow(const Aspect& scene, const std::string& node) {
    const Expected<ObjectId> top = findNode(scene, node);
    if (!top) return tl::unexpected(top.error());
    std::vector<ControlPoints> bodies;
    std::unordered_set<ObjectId> known;
    Action action;
    action.onNode([&](const Visit& visit) {
        const Object core = scene.find(visit.node.core);
        if (!core) return Descend::kInto;
        const std::optional<PointArray> array = pointArrayOf(core);
        if (array && array->bytes.resident() && !array->bytes.empty() && known.insert(visit.node.core).second) {
            const Blob& bytes = array->bytes;
            bodies.push_back({.core = visit.node.core,
                              .type = typeOf(core),
                              .field = array->field,
                              .isDouble = array->isDouble,
                              .rest = array->isDouble ? pointsOf(bytes.as<double>()) : pointsOf(bytes.as<float>()),
                              .path = pathOf(scene, visit.nodeId)});
        }
        return Descend::kInto;
    });
    action.run(scene, *top);
    if (bodies.empty())
        return fail(ErrorCode::kNotFound, fmt::format("{} has no control points, and nothing below it has", node));
    return bodies;
}

void lead(ChangeListBuilder& list, const Aspect& scene, const ControlPoints& body, std::span<const Vec3d> points) {
    const Object core = scene.find(body.core);
    const std::optional<PointArray> array = core ? pointArrayOf(core) : std::nullopt;
    const std::size_t bytes = 3 * points.size() * (body.isDouble ? sizeof(double) : sizeof(float));
    if (!array || array->field != body.field || array->bytes.sizeBytes() != bytes || bytes == 0) return;
    list.setRange(body.core, body.type, body.field, 0, body.isDouble ? blobOf<double>(points) : blobOf<float>(points));
}

}  // namespace tessera
