#include "common/math/Decompositions.h"

#include <Eigen/SVD>
#include <cmath>

namespace tessera {

SingularValues singularValuesOf(const Mat3d& matrix) {
    const Eigen::JacobiSVD<Mat3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
    return {svd.matrixU(), svd.matrixV(), svd.singularValues()};
}

SingularStretch singularStretchOf(const Mat3d& matrix) {
    const Eigen::JacobiSVD<Mat3d> svd(matrix);
    return {svd.singularValues()[0], svd.singularValues()[2]};
}

double stretchOf(const Mat3d& matrix) {
    const Mat3d square = matrix.transpose() * matrix;
    return std::sqrt(square.cwiseAbs().rowwise().sum().maxCoeff()) * (1 + 1e-12);
}

Mat3d rotationOf(const Affine3d& transform) {
    return transform.rotation();
}

Quatd turnBetween(const Vec3d& from, const Vec3d& to) {
    return Quatd::FromTwoVectors(from, to);
}

}  // namespace tessera
