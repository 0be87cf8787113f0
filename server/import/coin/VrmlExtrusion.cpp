#include "server/import/coin/VrmlExtrusion.h"

#include <Inventor/VRMLnodes/SoVRMLExtrusion.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/geometry/Primitives.h"
#include "common/math/Types.h"
#include "server/import/coin/CoinNodes.h"
#include "server/import/reader/SmoothNormals.h"

namespace tessera {
namespace {

/// Directions shorter than that are none.
constexpr double kNone = 1e-12;

/// The planes across the spine, one at each of its points: columns are their axes; y goes along.
std::vector<Mat3d> planesAlong(const std::vector<Vec3d>& spine) {
    const std::size_t count = spine.size(), last = count - 1;
    const bool isClosed = count > 2 && spine.front() == spine.back();
    std::vector<Vec3d> along(count), up(count);
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t before = i > 0 ? i - 1 : isClosed ? last - 1 : 0;
        const std::size_t after = i < last ? i + 1 : isClosed ? 1 : last;
        along[i] = spine[after] - spine[before];
        up[i] = (spine[after] - spine[i]).cross(spine[before] - spine[i]);
    }
    if (!isClosed && count > 2) {
        up.front() = up[1];
        up.back() = up[last - 1];
    }
    // What a point does not say is as at the one before; of the first ones as at the first that says it.
    const auto complete = [&](std::vector<Vec3d>& axes) {
        std::optional<Vec3d> known;
        for (Vec3d& axis : axes) {
            const double length = axis.norm();
            axis = length > kNone && std::isfinite(length) ? Vec3d(axis / length) : known.value_or(Vec3d::Zero());
            if (!axis.isZero()) known = axis;
        }
        if (!known) return false;
        const auto first = std::ranges::find_if(axes, [](const Vec3d& axis) { return !axis.isZero(); });
        std::fill(axes.begin(), first, Vec3d(*first));
        return true;
    };
    const bool goesSomewhere = complete(along), bends = complete(up);
    std::vector<Mat3d> planes(count, Mat3d::Identity());
    if (!goesSomewhere) return planes;
    if (!bends) {
        const Mat3d turned = Quatd::FromTwoVectors(Vec3d::UnitY(), along.front()).toRotationMatrix();
        std::ranges::fill(planes, turned);
        return planes;
    }
    for (std::size_t i = 0; i < count; ++i) {
        if (i > 0 && up[i].dot(up[i - 1]) < 0) up[i] = -up[i];
        const Vec3d& y = along[i];
        Vec3d z = up[i] - up[i].dot(y) * y;  // that of another point may lean
        z = z.norm() > kNone ? Vec3d(z.normalized()) : y.unitOrthogonal();
        planes[i] << y.cross(z), y, z;
    }
    return planes;
}

/// The last is that of all that follow.
template <typename Field>
auto valueAt(const Field& field, std::size_t i) {
    return field[static_cast<int>(std::min(i, static_cast<std::size_t>(field.getNum()) - 1))];
}

class Extrusion {
public:
    Extrusion(const SoVRMLExtrusion& node, bool textured, const SbMatrix& texture)
        : node_(node), textured_(textured), texture_(texture) {}

    Expected<MeshData> mesh(std::size_t& faces) {
        for (int i = 0; i < node_.crossSection.getNum(); ++i)
            across_.emplace_back(node_.crossSection[i][0], node_.crossSection[i][1]);
        for (int i = 0; i < node_.spine.getNum(); ++i) spine_.push_back(vectorOf(node_.spine[i]));
        if (across_.size() < 2 || spine_.size() < 2) return MeshData();
        const std::size_t sides = (across_.size() - 1) * (spine_.size() - 1) + across_.size();
        if (sides > faces)
            return fail(ErrorCode::kLimit, fmt::format("it has {} faces, more than there is room for", sides));
        faces -= sides;
        addSides();
        if (node_.beginCap.getValue())
            if (Expected<void> done = addCap(0, true); !done) return tl::unexpected(done.error());
        if (node_.endCap.getValue())
            if (Expected<void> done = addCap(spine_.size() - 1, false); !done) return tl::unexpected(done.error());
        if (!node_.ccw.getValue())
            for (std::size_t i = 0; i + 2 < mesh_.indices.size(); i += 3)
                std::swap(mesh_.indices[i], mesh_.indices[i + 2]);
        setSmoothNormals(mesh_, node_.creaseAngle.getValue());
        return std::move(mesh_);
    }

private:
    void addVertex(const Vec3d& place, double u, double v) {
        for (const double x : place) mesh_.positions.push_back(static_cast<float>(x) + 0.0f);
        if (!textured_) return;
        SbVec4f moved(static_cast<float>(u), static_cast<float>(v), 0, 1);
        texture_.multVecMatrix(moved, moved);
        for (const float x : {moved[0], 1.0f - moved[1]}) mesh_.texcoords.push_back(std::isfinite(x) ? x : 0.0f);
    }
    void addTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        const auto same = [&](std::uint32_t one, std::uint32_t other) {
            return std::equal(&mesh_.positions[3 * std::size_t{one}], &mesh_.positions[3 * std::size_t{one}] + 3,
                              &mesh_.positions[3 * std::size_t{other}]);
        };
        if (!same(a, b) && !same(b, c) && !same(c, a)) mesh_.indices.insert(mesh_.indices.end(), {a, b, c});
    }

    void addSides() {
        const std::vector<Mat3d> planes = planesAlong(spine_);
        const std::size_t rings = spine_.size(), points = across_.size();
        for (std::size_t i = 0; i < rings; ++i) {
            Mat3d plane = planes[i];
            if (node_.orientation.getNum() > 0) {
                float x = 0, y = 0, z = 0, w = 1;
                valueAt(node_.orientation, i).getValue(x, y, z, w);
                plane = plane * Quatd(w, x, y, z).toRotationMatrix();
            }
            Vec2d scale = Vec2d::Ones();
            if (node_.scale.getNum() > 0) scale = {valueAt(node_.scale, i)[0], valueAt(node_.scale, i)[1]};
            for (std::size_t j = 0; j < points; ++j)
                addVertex(spine_[i] + plane * Vec3d(across_[j].x() * scale.x(), 0, across_[j].y() * scale.y()),
                          static_cast<double>(j) / static_cast<double>(points - 1),
                          static_cast<double>(i) / static_cast<double>(rings - 1));
        }
        for (std::size_t i = 0; i + 1 < rings; ++i)
            for (std::size_t j = 0; j + 1 < points; ++j) {
                const auto a = static_cast<std::uint32_t>(i * points + j);
                const auto d = static_cast<std::uint32_t>(a + points);
                addTriangle(a, a + 1, d + 1);
                addTriangle(a, d + 1, d);
            }
    }

    /// At one of the rings. The first is seen from before, the last from behind.
    Expected<void> addCap(std::size_t ring, bool isReversed) {
        const std::size_t points = across_.size() - (across_.front() == across_.back() ? 1 : 0);
        if (points < 3) return {};
        Vec2d low = across_.front(), high = across_.front();
        for (const Vec2d& point : across_) {
            low = low.cwiseMin(point);
            high = high.cwiseMax(point);
        }
        const double side = std::max((high - low).maxCoeff(), kNone);
        const std::size_t begin = mesh_.positions.size() / 3;
        for (std::size_t j = 0; j < points; ++j) {
            const float* const place = &mesh_.positions[3 * (ring * across_.size() + j)];
            const Vec2d uv = (across_[j] - low) / side;
            addVertex(Vec3d(place[0], place[1], place[2]), uv.x(), uv.y());
        }
        std::vector<std::uint32_t> order(points);
        for (std::size_t j = 0; j < points; ++j)
            order[j] = static_cast<std::uint32_t>(begin + (isReversed ? points - 1 - j : j));
        const std::uint32_t length = static_cast<std::uint32_t>(points);
        const Expected<std::vector<std::uint32_t>> cut = assembleRuns({.kind = RunKind::kPolygons,
                                                                       .positions = mesh_.positions,
                                                                       .indices = order,
                                                                       .lengths = std::span(&length, 1)});
        if (!cut) return failWith("its caps", cut.error());
        for (std::size_t i = 0; i + 2 < cut->size(); i += 3) addTriangle((*cut)[i], (*cut)[i + 1], (*cut)[i + 2]);
        return {};
    }

    const SoVRMLExtrusion& node_;
    bool textured_;
    const SbMatrix& texture_;
    std::vector<Vec2d> across_;
    std::vector<Vec3d> spine_;
    MeshData mesh_;
};

}  // namespace

Expected<MeshData> meshOfExtrusion(const SoVRMLExtrusion& node, bool textured, const SbMatrix& texture,
                                   std::size_t& faces) {
    return Extrusion(node, textured, texture).mesh(faces);
}

}  // namespace tessera
