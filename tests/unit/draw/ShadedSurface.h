/// What a surface reflects, by glTF 2.0's own formulas, in double.
#pragma once

#include <cmath>

#include "common/math/Types.h"

namespace tessera {

/// A surface of glTF's metallic-roughness model under one light, as appendix B.3 of its specification has it.
struct Shaded {
    Vec3d base = Vec3d::Constant(0.5);
    double metallic = 0, roughness = 1;
    double clearcoat = 0, clearcoatRoughness = 0;

    /// Unit vectors. Of a light that gives 1 to a white surface straight below it.
    [[nodiscard]] Vec3d reflected(const Vec3d& n, const Vec3d& l, const Vec3d& v) const {
        const double nl = n.dot(l), nv = n.dot(v);
        if (nl <= 0) return Vec3d::Zero();
        const Vec3d h = (l + v).normalized();
        const Vec3d f0 = (1 - metallic) * Vec3d::Constant(0.04) + metallic * base;
        const Vec3d fresnel = schlick(f0, v.dot(h));
        const Vec3d diffuse = ((Vec3d::Ones() - fresnel).array() * ((1 - metallic) * base).array()).matrix();
        Vec3d c = nl * (diffuse + fresnel * lobe(roughness, n.dot(h), nl, nv));
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
