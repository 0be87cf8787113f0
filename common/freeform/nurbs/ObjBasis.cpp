#include "common/freeform/nurbs/ObjBasis.h"

#include <algorithm>
#include <string>

namespace tessera {
namespace {

/// Row i, column j: the share of the coefficient of t^j in Bézier point i, C(i, j) / C(n, j) (Farin, Curves and
/// Surfaces for CAGD).
std::vector<double> bezierOfPowers(int degree) {
    const auto order = static_cast<std::size_t>(degree) + 1;
    std::vector<double> rows(order * order, 0.0);
    for (std::size_t i = 0; i < order; ++i) {
        double share = 1;
        for (std::size_t j = 0; j <= i; ++j) {
            rows[i * order + j] = share;
            if (j < i) share *= static_cast<double>(i - j) / static_cast<double>(order - 1 - j);
        }
    }
    return rows;
}

}  // namespace

Expected<ObjBasis> ObjBasis::make(const ObjAxis& axis, std::string_view name) {
    const auto wrong = [&](const std::string& what) {
        return fail(ErrorCode::kBadInput, "parameter " + std::string(name) + ": " + what);
    };
    const int n = axis.degree;
    if (n < 1 || n > kMaxNurbsDegree)
        return wrong("degree " + std::to_string(n) + " is not in 1 to " + std::to_string(kMaxNurbsDegree));
    if (axis.parameters.size() < 2) return wrong("there is no parm, or one with fewer than 2 numbers");
    const auto order = static_cast<std::size_t>(n) + 1;
    ObjBasis basis;
    basis.knots_.degree = n;
    if (axis.type == ObjType::kBspline) {
        if (axis.parameters.size() < 2 * order)
            return wrong(std::to_string(axis.parameters.size()) + " knots are too few for degree " + std::to_string(n));
        basis.knots_.knots = axis.parameters;
        basis.fileCount_ = axis.parameters.size() - order;
        return basis;
    }
    basis.segments_ = axis.parameters.size() - 1;
    if (axis.type == ObjType::kBezier) {
        basis.step_ = order - 1;
    } else if (axis.type == ObjType::kCardinal) {
        if (n != 3) return wrong("cardinal curves are of degree 3, not " + std::to_string(n));
        // Through the two middle points, along the chords of their neighbours.
        constexpr double kSixth = 1.0 / 6;
        basis.matrix_ = {0, 1, 0, 0, -kSixth, 1, kSixth, 0, 0, kSixth, 1, -kSixth, 0, 0, 1, 0};
    } else {
        if (axis.step < 1) return wrong("bmatrix needs a step of at least 1");
        if (axis.matrix.size() != order * order)
            return wrong("bmatrix of degree " + std::to_string(n) + " needs a bmat of " +
                         std::to_string(order * order) + " numbers");
        basis.step_ = static_cast<std::size_t>(axis.step);
        const std::vector<double> powers = bezierOfPowers(n);
        basis.matrix_.assign(order * order, 0.0);
        for (std::size_t i = 0; i < order; ++i)
            for (std::size_t k = 0; k < order; ++k)
                for (std::size_t j = 0; j < order; ++j)
                    basis.matrix_[i * order + k] += powers[i * order + j] * axis.matrix[k * order + j];
    }
    basis.fileCount_ = (basis.segments_ - 1) * basis.step_ + order;
    // Segments of a basis matrix need not meet: each has all of its points then.
    basis.rowsPerSegment_ = axis.type == ObjType::kBmatrix ? order : order - 1;
    for (std::size_t k = 0; k < axis.parameters.size(); ++k)
        basis.knots_.knots.insert(basis.knots_.knots.end(),
                                  k == 0 || k == basis.segments_ ? order : basis.rowsPerSegment_, axis.parameters[k]);
    return basis;
}

}  // namespace tessera
