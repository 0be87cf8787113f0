/// Where in the world a change of what a light sees may be noticed. Conservative: what is not in there looks as before.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "client/render/DrawList.h"
#include "client/render/scene/RenderScene.h"
#include "common/math/Frustum.h"

namespace tessera {

/// Where a thing may leave pixels in a light's map, and nothing of it is nearer to the light than `front`, along the
/// light's view, in world units.
struct MapShade {
    PixelRect rect;
    double front = 0;
};

/// What a light's camera may see of boxes, roundings of the renderer included.
class ShadowSight {
public:
    /// `sun`: what is before its depths stands in its way, too.
    ShadowSight(const ScreenCamera& camera, bool sun);
    [[nodiscard]] const Frustum& frustum() const { return frustum_; }
    [[nodiscard]] Frustum::Mask planes() const;
    /// `reach`: at least the distance of any vertex from its mesh's own origin, in world units. None: it leaves no
    /// pixel.
    [[nodiscard]] std::optional<MapShade> shadeOf(const Box& box, double reach) const;

private:
    [[nodiscard]] bool isBeside(const Box& box) const;

    ScreenCamera camera_;
    bool sun_;
    Frustum frustum_;
    Vec3d light_;                          ///< towards it
    Eigen::Matrix<double, 3, 8> corners_;  ///< of the view
};

/// All that a caster shades, from its front to the end of the scene: a convex body, grown by as far as a surface looks
/// for its shadow.
class ShadowVolume {
public:
    /// `far`: nothing that is shaded is farther from the light, along its view. `softPx`: how far a surface may look in
    /// the map.
    ShadowVolume(const ScreenCamera& camera, bool sun, const MapShade& shade, double far, double softPx);
    /// Whether any of it may lie in the frustum; there, in the box, and not all in a view of `finer`, which are suns'.
    [[nodiscard]] bool meets(const Frustum& frustum) const;
    [[nodiscard]] bool meets(const Frustum& frustum, const Box& box, std::span<const ScreenCamera> finer) const;
    /// What a tile shows: pixels behind these planes, seen from there. `eye`: nothing where not all rays meet in one.
    struct Tile {
        Frustum frustum;
        std::optional<Vec3d> eye;
    };
    /// The same of what an item shows, by triangle: the inside of a house looks into no map. `left`: so many triangles
    /// are looked at, and fewer are left; where there are none the box decides.
    [[nodiscard]] bool meets(const Tile& tile, const DrawItem& item, std::span<const ScreenCamera> finer,
                             std::size_t& left) const;

private:
    [[nodiscard]] bool meets(const Frustum& frustum, const std::array<Vec3d, 3>& triangle,
                             std::span<const ScreenCamera> finer, double rounding) const;

    std::array<Vec3d, 8> corners_;  ///< bit 0 of the number: upper x, bit 1: y, bit 2: far
    std::array<Plane, 6> planes_;   ///< inwards
    Box around_;
    bool known_ = true;  ///< else it may be anywhere
};

/// What one tile's list has shown of shadows, from look to look.
class ShadowWatch {
public:
    /// A number that is another one than at the look before where a shadow may be another one on what the list shows;
    /// it tells lists of different watches apart, too. 0: no shadows. The scene has just been looked at from `camera`.
    [[nodiscard]] std::uint64_t look(const RenderScene::Impl& scene, const DrawList& list, const ScreenCamera& camera,
                                     const PixelRect& pixels);

private:
    struct Seen {
        std::uint64_t kin = 0, state = 0;
    };
    std::vector<Seen> seen_;
    std::uint64_t number_ = 0;
};

}  // namespace tessera
