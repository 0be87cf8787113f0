#include "client/render/cull/OccluderRasteriser.h"

#include <array>
#include <cmath>
#include <map>
#include <random>

#include "client/render/MeshClusters.h"
#include "tests/unit/render/TestScene.h"

namespace tessera {
namespace {

/// A mesh as a renderer in single precision may see it: every place off by up to `noise` metres in each clip
/// coordinate, pixels rounded to a grid of 1/256.
class SloppyRenderer {
public:
    SloppyRenderer(const TileProjection& tile, const MeshData& mesh, const Mat4d& clip_T_mesh, double noise,
                   std::mt19937& random)
        : nearest_(tile.nearMetres()) {
        std::uniform_real_distribution<double> off(-noise, noise);
        std::map<std::array<float, 3>, Vec3d> places;
        std::vector<Vec3d> vertices;
        for (std::size_t i = 0; i < mesh.positions.size(); i += 3) {
            const std::array<float, 3> p{mesh.positions[i], mesh.positions[i + 1], mesh.positions[i + 2]};
            const auto [it, isNew] = places.try_emplace(p);
            if (isNew) {
                const Vec4d c = clip_T_mesh * Vec4d(p[0], p[1], p[2], 1) +
                                Vec4d(off(random), off(random), off(random), off(random)) / 2;
                // Pixels times w, and w: what remains affine where w is not positive.
                Vec3d& v = it->second;
                v.x() = tile.xPx(c.x(), 1) + tile.xPx(0, 1) * (c.w() - 1);
                v.y() = tile.yPx(c.y(), 1) + tile.yPx(0, 1) * (c.w() - 1);
                v.z() = c.w();
                if (c.w() > nearest_) {
                    v.x() = std::round(256 * v.x() / c.w()) / 256 * c.w();
                    v.y() = std::round(256 * v.y() / c.w()) / 256 * c.w();
                }
            }
            vertices.push_back(it->second);
        }
        for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
            Mat3d corners;
            for (int i = 0; i < 3; ++i) corners.col(i) = vertices[mesh.indices[t + static_cast<std::size_t>(i)]];
            // Counter-clockwise on the screen (Olano and Greer 1997).
            if (corners.determinant() > 1e-12) weights_.push_back(corners.inverse());
        }
    }

    /// The greatest inverse depth of a front face at a point of the tile; 0 where there is none.
    [[nodiscard]] double nearestAt(const Vec2d& at) const {
        double nearest = 0;
        for (const Mat3d& weights : weights_) {
            const Vec3d share = weights * at.homogeneous();
            const double depth = share.sum();
            if ((share.array() >= -1e-12).all() && depth * nearest_ <= 1) nearest = std::max(nearest, depth);
        }
        return nearest;
    }

private:
    double nearest_;
    std::vector<Mat3d> weights_;
};

// The promise of the class, sample by sample: where it says that things are hidden, a surface is in front of them, in
// the whole pixel, however the renderer rounds.
TEST(OccluderRasteriser, WhereItMarksAPixelTheWholePixelIsCoveredAtLeastThatNear) {
    std::mt19937 random(9);
    const auto uniform = [&](double from, double to) {
        return std::uniform_real_distribution<double>(from, to)(random);
    };
    const TestCamera camera(53, 37);
    const TileProjection tile(camera.camera(), camera.tile());
    OcclusionBuffer buffer;
    OccluderRasteriser rasteriser;
    const MeshData meshes[] = {makeBox({1, 1, 1}), makeSphere(0.7, 9), makeTorus(0.6, 0.25, 12, 9),
                               makeTorus(0.6, 0.25, 40, 30), makeTube(0.6, 0.4, 1, 10)};
    int marked = 0;
    double depthKept = 0;
    for (int round = 0; round < 300; ++round) {
        const MeshData& mesh = meshes[static_cast<std::size_t>(round) % 5];
        const OccluderMesh occluder(mesh.positions, mesh.indices);
        // Every third reaches through the near plane.
        Affine3d place = Affine3d::Identity();
        place.translate(
            Vec3d(uniform(-1, 1), uniform(-0.6, 0.6), round % 3 == 0 ? uniform(-1, 0.5) : uniform(-5, -1.5)));
        place.rotate(Quatd(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)).normalized());
        place.scale(Vec3d(uniform(0.5, 1.5), uniform(0.5, 1.5), uniform(0.02, 1.5)));
        const Mat4d clip_T_mesh = tile.clip_T_world() * place.matrix();
        const double noise = round % 2 == 0 ? 1e-7 : 1e-3;
        buffer.reset(tile.widthPx(), tile.heightPx());
        rasteriser.add(occluder, {.clip_T_mesh = clip_T_mesh, .mirrored = false, .noise = noise}, tile, buffer);
        const SloppyRenderer renderer(tile, mesh, clip_T_mesh, noise, random);
        for (int py = 0; py < tile.heightPx(); ++py) {
            for (int px = 0; px < tile.widthPx(); ++px) {
                const double hidesFrom = buffer.at(px, py);
                if (hidesFrom == 0 || random() % 8 != 0) continue;
                ++marked;
                for (int sample = 0; sample < 8; ++sample) {
                    // Corners first: there the surface is farthest.
                    const Vec2d at = sample < 4 ? Vec2d(px + (sample & 1), py + (sample >> 1))
                                                : Vec2d(px + uniform(0, 1), py + uniform(0, 1));
                    ASSERT_GE(renderer.nearestAt(at), hidesFrom) << "round " << round << " pixel " << px << "," << py;
                }
                depthKept += hidesFrom / renderer.nearestAt(Vec2d(px + 0.5, py + 0.5));
            }
        }
    }
    // And it does mark, not much farther away than the surface is.
    EXPECT_GT(marked, 3000);
    EXPECT_GT(depthKept / marked, 0.85);
}

// The same for parts of a large mesh, beside those triangles alone: one rasteriser for all, so that what is left of a
// call before would show.
TEST(OccluderRasteriser, PartsOfAMeshMarkWhatTheyCoverByThemselves) {
    std::mt19937 random(11);
    const auto uniform = [&](double from, double to) {
        return std::uniform_real_distribution<double>(from, to)(random);
    };
    const TestCamera camera(53, 37);
    const TileProjection tile(camera.camera(), camera.tile());
    OcclusionBuffer buffer, again;
    OccluderRasteriser rasteriser;
    const MeshData meshes[] = {makeSphere(0.9, 40), makeTorus(0.6, 0.35, 40, 30), makeTube(0.6, 0.4, 1, 200)};
    int marked = 0;
    for (int round = 0; round < 120; ++round) {
        const MeshData& mesh = meshes[static_cast<std::size_t>(round) % 3];
        const OccluderMesh occluder(mesh.positions, mesh.indices);
        const std::size_t clusters = (mesh.indices.size() / 3 + MeshCluster::kTriangles - 1) / MeshCluster::kTriangles;
        std::vector<OccluderMesh::Run> runs;
        MeshData part = mesh;
        part.indices.clear();
        for (std::size_t k = 0; k < clusters; ++k) {
            if (random() % 3 == 0) continue;
            runs.push_back(occluder.cluster(k));
            const std::size_t first = 3 * MeshCluster::kTriangles * k;
            const std::size_t end = std::min(first + 3 * MeshCluster::kTriangles, mesh.indices.size());
            part.indices.insert(part.indices.end(), mesh.indices.begin() + static_cast<std::ptrdiff_t>(first),
                                mesh.indices.begin() + static_cast<std::ptrdiff_t>(end));
        }
        Affine3d place = Affine3d::Identity();
        place.translate(
            Vec3d(uniform(-0.5, 0.5), uniform(-0.4, 0.4), round % 3 == 0 ? uniform(-1, 0.5) : uniform(-3, -1)));
        place.rotate(Quatd(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)).normalized());
        const Mat4d clip_T_mesh = tile.clip_T_world() * place.matrix();
        const OccluderRasteriser::Placed placed{.clip_T_mesh = clip_T_mesh, .mirrored = false, .noise = 1e-6};
        buffer.reset(tile.widthPx(), tile.heightPx());
        rasteriser.add(occluder, runs, placed, tile, buffer);
        // As if the part were a mesh of its own.
        again.reset(tile.widthPx(), tile.heightPx());
        OccluderRasteriser().add(OccluderMesh(part.positions, part.indices), placed, tile, again);
        const SloppyRenderer renderer(tile, part, clip_T_mesh, 1e-6, random);
        for (int py = 0; py < tile.heightPx(); ++py) {
            for (int px = 0; px < tile.widthPx(); ++px) {
                ASSERT_EQ(buffer.at(px, py), again.at(px, py)) << "round " << round << " pixel " << px << "," << py;
                const double hidesFrom = buffer.at(px, py);
                if (hidesFrom == 0 || random() % 8 != 0) continue;
                ++marked;
                for (int sample = 0; sample < 4; ++sample)
                    ASSERT_GE(renderer.nearestAt(Vec2d(px + uniform(0, 1), py + uniform(0, 1))), hidesFrom)
                        << "round " << round << " pixel " << px << "," << py;
            }
        }
    }
    EXPECT_GT(marked, 1000);
}

}  // namespace
}  // namespace tessera
