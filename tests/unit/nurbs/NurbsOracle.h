/// Surfaces by the Cox-de Boor recursion in long double, and random surfaces: what the tests of this folder share.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>

#include "common/freeform/nurbs/NurbsSurface.h"

namespace tessera {

inline std::uint64_t firstSeed() {
    const char* const given = std::getenv("TESSERA_SEED");
    return given ? std::strtoull(given, nullptr, 10) : 1;
}
/// Of the program that repeats a failing seed; one seed then, instead of many.
inline std::uint64_t seedCount(std::uint64_t usual) {
    return std::getenv("TESSERA_SEED") ? 1 : usual;
}

/// The basis function i of degree p, by its definition: 0 / 0 is 0, spans are open above but for the last one.
inline long double coxDeBoor(const KnotVector& k, int i, int p, long double t) {
    if (p == 0) {
        const long double low = k.at(i), high = k.at(i + 1), end = k.domain().upper;
        return (t >= low && t < high) || (t == end && high == end && low < high) ? 1 : 0;
    }
    long double sum = 0;
    const long double rise = static_cast<long double>(k.at(i + p)) - k.at(i),
                      fall = static_cast<long double>(k.at(i + p + 1)) - k.at(i + 1);
    if (rise > 0) sum += (t - k.at(i)) / rise * coxDeBoor(k, i, p - 1, t);
    if (fall > 0) sum += (k.at(i + p + 1) - t) / fall * coxDeBoor(k, i + 1, p - 1, t);
    return sum;
}
inline Vec3d byCoxDeBoor(const NurbsDefinition& d, double u, double v) {
    using Wide = Eigen::Matrix<long double, 4, 1>;
    Wide sum = Wide::Zero();
    for (int j = 0; j < d.v.count(); ++j) {
        const long double alongV = coxDeBoor(d.v, j, d.v.degree, v);
        if (alongV == 0) continue;
        for (int i = 0; i < d.u.count(); ++i)
            sum += alongV * coxDeBoor(d.u, i, d.u.degree, u) *
                   d.points[static_cast<std::size_t>(j * d.u.count() + i)].cast<long double>();
    }
    return (sum.head<3>() / sum.w()).cast<double>();
}

/// Knots with repeats of every multiplicity that is allowed, clamped or not; sometimes far from 0, sometimes short.
inline KnotVector someKnots(std::mt19937_64& random, int highestDegree) {
    std::uniform_real_distribution<double> step(0.01, 1);
    KnotVector k{.degree = std::uniform_int_distribution<int>(1, highestDegree)(random), .knots = {}};
    const int order = k.degree + 1, inside = std::uniform_int_distribution<int>(0, 5)(random);
    const double scale = random() % 3 == 0 ? 1e-3 : 1;
    double at = random() % 3 == 0 ? 100 : 0;
    const auto put = [&](int times) {
        for (int i = 0; i < times; ++i) k.knots.push_back(at);
        at += scale * step(random);
    };
    const bool clamped = random() % 2 == 0;
    const auto someTimes = [&] { return random() % 2 == 0 ? 1 : std::uniform_int_distribution<int>(1, order)(random); };
    if (clamped) put(order);
    while (!clamped && static_cast<int>(k.knots.size()) < order)
        put(std::min(someTimes(), order - static_cast<int>(k.knots.size())));
    for (int i = 0; i < inside; ++i) put(someTimes());
    if (clamped) put(order);
    const int before = static_cast<int>(k.knots.size());
    while (!clamped && static_cast<int>(k.knots.size()) < before + order)
        put(std::min(someTimes(), before + order - static_cast<int>(k.knots.size())));
    return k;
}
inline NurbsDefinition someSurface(std::mt19937_64& random, int highestDegree = 5) {
    std::uniform_real_distribution<double> some(-1, 1), weight(0.2, 3);
    NurbsDefinition d{.u = someKnots(random, highestDegree),
                      .v = someKnots(random, highestDegree),
                      .points = {},
                      .rangeU = {},
                      .rangeV = {},
                      .loops = {}};
    const bool rational = random() % 2 == 0;
    for (int i = 0; i < d.u.count() * d.v.count(); ++i) {
        const double w = rational ? weight(random) : 1;
        d.points.emplace_back(w * some(random), w * some(random), w * some(random), w);
    }
    return d;
}
inline double between(std::mt19937_64& random, const ParameterRange& r) {
    return std::uniform_real_distribution<double>(r.lower, r.upper)(random);
}
/// Now and then a knot or an end.
inline double someParameter(std::mt19937_64& random, const KnotVector& k) {
    const ParameterRange domain = k.domain();
    if (random() % 4 != 0) return between(random, domain);
    return std::min(std::max(k.knots[random() % k.knots.size()], domain.lower), domain.upper);
}

}  // namespace tessera
