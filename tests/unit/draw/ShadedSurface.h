/// What a surface reflects, by glTF 2.0's own formulas, in double.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/Types.h"

namespace tessera {

/// Of light from all around, what GGX's facets do (Smith's height-correlated visibility), seen at nv: integrals over
/// half vectors, sampled by their density.
struct FacetShares {
    double lost;    ///< between them, where each reflects all of it
    double turned;  ///< from f0 to f90 by Schlick's term
};
inline FacetShares facetShares(double roughness, double nv) {
    constexpr int kSteps = 96;
    const double alpha2 = std::pow(roughness, 4);
    const auto root = [&](double x) { return std::sqrt(alpha2 + (1 - alpha2) * x * x); };
    const Vec3d v(std::sqrt(std::max(1 - nv * nv, 0.0)), 0, nv);
    double sum = 0, turned = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double share = (i + 0.5) / kSteps, nh = std::sqrt((1 - share) / (1 + (alpha2 - 1) * share));
        for (int k = 0; k < kSteps; ++k) {
            const double phi = std::numbers::pi * (k + 0.5) / kSteps, sine = std::sqrt(1 - nh * nh);
            const Vec3d h(sine * std::cos(phi), sine * std::sin(phi), nh);
            const double vh = v.dot(h), nl = 2 * vh * nh - nv;
            if (!(vh > 0 && nl > 0)) continue;
            const double one = 2 * vh * nl / (nh * (nl * root(nv) + nv * root(nl)));
            sum += one;
            turned += one * std::pow(1 - vh, 5);
        }
    }
    return {1 - sum / (kSteps * kSteps), turned / (kSteps * kSteps)};
}

/// How many times as much leaves the facets after all bounces as after the first (Fdez-Agüera 2019): each leaves the
/// mean of Schlick's term.
inline Vec3d bouncedOn(const Vec3d& f0, double f90, double lost) {
    const Vec3d mean = f0 + (Vec3d::Constant(f90) - f0) / 21;
    return (Vec3d::Ones() - lost * mean).cwiseInverse();
}

/// A surface of glTF's metallic-roughness model under one light, as appendix B of its specification has it, with all
/// bounces between its facets.
struct Shaded {
    Vec3d base = Vec3d::Constant(0.5);
    double metallic = 0, roughness = 1;
    double clearcoat = 0, clearcoatRoughness = 0;

    /// Unit vectors. Of a light that gives 1 to a white surface straight below it.
    [[nodiscard]] Vec3d reflected(const Vec3d& n, const Vec3d& l, const Vec3d& v) const {
        const double nl = n.dot(l), nv = n.dot(v);
        if (nl <= 0) return Vec3d::Zero();
        const Vec3d h = (l + v).normalized();
        // B.2: a mix of a metal and of what is none, whose base gets what its own Fresnel term leaves.
        const Vec3d diffuse = (1 - schlick(Vec3d::Constant(0.04), v.dot(h)).x()) * (1 - metallic) * base;
        const double lost = facetShares(roughness, nv).lost;
        const auto mirrored = [&](const Vec3d& f0) -> Vec3d {
            return schlick(f0, v.dot(h)).cwiseProduct(bouncedOn(f0, 1, lost));
        };
        const Vec3d specular = (1 - metallic) * mirrored(Vec3d::Constant(0.04)) + metallic * mirrored(base);
        Vec3d c = nl * (diffuse + specular * lobe(roughness, n.dot(h), nl, nv));
        if (clearcoat > 0) {
            const double below = 1 - clearcoat * schlick(Vec3d::Constant(0.04), nv).x();
            c = c * below +
                clearcoat * nl * schlick(Vec3d::Constant(0.04), v.dot(h)) * lobe(clearcoatRoughness, n.dot(h), nl, nv);
        }
        return c;
    }

private:
    [[nodiscard]] static Vec3d schlick(const Vec3d& f0, double cosine) {
        return f0 + (Vec3d::Ones() - f0) * std::pow(1 - std::abs(cosine), 5);
    }
    /// pi times distribution and visibility; a light of one has pi in it.
    [[nodiscard]] static double lobe(double roughness, double nh, double nl, double nv) {
        const double alpha2 = std::pow(roughness, 4);
        const double d = alpha2 / std::pow(nh * nh * (alpha2 - 1) + 1, 2);
        const auto root = [&](double x) { return std::sqrt(alpha2 + (1 - alpha2) * x * x); };
        return d * 0.5 / (nl * root(nv) + nv * root(nl));  // Smith, height-correlated
    }
};

}  // namespace tessera
