#include "server/sim/tracking/SensorReport.h"

#include <cmath>

namespace tessera {

std::optional<Quatd> orientationOf(const Mat3d& matrix) {
    constexpr double kRounding = 0.02;
    if (!matrix.allFinite()) return std::nullopt;
    const double strays = (matrix.transpose() * matrix - Mat3d::Identity()).cwiseAbs().maxCoeff();
    if (!(strays < kRounding) || matrix.determinant() < 0) return std::nullopt;
    return Quatd(matrix).normalized();
}

}  // namespace tessera
