/// Boxes that move, for tests of neighbour finding.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "server/collision/neighbours/NeighbourFinder.h"

namespace tessera {

inline Box boxAt(const Vec3d& lower, const Vec3d& size) {
    Box box;
    box.lower = lower;
    box.upper = lower + size;
    return box;
}

inline Box boxBetween(double lower, double upper) {
    return boxAt(Vec3d::Constant(lower), Vec3d::Constant(upper - lower));
}

inline std::vector<NeighbourPair> list(std::span<const NeighbourPair> pairs) {
    return {pairs.begin(), pairs.end()};
}

/// What every finder must find.
inline std::vector<NeighbourPair> bruteForce(std::span<const Box> boxes, const InteractionTable& table) {
    std::vector<NeighbourPair> pairs;
    const auto n = static_cast<std::uint32_t>(boxes.size());
    for (std::uint32_t a = 0; a < n; ++a) {
        if (boxes[a].empty()) continue;
        for (std::uint32_t b = a + 1; b < n; ++b)
            if (table.relevant(a, b) && !boxes[b].empty() && boxes[a].overlaps(boxes[b])) pairs.push_back({a, b});
    }
    return pairs;
}

using Random = std::mt19937_64;

inline double uniform(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
inline Vec3d uniform3(Random& random, double low, double high) {
    const double x = uniform(random, low, high), y = uniform(random, low, high);
    return {x, y, uniform(random, low, high)};
}

/// A kind of scene: a box, for item i of n.
using MakeBox = std::function<Box(Random&, std::size_t i, std::size_t n)>;

struct Kind {
    std::string name;
    MakeBox make;
};

inline double sideFor(std::size_t n) {
    return 2 * std::cbrt(static_cast<double>(n) / 4);
}

/// Kinds of scenes, from friendly to hostile.
inline std::vector<Kind> kinds() {
    const double infinity = std::numeric_limits<double>::infinity();
    return {
        {"evenly spread",
         [](Random& random, std::size_t, std::size_t n) {
             return boxAt(uniform3(random, 0, sideFor(n)), uniform3(random, 0.5, 1.5));
         }},
        {"far from the origin",
         [](Random& random, std::size_t, std::size_t n) {
             return boxAt(Vec3d(4e6, -7e5, 3e6) + uniform3(random, 0, sideFor(n)), uniform3(random, 0.5, 1.5));
         }},
        {"on a lattice, touching",
         [](Random& random, std::size_t, std::size_t n) {
             const auto side = static_cast<int>(std::cbrt(static_cast<double>(n))) + 2;
             const auto at = [&] { return 0.1 * std::uniform_int_distribution<int>(0, side)(random); };
             const double x = at(), y = at(), z = at();
             Box box;
             box.lower = {x, y, z};
             box.upper = {x + 0.1, y + 0.1, z + 0.1};
             return box;
         }},
        {"on a plane",
         [](Random& random, std::size_t, std::size_t n) {
             const double side = std::sqrt(static_cast<double>(n));
             return boxAt({uniform(random, 0, side), 3, uniform(random, 0, side)}, {1, 0, uniform(random, 0, 1)});
         }},
        {"clusters",
         [](Random& random, std::size_t i, std::size_t n) {
             const double far = static_cast<double>(i * 7 / n) * 1000;
             return boxAt(Vec3d(far, -far, 0) + uniform3(random, 0, 0.3 * sideFor(n)), uniform3(random, 0.01, 0.2));
         }},
        {"one cluster and one far away",
         [](Random& random, std::size_t i, std::size_t n) {
             if (i == 0) return boxAt({1e12, 1e12, -1e12}, {1, 1, 1});
             return boxAt(uniform3(random, 0, sideFor(n)), uniform3(random, 0, 1));
         }},
        {"sizes over six decades",
         [](Random& random, std::size_t, std::size_t n) {
             const double size = std::pow(10, uniform(random, -5, 1));
             return boxAt(uniform3(random, 0, 2 * sideFor(n)), uniform3(random, 0.1 * size, size));
         }},
        {"points in one place",
         [](Random& random, std::size_t, std::size_t) {
             return random() % 4 == 0 ? boxAt({1, 1, 1}, {0, 0, 0}) : boxAt(uniform3(random, 0, 100), {0, 0, 0});
         }},
        {"empty, infinite and not numbers among others",
         [infinity](Random& random, std::size_t, std::size_t n) {
             Box box = boxAt(uniform3(random, 0, sideFor(n)), uniform3(random, 0.5, 1.5));
             const auto axis = static_cast<int>(random() % 3);
             switch (random() % 60) {
                 case 0:
                     return Box{};
                 case 1:
                     box.lower[axis] = std::numeric_limits<double>::quiet_NaN();
                     break;
                 case 2:
                     box.upper[axis] = std::numeric_limits<double>::quiet_NaN();
                     break;
                 case 3:
                     box.upper[axis] = infinity;
                     break;
                 case 4:
                     box.lower[axis] = -infinity;
                     break;
                 case 5:
                     box.lower[axis] = box.upper[axis] = infinity;
                     break;
                 case 6:
                     box.upper[axis] = 1e300;
                     break;
                 case 7:
                     box.lower[axis] = box.upper[axis] + 1;
                     break;
                 default:
                     break;
             }
             return box;
         }},
    };
}

/// Everybody of interest to everybody; or four groups: 0 meets all but 3, 1 meets only 0, 2 itself too, 3 nobody at
/// all.
inline InteractionTable interests(Random& random, std::size_t n, bool everybody) {
    if (everybody) return InteractionTable::everybody(n);
    InteractionTable table;
    const std::uint64_t active = random() % 2 == 0 ? 12 : 2;  // few or many active ones
    for (std::size_t i = 0; i < n; ++i)
        table.groupOf.push_back(random() % active == 0 ? 0 : static_cast<std::uint32_t>(1 + random() % 3));
    if (active == 2)
        for (std::uint32_t& group : table.groupOf)
            if (group == 1) group = 2;
    table.active = {true, false, active == 2, false};
    table.interacts = {true,  true,  true,        false,  //
                       true,  false, false,       false,  //
                       true,  false, active == 2, false,  //
                       false, false, false,       false};
    return table;
}

}  // namespace tessera
