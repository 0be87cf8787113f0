#include "common/geometry/MeshCopies.h"

namespace tessera {

std::array<Vec3d, 8> cornersOfCopy(const MeshCopy& copy, const Box& mesh) {
    const Quatd turn(static_cast<double>(copy.turn[3]), static_cast<double>(copy.turn[0]),
                     static_cast<double>(copy.turn[1]), static_cast<double>(copy.turn[2]));
    const Vec3d place(static_cast<double>(copy.place[0]), static_cast<double>(copy.place[1]),
                      static_cast<double>(copy.place[2]));
    const Vec3d scale(static_cast<double>(copy.width), static_cast<double>(copy.length),
                      static_cast<double>(copy.width));
    std::array<Vec3d, 8> corners;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vec3d corner((i & 4) != 0 ? mesh.upper.x() : mesh.lower.x(),
                           (i & 2) != 0 ? mesh.upper.y() : mesh.lower.y(),
                           (i & 1) != 0 ? mesh.upper.z() : mesh.lower.z());
        corners[i] = place + turn * scale.cwiseProduct(corner);
    }
    return corners;
}

Box boundsOfCopies(const MeshArrays& arrays, std::size_t first, std::size_t end) {
    const Box mesh = boundsOf(arrays.positions.as<float>());
    Box all;
    if (mesh.empty()) return all;
    double greatest = 0;
    for (const MeshCopy& copy : arrays.copies.as<MeshCopy>().subspan(first, end - first))
        for (const Vec3d& corner : cornersOfCopy(copy, mesh)) {
            all.extend(corner);
            greatest = std::max(greatest, corner.cwiseAbs().maxCoeff());
        }
    // A dozen operations, of numbers that are no greater.
    if (!all.empty()) {
        all.lower.array() -= 2e-6 * greatest;
        all.upper.array() += 2e-6 * greatest;
    }
    return all;
}

}  // namespace tessera
