/// OpenSubdiv's own answers for a control mesh: limit surfaces of Bfr, and limits at the vertices of uniform refinement
/// of Far.
///
/// Both in double. Bfr approximates what lies within 2^-level of an irregular vertex by a Gregory patch; Far's limits
/// have no such limit and exist where faces are no manifold, but only at dyadic parameters.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "common/freeform/subdivision/ControlMesh.h"

namespace tessera::test {

/// Whether this program was built with OpenSubdiv (`deploy/set-up` unpacks it).
[[nodiscard]] bool hasOpenSubdiv();

struct OraclePoint {
    Vec3d point, du, dv;
};

class SubdivisionOracle {
public:
    /// Levels of 2 to 15 until which Bfr isolates irregular vertices. The mesh has to be one that OpenSubdiv takes.
    SubdivisionOracle(const ControlMesh& mesh, int level);
    ~SubdivisionOracle();
    [[nodiscard]] std::size_t ptexFaceCount() const;
    /// By the parameters of ptex faces. Nothing where Bfr has no surface.
    [[nodiscard]] std::optional<OraclePoint> bfr(std::size_t ptex, double u, double v) const;

    struct FarVertex {
        std::size_t ptex = 0;
        double u = 0, v = 0;
        Vec3d point;
        bool isInterior = false;  ///< not on the edge of its ptex face
    };
    /// The limits of Far's vertices after `level` uniform refinements, by every ptex face that has them; quadrilaterals
    /// only.
    [[nodiscard]] std::vector<FarVertex> far(int level) const;

private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

}  // namespace tessera::test
