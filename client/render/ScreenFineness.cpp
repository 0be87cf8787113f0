#include "client/render/ScreenFineness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <queue>

#include "client/render/SceneItems.h"

namespace tessera {
namespace {

/// What takes steps together: one item, or surfaces that share edges.
struct FinenessUnit {
    std::vector<std::uint32_t> items;
    std::vector<double> pixelsPerUnit;  ///< of each
    ObjectId first;                     ///< of its nodes, the least
    unsigned fineness = 0, finest = 0;
    std::uint64_t triangles = 0;
};

struct FartherOff {
    double ratio;  ///< of the deviation to what is wanted
    ObjectId first;
    std::size_t unit;
    bool operator<(const FartherOff& other) const { return ratio != other.ratio ? ratio < other.ratio : other.first < first; }
};

/// Surfaces that stand in one frame, and are cut alike, share their edges' vertices as long as they are as fine.
using SeamKey = std::array<std::uint64_t, 17>;
SeamKey seamKeyOf(double seam, const Affine3d& world_T_item) {
    SeamKey key{};
    std::memcpy(key.data(), &seam, sizeof seam);
    std::memcpy(key.data() + 1, world_T_item.data(), 16 * sizeof(double));
    return key;
}

[[nodiscard]] bool contains(const Box& outer, const Box& inner) { return outer.contains(inner.lower) && outer.contains(inner.upper); }

}  // namespace

double stretchOf(const Mat3d& linear) {
    // The largest eigenvalue of the square is at most its largest sum of a row (Gershgorin).
    const Mat3d square = linear.transpose() * linear;
    return std::sqrt(square.cwiseAbs().rowwise().sum().maxCoeff());
}

ScreenMeasure::ScreenMeasure(const ScreenCamera& camera) : eyeWorld_(camera.eyeWorld), eye_T_world_(camera.eye_T_world) {
    const Mat4d& clip = camera.clip_T_eye;
    nearest_ = clip(2, 3) / (clip(2, 2) - 1);
    // p and q, a metre apart, lie |(p - q) + (q's slope) (p - q)_z| / p_z apart in the plane at a metre: at most what follows (Cauchy, Schwarz).
    double slope2 = 0;
    for (const double x : {-1.0, 1.0})
        for (const double y : {-1.0, 1.0}) {
            const double sx = (x + clip(0, 2)) / clip(0, 0), sy = (y + clip(1, 2)) / clip(1, 1);
            slope2 = std::max(slope2, sx * sx + sy * sy);
        }
    const double perMetre = std::max(0.5 * clip(0, 0) * camera.pixels.width, 0.5 * clip(1, 1) * camera.pixels.height);
    slant_ = std::sqrt(1 + slope2);
    pixelsAtOne_ = perMetre * slant_;
}

double ScreenMeasure::pixelsPerUnit(const Box& own, const Box& box, const Affine3d& world_T_item, double apart) const {
    const Affine3d eye_T_item = eye_T_world_ * world_T_item;
    const double perUnit = stretchOf(eye_T_item.linear());
    // By depth: of all that it may be. By distance: what is seen is within the screen's slant, what belongs to it not far from that.
    const Eigen::RowVector3d axis = -eye_T_item.linear().row(2);
    const double depth = axis.dot(own.center()) - eye_T_item.translation().z() - 0.5 * axis.cwiseAbs().dot(own.size());
    const Vec3d nearestWorld = eyeWorld_.cwiseMax(box.lower).cwiseMin(box.upper);
    const double distance = (nearestWorld - eyeWorld_).norm() * eye_T_world_.linear().row(2).norm();
    return perUnit * pixelsAtOne_ / std::max({depth, distance / slant_ - perUnit * apart, nearest_});
}

void RenderScene::Impl::lookFrom(const ScreenCamera& camera) {
    if (byScreen.empty() || (lookedAt_ == version && drawAlike(camera, lookedFrom_))) return;
    lookedAt_ = version;
    lookedFrom_ = camera;
    looks_.beginLook();
    const Frustum seen = tileFrustum(camera, {.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height});
    const ScreenMeasure measure(camera);

    std::vector<FinenessUnit> units;
    std::map<SeamKey, std::size_t> unitOfSeam;
    std::uint64_t triangles = 0;
    for (const std::uint32_t index : byScreen) {
        const SceneItem& item = items[index];
        if (boxes[index].empty() || seen.classify(boxes[index]).outside) {
            drawAt(index, 0, item.base);
            continue;
        }
        const Drawable& drawable = looks_.drawableByScreen(item.geometry);
        const Affine3d& world_T_item = places[item.place].world_T_node;
        std::size_t unit = units.size();
        if (const double seam = drawable.seam(); seam > 0) unit = unitOfSeam.try_emplace(seamKeyOf(seam, world_T_item), unit).first->second;
        if (unit == units.size()) units.push_back({.items = {}, .pixelsPerUnit = {}, .first = item.node, .fineness = 0, .finest = drawable.finest(), .triangles = 0});
        FinenessUnit& of = units[unit];
        of.items.push_back(index);
        of.pixelsPerUnit.push_back(measure.pixelsPerUnit(reachedBy(item), boxes[index], world_T_item, item.slack));
        of.first = std::min(of.first, item.node);
        of.finest = std::min(of.finest, drawable.finest());
        of.triangles += item.base->triangles;
        triangles += item.base->triangles;
    }

    std::priority_queue<FartherOff> farthest;
    const auto judge = [&](std::size_t u) {
        const FinenessUnit& unit = units[u];
        double ratio = 0;
        for (std::size_t i = 0; i < unit.items.size(); ++i) {
            const ObjectId core = items[unit.items[i]].geometry;
            ratio = std::max(ratio, unit.pixelsPerUnit[i] * looks_.stepOf(core, unit.fineness).deviation / looks_.drawableByScreen(core).screenError());
        }
        if (ratio > 1 && unit.fineness < unit.finest) farthest.push({ratio, unit.first, u});
    };
    for (std::size_t u = 0; u < units.size(); ++u) judge(u);
    while (!farthest.empty()) {
        const std::size_t u = farthest.top().unit;
        farthest.pop();
        FinenessUnit& unit = units[u];
        // Before anything is made: a step makes four triangles of each.
        bool fits = triangles + 3 * unit.triangles <= kMostTrianglesOfScreen;
        for (const std::uint32_t index : unit.items) fits = fits && 4 * looks_.stepOf(items[index].geometry, unit.fineness).mesh->triangles <= kMostTrianglesByScreen;
        std::uint64_t finer = 0;
        for (std::size_t i = 0; i < unit.items.size() && fits; ++i) {
            const SceneItem& item = items[unit.items[i]];
            const RenderMesh* mesh = looks_.stepOf(item.geometry, unit.fineness + 1).mesh;
            // The tree's boxes are those of what the fields say, and what they may be off.
            fits = mesh && mesh->drawable() && contains(reachedBy(item), mesh->bounds);
            if (fits) finer += mesh->triangles;
        }
        if (!fits || triangles - unit.triangles + finer > kMostTrianglesOfScreen) continue;
        triangles += finer - unit.triangles;
        unit.triangles = finer;
        ++unit.fineness;
        judge(u);
    }
    for (const FinenessUnit& unit : units)
        for (const std::uint32_t index : unit.items) drawAt(index, unit.fineness, looks_.stepOf(items[index].geometry, unit.fineness).mesh);
    looks_.endLook();
}

void RenderScene::Impl::drawAt(std::uint32_t index, unsigned fineness, const RenderMesh* mesh) {
    SceneItem& item = items[index];
    if (item.mesh == mesh && item.fineness == fineness) return;
    if (item.transparent) finerTransparentTriangles += mesh->triangles - item.mesh->triangles;
    item.mesh = mesh;
    item.fineness = static_cast<std::uint8_t>(fineness);
    ++finenessChanges;
}

}  // namespace tessera
