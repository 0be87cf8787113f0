/// Rooms by chance: floors, walls, posts, steps and lips, all one mesh; terrains.
#pragma once

#include <cmath>
#include <cstdlib>
#include <utility>

#include "tests/property/Seeds.h"
#include "tests/unit/motion/Bodies.h"

namespace tessera {

/// TESSERA_HUNT: how many seeds.
inline std::uint64_t seeds(std::uint64_t few) {
    const char* many = std::getenv("TESSERA_HUNT");
    return many ? std::strtoull(many, nullptr, 10) : few;
}

class Chance {
public:
    explicit Chance(Random& random) : random_(random) {}
    double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    /// Evenly in the logarithm.
    double of(double low, double high) { return std::exp(in(std::log(low), std::log(high))); }
    bool oneIn(std::size_t n) { return tessera::oneIn(random_, n); }
    std::size_t below(std::size_t n) { return tessera::below(random_, n); }
    Vec3d vector() { return {in(-1, 1), in(-1, 1), in(-1, 1)}; }
    Quatd turn(double most) { return Quatd(Eigen::AngleAxisd(in(-most, most), vector().normalized())); }
    Quatd upright(double most) { return Quatd(Eigen::AngleAxisd(in(-most, most), Vec3d::UnitY())); }

private:
    Random& random_;
};

/// A sheet of n by m tiles over corner + [0, 1] u + [0, 1] v, raised by some height.
template <typename Height>
void addSheet(bodies::Body& body, const Vec3d& corner, const Vec3d& u, const Vec3d& v, int n, int m, Height&& height) {
    const auto first = static_cast<std::uint32_t>(body.positions.size() / 3);
    const Vec3d up = v.cross(u).normalized();
    for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= m; ++j) body.vertex(corner + i * u / n + j * v / m + height(i, j) * up);
    const auto at = [&](int i, int j) { return first + static_cast<std::uint32_t>(i * (m + 1) + j); };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < m; ++j) {
            body.face(at(i, j), at(i, j + 1), at(i + 1, j + 1));
            body.face(at(i, j), at(i + 1, j + 1), at(i + 1, j));
        }
}

inline bodies::Body terrain(Chance& chance) {
    bodies::Body out;
    const int n = 2 + static_cast<int>(chance.below(12));
    const double steep = chance.oneIn(3) ? chance.of(1e-6, 1e-2) : chance.in(0, 0.3);
    addSheet(out, Vec3d(-4, 0, -4), Vec3d(8, 0, 0), Vec3d(0, 0, 8), n, n,
             [&](int, int) { return steep * chance.in(0, 1); });
    return out;
}

/// A floor, walls around it and in it, posts, steps and lips, all one mesh.
inline bodies::Body hall(Chance& chance) {
    bodies::Body out;
    const int n = 1 + static_cast<int>(chance.below(8));
    const auto flat = [](int, int) { return 0.0; };
    addSheet(out, Vec3d(-4, 0, -4), Vec3d(8, 0, 0), Vec3d(0, 0, 8), n, n, flat);
    addSheet(out, Vec3d(-4, 0, -4), Vec3d(8, 0, 0), Vec3d(0, 3, 0), n, 1, flat);
    addSheet(out, Vec3d(-4, 0, 4), Vec3d(8, 0, 0), Vec3d(0, 3, 0), 1, n, flat);
    addSheet(out, Vec3d(-4, 0, -4), Vec3d(0, 0, 8), Vec3d(0, 3, 0), 1, 1, flat);
    addSheet(out, Vec3d(4, 0, -4), Vec3d(0, 0, 8), Vec3d(0, 3, 0), n, n, flat);
    for (std::size_t i = chance.below(4); i > 0; --i) {
        const double angle = chance.oneIn(2) ? 0 : chance.in(0, 7);
        const Vec3d along(std::cos(angle), 0, std::sin(angle));
        const Vec3d at(chance.in(-3, 3), 0, chance.in(-3, 3));
        addSheet(out, at, chance.in(0.2, 3) * along, Vec3d(0, chance.of(0.05, 3), 0),
                 1 + static_cast<int>(chance.below(3)), 1, flat);
    }
    for (std::size_t i = chance.below(4); i > 0; --i) {
        const double high = chance.of(1e-3, 1), wide = chance.of(0.01, 1);
        out = out.with(bodies::box(Vec3d(wide, high, chance.of(0.01, 2)))
                           .moved(Vec3d(chance.in(-3, 3), 0.5 * high, chance.in(-3, 3))));
    }
    return out;
}

}  // namespace tessera
