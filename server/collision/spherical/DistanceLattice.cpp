#include "server/collision/spherical/DistanceLattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "common/base/Workers.h"
#include "server/collision/mesh/Predicates.h"
#include "server/collision/query/SurfaceTopology.h"
#include "server/collision/spherical/FieldKernels.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

using kernel::LatticeView;

constexpr std::size_t kMostPlaces = 16'000'000;
/// Of the error asked for: corners of a cell bound what is between them to 0.37 of the spacing, from below, on a plane.
constexpr double kSpacingPerError = 2;
/// Of the spacing: known distances may be so much too large.
constexpr double kLatticeTolerance = 0.05;
constexpr double kValueSteps = 32000;

struct EdgeCrossing {
    double height;
    int turn;  ///< +1: out of the body, upwards
};

/// Every place's winding number, as a bit: not 0. Columns along the third axis; where a column meets the projection of
/// an edge exactly, one of the triangles beside it has it, whichever way they are turned.
class Sides {
public:
    Sides(const TreeStorage& tree, const LatticeView& view)
        : view_(view), columns_(static_cast<std::size_t>(view.size[0]) * static_cast<std::size_t>(view.size[1])) {
        const TriangleMesh& mesh = *tree.mesh;
        for (std::uint32_t face = 0; face < mesh.faceCount(); ++face) {
            std::array<Vec3d, 3> p;
            for (unsigned k = 0; k < 3; ++k) p[k] = (mesh.corner(face, k) - tree.centre) * tree.unit;
            add(p);
        }
    }
    /// For the places of one column, upwards.
    void column(std::int32_t i, std::int32_t j, std::vector<bool>& inside) {
        std::vector<EdgeCrossing>& all =
            columns_[static_cast<std::size_t>(j) * static_cast<std::size_t>(view_.size[0]) +
                     static_cast<std::size_t>(i)];
        std::sort(all.begin(), all.end(),
                  [](const EdgeCrossing& a, const EdgeCrossing& b) { return a.height > b.height; });
        inside.assign(static_cast<std::size_t>(view_.size[2]), false);
        int winding = 0;
        std::size_t next = 0;
        for (std::int32_t k = view_.size[2] - 1; k >= 0; --k) {
            const double z = place(2, k);
            while (next < all.size() && all[next].height > z) winding += all[next++].turn;
            inside[static_cast<std::size_t>(k)] = winding != 0;
        }
    }

private:
    [[nodiscard]] double place(int axis, std::int32_t i) const {
        return static_cast<double>(view_.origin[axis]) + static_cast<double>(view_.spacing) * i;
    }
    [[nodiscard]] std::pair<std::int32_t, std::int32_t> range(int axis, double low, double high) const {
        const double start = static_cast<double>(view_.origin[axis]), step = static_cast<double>(view_.spacing);
        return {std::max(0, static_cast<std::int32_t>(std::floor((low - start) / step))),
                std::min(view_.size[axis] - 1, static_cast<std::int32_t>(std::ceil((high - start) / step)))};
    }
    void add(std::array<Vec3d, 3> p) {
        const auto flat = [](const Vec3d& x) { return Vec2d(x[0], x[1]); };
        int turn = orient2d(flat(p[0]), flat(p[1]), flat(p[2]));
        if (turn == 0) return;
        if (turn < 0) std::swap(p[1], p[2]);
        const Vec3d n = (p[1] - p[0]).cross(p[2] - p[0]);
        const auto [i0, i1] = range(0, std::min({p[0][0], p[1][0], p[2][0]}), std::max({p[0][0], p[1][0], p[2][0]}));
        const auto [j0, j1] = range(1, std::min({p[0][1], p[1][1], p[2][1]}), std::max({p[0][1], p[1][1], p[2][1]}));
        for (std::int32_t j = j0; j <= j1; ++j)
            for (std::int32_t i = i0; i <= i1; ++i) {
                const Vec2d at(place(0, i), place(1, j));
                bool in = true;
                for (unsigned k = 0; k < 3 && in; ++k) {
                    const Vec3d &a = p[k], &b = p[(k + 1) % 3];
                    const int side = orient2d(flat(a), flat(b), at);
                    in = side > 0 || (side == 0 && (b[1] > a[1] || (b[1] == a[1] && b[0] < a[0])));
                }
                if (!in) continue;
                const double height =
                    n[2] != 0 ? p[0][2] - (n[0] * (at[0] - p[0][0]) + n[1] * (at[1] - p[0][1])) / n[2] : p[0][2];
                columns_[static_cast<std::size_t>(j) * static_cast<std::size_t>(view_.size[0]) +
                         static_cast<std::size_t>(i)]
                    .push_back({height, turn});
            }
    }

    const LatticeView& view_;
    std::vector<std::vector<EdgeCrossing>> columns_;
};

template <typename Task>
void overTasks(Workers* workers, std::size_t count, const Task& task) {
    if (workers != nullptr && count > 1) return workers->run(count, task);
    for (std::size_t i = 0; i < count; ++i) task(i);
}

}  // namespace

Expected<DistanceLattice> DistanceLattice::make(const TriangleTree& tree, const DistanceLatticeOptions& options) {
    const TreeStorage& s = tree.storage();
    if (s.empty()) return fail(ErrorCode::kBadInput, "a mesh without triangles has no distances");
    if (s.options.volume != VolumeKind::kObb)
        return fail(ErrorCode::kBadInput, "a lattice of distances needs a tree of oriented boxes");
    if (!(options.error >= 0.001 && options.error <= 0.2))
        return fail(ErrorCode::kBadInput, "an error that is not between 0.001 and 0.2 of the size");
    if (!(options.reach >= 0 && options.reach <= 10))
        return fail(ErrorCode::kBadInput, "a reach that is not between 0 and 10 of the size");

    DistanceLattice out;
    out.tree_ = &tree;
    const Box& box = s.mesh->bounds();
    const Vec3d low = (box.lower - s.centre) * s.unit, high = (box.upper - s.centre) * s.unit;
    // Of a mesh that is one point there is no size: the tree's own unit is.
    const double size = (high - low).norm() > 0 ? (high - low).norm() : 1;
    out.error_ = options.error * size / s.unit;
    LatticeView& v = out.view_;
    const double spacing = kSpacingPerError * options.error * size;
    v.spacing = static_cast<float>(spacing);
    double places = 1;
    for (int r = 0; r < 3; ++r) {
        const double from = low[r] - options.reach * size - 0.5 * spacing,
                     to = high[r] + options.reach * size + 0.5 * spacing;
        v.size[r] = std::max(2, static_cast<std::int32_t>(std::ceil((to - from) / spacing)) + 1);
        v.origin[r] = static_cast<float>(from);
        // The surface itself is rounded to floats.
        v.boxLower[r] = static_cast<float>(low[r] - 1e-6);
        v.boxUpper[r] = static_cast<float>(high[r] + 1e-6);
        places *= v.size[r];
    }
    if (places > static_cast<double>(kMostPlaces))
        return fail(ErrorCode::kLimit, std::to_string(static_cast<std::uint64_t>(std::min(places, 1e18))) +
                                           " places of a lattice, at most " + std::to_string(kMostPlaces) +
                                           ": take a larger error");
    out.values_.resize(static_cast<std::size_t>(places));
    const double farthest = spacing * Vec3d(v.size[0], v.size[1], v.size[2]).norm();
    v.unit = static_cast<float>(farthest / kValueSteps);
    const float tolerance = static_cast<float>(kLatticeTolerance * spacing);
    v.doubt = 0.5F * tolerance + 0.51F * v.unit + 4e-6F;
    v.isSigned = SurfaceTopology(*s.mesh).closed();

    const kernel::TreeView view = s.view();
    const kernel::PointDistance measure = kernel::fieldKernels().pointDistance;
    std::optional<Sides> sides;
    if (v.isSigned) sides.emplace(s, v);
    const auto width = static_cast<std::size_t>(v.size[0]), depth = static_cast<std::size_t>(v.size[1]);
    overTasks(options.workers, depth, [&](std::size_t j) {
        std::vector<bool> inside(static_cast<std::size_t>(v.size[2]), false);
        for (std::size_t i = 0; i < width; ++i) {
            if (sides) sides->column(static_cast<std::int32_t>(i), static_cast<std::int32_t>(j), inside);
            float last = static_cast<float>(2 * farthest);
            for (std::int32_t k = 0; k < v.size[2]; ++k) {
                const float p[3] = {v.origin[0] + v.spacing * static_cast<float>(i),
                                    v.origin[1] + v.spacing * static_cast<float>(j),
                                    v.origin[2] + v.spacing * static_cast<float>(k)};
                // From the place below it is one step farther at most.
                last = measure(view, p, std::min(last + v.spacing * 1.0001F + 1e-6F, static_cast<float>(2 * farthest)),
                               tolerance);
                const float middle = std::max(0.0F, last - 0.5F * tolerance);
                const float value = std::round((inside[static_cast<std::size_t>(k)] ? -middle : middle) / v.unit);
                out.values_[(static_cast<std::size_t>(k) * depth + j) * width + i] =
                    static_cast<std::int16_t>(std::clamp(value, -32767.0F, 32767.0F));
            }
        }
    });
    return out;
}

kernel::LatticeView DistanceLattice::view() const {
    LatticeView v = view_;
    v.values = values_.data();
    return v;
}

double DistanceLattice::spacing() const {
    return static_cast<double>(view_.spacing) / tree_->storage().unit;
}

Expected<DistanceBound> DistanceLattice::at(const Vec3d& place) const {
    if (!place.allFinite()) return fail(ErrorCode::kBadInput, "a place that is not finite");
    const TreeStorage& s = tree_->storage();
    const Vec3d own = (place - s.centre) * s.unit;
    // As the kernel has it, in double.
    Vec3d kept, inside;
    std::array<std::int32_t, 3> cell{};
    double box = 0;
    for (int r = 0; r < 3; ++r) {
        const double from = static_cast<double>(view_.origin[r]), step = static_cast<double>(view_.spacing);
        kept[r] = std::clamp(own[r], from, from + step * (view_.size[r] - 1));
        cell[static_cast<std::size_t>(r)] =
            std::min(static_cast<std::int32_t>((kept[r] - from) / step), view_.size[r] - 2);
        inside[r] = kept[r] - from - step * cell[static_cast<std::size_t>(r)];
        const double out = std::max(
            {0.0, static_cast<double>(view_.boxLower[r]) - own[r], own[r] - static_cast<double>(view_.boxUpper[r])});
        box += out * out;
    }
    const double away = (own - kept).norm();
    DistanceBound bound{-1e300, 1e300};
    for (int corner = 0; corner < 8; ++corner) {
        Vec3d way;
        std::array<std::size_t, 3> at{};
        for (int r = 0; r < 3; ++r) {
            const int up = corner >> r & 1;
            at[static_cast<std::size_t>(r)] = static_cast<std::size_t>(cell[static_cast<std::size_t>(r)] + up);
            way[r] = up != 0 ? static_cast<double>(view_.spacing) - inside[r] : inside[r];
        }
        const double known = values_[(at[2] * static_cast<std::size_t>(view_.size[1]) + at[1]) *
                                         static_cast<std::size_t>(view_.size[0]) +
                                     at[0]] *
                             static_cast<double>(view_.unit);
        bound.lower = std::max(bound.lower, known - way.norm());
        bound.upper = std::min(bound.upper, known + way.norm());
    }
    const double doubt = static_cast<double>(view_.doubt) + away * (1 + 1e-12);
    bound.lower -= doubt;
    bound.upper += doubt;
    if (box > 0) bound.lower = std::max(bound.lower, std::sqrt(box) - static_cast<double>(view_.doubt));
    if (!view_.isSigned) bound.lower = std::max(bound.lower, 0.0);
    return DistanceBound{bound.lower / s.unit, bound.upper / s.unit};
}

Vec3d DistanceLattice::gradient(const Vec3d& place) const {
    const double step = spacing();
    Vec3d out = Vec3d::Zero();
    for (int r = 0; r < 3; ++r) {
        const Expected<DistanceBound> below = at(place - step * Vec3d::Unit(r)),
                                      above = at(place + step * Vec3d::Unit(r));
        if (!below || !above) return Vec3d::Zero();
        out[r] = above->distance() - below->distance();
    }
    const double length = out.norm();
    return length > 1e-6 * step ? Vec3d(out / length) : Vec3d(Vec3d::Zero());
}

}  // namespace tessera
