/// A city of boxes with things around them, and the way through it: what both sides of a comparison of drawing show.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "common/geometry/Mesh.h"
#include "common/wall/View.h"

namespace tessera::bench {

struct City {
    struct Place {
        std::size_t mesh;  ///< in `meshes`
        Vec3d at, size;
    };
    std::vector<MeshData> meshes;
    std::vector<Place> places;
};

/// 576 houses that are boxes, 20 tori around each: 12,096 things. Tori of 16 × 16 are 5.9 million triangles, of 32 ×
/// 31 22.9. `half`: so many houses from its middle to its edge.
[[nodiscard]] inline City makeCity(int around = 16, int across = 16, int half = 12) {
    std::mt19937 random(1);
    const auto uniform = [&](double from, double to) {
        return std::uniform_real_distribution<double>(from, to)(random);
    };
    City city;
    city.meshes = {makeBox({1, 1, 1}), makeTorus(0.7, 0.3, around, across)};
    for (int x = -half; x < half; ++x) {
        for (int z = -half; z < half; ++z) {
            const Vec3d corner(24.0 * x + 12, 0, 24.0 * z + 12);
            const double height = uniform(8, 40);
            city.places.push_back({0, corner + Vec3d(0, height / 2, 0), {16, height, 16}});
            for (int i = 0; i < 20; ++i) {
                const double along = uniform(-11, 11);
                const double off = (random() % 2 ? 1 : -1) * uniform(9, 11);
                const double up = uniform(0.3, 5);
                city.places.push_back({1, corner + (i % 2 ? Vec3d(along, up, off) : Vec3d(off, up, along)),
                                       Vec3d::Constant(uniform(0.3, 1))});
            }
        }
    }
    return city;
}

/// Down a street, looking about; `t` from 0 to 1.
[[nodiscard]] inline View cityView(double t) {
    View view;
    view.position = {0, 0.5, 200 - 300 * t};
    view.orientation = Quatd(Eigen::AngleAxisd(0.5 * std::sin(6 * t), Vec3d::UnitY()));
    return view;
}

/// 3.2 m × 1.8 m of 1920×1080 pixels, seen from its middle.
[[nodiscard]] inline Screen benchScreen() {
    Screen screen;
    screen.name = "front";
    screen.lowerLeft = {-1.6, 0.6, 0};
    screen.lowerRight = {1.6, 0.6, 0};
    screen.upperLeft = {-1.6, 2.4, 0};
    screen.grid.columns = 2;
    screen.grid.rows = 2;
    screen.grid.tileWidthPx = 960;
    screen.grid.tileHeightPx = 540;
    return screen;
}

}  // namespace tessera::bench
