/// tessera-collide on smooth surfaces: subdivision surfaces and NURBS of files, against each other, triangles and
/// hulls.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/collision/freeform/FreeformQuery.h"
#include "server/collision/pairwise/CollisionShape.h"
#include "server/tools/CollideCommand.h"

namespace tessera {

/// Of a surface that Bézier patches stand for (kBezier): what answers have to add, and call its faces.
struct BezierFaces {
    double error = 0;                 ///< no point of the surface or of the patches is farther from the other
    std::vector<std::uint32_t> ptex;  ///< of each patch; empty: faces are the shape's own
};

/// A file as its kind. kBadInput, kNotFound, kLimit name the file. `faces`: for kBezier, filled.
[[nodiscard]] Expected<FreeformShape> loadFreeform(const std::string& path, const std::optional<FreeformKind>& kind,
                                                   Representation otherwise, const CollideArguments& arguments,
                                                   BezierFaces* faces = nullptr);

/// The same with triangles of it, for who asks for its depth: as the table of pairs takes it.
[[nodiscard]] Expected<std::shared_ptr<CollisionShape>> loadFreeformShape(const std::string& path,
                                                                          const std::optional<FreeformKind>& kind,
                                                                          Representation otherwise,
                                                                          const CollideArguments& arguments);

/// The answer to one line of the pose file, without its end; `us`: what it took.
[[nodiscard]] std::string freeformAnswer(FreeformPair& pair, const PoseLine& pose, const CollideArguments& arguments,
                                         double& us, const BezierFaces& facesA = {}, const BezierFaces& facesB = {});

}  // namespace tessera
