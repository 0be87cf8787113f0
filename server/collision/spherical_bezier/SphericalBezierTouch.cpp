#include "server/collision/spherical_bezier/SphericalBezierTouch.h"

#include <algorithm>
#include <cmath>

namespace tessera {

namespace {

/// What rounding may do to places and lengths, of the sum of the lengths involved.
constexpr double kSlack = 1e-9;

/// The scale of a similarity; 0 of other maps.
double scaleOfSimilarity(const Affine3d& map) {
    const Mat3d gram = map.linear().transpose() * map.linear();
    const double squared = gram.trace() / 3;
    if (!(squared > 0 && std::isfinite(squared))) return 0;
    return (gram - squared * Mat3d::Identity()).cwiseAbs().maxCoeff() <= 1e-12 * squared ? std::sqrt(squared) : 0;
}

/// Whether a ball about `centre`, from the body's own centre, may meet what the body has in a patch.
bool mayMeet(const SphericalTriangle& domain, const PatchBound& patch, const Vec3d& centre, double radius) {
    const double between = radius + patch.ballRadius;
    if ((centre - patch.ballCentre).squaredNorm() > between * between) return false;
    const double distance = centre.norm();
    // The centre is in the ball: no direction is ruled out.
    if (distance <= radius * (1 + kSlack)) return true;
    const Vec3d u = centre / distance;
    const double sine = radius / distance, cosine = std::sqrt(std::max(0.0, 1 - sine * sine));
    // The angle from the patch's axis is at most its own half-angle and the ball's.
    const double height = domain.height(), rim = std::sqrt(std::max(0.0, 1 - height * height));
    if (u.dot(domain.axis()) < height * cosine - rim * sine - kSlack) return false;
    // p about u: u'Mu + 2 (Mu)·d + d'Md for u + d on the sphere, |d| at most the chord of the ball's angle.
    const double chord = std::sqrt(std::max(0.0, 2 - 2 * cosine));
    const Vec3d product = patch.form * u;
    const double local = u.dot(product) + 2 * product.norm() * chord + patch.formNorm * chord * chord;
    return distance - radius <= std::min(patch.upper, local) + kSlack * (patch.upper + distance);
}

}  // namespace

bool mayMeetBall(const SphericalBezierBound& body, const Vec3d& centre, double radius, QueryWork& work) {
    const std::vector<SphericalTriangle>& domains = body.layout().triangles();
    const Vec3d from = centre - body.centre();
    const double grown = radius * (1 + kSlack) + kSlack * from.norm() + 1e-15 * (centre.norm() + body.centre().norm());
    for (std::size_t p = 0; p < domains.size(); ++p) {
        const PatchBound& bound = body.patches()[p];
        if (bound.faces.empty()) continue;
        ++work.boxTests;
        if (mayMeet(domains[p], bound, from, grown)) return true;
    }
    return false;
}

std::vector<PatchPair> patchesThatMayMeet(const SphericalBezierBound& a, const SphericalBezierBound& b,
                                          const Affine3d& a_T_b, QueryWork& work) {
    std::vector<PatchPair> left;
    const std::vector<SphericalTriangle>&domainsA = a.layout().triangles(), &domainsB = b.layout().triangles();
    const double scale = scaleOfSimilarity(a_T_b);
    const bool similar = scale > 0;
    // Between the two centres' frames.
    const Mat3d linear = a_T_b.linear();
    const Mat3d back = similar ? Mat3d(linear.transpose() / (scale * scale)) : Mat3d::Identity();
    const Vec3d offset = a_T_b * b.centre() - a.centre();
    const double rounding =
        1e-15 * ((linear.cwiseAbs() * b.centre().cwiseAbs()).norm() + a_T_b.translation().norm() + a.centre().norm());
    struct Ball {
        Vec3d centre;
        double radius;
    };
    std::vector<Ball> ballsB(domainsB.size());
    for (std::size_t q = 0; q < domainsB.size(); ++q) {
        const PatchBound& bound = b.patches()[q];
        ballsB[q].centre = linear * bound.ballCentre + offset;
        ballsB[q].radius =
            scale * bound.ballRadius + kSlack * (ballsB[q].centre.norm() + scale * bound.ballCentre.norm()) + rounding;
    }
    for (std::uint32_t p = 0; p < domainsA.size(); ++p) {
        const PatchBound& boundA = a.patches()[p];
        if (boundA.faces.empty()) continue;
        const Vec3d centre = back * (boundA.ballCentre - offset);
        const double radius =
            similar ? (boundA.ballRadius + rounding + kSlack * (boundA.ballCentre.norm() + offset.norm())) / scale : 0;
        for (std::uint32_t q = 0; q < domainsB.size(); ++q) {
            const PatchBound& boundB = b.patches()[q];
            if (boundB.faces.empty()) continue;
            ++work.boxTests;
            if (similar && !(mayMeet(domainsB[q], boundB, centre, radius) &&
                             mayMeet(domainsA[p], boundA, ballsB[q].centre, ballsB[q].radius)))
                continue;
            left.push_back({p, q});
        }
    }
    return left;
}

}  // namespace tessera
