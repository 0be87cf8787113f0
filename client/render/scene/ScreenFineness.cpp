#include "client/render/scene/ScreenFineness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <queue>
#include <span>
#include <utility>

#include "client/render/scene/SceneItems.h"
#include "common/wall/Detail.h"

namespace tessera {
namespace {

/// What takes steps together: one item, or surfaces that share edges.
struct FinenessUnit {
    std::vector<std::uint32_t> items;
    std::vector<double> pixelsPerUnit;  ///< of each
    ObjectId first;                     ///< of its nodes, the least
    unsigned fineness = 0, finest = 0;
    std::uint64_t triangles = 0;
    // Of one item whose parts step by themselves:
    const ScreenParts* parts = nullptr;
    std::vector<double> worth;         ///< by part: pixels of a unit, by the pixels that may be; 0: no pixel shows it
    std::vector<std::uint8_t> levels;  ///< by part
    bool alike = true;                 ///< all as fine as `fineness`
};

/// How parts would be where none is farther off than `within` times what may be.
struct PartLevels {
    std::vector<std::uint8_t> levels;
    unsigned most = 0;
    std::uint64_t triangles = 0;  ///< at most
    bool alike = true;  ///< finer where nobody asks for it: hardly more triangles, and a mesh that others may have, too
};
PartLevels levelsWithin(const FinenessUnit& unit, double within) {
    constexpr std::uint64_t kFew = 2048;
    const ScreenParts& parts = *unit.parts;
    PartLevels out{.levels = std::vector<std::uint8_t>(parts.parts.size(), 0)};
    std::uint64_t asSaid = 0;
    for (std::size_t i = 0; i < parts.parts.size(); ++i) {
        const ScreenParts::Part& part = parts.parts[i];
        unsigned level = 0;
        while (level < parts.finest && unit.worth[i] * static_cast<double>(part.deviation[level]) > within) ++level;
        out.levels[i] = static_cast<std::uint8_t>(level);
        out.most = std::max(out.most, level);
        out.triangles += (std::uint64_t{part.triangles} << (2 * level)) + (std::uint64_t{part.rim} << level) - part.rim;
        asSaid += part.triangles;
    }
    const std::uint64_t everywhere = asSaid << (2 * out.most);
    out.alike = everywhere <= std::max(kFew, out.triangles + out.triangles / 2);
    if (out.alike) {
        out.triangles = everywhere;
        std::fill(out.levels.begin(), out.levels.end(), static_cast<std::uint8_t>(out.most));
    }
    return out;
}
double farthestOff(const FinenessUnit& unit) {
    double ratio = 0;
    for (std::size_t i = 0; i < unit.worth.size(); ++i)
        if (unit.levels[i] < unit.parts->finest)
            ratio =
                std::max(ratio, unit.worth[i] * static_cast<double>(unit.parts->parts[i].deviation[unit.levels[i]]));
    return ratio;
}
/// What parts are worth on a screen, as many as it may show at all.
std::vector<double> worthOf(const ScreenParts& parts, const ScreenMeasure& measure, const Frustum& seen,
                            const Affine3d& world_T_item, double screenError) {
    const ScreenMeasure::OfItem of(measure, world_T_item);
    std::vector<double> worth(parts.parts.size(), 0.0);
    for (std::size_t g = 0; g < parts.groups.size(); ++g) {
        const ScreenParts::Group& group = parts.groups[g];
        if (group.box.empty() || seen.classify(group.box.transformed(world_T_item)).outside) continue;
        if (of.pixelsPerUnit(group.box, static_cast<double>(group.deviation)) * static_cast<double>(group.deviation) <=
            screenError)
            continue;
        const std::size_t end = std::min(parts.parts.size(), (g + 1) * ScreenParts::kGroup);
        for (std::size_t i = g * ScreenParts::kGroup; i < end; ++i)
            if (const ScreenParts::Part& part = parts.parts[i]; part.triangles > 0)
                worth[i] = of.pixelsPerUnit(part.box(), static_cast<double>(part.deviation[0])) / screenError;
    }
    return worth;
}

struct FartherOff {
    double ratio;  ///< of the deviation to what is wanted
    ObjectId first;
    std::size_t unit;
    bool operator<(const FartherOff& other) const {
        return ratio != other.ratio ? ratio < other.ratio : other.first < first;
    }
};

/// Surfaces that stand in one frame, and are cut alike, share their edges' vertices as long as they are as fine.
using SeamKey = std::array<std::uint64_t, 17>;
SeamKey seamKeyOf(double seam, const Affine3d& world_T_item) {
    SeamKey key{};
    std::memcpy(key.data(), &seam, sizeof seam);
    std::memcpy(key.data() + 1, world_T_item.data(), 16 * sizeof(double));
    return key;
}

[[nodiscard]] bool contains(const Box& outer, const Box& inner) {
    return outer.contains(inner.lower) && outer.contains(inner.upper);
}

}  // namespace

double rowStretchOf(const Mat3d& linear) {
    // The largest eigenvalue of the square is at most its largest sum of a row (Gershgorin).
    const Mat3d square = linear.transpose() * linear;
    return std::sqrt(square.cwiseAbs().rowwise().sum().maxCoeff());
}

ScreenMeasure::ScreenMeasure(const ScreenCamera& camera)
    : eyeWorld_(camera.eyeWorld), eye_T_world_(camera.eye_T_world) {
    const Mat4d& clip = camera.clip_T_eye;
    nearest_ = clip(2, 3) / (clip(2, 2) - 1);
    // p and q, a metre apart, lie |(p - q) + (q's slope) (p - q)_z| / p_z apart in the plane at a metre: at most what
    // follows (Cauchy, Schwarz).
    double slope2 = 0;
    for (const double x : {-1.0, 1.0})
        for (const double y : {-1.0, 1.0}) {
            const double sx = (x + clip(0, 2)) / clip(0, 0), sy = (y + clip(1, 2)) / clip(1, 1);
            slope2 = std::max(slope2, sx * sx + sy * sy);
        }
    const double perMetre = std::max(0.5 * clip(0, 0) * camera.pixels.width, 0.5 * clip(1, 1) * camera.pixels.height);
    slant_ = std::sqrt(1 + slope2);
    pixelsAtOne_ = perMetre * slant_ / detailStep(camera.detail).coarser;
}

double ScreenMeasure::pixelsPerUnit(const Box& own, const Box& box, const Affine3d& world_T_item, double apart) const {
    const Affine3d eye_T_item = eye_T_world_ * world_T_item;
    const double perUnit = rowStretchOf(eye_T_item.linear());
    // By depth: of all that it may be. By distance: what is seen is within the screen's slant, what belongs to it not
    // far from that.
    const Eigen::RowVector3d axis = -eye_T_item.linear().row(2);
    const double depth = axis.dot(own.center()) - eye_T_item.translation().z() - 0.5 * axis.cwiseAbs().dot(own.size());
    const Vec3d nearestWorld = eyeWorld_.cwiseMax(box.lower).cwiseMin(box.upper);
    const double distance = (nearestWorld - eyeWorld_).norm() * eye_T_world_.linear().row(2).norm();
    return perUnit * pixelsAtOne_ / std::max({depth, distance / slant_ - perUnit * apart, nearest_});
}

ScreenMeasure::OfItem::OfItem(const ScreenMeasure& screen, const Affine3d& world_T_item)
    : screen_(screen), world_T_item_(world_T_item) {
    const Affine3d eye_T_item = screen.eye_T_world_ * world_T_item;
    perUnit_ = rowStretchOf(eye_T_item.linear());
    axis_ = -eye_T_item.linear().row(2);
    offset_ = -eye_T_item.translation().z();
    axisWorld_ = -screen.eye_T_world_.linear().row(2).transpose();
}

double ScreenMeasure::OfItem::pixelsPerUnit(const Box& own, double apart) const {
    const Vec3d& eye = screen_.eyeWorld_;
    const Box box = own.transformed(world_T_item_);
    const double perMetre = axisWorld_.norm();
    const double away = (eye - eye.cwiseMax(box.lower).cwiseMin(box.upper)).norm();
    int exponent = 0;
    (void)std::frexp(std::max(away, screen_.nearest_ / perMetre), &exponent);
    // Of the power of two at or below the distance an eighth.
    const double cell = std::ldexp(1.0, exponent - 4);
    const Vec3d low = cell * (eye / cell).array().floor().matrix(), high = low.array() + cell;
    const double depth = axis_.dot(own.center()) + offset_ - 0.5 * axis_.cwiseAbs().dot(own.size()) +
                         axisWorld_.dot(eye - 0.5 * (low + high)) - 0.5 * cell * axisWorld_.cwiseAbs().sum();
    const double distance = (box.lower - high).cwiseMax(low - box.upper).cwiseMax(0.0).norm() * perMetre;
    return perUnit_ * screen_.pixelsAtOne_ /
           std::max({depth, distance / screen_.slant_ - perUnit_ * apart, screen_.nearest_});
}

void RenderScene::Impl::refineFor(const ScreenCamera& camera) {
    if (byScreen.empty() || (lookedAt_ == version && drawAlike(camera, lookedFrom_))) return;
    lookedAt_ = version;
    lookedFrom_ = camera;
    looks_.beginLook();
    const Frustum seen =
        tileFrustum(camera, {.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height});
    const ScreenMeasure measure(camera);

    std::vector<FinenessUnit> units;
    std::map<SeamKey, std::size_t> unitOfSeam;
    std::uint64_t triangles = 0;
    for (const std::uint32_t index : byScreen) {
        const SceneItem& item = items[index];
        if (boxes[index].empty() || seen.classify(boxes[index]).outside) {
            drawAt(index, {}, item.base);
            continue;
        }
        const Drawable& drawable = looks_.drawableByScreen(item.geometry);
        const Affine3d& world_T_item = item.world_T_item;
        std::size_t unit = units.size();
        if (const double seam = drawable.seam(); seam > 0)
            unit = unitOfSeam.try_emplace(seamKeyOf(seam, world_T_item), unit).first->second;
        if (unit == units.size())
            units.push_back({.items = {},
                             .pixelsPerUnit = {},
                             .first = item.node,
                             .fineness = 0,
                             .finest = 0,
                             .triangles = 0,
                             .parts = looks_.partsOf(item.geometry),
                             .worth = {},
                             .levels = {}});
        FinenessUnit& of = units[unit];
        if (of.parts) {
            of.worth = worthOf(*of.parts, measure, seen, world_T_item, drawable.screenError());
            of.levels.assign(of.worth.size(), 0);
        } else {
            of.finest = of.items.empty() ? drawable.finest() : std::min(of.finest, drawable.finest());
        }
        of.items.push_back(index);
        of.pixelsPerUnit.push_back(measure.pixelsPerUnit(reachedBy(item), boxes[index], world_T_item, item.slack));
        of.first = std::min(of.first, item.node);
        of.triangles += item.base->triangles;
        triangles += item.base->triangles;
    }

    std::priority_queue<FartherOff> farthest;
    const auto judge = [&](std::size_t u) {
        const FinenessUnit& unit = units[u];
        if (unit.parts) {
            if (const double ratio = farthestOff(unit); ratio > 1) farthest.push({ratio, unit.first, u});
            return;
        }
        double ratio = 0;
        for (std::size_t i = 0; i < unit.items.size(); ++i) {
            const ObjectId core = items[unit.items[i]].geometry;
            ratio = std::max(ratio, unit.pixelsPerUnit[i] * looks_.stepOf(core, unit.fineness).deviation /
                                        looks_.drawableByScreen(core).screenError());
        }
        if (ratio > 1 && unit.fineness < unit.finest) farthest.push({ratio, unit.first, u});
    };
    for (std::size_t u = 0; u < units.size(); ++u) judge(u);
    while (!farthest.empty()) {
        const std::size_t u = farthest.top().unit;
        const double ratio = farthest.top().ratio;
        farthest.pop();
        FinenessUnit& unit = units[u];
        if (unit.parts) {
            // Half as far off: half a step.
            PartLevels next = levelsWithin(unit, std::max(1.0, 0.5 * ratio));
            if (next.triangles > kMostTrianglesByScreen ||
                triangles - unit.triangles + next.triangles > kMostTrianglesOfScreen)
                continue;
            triangles += next.triangles - unit.triangles;
            unit.triangles = next.triangles;
            unit.levels = std::move(next.levels);
            unit.fineness = next.most;
            unit.alike = next.alike;
            judge(u);
            continue;
        }
        // Before anything is made: a step makes four triangles of each.
        bool fits = triangles + 3 * unit.triangles <= kMostTrianglesOfScreen;
        for (const std::uint32_t index : unit.items)
            fits = fits &&
                   4 * looks_.stepOf(items[index].geometry, unit.fineness).mesh->triangles <= kMostTrianglesByScreen;
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
    for (const FinenessUnit& unit : units) {
        if (unit.parts) {
            const std::uint32_t index = unit.items.front();
            const Fineness fineness =
                unit.alike ? Fineness(unit.fineness) : Fineness(Blob::of(std::span<const std::uint8_t>(unit.levels)));
            const RenderMesh* mesh = looks_.meshOf(items[index].geometry, fineness);
            const bool fits = mesh && mesh->drawable() && contains(reachedBy(items[index]), mesh->bounds);
            drawAt(index, fits ? fineness : Fineness(), fits ? mesh : items[index].base);
            continue;
        }
        for (const std::uint32_t index : unit.items)
            drawAt(index, unit.fineness, looks_.stepOf(items[index].geometry, unit.fineness).mesh);
    }
    looks_.endLook();
}

void RenderScene::Impl::drawAt(std::uint32_t index, const Fineness& fineness, const RenderMesh* mesh) {
    SceneItem& item = items[index];
    if (item.mesh == mesh && item.fineness == fineness) return;
    if (item.transparent) finerTransparentTriangles += mesh->triangles - item.mesh->triangles;
    item.mesh = mesh;
    item.fineness = fineness;
    shadows.changed(index);
}

}  // namespace tessera
