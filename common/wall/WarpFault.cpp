/// What can be wrong with a warp mesh, in words.
#include <fmt/format.h>

#include <cmath>

#include "common/wall/Output.h"

namespace tessera {
namespace {

struct FlatPoint {
    double x = 0, y = 0;
};

/// Twice the area of a corner's triangle; above 0 where the way turns left.
double turnAt(FlatPoint before, FlatPoint corner, FlatPoint after) {
    return (corner.x - before.x) * (after.y - corner.y) - (corner.y - before.y) * (after.x - corner.x);
}

/// The smallest and the largest turn of a face, walked around from its node (column, row).
struct FaceTurns {
    double least = 0, most = 0;
};
template <typename PlaceOf>
FaceTurns turnsOf(const WarpMesh& mesh, int column, int row, PlaceOf placeOf) {
    const FlatPoint corners[4] = {placeOf(mesh.at(column, row)), placeOf(mesh.at(column + 1, row)),
                                  placeOf(mesh.at(column + 1, row + 1)), placeOf(mesh.at(column, row + 1))};
    FaceTurns turns{turnAt(corners[3], corners[0], corners[1]), 0};
    turns.most = turns.least;
    for (int i = 1; i < 4; ++i) {
        const double turn = turnAt(corners[i - 1], corners[i], corners[(i + 1) % 4]);
        turns.least = std::min(turns.least, turn);
        turns.most = std::max(turns.most, turn);
    }
    return turns;
}

}  // namespace

std::optional<std::string> findWarpFault(const WarpMesh& mesh, const OutputLimits& limits) {
    const auto countOf = [](int columns, int rows) {
        return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    };
    if (mesh.columns < 2 || mesh.rows < 2 || mesh.columns > limits.maxWarpSide || mesh.rows > limits.maxWarpSide ||
        countOf(mesh.columns, mesh.rows) > limits.maxWarpNodes)
        return fmt::format("has {} x {} nodes: 2 to {} each way and at most {} in all are possible", mesh.columns,
                           mesh.rows, limits.maxWarpSide, limits.maxWarpNodes);
    if (mesh.nodes.size() != countOf(mesh.columns, mesh.rows))
        return fmt::format("has {} nodes instead of {} x {}", mesh.nodes.size(), mesh.columns, mesh.rows);
    for (int row = 0; row < mesh.rows; ++row) {
        for (int column = 0; column < mesh.columns; ++column) {
            const WarpNode& node = mesh.at(column, row);
            for (const float value : {node.x, node.y, node.u, node.v, node.intensity}) {
                if (!std::isfinite(value))
                    return fmt::format("has a hole: node column {} row {} is not made of finite numbers", column, row);
            }
            if (node.intensity < 0)
                return fmt::format("has a hole: node column {} row {} is marked as missing (intensity {:.6g})", column,
                                   row, node.intensity);
            if (node.intensity > 1)
                return fmt::format("wants {:.6g} times the light at node column {} row {}: 0 to 1 are possible",
                                   node.intensity, column, row);
            for (const float value : {node.x, node.y, node.u, node.v}) {
                if (std::abs(value) > limits.maxNodePlace)
                    return fmt::format(
                        "has its node column {} row {} far outside of the picture ({:.6g} {:.6g} shows {:.6g} {:.6g})",
                        column, row, node.x, node.y, node.u, node.v);
            }
        }
    }
    // All faces turn the way that the first one does: over the output, and over the tile's picture (where one may be of
    // no size).
    double side = 0, pictureSide = 0;
    for (int row = 0; row + 1 < mesh.rows; ++row) {
        for (int column = 0; column + 1 < mesh.columns; ++column) {
            const FaceTurns there = turnsOf(mesh, column, row, [](const WarpNode& n) { return FlatPoint{n.x, n.y}; });
            if (side == 0) side = there.least + there.most < 0 ? -1 : 1;
            if (std::min(side * there.least, side * there.most) <= 0)
                return fmt::format(
                    "is folded, dented or of no size at the face of nodes column {} row {} to column {} row {}", column,
                    row, column + 1, row + 1);
            const FaceTurns shown = turnsOf(mesh, column, row, [](const WarpNode& n) { return FlatPoint{n.u, n.v}; });
            const double larger = std::abs(shown.least) > std::abs(shown.most) ? shown.least : shown.most;
            if (pictureSide == 0 && larger != 0) pictureSide = larger < 0 ? -1 : 1;
            // Measured places jitter where the picture ends: a millionth of it is no fold.
            if (std::min(pictureSide * shown.least, pictureSide * shown.most) < -1e-6)
                return fmt::format(
                    "is folded in what it shows of the picture at the face of nodes column {} row {} to column {} row "
                    "{}",
                    column, row, column + 1, row + 1);
        }
    }
    if (pictureSide == 0) return "shows no more of the picture than a point or a line";
    return std::nullopt;
}

}  // namespace tessera
