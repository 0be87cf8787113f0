/// How fine surfaces that control points stand for are drawn, by screen: the second of the two steps before drawing
/// (SceneItems.h, lookFrom; the other half is UserView.cpp).
///
/// Triangles as the fields say are drawn where their surface is within the wanted pixels of them. Where it may be
/// farther off on this screen, finer ones are, a step of half as long edges after the other, those first that are
/// farthest off for what they ask for; until none is, or there would be too many. What has parts (Derivation.h,
/// ScreenParts) is as fine in each as that asks for, unless that would save little. The choice looks at what the scene
/// shows and at the screen's camera alone, not at tiles, cullers, hosts or the past: so all tiles of a screen draw the
/// same, and so does who joins late. What no pixel of the screen can show stays as it is.
#pragma once

#include <cstdint>

#include "common/math/Box.h"
#include "common/wall/View.h"

namespace tessera {

/// No step leads beyond, of one thing and of all that a screen shows; what fields ask for themselves is drawn whatever
/// it is.
inline constexpr std::uint64_t kMostTrianglesByScreen = std::uint64_t{1} << 18,
                               kMostTrianglesOfScreen = std::uint64_t{1} << 20;

/// What a length is on a screen. IEEE's four operations and roots alone: hosts with other processors have to choose
/// alike.
class ScreenMeasure {
public:
    explicit ScreenMeasure(const ScreenCamera& camera);
    /// Two points within `own` (the item's coordinates) and within `box` (world), no more than `apart` of the item's
    /// units from each other, one of them seen: on the screen they are so many pixels for each of these units from each
    /// other at most.
    [[nodiscard]] double pixelsPerUnit(const Box& own, const Box& box, const Affine3d& world_T_item,
                                       double apart) const;

    /// The same of many parts of one item. From wherever in its cell of a grid the eye is: cells are a sixteenth to an
    /// eighth of the way to the part wide, so that what an eye sees that moves a little is mostly the same.
    class OfItem {
    public:
        OfItem(const ScreenMeasure& screen, const Affine3d& world_T_item);
        [[nodiscard]] double pixelsPerUnit(const Box& own, double apart) const;

    private:
        const ScreenMeasure& screen_;
        Affine3d world_T_item_;
        double perUnit_ = 1;
        Eigen::RowVector3d axis_;  ///< depth by the item's coordinates
        double offset_ = 0;
        Vec3d axisWorld_;
    };

private:
    Vec3d eyeWorld_;
    Affine3d eye_T_world_;
    double nearest_ = 0;      ///< of the clip planes, metres
    double slant_ = 1;        ///< of a line of sight's length to its depth, at most
    double pixelsAtOne_ = 0;  ///< of a metre across the line of sight, a metre away; however it lies there; as many
                              ///< times fewer as the camera's detail is coarser
};

/// At most so much longer becomes what a matrix is applied to. No more than that where it is a turn and one scale.
[[nodiscard]] double rowStretchOf(const Mat3d& linear);

}  // namespace tessera
