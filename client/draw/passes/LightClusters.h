/// Which lights a part of a picture must look at: lists per cluster, made on the processor. No GL.
///
/// A cluster is 64×64 pixels of a cell (ScreenCells.h) between two depths (Olsson, Billeter and Assarsson 2012,
/// "Clustered deferred and forward shading"). A light that has no range is everybody's. One that has stands in the
/// lists of the clusters that its sphere may touch: beyond its range it gives exactly 0 (the window of
/// KHR_lights_punctual), so the picture is, to the bit, the one of all lights everywhere, whatever the clusters are;
/// the order of summing is fixed.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "client/render/DrawList.h"
#include "common/wall/View.h"

namespace tessera {

/// What a shader reads of a light: four texels.
struct LightTexels {
    std::array<float, 4> place;     ///< eye space, metres: position and 1, or direction towards the light and 0
    std::array<float, 4> radiance;  ///< rgb at one metre; w: 1 / range in metres, 0 for unlimited
    /// Of a spot: its axis in eye space times s, and o, so that cos · s + o goes from 0 at the outer angle to 1 at the
    /// inner one. Of others: 0 0 0 1.
    std::array<float, 4> cone;
    /// x, y, z: 1 / (x + y d + z d²) at d metres, times what `radiance` was multiplied with. Of directional ones and by
    /// default 0 0 1. w: LightItem::scope, negative for those that light what is outside of it.
    std::array<float, 4> falloff = {0, 0, 1, 0};
};

/// Kept from draw to draw for its memory.
class LightClusters {
public:
    static constexpr int kSidePx = 64, kSlices = 32;

    /// For a whole frame. Takes the first DrawList::kMaxLights.
    /// Of those with shadows, if `shadowed`, there is a list of their own; otherwise they are lights as others.
    void collect(std::span<const LightItem> lights, const ScreenCamera& camera, bool shadowed = false);
    /// For a cell, and of it the rectangle, in the cell's pixels, on multiples of kSidePx.
    void assign(const ScreenCamera& cell, const PixelRect& scissor);

    /// Those with shadows, in the list's order. No cluster names them.
    [[nodiscard]] const std::vector<LightTexels>& shadowed() const { return shadowed_; }
    /// Those without a range in the list's order, then the others in the list's order, then one that is dark.
    [[nodiscard]] const std::vector<LightTexels>& lights() const { return lights_; }
    /// How many of them are everybody's.
    [[nodiscard]] std::size_t everywhere() const { return everywhere_; }
    /// Whether any is not.
    [[nodiscard]] bool hasLists() const { return everywhere_ + 1 < lights_.size(); }
    /// Two numbers for each cluster, x fastest, then y, then slice: where its list lies, and how many lights it has in
    /// all. The k-th light of a list is light k as long as that is everybody's, and else what is said at its place + k.
    [[nodiscard]] const std::vector<std::uint32_t>& lists() const { return lists_; }
    /// The slice of depth d (metres before the eye) is floor(log2(d) · scale + offset), cut off to [0, kSlices).
    [[nodiscard]] std::array<float, 2> sliceScaleAndOffset() const { return {sliceScale_, sliceOffset_}; }
    /// All lights in every list: what the lists are compared with.
    void setEverywhere(bool all) { bruteForce_ = all; }
    [[nodiscard]] bool isEverywhere() const { return bruteForce_; }

    static constexpr int kColumns = 16, kRows = 9;
    static constexpr std::size_t kClusters = std::size_t{kColumns} * kRows * kSlices;

private:
    /// Around all that a light with a range can reach; eye space, metres.
    struct Sphere {
        Vec3d center;
        double radius;
        std::uint32_t light;
    };
    void fitSlices();
    /// Calls visit(first column, last column, first row, last row, slice) for what the sphere may touch.
    template <typename Visit>
    void forEachTouched(const Sphere& sphere, const Visit& visit) const;
    /// Whether there is room; otherwise nothing is usable.
    [[nodiscard]] bool fill();
    void shareOneList();

    std::vector<LightTexels> lights_, shadowed_;
    std::vector<Sphere> spheres_;
    std::vector<std::uint32_t> visible_;  ///< of the spheres, in order: those that the rectangle may see
    std::vector<std::uint32_t> counts_, lists_;
    std::size_t everywhere_ = 0;
    bool bruteForce_ = false;
    float sliceScale_ = 0, sliceOffset_ = 0;
    Mat4d clip_T_eye_ = Mat4d::Identity();
    int widthPx_ = 0, heightPx_ = 0;
    int left_ = 0, right_ = 0, below_ = 0, above_ = 0;  ///< columns and rows of the rectangle, the last ones included
};

}  // namespace tessera
