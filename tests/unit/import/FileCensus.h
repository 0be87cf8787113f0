/// What is in a file, counted without the readers: beside it stands what the import made of it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace tessera {

struct FileCensus {
    // As often as nodes place them.
    std::uint64_t triangles = 0, points = 0, lines = 0;
    /// Of a glTF: one line per material that is drawn, as `materialLine` writes it.
    std::multiset<std::string> materials;
    /// How many drawn parts have this attribute of vertices, and how many nodes a camera or light.
    std::map<std::string, std::uint64_t> parts;
    /// Files that drawn materials of an OBJ take colour, normals and light from: each is an image, or a note names it.
    std::set<std::string> pictures;
    /// Each has to be a part of some note.
    std::set<std::string> toBeNamed;
};

/// One texture of a material.
struct TextureLine {
    int texcoordSet = 0;
    std::string wrapU, wrapV, magnification, minification;
    double offsetU = 0, offsetV = 0, scaleU = 1, scaleV = 1, rotation = 0;
};

struct MaterialLine {
    std::string alphaMode;
    double alphaCutoff = 0.5, normalScale = 1, occlusionStrength = 1, clearcoat = 0, clearcoatRoughness = 0,
           transmission = 0;
    double specular = 1, specularRed = 1, specularGreen = 1, specularBlue = 1, ior = 1.5;
    bool doubleSided = false, unlit = false;
    std::map<std::string, TextureLine> textures;  ///< by slot
};
[[nodiscard]] std::string materialLine(const MaterialLine& material);

/// Nothing for formats that are not counted here, and for files that say too little to be counted.
[[nodiscard]] std::optional<FileCensus> censusOf(const std::string& path);

// The formats.
[[nodiscard]] std::optional<FileCensus> censusOfGltf(const std::string& bytes);
/// `path`: its material libraries lie beside it.
[[nodiscard]] std::optional<FileCensus> censusOfObj(const std::string& text, const std::string& path);
[[nodiscard]] std::optional<FileCensus> censusOfOff(const std::string& text);
[[nodiscard]] std::optional<FileCensus> censusOfPly(const std::string& bytes);
[[nodiscard]] std::optional<FileCensus> censusOfStl(const std::string& bytes);

}  // namespace tessera
