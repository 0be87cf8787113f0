/// Walls for tests, built by hand so that the tests do not depend on files.
#pragma once

#include "common/wall/Wall.h"

namespace tessera::test {

/// The shipped 2x2 wall's screen, cut into columns × rows tiles, one host each, row by row from the lower left.
inline Wall flatWall(int columns, int rows, int widthPx = 1920, int heightPx = 1080) {
    Wall wall;
    wall.name = "flat";
    Screen screen;
    screen.name = "front";
    screen.lowerLeft = {-1.6, 0.6, 0};
    screen.lowerRight = {1.6, 0.6, 0};
    screen.upperLeft = {-1.6, 2.4, 0};
    screen.grid = {.columns = columns, .rows = rows, .tileWidthPx = widthPx / columns, .tileHeightPx = heightPx / rows};
    wall.screens.push_back(screen);
    User viewer;
    viewer.name = "viewer";
    wall.users.push_back(viewer);
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            WallHost host;
            host.name = "host-" + std::to_string(column) + "-" + std::to_string(row);
            host.tiles.push_back(
                {.screen = "front", .column = column, .row = row, .eye = Eye::kCenter, .user = "viewer"});
            wall.hosts.push_back(host);
        }
    }
    return wall;
}

/// Front, left, right and floor of a room of 2.4 m, one tile each.
inline Wall caveWall() {
    Wall wall;
    wall.name = "cave";
    const auto add = [&](std::string name, Vec3d lowerLeft, Vec3d lowerRight, Vec3d upperLeft) {
        Screen screen;
        screen.name = name;
        screen.lowerLeft = lowerLeft;
        screen.lowerRight = lowerRight;
        screen.upperLeft = upperLeft;
        screen.grid = {.columns = 1, .rows = 1, .tileWidthPx = 800, .tileHeightPx = 800};
        wall.screens.push_back(screen);
        WallHost host;
        host.name = name;
        host.tiles.push_back({.screen = name, .column = 0, .row = 0, .eye = Eye::kCenter, .user = "viewer"});
        wall.hosts.push_back(host);
    };
    add("front", {-1.2, 0, 0}, {1.2, 0, 0}, {-1.2, 2.4, 0});
    add("left", {-1.2, 0, 2.4}, {-1.2, 0, 0}, {-1.2, 2.4, 2.4});
    add("right", {1.2, 0, 0}, {1.2, 0, 2.4}, {1.2, 2.4, 0});
    add("floor", {-1.2, 0, 2.4}, {1.2, 0, 2.4}, {-1.2, 0, 0});
    User viewer;
    viewer.name = "viewer";
    viewer.position = {0.2, 1.7, 1.3};
    wall.users.push_back(viewer);
    return wall;
}

}  // namespace tessera::test
