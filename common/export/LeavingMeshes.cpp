#include "common/export/LeavingMeshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "common/cores/Glyphs.h"
#include "common/cores/NurbsSurface.h"
#include "common/cores/ParticleEmitter.h"
#include "common/cores/ProxyGroup.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/cores/Text.h"
#include "common/drawable/GlyphArrays.h"
#include "common/geometry/MeshCopies.h"
#include "common/math/Decompositions.h"

namespace tessera {
namespace {

/// How a tolerance was met.
enum class Fit { kAsAsked, kFinerAnyway, kTooFine };

/// Triangles of `core` that are within the tolerance, or the finest there are. Its own fields may ask for no other
/// fineness: a copy does.
template <typename Core>
MeshArrays withinTolerance(const Core& core, double tolerance, Fit& fit) {
    Core asked = core;
    asked.screenError = 1;
    const Drawable drawable = drawableOf(Object::of(asked));
    const unsigned finest = drawable.finest();
    for (unsigned steps = 0; steps <= finest; ++steps) {
        const Drawable finer = drawable.at(Fineness(steps));
        const bool within = finer.deviation() <= tolerance;
        if (!within && steps < finest) continue;
        fit = !within ? Fit::kTooFine : steps == 0 ? Fit::kFinerAnyway : Fit::kAsAsked;
        MeshArrays arrays = finer.arrays();
        if (!arrays.positions.empty() || steps == 0) return arrays;
        // So many triangles are not made.
        fit = Fit::kTooFine;
        return drawable.at(Fineness(steps - 1)).arrays();
    }
    return {};
}

bool isHere(const MeshArrays& arrays) {
    return std::ranges::all_of(
        std::initializer_list<const Blob*>{&arrays.positions, &arrays.normals, &arrays.colors, &arrays.texcoords,
                                           &arrays.indices, &arrays.texcoords1, &arrays.lines, &arrays.tangents,
                                           &arrays.copies},
        [](const Blob* blob) { return blob->empty() || blob->resident(); });
}

}  // namespace

bool isSmooth(const Object& core) {
    return core.is<SubdivisionSurface>() || core.is<NurbsSurfaceCore>() || core.is<Text>();
}

Expected<MeshArrays> LeavingMeshes::of(const SelectedNode& node) {
    if (node.isWay || !node.core || !isDrawable(node.core.info().type)) return MeshArrays();
    double tolerance = 0;
    if (tolerance_ > 0) {
        const double stretch = singularStretchOf(node.world_T_node.linear()).most;
        tolerance = stretch > 0 ? tolerance_ / stretch : 0;
    }
    const std::pair<ObjectId, double> key{node.node->core, isSmooth(node.core) ? tolerance : 0};
    if (const auto found = made_.find(key); found != made_.end()) return found->second;
    Expected<MeshArrays> made = make(node, key.second);
    if (made) made_.emplace(key, *made);
    return made;
}

Expected<MeshArrays> LeavingMeshes::make(const SelectedNode& node, double tolerance) {
    if (node.core.is<ProxyGroup>()) {
        notes_.add("what a ProxyGroup loads is left out: load it and save again", node.id);
        return MeshArrays();
    }
    if (node.core.is<ParticleEmitter>()) {
        notes_.add("streams of particles are left out", node.id);
        return MeshArrays();
    }
    Drawable drawable = drawableOf(node.core);
    if (!drawable.resident())
        return fail(ErrorCode::kRefused, pathOf(scene_, node.id) + ": an array of it is not here");
    MeshArrays arrays;
    Fit fit = Fit::kAsAsked;
    if (tolerance > 0) {
        if (const auto* surface = node.core.as<SubdivisionSurface>())
            arrays = withinTolerance(*surface, tolerance, fit);
        else if (const auto* nurbs = node.core.as<NurbsSurfaceCore>())
            arrays = withinTolerance(*nurbs, tolerance, fit);
        else if (const auto* text = node.core.as<Text>())
            arrays = withinTolerance(*text, tolerance, fit);
    } else if (node.core.is<Glyphs>()) {
        arrays = drawable.at(Fineness(kGlyphsOnScreens)).arrays();
    } else {
        arrays = drawable.arrays();
    }
    if (fit == Fit::kTooFine)
        notes_.add("surfaces and letters are as fine as they can be, not within the tolerance", node.id);
    if (fit == Fit::kFinerAnyway)
        notes_.add("surfaces and letters are as fine as the scene draws them, finer than the tolerance", node.id);
    if (!isHere(arrays)) return fail(ErrorCode::kRefused, pathOf(scene_, node.id) + ": an array of it is not here");
    if (arrays.positions.empty()) return MeshArrays();
    if (const Expected<void> sound = checkMesh(arrays); !sound) {
        notes_.add(fmt::format("a mesh is left out: {}", sound.error().message), node.id);
        return MeshArrays();
    }
    return arrays;
}

Expected<MeshArrays> expandedCopies(const MeshArrays& glyphs) {
    const std::span<const MeshCopy> copies = glyphs.copies.as<MeshCopy>();
    const std::span<const float> corners = glyphs.positions.as<float>();
    const std::span<const std::uint32_t> faces = glyphs.indices.as<std::uint32_t>();
    const std::span<const std::uint8_t> colors = glyphs.colors.as<std::uint8_t>();
    const std::span<const float> texcoords = glyphs.texcoords.as<float>();
    const std::size_t vertices = corners.size() / 3;
    if (copies.size() * vertices > std::numeric_limits<std::uint32_t>::max())
        return fail(ErrorCode::kLimit,
                    fmt::format("{} glyphs of {} vertices are more than a mesh can hold", copies.size(), vertices));
    MeshData all;
    all.positions.reserve(3 * copies.size() * vertices);
    all.indices.reserve(copies.size() * faces.size());
    for (std::size_t i = 0; i < copies.size(); ++i) {
        const MeshCopy& copy = copies[i];
        if (!(copy.width > 0) || !(copy.length > 0)) continue;
        const auto first = static_cast<std::uint32_t>(all.positions.size() / 3);
        const Quatd turn(copy.turn[3], copy.turn[0], copy.turn[1], copy.turn[2]);
        const Vec3d place(copy.place[0], copy.place[1], copy.place[2]);
        for (std::size_t v = 0; v < vertices; ++v) {
            const Vec3d corner(copy.width * corners[3 * v], copy.length * corners[3 * v + 1],
                               copy.width * corners[3 * v + 2]);
            const Vec3f at = (place + turn * corner).cast<float>();
            all.positions.insert(all.positions.end(), at.begin(), at.end());
            for (std::size_t k = 0; k < 4 && !colors.empty(); ++k) all.colors.push_back(colors[4 * i + k]);
        }
        all.texcoords.insert(all.texcoords.end(), texcoords.begin(), texcoords.end());
        for (const std::uint32_t corner : faces) all.indices.push_back(first + corner);
    }
    return all.toArrays();
}

}  // namespace tessera
