/// How deep do two solid bodies reach into each other?
///
/// The surfaces of closed bodies cross in closed curves; between them each body has a patch inside the other, and the
/// patches enclose what both share. Each such region has
/// - a direction: that of the vector area of the curves, ½ ∮ x × dx, which is the mean outward normal of A's patch and
/// of
///   B's turned round, whatever the patches look like (Stokes' theorem);
/// - a depth: how far the region extends along that direction: the corners of the patches and the curves count.
///
/// For a face that sinks into a face, or a ball into a wall, this is what everybody calls the depth, to the last
/// digits. It is not the least translation that parts two bodies: where they reach round each other that is longer, and
/// where a region is long in its direction but thin across, shorter. A region without direction, as of a rod through a
/// plate, whose two curves cancel, has no depth. A body wholly inside another crosses nothing and makes no region.
#pragma once

#include <optional>

#include "server/collision/query/ContactQuery.h"
#include "server/collision/query/SurfaceTopology.h"

namespace tessera {

struct Penetration {
    Vec3d normal =
        Vec3d::Zero();  ///< unit length, in A's frame, from A to B: the way to push B; zero where there is none
    std::optional<double> depth;  ///< along it, in A's units
    std::size_t contacts = 0;     ///< how many contacts bound the region
    std::size_t first = 0;        ///< the first of them, as found
};

/// One per region, in the order of their first contacts. `contacts`: all of contactsBetween for the same pose. Nothing
/// for surfaces that are not closed, and for a flattened B. Contacts of triangles that only touch are left out: there
/// is no curve to go by. Takes about a microsecond per contact and a tenth of one per triangle of the patches.
[[nodiscard]] std::vector<Penetration> penetrations(const TriangleMesh& a, const SurfaceTopology& topologyA,
                                                    const TriangleMesh& b, const SurfaceTopology& topologyB,
                                                    const Affine3d& a_T_b, const std::vector<BodyContact>& contacts);

/// The same, and which region each contact bounds.
struct PenetrationRegions {
    static constexpr std::uint32_t kNone = 0xffffffffu;
    std::vector<Penetration> regions;
    std::vector<std::uint32_t> regionOf;  ///< per contact; kNone: it only touches, or nothing is known
};
[[nodiscard]] PenetrationRegions penetrationRegions(const TriangleMesh& a, const SurfaceTopology& topologyA,
                                                    const TriangleMesh& b, const SurfaceTopology& topologyB,
                                                    const Affine3d& a_T_b, const std::vector<BodyContact>& contacts);

}  // namespace tessera
