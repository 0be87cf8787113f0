/// How the control points of an OBJ file become those of a B-spline, along one parameter: what its types (`cstype`)
/// differ by.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "common/freeform/nurbs/KnotVector.h"

namespace tessera {

enum class ObjType : std::uint8_t { kBspline, kBezier, kBmatrix, kCardinal };

/// What the file says of a parameter.
struct ObjAxis {
    ObjType type = ObjType::kBspline;
    int degree = 0, step = 0;  ///< `step`: of kBmatrix, from one segment's first control point to the next one's
    std::vector<double>
        matrix;  ///< of kBmatrix: row i has the coefficients of 1, t, t² … of the basis function of control point i
    std::vector<double> parameters;
};

/// A B-spline with the same curve: each of its control points is a sum over some of the file's.
class ObjBasis {
public:
    /// Refuses what makes no knots: counts and degrees; knots that descend or repeat too often are left to checkKnots.
    [[nodiscard]] static Expected<ObjBasis> make(const ObjAxis& axis, std::string_view name);

    [[nodiscard]] std::size_t fileCount() const { return fileCount_; }  ///< of control points in the file
    [[nodiscard]] const KnotVector& knots() const { return knots_; }
    /// The curve's control points, of the file's points `stride` apart.
    template <typename Point>
    [[nodiscard]] std::vector<Point> points(const Point* file, std::size_t stride) const {
        std::vector<Point> made;
        made.reserve(static_cast<std::size_t>(knots_.count()));
        const std::size_t order = static_cast<std::size_t>(knots_.degree) + 1;
        for (std::size_t i = 0; i < static_cast<std::size_t>(knots_.count()); ++i) {
            if (matrix_.empty()) {
                made.push_back(file[i * stride]);
                continue;
            }
            // The last row of a segment is the next one's first, where they share it.
            const std::size_t segment = std::min(i / rowsPerSegment_, segments_ - 1),
                              row = i - segment * rowsPerSegment_;
            Point sum = Point::Zero();
            for (std::size_t k = 0; k < order; ++k)
                sum += matrix_[row * order + k] * file[(segment * step_ + k) * stride];
            made.push_back(sum);
        }
        return made;
    }

private:
    KnotVector knots_;
    std::size_t fileCount_ = 0, segments_ = 1, step_ = 1, rowsPerSegment_ = 1;
    std::vector<double>
        matrix_;  ///< Bézier point i of a segment, of its file point k; empty: the file's points are the curve's
};

}  // namespace tessera
