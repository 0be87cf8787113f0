/// Files of one mesh in many formats, for FormatsBench.cpp: as other programs write them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace tessera::bench {

/// A square of waves: a grid of vertices, two triangles each cell.
struct Waves {
    std::vector<float> positions, normals, texcoords;
    std::vector<std::uint32_t> indices;
};
/// So many triangles, or a few fewer.
[[nodiscard]] Waves waves(std::size_t triangles);

/// Statements `v` and `f`; `isWhole`: `vt` and `vn` besides.
void writeObj(const std::string& path, const Waves& waves, bool isWhole);
/// Places and corners.
void writePly(const std::string& path, const Waves& waves, bool isText);
void writeStl(const std::string& path, const Waves& waves, bool isText);

/// Places and corners; a 3MF deflated, as programs do.
void writeThreeMf(const std::string& path, const Waves& waves);
void writeAmf(const std::string& path, const Waves& waves);

enum class GlbKind : std::uint8_t { kPlain, kDraco, kMeshopt, kQuantised };
/// Places, normals, texture coordinates and corners.
void writeGlb(const std::string& path, const Waves& waves, GlbKind kind);

}  // namespace tessera::bench
