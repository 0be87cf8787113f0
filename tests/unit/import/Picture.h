/// Small pictures for tests, and what an import made of them.
#pragma once

#include <array>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "tests/unit/import/ImportFixture.h"

namespace tessera {

using Rgba = std::array<std::uint8_t, 4>;

/// An uncompressed TGA of one row, whatever its name says: readers go by the content.
inline std::string pictureOf(const std::vector<Rgba>& pixels) {
    std::string tga("\0\0\2\0\0\0\0\0\0\0\0\0", 12);
    for (const std::size_t part :
         {pixels.size() & 255, pixels.size() >> 8, std::size_t{1}, std::size_t{0}, std::size_t{32}, std::size_t{0x28}})
        tga.push_back(static_cast<char>(part));
    for (const auto& [r, g, b, a] : pixels)
        for (const std::uint8_t part : {b, g, r, a}) tga.push_back(static_cast<char>(part));
    return tga;
}

/// All objects of one type.
template <typename T>
std::vector<const T*> allOf(const ImportedAspect& aspect) {
    std::vector<const T*> found;
    for (const ObjectId id : aspect->ids())
        if (const T* object = aspect->get<T>(id)) found.push_back(object);
    return found;
}

inline std::string contentOf(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

inline bool hasNote(const ImportedScene& scene, std::string_view text) {
    return std::any_of(scene.notes.begin(), scene.notes.end(),
                       [&](const std::string& note) { return note.find(text) != std::string::npos; });
}

}  // namespace tessera
