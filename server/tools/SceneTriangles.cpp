#include "server/tools/SceneTriangles.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <unordered_map>
#include <utility>

#include "common/drawable/Drawable.h"
#include "common/geometry/Points.h"
#include "common/math/Decompositions.h"
#include "common/scene/Action.h"
#include "server/tools/TerminalProgress.h"

namespace tessera {

namespace {

/// Gives equal positions one index, in order of appearance.
class Welder {
public:
    std::uint32_t indexOf(const Vec3d& p) {
        // 0 and -0 are one place.
        const std::array<double, 3> key{p.x() + 0.0, p.y() + 0.0, p.z() + 0.0};
        const auto [at, isNew] = indices_.try_emplace(key, static_cast<std::uint32_t>(indices_.size()));
        if (isNew) positions_.insert(positions_.end(), key.begin(), key.end());
        return at->second;
    }
    [[nodiscard]] const std::vector<double>& positions() const { return positions_; }

private:
    struct Hash {
        std::size_t operator()(const std::array<double, 3>& p) const {
            std::uint64_t h = 0;
            for (const double x : p) h = (h ^ std::bit_cast<std::uint64_t>(x)) * 0x9E3779B97F4A7C15u, h ^= h >> 32;
            return h;
        }
    };
    std::unordered_map<std::array<double, 3>, std::uint32_t, Hash> indices_;
    std::vector<double> positions_;
};

/// The file as a scene of its own.
Expected<void> readScene(const std::string& path, ImportOptions options, Aspect& aspect,
                         std::vector<std::string>* notes) {
    options.whole = true;
    options.watch = progressOnTerminal(path);
    Expected<ImportedScene> imported = importScene(path, kRootNode, options);
    if (!imported) return tl::unexpected(imported.error());
    // In an aspect of its own the new objects can have any ids.
    replaceIds(imported->list, [](ObjectId id) {
        return isPlaceholder(id) ? ObjectId{id.value - kFirstPlaceholder + kRootNode.value + 1} : id;
    });
    if (const Expected<void> applied = aspect.apply(imported->list); !applied) return failWith(path, applied.error());
    if (notes) *notes = std::move(imported->notes);
    return {};
}

}  // namespace

Expected<TriangleMesh> readTriangles(const std::string& path, ImportOptions options, std::vector<std::string>* notes) {
    options.verbatim = true;
    Aspect aspect;
    if (Expected<void> read = readScene(path, std::move(options), aspect, notes); !read)
        return tl::unexpected(read.error());

    Welder welder;
    std::vector<std::uint32_t> indices;
    Action collect;
    collect.onNode([&](const Visit& visit) {
        const Drawable drawable = drawableOf(aspect, visit.node);
        if (!drawable) return Descend::kInto;
        const MeshArrays arrays = drawable.arrays();
        const std::span<const float> positions = arrays.positions.as<float>();
        const auto first = indices.size();
        for (const std::uint32_t i : arrays.indices.as<std::uint32_t>()) {
            const float* p = &positions[std::size_t{3} * i];
            indices.push_back(welder.indexOf(visit.world_T_node * Vec3d(p[0], p[1], p[2])));
        }
        // A file's counter-clockwise is what is seen; a mirroring place turns it.
        if (visit.world_T_node.linear().determinant() < 0)
            for (auto f = first; f + 2 < indices.size(); f += 3) std::swap(indices[f + 1], indices[f + 2]);
        return Descend::kInto;
    });
    collect.run(aspect);
    if (indices.empty()) return fail(ErrorCode::kBadInput, path + ": there is no triangle in it");
    Expected<TriangleMesh> mesh = TriangleMesh::make(welder.positions(), indices);
    if (!mesh) return failWith(path, mesh.error());
    return mesh;
}

Expected<FilePoints> readPoints(const std::string& path, ImportOptions options, std::vector<std::string>* notes) {
    Aspect aspect;
    if (Expected<void> read = readScene(path, std::move(options), aspect, notes); !read)
        return tl::unexpected(read.error());
    FilePoints out;
    Action collect;
    collect.onNode([&](const Visit& visit) {
        const Drawable drawable = drawableOf(aspect, visit.node);
        if (!drawable) return Descend::kInto;
        const MeshArrays arrays = drawable.arrays();
        if (arrays.kind != MeshKind::kPoints) return Descend::kInto;
        const std::span<const float> xyz = arrays.positions.as<float>();
        for (std::size_t i = 0; i + 2 < xyz.size(); i += 3)
            out.places.emplace_back(visit.world_T_node * Vec3d(xyz[i], xyz[i + 1], xyz[i + 2]));
        const double stretch = singularStretchOf(visit.world_T_node.linear()).most;
        out.radius = std::max(out.radius, shownRadius(arrays) * stretch);
        return Descend::kInto;
    });
    collect.run(aspect);
    if (out.places.empty()) return fail(ErrorCode::kBadInput, path + ": there are no points in it");
    return out;
}

}  // namespace tessera
