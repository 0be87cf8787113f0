#include "client/render/scene/ShadowReach.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <span>

#include "client/render/scene/SceneItems.h"
#include "client/render/scene/StudioLook.h"

namespace tessera {
namespace {

constexpr Frustum::Mask kAllButNear = Frustum::kAllPlanes & ~(1u << 4);
/// Four products and their sum, matrices rounded before (TileProjection.h).
constexpr double kRounding = 1.0 / (1 << 20);
/// What a rasteriser's own grid, and the rims of balls, may add to a thing's pixels.
constexpr double kRimPx = 2;
/// How far from its own place a surface looks for its shadow: two pixels along its normal, one towards the light, and
/// taps of 0.75 pixels, each of them of four pixels (Lighting.glsl). A studio's ground looks around 14 pixels.
constexpr double kSoftPx = 6, kStudioSoftPx = 20;

Vec3d cornerOf(const Box& box, unsigned i) {
    return {i & 1 ? box.upper.x() : box.lower.x(), i & 2 ? box.upper.y() : box.lower.y(),
            i & 4 ? box.upper.z() : box.lower.z()};
}

/// A convex polygon, cut in place (Sutherland and Hodgman 1974).
struct CutFace {
    std::array<Vec3d, 16> corners;
    std::size_t size = 0;

    /// Keeps what is not below 0.
    template <typename Height>
    void cut(Height height) {
        CutFace kept;
        for (std::size_t i = 0; i < size; ++i) {
            const Vec3d &a = corners[i], &b = corners[i + 1 == size ? 0 : i + 1];
            const double da = height(a), db = height(b);
            if (da >= 0) kept.corners[kept.size++] = a;
            if ((da >= 0) != (db >= 0)) kept.corners[kept.size++] = a + (b - a) * (da / (da - db));
        }
        *this = kept;
    }
    /// Keeps what has sign · p[axis] <= sign · at.
    void cut(int axis, double sign, double at) {
        cut([=](const Vec3d& p) { return sign * (at - p[axis]); });
    }
    /// Keeps what is no farther than that behind a plane.
    void cut(const Plane& plane, double behind) {
        cut([&](const Vec3d& p) { return plane.normal.dot(p) + plane.offset + behind; });
    }
};

/// Whether a surface there looks into the map of a sun's view: not at its rim, and between its depths (Lighting.glsl).
bool knows(const ScreenCamera& sun, const Vec3d& place) {
    const Vec3d seen = (sun.clip_T_eye * (sun.eye_T_world * place).homogeneous()).head<3>();
    const double rim = 2 * (4 + 0.01 * sun.pixels.width + 2) / sun.pixels.width;
    return seen.head<2>().cwiseAbs().maxCoeff() < 1 - rim && std::abs(seen.z()) < 1 - 1e-5;
}

bool showsBacks(const DrawItem& item) {
    const auto both = [](const DrawMaterial::Layer& layer) { return layer.look->doubleSided; };
    return item.look && std::ranges::any_of(item.look->levels, [&](const DrawMaterial::Level& level) {
               return both(level.own) || std::ranges::any_of(level.passes, both);
           });
}

/// Corners of the faces of eight corners, around each.
constexpr unsigned kFaces[6][4] = {{0, 2, 6, 4}, {1, 5, 7, 3}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 6, 7, 5}};

}  // namespace

ShadowSight::ShadowSight(const ScreenCamera& camera, bool sun)
    : camera_(camera),
      sun_(sun),
      frustum_(tileFrustum(camera, {.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height})),
      light_(camera.eye_T_world.linear().row(2)) {
    const Affine3d world_T_eye = camera.eye_T_world.inverse();
    const Mat4d eye_T_clip = camera.clip_T_eye.inverse();
    for (int i = 0; i < 8; ++i) {
        const Vec4d corner = eye_T_clip * Vec4d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1, 1);
        corners_.col(i) = world_T_eye * Vec3d(corner.head<3>() / corner.w());
    }
}

Frustum::Mask ShadowSight::planes() const {
    return sun_ ? kAllButNear : Frustum::kAllPlanes;
}

/// What planes alone leave in doubt of large boxes, whose corners mean nothing any more in single precision: whether
/// the box lies beside the view along an edge of its own. Of a sun across its light; of a spot around its cone.
bool ShadowSight::isBeside(const Box& box) const {
    const Vec3d half = 0.5 * box.size(), center = box.center();
    for (int i = 0; i < 3; ++i) {
        const Vec3d axis = sun_ ? Vec3d(light_.cross(Vec3d::Unit(i))) : Vec3d(Vec3d::Unit(i));
        const Eigen::Matrix<double, 1, 8> along = axis.transpose() * corners_;
        const double reach = axis.cwiseAbs().dot(half), at = axis.dot(center);
        if (at - reach > along.maxCoeff() || at + reach < along.minCoeff()) return true;
    }
    return false;
}

std::optional<MapShade> ShadowSight::shadeOf(const Box& box, double reach) const {
    if (frustum_.classify(box, planes()).outside || isBeside(box)) return std::nullopt;
    const int width = camera_.pixels.width, height = camera_.pixels.height;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    double left = kInfinity, right = -kInfinity, below = kInfinity, above = -kInfinity, front = kInfinity, away = 0;
    const Mat4d& clip = camera_.clip_T_eye;
    const double near = sun_ ? -kInfinity : clip(2, 3) / (clip(2, 2) - 1);
    bool known = true;
    for (unsigned i = 0; i < 8; ++i) {
        const Vec3d eye = camera_.eye_T_world * cornerOf(box, i);
        const double depth = -eye.z();
        front = std::min(front, depth);
        away = std::max(away, eye.cwiseAbs().maxCoeff());
        if (!(depth > 1.5 * near)) known = false;
        const double w = sun_ ? 1 : depth;
        const double x = (0.5 + 0.5 * clip(0, 0) * eye.x() / w) * width,
                     y = (0.5 + 0.5 * clip(1, 1) * eye.y() / w) * height;
        left = std::min(left, x), right = std::max(right, x);
        below = std::min(below, y), above = std::max(above, y);
    }
    const double noise = kRounding * (2 * reach + away);
    const double perUnit = 0.5 * std::max(clip(0, 0) * width, clip(1, 1) * height);
    const double margin = kRimPx + noise * perUnit / (sun_ ? 1 : std::max(front - noise, 1e-300));
    MapShade shade{.rect = {.x = 0, .y = 0, .width = width, .height = height}, .front = front - noise};
    // Also where something is no number.
    if (!known || !(margin < width) || !(right - left < 1e9) || !(above - below < 1e9)) {
        if (!std::isfinite(shade.front)) shade.front = -std::numeric_limits<double>::max();
        return shade;
    }
    const auto pixel = [](double px, int side) {
        return static_cast<int>(std::clamp(px, 0.0, static_cast<double>(side)));
    };
    shade.rect.x = pixel(std::floor(left - margin), width);
    shade.rect.y = pixel(std::floor(below - margin), height);
    shade.rect.width = pixel(std::ceil(right + margin), width) - shade.rect.x;
    shade.rect.height = pixel(std::ceil(above + margin), height) - shade.rect.y;
    if (shade.rect.width <= 0 || shade.rect.height <= 0) return std::nullopt;
    return shade;
}

ShadowVolume::ShadowVolume(const ScreenCamera& camera, bool sun, const MapShade& shade, double far, double softPx) {
    const Mat4d& clip = camera.clip_T_eye;
    const Affine3d world_T_eye = camera.eye_T_world.inverse();
    const double pixel = 2 / (clip(0, 0) * camera.pixels.width);  // world units; of a spot, a unit before it
    double front = shade.front;
    if (sun) {
        front -= softPx * pixel;
        far = std::max(far, front) + softPx * pixel;
    } else {
        const double near = clip(2, 3) / (clip(2, 2) - 1);
        front = std::max(front * (1 - softPx * pixel), 0.5 * near);
        far = std::max(far, 2 * front);
    }
    Vec3d middle = Vec3d::Zero();
    for (unsigned i = 0; i < 8; ++i) {
        const double x = i & 1 ? shade.rect.x + shade.rect.width + softPx : shade.rect.x - softPx,
                     y = i & 2 ? shade.rect.y + shade.rect.height + softPx : shade.rect.y - softPx;
        const double depth = i & 4 ? far : front, w = sun ? 1 : depth;
        corners_[i] = world_T_eye * Vec3d((2 * x / camera.pixels.width - 1) * w / clip(0, 0),
                                          (2 * y / camera.pixels.height - 1) * w / clip(1, 1), -depth);
        known_ = known_ && corners_[i].allFinite() && corners_[i].cwiseAbs().maxCoeff() < 1e30;
        around_.extend(corners_[i]);
        middle += 0.125 * corners_[i];
    }
    for (std::size_t f = 0; f < 6; ++f) {
        const auto corner = [&](std::size_t i) { return corners_[kFaces[f][i]]; };
        Plane& plane = planes_[f];
        plane.normal = (corner(2) - corner(0)).cross(corner(3) - corner(1));
        const double length = plane.normal.norm();
        if (!(length > 0) || !std::isfinite(length)) {
            plane = {.normal = Vec3d::Zero(), .offset = 1};
            continue;
        }
        plane.normal /= length;
        if (plane.normal.dot(middle - corner(0)) < 0) plane.normal = -plane.normal;
        // All four corners lie in it, but for rounding.
        plane.offset = -std::min({plane.normal.dot(corner(0)), plane.normal.dot(corner(1)), plane.normal.dot(corner(2)),
                                  plane.normal.dot(corner(3))});
    }
}

bool ShadowVolume::meets(const Frustum& frustum) const {
    if (!known_) return true;
    return std::ranges::none_of(frustum.planes(), [this](const Plane& plane) {
        return std::ranges::all_of(corners_,
                                   [&](const Vec3d& corner) { return plane.normal.dot(corner) + plane.offset < 0; });
    });
}

// What box and body share is the hull of the body's faces, cut at the box, and of the box's corners in the body. It is
// seen where its corners do not lie wholly behind one side of the frustum. A finer view is asked in its place where all
// of them lie in that.
bool ShadowVolume::meets(const Frustum& frustum, const Box& box, std::span<const ScreenCamera> finer) const {
    if (!known_ || box.empty()) return true;
    const double rounding = 1e-9 * (1 + box.lower.cwiseAbs().cwiseMax(box.upper.cwiseAbs()).maxCoeff());
    const Box grown{.lower = box.lower.array() - rounding, .upper = box.upper.array() + rounding};
    if (!around_.overlaps(grown)) return false;
    for (const Plane& plane : planes_) {
        const Vec3d farthest = plane.normal.cwiseProduct(grown.lower).cwiseMax(plane.normal.cwiseProduct(grown.upper));
        if (farthest.sum() + plane.offset < 0) return false;
    }
    std::array<bool, 6> someInside{};
    std::array<bool, 2> allKnown{finer.size() > 0, finer.size() > 1};
    const auto note = [&](const Vec3d& point) {
        for (std::size_t i = 0; i < 2; ++i) allKnown[i] = allKnown[i] && knows(finer[i], point);
        for (std::size_t i = 0; i < 6; ++i) {
            const Plane& plane = frustum.planes()[i];
            someInside[i] = someInside[i] || !(plane.normal.dot(point) + plane.offset < 0);
        }
    };
    for (const auto& face : kFaces) {
        CutFace cut;
        for (const unsigned corner : face) cut.corners[cut.size++] = corners_[corner];
        for (int axis = 0; axis < 3; ++axis) {
            cut.cut(axis, -1, grown.lower[axis]);
            cut.cut(axis, 1, grown.upper[axis]);
        }
        for (std::size_t i = 0; i < cut.size; ++i) note(cut.corners[i]);
    }
    for (unsigned i = 0; i < 8; ++i) {
        const Vec3d corner = cornerOf(grown, i);
        if (std::ranges::none_of(planes_, [&](const Plane& p) { return p.normal.dot(corner) + p.offset < -rounding; }))
            note(corner);
    }
    return !allKnown[0] && !allKnown[1] && std::ranges::all_of(someInside, [](bool some) { return some; });
}

bool ShadowVolume::meets(const Frustum& frustum, const std::array<Vec3d, 3>& triangle,
                         std::span<const ScreenCamera> finer, double rounding) const {
    const auto behind = [&](const Plane& plane) {
        return std::ranges::all_of(triangle,
                                   [&](const Vec3d& p) { return plane.normal.dot(p) + plane.offset + rounding < 0; });
    };
    if (std::ranges::any_of(planes_, behind) || std::ranges::any_of(frustum.planes(), behind)) return false;
    CutFace cut;
    for (const Vec3d& corner : triangle) cut.corners[cut.size++] = corner;
    for (const Plane& plane : planes_) cut.cut(plane, rounding);
    for (const Plane& plane : frustum.planes()) cut.cut(plane, rounding);
    const std::span<const Vec3d> shared = std::span(cut.corners).first(cut.size);
    return !shared.empty() && std::ranges::none_of(finer, [&](const ScreenCamera& view) {
        return std::ranges::all_of(shared, [&](const Vec3d& place) { return knows(view, place); });
    });
}

bool ShadowVolume::meets(const Tile& tile, const DrawItem& item, std::span<const ScreenCamera> finer,
                         std::size_t& left) const {
    const Frustum& frustum = tile.frustum;
    if (!meets(frustum, item.box, finer)) return false;
    if (!known_ || item.kind != MeshKind::kTriangles || item.asWhole || item.lineWidth > 0 || item.box.empty())
        return true;
    const std::span<const float> positions = item.mesh->arrays.positions.as<float>();
    const std::span<const std::uint32_t> indices = item.mesh->arrays.indices.as<std::uint32_t>();
    // Vertices are placed in single precision, around the eye.
    const double rounding = 1e-6 * (1 + 2 * item.box.size().norm() +
                                    item.box.lower.cwiseAbs().cwiseMax(item.box.upper.cwiseAbs()).maxCoeff());
    const double outwards = item.world_T_item.linear().determinant() < 0 ? -1 : 1;
    const bool backsSeen = !tile.eye || showsBacks(item);
    /// Its front side is what it shows, and that is turned away.
    const auto turnedAway = [&](const std::array<Vec3d, 3>& corners) {
        if (backsSeen) return false;
        const Vec3d normal = outwards * (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        return normal.dot(*tile.eye - corners[0]) < -rounding * normal.norm();
    };
    const std::span<const MeshCluster> clusters = item.mesh->clusters;
    const std::size_t triangles = indices.size() / 3, each = clusters.empty() ? triangles : MeshCluster::kTriangles;
    for (std::size_t first = 0; first < triangles; first += each) {
        if (!clusters.empty()) {
            const Box part = clusters[first / each].box().transformed(item.world_T_item);
            if (!meets(frustum, part, finer)) continue;
        }
        const std::size_t end = std::min(first + each, triangles);
        if (left < end - first) return true;
        left -= end - first;
        for (std::size_t t = first; t < end; ++t) {
            std::array<Vec3d, 3> corners;
            for (std::size_t c = 0; c < 3; ++c) {
                const float* at = &positions[std::size_t{3} * indices[3 * t + c]];
                corners[c] = item.world_T_item * Vec3d(at[0], at[1], at[2]);
            }
            if (!turnedAway(corners) && meets(frustum, corners, finer, rounding)) return true;
        }
    }
    return false;
}

namespace {

/// How far the scene reaches from the light, along its view.
double farthestOf(const ScreenCamera& camera, const Box& scene) {
    double far = 0;
    for (unsigned i = 0; i < 8; ++i) far = std::max(far, -(camera.eye_T_world * cornerOf(scene, i)).z());
    return far;
}

/// Whether anything that a list shows may have another shadow by these changes of a view.
bool reaches(const RenderScene::Impl& scene, const DrawList& list, const ShadowVolume::Tile& tile,
             const ShadowView& view, std::span<const ShadowStore::Change> changes) {
    // The studio's ground looks into the coarsest one, wherever it is.
    std::vector<ScreenCamera> finer;
    const ShadowCasters& casters = *list.casters;
    if (view.clamped && !list.studio)
        for (const auto& other : {casters.middle, casters.near})
            if (other && other.get() != &view && &view != casters.near.get()) finer.push_back(other->camera);
    constexpr std::size_t kMostChanges = 4096, kMostTriangles = 16'384;
    if (changes.size() > kMostChanges) return true;
    std::size_t left = kMostTriangles;
    Box shaded = scene.tree.bounds();
    if (list.studio) shaded.extend(studioFloor(*list.studio));  // no item, and shaded all the same
    const double far = farthestOf(view.camera, shaded);
    const double soft = list.studio ? kStudioSoftPx : kSoftPx;
    for (const ShadowStore::Change& change : changes) {
        const ShadowVolume volume(view.camera, view.clamped, change.shade, far, soft);
        if (!volume.meets(tile.frustum)) continue;
        // The ground of a studio is everywhere.
        if (list.studio) return true;
        const auto meets = [&](const DrawItem& item) {
            const std::size_t before = left;
            const bool met = volume.meets(tile, item, finer, left);
            scene.shadows.count(1 + before - left);
            return met;
        };
        if (std::ranges::any_of(list.opaque, meets) || std::ranges::any_of(list.transparent, meets)) return true;
    }
    return false;
}

}  // namespace

std::uint64_t ShadowWatch::look(const RenderScene::Impl& scene, const DrawList& list, const ScreenCamera& camera,
                                const PixelRect& pixels) {
    static std::atomic<std::uint64_t> last{0};
    if (!list.casters) {
        seen_.clear();
        return 0;
    }
    const auto views = list.casters->all();
    bool another = views.size() != seen_.size() || number_ == 0;
    seen_.resize(views.size());
    ShadowVolume::Tile tile{tileFrustum(camera, pixels, kFrustumMarginPx + scene.widestLineReachPx()), {}};
    if (camera.clip_T_eye(3, 3) == 0) tile.eye = camera.eye_T_world.inverse().translation();
    // The finest, which are the last, first: what a tile shows looks into them, and one answer is enough.
    for (std::size_t i = views.size(); i-- > 0;) {
        const ShadowView& view = *views[i];
        Seen& seen = seen_[i];
        if (seen.kin != view.kin) {
            another = true;
        } else if (!another && seen.state != view.state) {
            const auto changes = scene.shadows.changesAfter(view.kin, seen.state);
            another = !changes || reaches(scene, list, tile, view, *changes);
        }
        seen = {view.kin, view.state};
    }
    if (another) number_ = ++last;
    return number_;
}

}  // namespace tessera
