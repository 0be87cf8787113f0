/// Walls and pictures for tests of outputs.
#pragma once

#include <random>

#include "client/output/OutputMaker.h"
#include "common/wall/Wall.h"

namespace tessera::test {

/// One flat screen, each tile drawn by a host of its own; `eyes`: for each cell one tile per eye, on one host.
inline Wall flatWall(int columns, int rows, int widthPx, int heightPx, int overlapXPx = 0, int overlapYPx = 0,
                     bool eyes = false) {
    Wall wall;
    wall.name = "flat";
    Screen screen{.name = "s", .lowerLeft = {-1.6, 0.6, 0}, .lowerRight = {1.6, 0.6, 0}, .upperLeft = {-1.6, 2.4, 0}};
    screen.grid = {.columns = columns,
                   .rows = rows,
                   .tileWidthPx = widthPx,
                   .tileHeightPx = heightPx,
                   .overlapXPx = overlapXPx,
                   .overlapYPx = overlapYPx};
    wall.screens = {screen};
    wall.users = {User{.name = "u"}};
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            WallHost host{.name = "h" + std::to_string(wall.hosts.size())};
            for (const Eye eye : {Eye::kCenter, Eye::kLeft, Eye::kRight}) {
                if ((eye == Eye::kCenter) != eyes)
                    host.tiles.push_back({.screen = "s", .column = column, .row = row, .eye = eye, .user = "u"});
            }
            wall.hosts.push_back(host);
        }
    }
    return wall;
}

inline std::vector<std::uint8_t> noise(std::mt19937& random, int widthPx, int heightPx) {
    std::vector<std::uint8_t> rgbx(4 * static_cast<std::size_t>(widthPx) * static_cast<std::size_t>(heightPx));
    for (std::uint8_t& byte : rgbx) byte = static_cast<std::uint8_t>(random());
    return rgbx;
}
inline std::vector<std::uint8_t> even(int widthPx, int heightPx, std::uint8_t value) {
    return std::vector<std::uint8_t>(4 * static_cast<std::size_t>(widthPx) * static_cast<std::size_t>(heightPx), value);
}

/// The channel of a pixel of rows without gaps.
inline int channelAt(const std::uint8_t* rgbx, int widthPx, int x, int y, std::size_t channel) {
    return rgbx[4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(widthPx) + static_cast<std::size_t>(x)) +
                channel];
}

/// A mesh that shows the picture where it is.
inline WarpMesh straightMesh(int columns, int rows) {
    WarpMesh mesh{.columns = columns, .rows = rows, .nodes = {}};
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const float u = static_cast<float>(column) / static_cast<float>(columns - 1),
                        v = static_cast<float>(row) / static_cast<float>(rows - 1);
            mesh.nodes.push_back({.x = 2 * u - 1, .y = 2 * v - 1, .u = u, .v = v, .intensity = 1});
        }
    }
    return mesh;
}

inline std::string again(const char* filter, unsigned seed) {
    return "seed " + std::to_string(seed) + "; build/bin/unit_output --gtest_filter=" + filter;
}

}  // namespace tessera::test
