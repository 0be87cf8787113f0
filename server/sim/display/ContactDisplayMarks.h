/// Which marks a step's contacts and distances want, and where: plain values, before any node.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "common/drawable/Drawable.h"
#include "common/math/Box.h"
#include "common/scene/Aspect.h"
#include "server/collision/pipeline/StepResult.h"
#include "server/sim/display/ContactDisplayShapes.h"

namespace tessera {

/// What an interest wants drawn (InterestWords::kShowPoints, kShowNormals, kShowFaces).
struct InterestShow {
    ObjectId interest;
    std::int64_t show = 0;
    bool operator==(const InterestShow&) const = default;
};

/// root_T_mark = translation · rotation · scale · turn. The last turn is about the mark's own Z axis; triangles alone
/// have one: it makes every triangle of the one.
struct Mark {
    Vec3d translation = Vec3d::Zero();
    Quatd rotation = Quatd::Identity();
    Vec3d scale = Vec3d::Ones();
    Quatd turn = Quatd::Identity();
};

struct Marks {
    std::array<std::vector<Mark>, kMarkKinds> of;
    /// Beyond kMaxMarks: not drawn.
    std::array<std::uint64_t, kMarkKinds> leftOut{};
};

/// Drawn at a time, by kind. Of more, as many are drawn, evenly taken from the whole list.
inline constexpr std::array<std::size_t, kMarkKinds> kMaxMarks{200, 200, 500, 100, 576};

inline constexpr std::size_t kMostRulers = 32;

struct DrawableExtent {
    Box bounds;              ///< in its own coordinates
    double pointRadius = 0;  ///< as points are shown
};

/// Sizes follow the smaller one of the two objects that touch: those of the interest's events, else the nodes
/// themselves.
///
/// Of an interest in distances, for each pair that is near: kShowPoints, a ball at either end; kShowNormals, the line
/// between, which is a ruler; kShowFaces, the two nearest faces. What touches has balls and faces.
///
/// **The ruler** says two digits of the distance: a large tick at each multiple of the largest power of ten that is no
/// longer than it, in world units, and beyond the last one a small tick at each tenth of that. 0.37 has three large
/// ticks and seven small ones. Where more than kMostRulers are drawn none has ticks.
class MarkMaker {
public:
    /// `asked`: ascending by interest. Nodes that are gone, faces that are not there and triangles without area have no
    /// mark. `display`: the node that bears the marks, which are no part of anything's size; may be none.
    [[nodiscard]] Marks make(const Aspect& scene, const StepResult& step, std::span<const InterestShow> asked,
                             ObjectId display);

private:
    /// What costs as much as a mesh is large.
    std::unordered_map<MeshKey, DrawableExtent, MeshKeyHash> extents_;
};

/// The affine map of the unit triangle to (a, b, c), lifted by `lift` along its normal. Nothing for a triangle without
/// area.
[[nodiscard]] std::optional<Mark> markOfTriangle(const Vec3d& a, const Vec3d& b, const Vec3d& c, double lift);

/// Where the ticks of a ruler of this length stand.
struct RulerTicks {
    double step = 0;  ///< a power of ten; 0: the length is none of 1e-30 to 1e30, and there are no ticks
    int large = 0;    ///< 1 to 9: at step, 2 · step, …
    int small = 0;    ///< 0 to 9: at large · step + step / 10, …
};
[[nodiscard]] RulerTicks ticksOf(double length);

}  // namespace tessera
