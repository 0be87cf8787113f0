/// What one tile draws: the outcome of culling, the input of drawing. No GL.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "client/render/DrawMaterial.h"
#include "client/render/DrawMesh.h"
#include "client/render/MeshClusters.h"
#include "common/base/Blob.h"
#include "common/cores/Environment.h"
#include "common/cores/Material.h"
#include "common/math/Box.h"
#include "common/math/Types.h"
#include "common/scene/Aspect.h"
#include "common/wall/View.h"

namespace tessera {

/// One geometry at one place. Items are drawn in the list's order, which is the same on every tile (a subsequence of
/// one order: depth from the wall's camera, then node id); ties of depth are then decided alike everywhere.
struct DrawItem {
    ObjectId node;
    ObjectId geometry;
    ObjectId material;
    std::shared_ptr<const DrawMesh> mesh;      ///< of its geometry, as fine as it is drawn
    std::shared_ptr<const DrawMaterial> look;  ///< of its material; null: it has none
    Affine3d world_T_item;
    bool mirrored = false;  ///< odd number of reflections: front faces are clockwise
    bool over = false;      ///< among what is transparent: an opaque item, of which the blended passes alone are drawn
    bool everywhere = false;  ///< it is drawn wherever its box is not, too
    bool asWhole = false;     ///< something moves its vertices: its mesh's triangles are not where they stand
    MeshKind kind = MeshKind::kTriangles;
    float lineWidth = 0;  ///< pixels, where it is lines; else 0
    static constexpr float kAnyWidth = std::numeric_limits<float>::infinity();
    float widestLinePx = kAnyWidth;  ///< of its lines, edges, corners and streaks on this screen: see LineWidths.h
    static constexpr std::uint32_t kNoneHidden = 0xffffffffu;
    std::uint32_t hiddenFrom = kNoneHidden;  ///< in the list's `hiddenClusters`
    double pointRadius = 0;                  ///< of points as they are shown, in the item's units (shownRadius); else 0
    std::int64_t fill =
        Material::kFilled;  ///< of triangles; otherwise `kind` is lines, and the mesh's edges or corners are drawn
    Box box = {};           ///< in the world, around all of it; empty: not known
    /// Those of `mesh`, or none: it is drawn as a whole.
    std::span<const MeshCluster> clusters = {};
    std::uint32_t sortedFrom = 0, sortedCount = 0;  ///< these of the list's `sortedTriangles` alone; 0: all
    std::uint32_t scopes = 0;  ///< a bit for each scope of lights that it lies in, see LightItem::scope
};

/// How far, in pixels, lines of this width stand out beside and beyond the lines themselves: their ends are square.
[[nodiscard]] inline double lineReachPx(float lineWidth) {
    return std::ceil(0.7072 * static_cast<double>(lineWidth));
}

struct LightItem {
    using Kind = LightSource::Kind;
    Kind kind = Kind::kPoint;
    Vec3d position = Vec3d::Zero();     ///< world
    Vec3d direction = -Vec3d::UnitZ();  ///< world, the way the light travels
    Vec3f radiance = Vec3f::Ones();     ///< colour × intensity
    float range = 0;
    Vec3f attenuation{
        0, 0, 1};  ///< 1 / (x + y d + z d²) at distance d in world units; not of directional ones; all 0: no falloff
    float innerAngle = 0, outerAngle = 0;  ///< of a spot: radians from its axis
    bool shadows = false;    ///< of one directional light, kMaxShadowSpots spots and kMaxShadowPoints points at most;
                             ///< whatever its scope is, all things cast them
    std::uint8_t scope = 0;  ///< 0: it lights everything; else n: items alone that have bit n - 1, or, `outside`, those
                             ///< alone that have not
    bool outside = false;
};

struct ShadowCasters;  // ShadowCasters.h

/// Lines that a screen draws narrower than they say, as they would cover too much (LineWidths.h).
struct NarrowedLines {
    std::uint64_t items = 0;
    // Of the item that covers most:
    ObjectId node;
    float wantedPx = 0, drawnPx = 0;
    double wantedPixels = 0;  ///< that all lines of the screen would cover together
};

struct DrawList {
    std::vector<DrawItem> opaque;                ///< front to back
    std::vector<DrawItem> transparent;           ///< back to front; one whose triangles lie among others' several times
    std::vector<std::uint32_t> sortedTriangles;  ///< of transparent items: their numbers in the item's mesh
    std::vector<std::uint64_t> hiddenClusters;   ///< a bit per cluster of those items that have some; left away
    std::vector<LightItem> lights;               ///< in document order, at most kMaxLights
    std::uint64_t lightsLeftOut = 0;             ///< of the scene, beyond those
    std::uint64_t shadowsLeftOut = 0;            ///< lights that ask for shadows, beyond those that get some
    NarrowedLines narrowed;
    std::uint64_t scopesLeftOut =
        0;  ///< lights whose scope is none of the first kMaxScopes that lights name; they shine on nothing
    /// Null: nobody has shadows.
    std::shared_ptr<const ShadowCasters> casters;
    /// Of one RenderAction's lists: another one where casters that have changed may be noticed on what the list shows.
    std::uint64_t shadowState = 0;
    Environment environment;
    std::optional<Studio> studio;  ///< its ground is drawn where nothing is
    // Of the scene, the same on every tile: a pixel may be computed otherwise where one of them is set.
    bool detailed = false;  ///< images of some material say more than its colour and its normals
    bool coated = false;    ///< some material has lacquer
    bool glossy = false;    ///< some material is Phong's, or says how it reflects (specular, specularColor, ior)
    static constexpr std::size_t kMaxLights = 65536, kMaxShadowSpots = 8, kMaxShadowPoints = 4, kMaxScopes = 32;

    [[nodiscard]] ClusterBits hiddenOf(const DrawItem& item) const {
        if (item.hiddenFrom == DrawItem::kNoneHidden) return {};
        return ClusterBits(hiddenClusters).subspan(item.hiddenFrom, wordsFor(item.clusters.size()));
    }
};

/// Whether the lists name the same things in the same places, to the bit: they draw the same picture then, as long as
/// the arrays, materials and images that they name are the same.
[[nodiscard]] bool drawAlike(const DrawList& a, const DrawList& b);
[[nodiscard]] bool drawAlike(const ScreenCamera& a, const ScreenCamera& b);
[[nodiscard]] bool shineAlike(std::span<const LightItem> a, std::span<const LightItem> b);

}  // namespace tessera
