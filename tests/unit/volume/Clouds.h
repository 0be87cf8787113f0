/// Points and maps to bound: what is round, flat, thin, one point, far away; and the truth about them.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "server/collision/volume/KDop.h"

namespace tessera::clouds {

using Random = std::mt19937_64;
using Cloud = std::vector<Vec3d>;

inline Vec3d normal(Random& random) {
    std::normal_distribution<double> n;
    return {n(random), n(random), n(random)};
}
inline double uniform(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}
inline Quatd turn(Random& random) {
    const Vec3d v = normal(random);
    return Quatd(std::normal_distribution<double>()(random), v.x(), v.y(), v.z()).normalized();
}

/// Of no special shape: a normal cloud, stretched and turned.
inline Cloud anisotropic(Random& random, int count) {
    const Vec3d scale(uniform(random, 0.2, 1), uniform(random, 0.2, 1), uniform(random, 0.2, 1));
    const Mat3d frame = turn(random).toRotationMatrix() * scale.asDiagonal();
    Cloud cloud;
    for (int i = 0; i < count; ++i) cloud.emplace_back(frame * normal(random));
    return cloud;
}

inline constexpr int kKinds = 8;
inline const char* const kKindNames[kKinds] = {
    "round", "flat", "flat on an axis plane", "needle", "needle on x", "one point", "far away", "tiny"};

inline Cloud make(int kind, Random& random) {
    Cloud cloud = anisotropic(random, 1 + static_cast<int>(random() % 30));
    const Vec3d n = normal(random).normalized();
    const Vec3d away = std::pow(10.0, uniform(random, 1, 6)) * normal(random);
    if (kind == 5) cloud.resize(1);
    for (Vec3d& p : cloud) {
        if (kind == 1) p -= (p.dot(n)) * n;
        if (kind == 2) p.y() = 0;
        if (kind == 3) p = p.dot(n) * n + 1e-9 * p;
        if (kind == 4) p = Vec3d(p.x(), 0, 0);
        if (kind == 5 || kind == 6) p += away;
        if (kind == 7) p *= 1e-30;
    }
    return cloud;
}

inline constexpr int kMaps = 7;
inline const char* const kMapNames[kMaps] = {"rotation",   "similarity", "uneven scale", "mirror",
                                             "flattening", "to a point", "axes swapped"};

inline Affine3d map(int kind, Random& random) {
    Affine3d m = Affine3d::Identity();
    const Mat3d r = turn(random).toRotationMatrix(), s = turn(random).toRotationMatrix();
    const double size = std::pow(10.0, uniform(random, -3, 3));
    m.linear() = r;
    if (kind == 1) m.linear() *= size;
    if (kind == 2 || kind == 3 || kind == 4) {
        const Vec3d scale(size, uniform(random, 0.1, 3),
                          kind == 4 ? 0 : (kind == 3 ? -1 : 1) * uniform(random, 0.01, 1));
        m.linear() = r * scale.asDiagonal() * s;
    }
    if (kind == 5) m.linear().setZero();
    if (kind == 6) {
        m.linear().setZero();
        const int first = static_cast<int>(random() % 3);
        for (int i = 0; i < 3; ++i) m.linear()(i, (first + i) % 3) = random() % 2 ? 1 : -1;
    }
    m.translation() = (random() % 4 ? 1.0 : 1e5) * normal(random);
    return m;
}

/// d · (M x + T) with 11 more bits than double has.
inline long double along(const Vec3d& d, const Affine3d& m, const Vec3d& x) {
    long double sum = 0;
    for (int i = 0; i < 3; ++i) {
        long double y = m.translation()[i];
        for (int j = 0; j < 3; ++j) y += static_cast<long double>(m.linear()(i, j)) * x[j];
        sum += d[i] * y;
    }
    return sum;
}

inline long double dot(const Vec3d& a, const Vec3d& b) {
    return static_cast<long double>(a.x()) * b.x() + static_cast<long double>(a.y()) * b.y() +
           static_cast<long double>(a.z()) * b.z();
}

inline double radius(const Cloud& cloud, const Vec3d& center) {
    double most = 0;
    for (const Vec3d& p : cloud) most = std::max(most, (p - center).norm());
    return most;
}

inline Vec3d mean(const Cloud& cloud) {
    Vec3d sum = Vec3d::Zero();
    for (const Vec3d& p : cloud) sum += p;
    return sum / static_cast<double>(cloud.size());
}

inline const DirectionSet kSets[] = {DirectionSet::k6, DirectionSet::k14, DirectionSet::k18, DirectionSet::k26};

}  // namespace tessera::clouds
