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

std::vector<PatchPair> patchesThatMayMeet(const SphericalBezierBound& a, const SphericalBezierBound& b, const Affine3d& a_T_b,
                                          QueryWork& work) {
    std::vector<PatchPair> left;
    const std::vector<SphericalTriangle>&domainsA = a.layout().triangles(), &domainsB = b.layout().triangles();
    const double scale = scaleOfSimilarity(a_T_b);
    const bool similar = scale > 0;
    // Between the two centres' frames.
    const Mat3d linear = a_T_b.linear();
    const Mat3d back = similar ? Mat3d(linear.transpose() / (scale * scale)) : Mat3d::Identity();
    const Vec3d offset = a_T_b * b.centre() - a.centre();
    const double rounding = 1e-15 * ((linear.cwiseAbs() * b.centre().cwiseAbs()).norm() + a_T_b.translation().norm() + a.centre().norm());
    struct Ball {
        Vec3d centre;
        double radius;
    };
    std::vector<Ball> ballsB(domainsB.size());
    for (std::size_t q = 0; q < domainsB.size(); ++q) {
        const PatchBound& bound = b.patches()[q];
        ballsB[q].centre = linear * bound.ballCentre + offset;
        ballsB[q].radius = scale * bound.ballRadius + kSlack * (ballsB[q].centre.norm() + scale * bound.ballCentre.norm()) + rounding;
    }
    for (std::uint32_t p = 0; p < domainsA.size(); ++p) {
        const PatchBound& boundA = a.patches()[p];
        if (boundA.faces.empty()) continue;
        const Vec3d centre = back * (boundA.ballCentre - offset);
        const double radius = similar ? (boundA.ballRadius + rounding + kSlack * (boundA.ballCentre.norm() + offset.norm())) / scale : 0;
        for (std::uint32_t q = 0; q < domainsB.size(); ++q) {
            const PatchBound& boundB = b.patches()[q];
            if (boundB.faces.empty()) continue;
            ++work.boxTests;
            if (similar && !(mayMeet(domainsB[q], boundB, centre, radius) && mayMeet(domainsA[p], boundA, ballsB[q].centre, ballsB[q].radius)))
                continue;
            left.push_back({p, q});
        }
    }
    return left;
}

namespace {

struct FaceBox {
    Vec3d lower, upper;
    std::uint32_t face;
};

void sortUnique(std::vector<std::uint32_t>& v) {
    std::sort(v.begin(), v.end());
    v.erase(std::unique(v.begin(), v.end()), v.end());
}

/// Of these faces of a mesh, mapped, those whose boxes meet `region`.
std::vector<FaceBox> boxesOf(const TriangleMesh& mesh, const std::vector<std::uint32_t>& faces, const Affine3d* map, const Box& region) {
    std::vector<FaceBox> out;
    for (const std::uint32_t face : faces) {
        Triangle t = mesh.triangle(face);
        // As the predicate maps them: boxes of the very numbers that it looks at need no slack.
        if (map != nullptr) t = transformed(*map, t);
        const Vec3d lower = t[0].cwiseMin(t[1]).cwiseMin(t[2]), upper = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
        if ((lower.array() > region.upper.array()).any() || (upper.array() < region.lower.array()).any()) continue;
        out.push_back({lower, upper, face});
    }
    std::sort(out.begin(), out.end(), [](const FaceBox& x, const FaceBox& y) {
        return x.lower.x() != y.lower.x() ? x.lower.x() < y.lower.x() : x.face < y.face;
    });
    return out;
}

Box boxAround(const std::vector<FaceBox>& boxes) {
    Box box;
    for (const FaceBox& b : boxes) {
        box.extend(b.lower);
        box.extend(b.upper);
    }
    return box;
}

}  // namespace

TouchedPair firstTouching(const SphericalBezierBound& a, const SphericalBezierBound& b, const Affine3d& a_T_b, QueryWork& work) {
    const std::vector<PatchPair> left = patchesThatMayMeet(a, b, a_T_b, work);
    if (left.empty()) return {};
    std::vector<std::uint32_t> patchesA, patchesB, facesA, facesB;
    for (const PatchPair& pair : left) {
        patchesA.push_back(pair.a);
        patchesB.push_back(pair.b);
    }
    sortUnique(patchesA);
    sortUnique(patchesB);
    for (const std::uint32_t p : patchesA) facesA.insert(facesA.end(), a.patches()[p].faces.begin(), a.patches()[p].faces.end());
    for (const std::uint32_t q : patchesB) facesB.insert(facesB.end(), b.patches()[q].faces.begin(), b.patches()[q].faces.end());
    sortUnique(facesA);
    sortUnique(facesB);
    const std::vector<FaceBox> ofB = boxesOf(b.mesh(), facesB, &a_T_b, a.mesh().bounds());
    const std::vector<FaceBox> ofA = boxesOf(a.mesh(), facesA, nullptr, boxAround(ofB));
    const auto meet = [&](const FaceBox& x, const FaceBox& y) {
        ++work.boxTests;
        if (x.lower.y() > y.upper.y() || y.lower.y() > x.upper.y() || x.lower.z() > y.upper.z() || y.lower.z() > x.upper.z()) return false;
        ++work.triangleTests;
        return trianglesIntersect(a.mesh().triangle(x.face), transformed(a_T_b, b.mesh().triangle(y.face)));
    };
    // Sorted by where they begin: of two that overlap along x one begins within the other.
    for (std::size_t i = 0, j = 0; i < ofA.size() && j < ofB.size();) {
        if (work.exhausted()) return {Touch::kUnknown, {}};
        if (ofA[i].lower.x() <= ofB[j].lower.x()) {
            for (std::size_t k = j; k < ofB.size() && ofB[k].lower.x() <= ofA[i].upper.x(); ++k)
                if (meet(ofA[i], ofB[k])) return {Touch::kYes, {ofA[i].face, ofB[k].face}};
            ++i;
        } else {
            for (std::size_t k = i; k < ofA.size() && ofA[k].lower.x() <= ofB[j].upper.x(); ++k)
                if (meet(ofA[k], ofB[j])) return {Touch::kYes, {ofA[k].face, ofB[j].face}};
            ++j;
        }
    }
    return {};
}

}  // namespace tessera
