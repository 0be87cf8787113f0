/// Support profiles: k-DOP realignment by table (C. Fünfzig, Spherical Techniques, 2007, chapter 4), made safe.
///
/// Around each half-direction of a set, a volume keeps how far its points reach along the directions nearby. With a
/// point at height a over the centre along the unit half-direction and at distance r beside it, a direction at angle β
/// from the half-direction, turned by φ from the point's azimuth, sees it at a·cos β + r·cos φ·sin β. The angles up to
/// the set's covering angle are cut into bins, the azimuths into sectors; an entry is the largest value over the bin,
/// the sector and the points. A query is one look-up: no scan, nothing divided by the slab, so flat volumes and points
/// below the slab are nothing special.
///
/// The public code of that time (OpenSG PLUS) multiplied slabs by factors from a table instead, and came out below the
/// true support for most points and angles, by up to 9 % with 14 and 18 directions.
/// Where the azimuth is on the far side, cos φ < 0 counts as such: entries may fall below what r alone would allow.
///
/// A look-up is for one direction of any kind, so every affine map will do (normalise p = Mᵀd, multiply by |p|): also
/// non-uniform scale, mirroring and flattening. Nothing falls back to planes.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/collision/volume/KDop.h"

namespace tessera {

struct ProfileShape {
    DirectionSet directions = DirectionSet::k18;
    std::uint8_t sectors = 4;  ///< 1 (rings only), else 3 to 16
    std::uint8_t bins = 8;     ///< 1 to 32

    /// Entries, a byte each: [half-plane of KDop][sector][bin].
    [[nodiscard]] constexpr std::size_t size() const { return 2 * directionCount(directions) * sectors * bins; }
    [[nodiscard]] constexpr std::size_t entry(std::size_t plane, std::size_t sector, std::size_t bin) const {
        return (plane * sectors + sector) * bins + bin;
    }
    friend bool operator==(const ProfileShape&, const ProfileShape&) = default;
};

/// Of one volume. A value. Its points reach (x - center)·p ≤ step · table[entry] for every unit p of that entry.
struct SupportProfile {
    /// Of at least one point. Entries are rounded up; they are never negative, although a centre outside its points'
    /// hull could do with less (their own mean, which is chosen here, is inside).
    [[nodiscard]] static SupportProfile around(const ProfileShape& shape, std::span<const Vec3d> points);

    ProfileShape shape;
    Vec3f center;    ///< their mean, rounded to float: these very bits
    float step = 0;  ///< above 0; largest distance from the centre / 255, rounded up
    std::vector<std::uint8_t> table;
};

/// Where to look, and what to make of it: found once per pair of frames. A value; finite if the map is.
struct ProfileLookup {
    /// From B's frame to A's: profiles of B, bounds along A's `target` directions.
    [[nodiscard]] static ProfileLookup make(const ProfileShape& shape, DirectionSet target, const Affine3d& a_T_b);

    ProfileShape shape;
    DirectionSet target;
    /// For each target half-plane, as KDop numbers them.
    std::array<std::uint16_t, 2 * kMaxDirections> entry;
    std::array<Vec3d, kMaxDirections> vector;   ///< p; its opposite for the opposite half-plane
    std::array<double, kMaxDirections> length;  ///< |p|, rounded up
    std::array<double, kMaxDirections> offset;  ///< T·d
    Affine3d map;

    /// As PlaneWeights::rounding, for points whose |x|+|y|+|z| is at most `extent`, also about their centre.
    [[nodiscard]] double rounding(double extent) const;
};

/// For kernels in float, for all 2n target half-planes:
///
///     h'[i] = vector[i]·center + length[i]·(step·table[entry[i]]) + offset[i]
///
/// Plain data.
struct FloatProfileLookup {
    std::uint16_t entry[2 * kMaxDirections];
    float vector[2 * kMaxDirections][3];
    float length[2 * kMaxDirections];
    float offset[2 * kMaxDirections];  ///< ±T·d plus the slack
};

/// With the slack that makes the line above an upper bound in float in any order, as for planes, for profiles whose
/// points lie in `whole`. With C_j = whole.magnitude(j) and D the diagonal of its axis box,
///
///     slack = 10 ε (Σ |p_j| C_j + |p| D + |T·d|) + rounding + 2^-120 (1 + Σ C)
///
/// (seven roundings at most of a sum of five terms, of which four are products of two or three factors; one for p).
[[nodiscard]] FloatProfileLookup forKernels(const ProfileLookup& lookup, const KDop& whole);

}  // namespace tessera
