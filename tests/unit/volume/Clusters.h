/// The points that real volumes hold: triangles of models, divided as a tree would.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <sstream>

#include "common/math/Box.h"
#include "tests/unit/volume/Clouds.h"

namespace tessera::clouds {

using Corners = std::array<Vec3d, 3>;

inline std::filesystem::path dataFolder() {
    const char* named = std::getenv("TESSERA_TEST_DATA");
    return named ? std::filesystem::path(named) : std::filesystem::path(TESSERA_SOURCE_DIR) / ".." / "shared" / "data";
}

/// Wavefront OBJ (`v` and `f` lines) or PLY in text; polygons fanned, positions rounded to float. Empty if missing.
inline std::vector<Corners> readModel(const std::filesystem::path& file) {
    std::ifstream in(file);
    std::vector<Vec3d> vertices;
    std::vector<Corners> triangles;
    const auto addFace = [&](const std::vector<std::size_t>& face) {
        for (std::size_t i = 2; i < face.size(); ++i)
            triangles.push_back({vertices.at(face[0]), vertices.at(face[i - 1]), vertices.at(face[i])});
    };
    const auto readPoint = [](std::istream& words) {
        Vec3f p = Vec3f::Zero();
        words >> p.x() >> p.y() >> p.z();
        return Vec3d(p.cast<double>());
    };
    std::string line, word;
    if (file.extension() == ".ply") {
        std::size_t vertexCount = 0, faceCount = 0;
        while (std::getline(in, line) && line != "end_header") {
            std::istringstream words(line);
            words >> word;
            if (word != "element") continue;
            words >> word;
            words >> (word == "vertex" ? vertexCount : faceCount);
        }
        for (std::size_t i = 0; i < vertexCount && std::getline(in, line); ++i) {
            std::istringstream words(line);
            vertices.push_back(readPoint(words));
        }
        for (std::size_t i = 0, corners = 0; i < faceCount && in >> corners; ++i) {
            std::vector<std::size_t> face(corners);
            for (std::size_t& c : face) in >> c;
            addFace(face);
        }
        return triangles;
    }
    while (std::getline(in, line)) {
        std::istringstream words(line);
        word.clear();
        words >> word;
        if (word == "v") vertices.push_back(readPoint(words));
        if (word != "f") continue;
        std::vector<std::size_t> face;
        while (words >> word) face.push_back(std::stoul(word) - 1);
        addFace(face);
    }
    return triangles;
}

/// The corners of at most `most` triangles each: halves along the longest side, again and again.
inline void divide(std::span<Corners> triangles, std::size_t most, std::vector<Cloud>& clusters) {
    if (triangles.empty()) return;
    if (triangles.size() <= most) {
        Cloud cloud;
        for (const Corners& t : triangles) cloud.insert(cloud.end(), t.begin(), t.end());
        clusters.push_back(std::move(cloud));
        return;
    }
    const auto middle = [](const Corners& t) { return Vec3d(t[0] + t[1] + t[2]); };
    Box box;
    for (const Corners& t : triangles) box.extend(middle(t));
    int axis = 0;
    box.size().maxCoeff(&axis);
    const std::size_t half = triangles.size() / 2;
    std::nth_element(triangles.begin(), triangles.begin() + static_cast<std::ptrdiff_t>(half), triangles.end(),
                     [&](const Corners& a, const Corners& b) { return middle(a)[axis] < middle(b)[axis]; });
    divide(triangles.first(half), most, clusters);
    divide(triangles.subspan(half), most, clusters);
}

}  // namespace tessera::clouds
