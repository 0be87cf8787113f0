#include "server/sim/display/ContactDisplayShapes.h"

#include <cmath>
#include <map>

namespace tessera {
namespace {

/// An octahedron whose faces are cut in four twice, its corners put on the sphere.
MeshData makeBall() {
    std::vector<Vec3d> corners{Vec3d::UnitX(),  Vec3d::UnitY(),  Vec3d::UnitZ(),
                               -Vec3d::UnitX(), -Vec3d::UnitY(), -Vec3d::UnitZ()};
    std::vector<std::array<std::uint32_t, 3>> faces{{0, 1, 2}, {1, 3, 2}, {3, 4, 2}, {4, 0, 2},
                                                    {1, 0, 5}, {3, 1, 5}, {4, 3, 5}, {0, 4, 5}};
    for (int round = 0; round < 2; ++round) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [it, isNew] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(corners.size()));
            if (isNew) corners.push_back((corners[a] + corners[b]).normalized());
            return it->second;
        };
        std::vector<std::array<std::uint32_t, 3>> finer;
        for (const auto& [a, b, c] : faces) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        faces = std::move(finer);
    }
    MeshData mesh;
    for (const Vec3d& corner : corners)
        for (int i = 0; i < 3; ++i) mesh.positions.push_back(static_cast<float>(corner[i]));
    mesh.normals = mesh.positions;
    for (const auto& face : faces) mesh.indices.insert(mesh.indices.end(), face.begin(), face.end());
    return mesh;
}

/// Six corners around the Z axis.
void addRing(MeshData& mesh, double radius, double z) {
    const double half = 0.5, height = std::sqrt(0.75);
    const std::array<std::array<double, 2>, 6> ring{
        {{1, 0}, {half, height}, {-half, height}, {-1, 0}, {-half, -height}, {half, -height}}};
    for (const auto& [x, y] : ring)
        for (const double v : {radius * x, radius * y, z}) mesh.positions.push_back(static_cast<float>(v));
}

/// A thin shaft and a head, six-sided, turned around +Z.
MeshData makeArrow() {
    constexpr double kShaft = 0.014, kHead = 0.05, kNeck = 0.8;
    MeshData mesh;
    addRing(mesh, kShaft, 0);
    addRing(mesh, kShaft, kNeck);
    addRing(mesh, kHead, kNeck);
    mesh.positions.insert(mesh.positions.end(), {0, 0, 0, 0, 0, 1});
    const std::uint32_t foot = 18, tip = 19;
    for (std::uint32_t i = 0; i < 6; ++i) {
        const std::uint32_t j = (i + 1) % 6;
        mesh.indices.insert(mesh.indices.end(), {i, j, 6 + j, i, 6 + j, 6 + i,                 // the shaft
                                                 6 + i, 6 + j, 12 + j, 6 + i, 12 + j, 12 + i,  // under the head
                                                 12 + i, 12 + j, tip, foot, j, i});
    }
    return mesh;
}

/// A six-sided prism; the middles of its ends are corners too.
MeshData makeRod() {
    MeshData mesh;
    addRing(mesh, 1, 0);
    addRing(mesh, 1, 1);
    mesh.positions.insert(mesh.positions.end(), {0, 0, 0, 0, 0, 1});
    const std::uint32_t foot = 12, top = 13;
    for (std::uint32_t i = 0; i < 6; ++i) {
        const std::uint32_t j = (i + 1) % 6;
        mesh.indices.insert(mesh.indices.end(), {i, j, 6 + j, i, 6 + j, 6 + i, 6 + i, 6 + j, top, foot, j, i});
    }
    return mesh;
}

MeshData makeTriangle() {
    MeshData mesh;
    mesh.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    mesh.indices = {0, 1, 2};
    return mesh;
}

}  // namespace

const std::array<MeshArrays, kMarkKinds>& markShapes() {
    static const std::array<MeshArrays, kMarkKinds> shapes{makeBall().toArrays(), makeArrow().toArrays(),
                                                           makeTriangle().toArrays(), makeRod().toArrays(),
                                                           makeRod().toArrays()};
    return shapes;
}

}  // namespace tessera
