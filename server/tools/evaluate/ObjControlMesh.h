/// Control meshes from Wavefront OBJ, with the tags of OpenSubdiv's shapes.
///
/// `v x y z`, `f i j k …` (from 1, or backwards from -1; `i/t/n` too) and `t NAME ints/floats/strings VALUES…`, whose
/// vertices and faces count from 0: `crease` (pairs of vertices; one sharpness, or one each), `corner`, `hole`,
/// `interpolateboundary` (0 none, 1 edges and corners, 2 edges), `creasemethod` (normal, chaikin), `smoothtriangles`
/// (catmark, smooth). Other statements shape no surface and are passed over; other tags, which OpenSubdiv 3 ignores
/// too, are named in notes. No bytes crash it.
#pragma once

#include <string>
#include <string_view>

#include "common/base/Error.h"
#include "common/freeform/subdivision/ControlMesh.h"

namespace tessera {

struct ObjControlMesh {
    ControlMesh mesh;  ///< of the scheme that was asked for
    std::vector<std::string> notes;
};

/// kBadInput as `file:line: what is wrong`. Whether faces and tags fit together, SubdivisionTopology::build says.
[[nodiscard]] Expected<ObjControlMesh> parseObjControlMesh(std::string_view text, std::string_view file,
                                                           SubdivisionScheme scheme);

/// A file as it is, but for a byte-order mark. kBadInput: a folder, or it cannot be read. kNotFound. kLimit: above 1
/// GiB.
[[nodiscard]] Expected<std::string> readSurfaceText(const std::string& path);

}  // namespace tessera
