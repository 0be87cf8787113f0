#include "server/collision/representation/BallPairs.h"

#include <algorithm>
#include <cmath>

#include "common/math/Decompositions.h"

namespace tessera {

double largestStretch(const Mat3d& linear) {
    const Mat3d gram = linear.transpose() * linear;
    const double square = gram.diagonal().maxCoeff();
    if ((gram - square * Mat3d::Identity()).cwiseAbs().maxCoeff() <= 1e-13 * square && square > 1e-200)
        return std::sqrt(square);
    return singularStretchOf(linear).most;
}

BallContact contactOfBalls(const FacePair& faces, const NearestPoints& near, const BallRadii& radii, const Vec3d& along,
                           double rounding) {
    BallContact out;
    out.faces = faces;
    out.normal = near.distance > rounding ? Vec3d((near.onB - near.onA) / near.distance) : along;
    out.depth = radii.sum() - near.distance;
    out.point = 0.5 * (near.onA + radii.a * out.normal + near.onB - radii.b * out.normal);
    return out;
}

Distance distanceOfBalls(const Distance& near, const BallRadii& radii, const DistanceOptions& options) {
    Distance out = near;
    if (!near.complete) {
        out.distance = std::max(0.0, std::min(near.distance - radii.sum(), options.upperBound));
        return out;
    }
    const bool touch = !near.farther && near.distance <= radii.reach();
    if (near.farther || (!touch && !(near.distance - radii.sum() < options.upperBound))) {
        Distance none;
        none.distance = options.upperBound;
        none.farther = true;
        return none;
    }
    const Vec3d n = near.distance > 0 ? Vec3d((near.onB - near.onA) / near.distance) : Vec3d(Vec3d::Zero());
    out.onA += radii.a * n;
    out.onB -= radii.b * n;
    out.distance = touch ? 0 : near.distance - radii.sum();
    if (touch) out.onA = out.onB = 0.5 * (out.onA + out.onB);
    return out;
}

}  // namespace tessera
