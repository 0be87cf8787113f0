/// The statements of an OBJ of polygons, lines and points, as they stand in it: pools, and faces that name them by
/// number. See "Object Files (.obj)", Wavefront's Advanced Visualizer 3.0.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/import/reader/ObjMaterials.h"

namespace tessera {

class TextCursor;

/// Faces, lines and points of one object and one material.
struct ObjPart {
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};

    std::string name, material;  ///< as the file calls them; no material: empty
    /// Of each corner of each face, numbers in the pools from 0. The latter two are as long, or empty; kNone: it has
    /// none.
    std::vector<std::uint32_t> places, texcoords, normals;
    std::vector<std::uint32_t> lengths;  ///< corners of each face, three at least; empty: all are triangles
    std::vector<std::uint32_t> lines;    ///< two places each
    std::vector<std::uint32_t> points;   ///< places

    [[nodiscard]] bool empty() const { return places.empty() && lines.empty() && points.empty(); }
};

/// What `o` and `g` name.
struct ObjObject {
    std::string name;
    std::vector<std::size_t> parts;
};

struct ObjText {
    std::vector<float> positions;      ///< xyz
    std::vector<float> texcoords;      ///< uv, from the lower left corner of the picture
    std::vector<float> normals;        ///< xyz, as they are
    std::vector<std::uint8_t> colors;  ///< empty, or rgb of each position, and 0 where the file says none for it
    std::vector<ObjPart> parts;
    std::vector<ObjObject> objects;
    ObjNames names;
    std::vector<std::string> libraries;  ///< in the file's order

    enum class Outcome : std::uint8_t {
        kRead,
        kSurfaces,  ///< it has free-form surfaces, which others read
        kUnsound,   ///< something in it is wrong, or free-form: who looks closer knows what
    };
    /// Replaces all. Names may come before what they name.
    [[nodiscard]] Outcome read(std::string_view text);

private:
    void take(const char* begin, const char* end);
    /// False: it is unsound. `line`: behind its keyword.
    bool statement(std::string_view key, TextCursor& line, const char* end);
    bool vertex(TextCursor& line);
    bool texcoord(TextCursor& line);
    bool normal(TextCursor& line);
    bool face(TextCursor& line);
    bool placesOf(TextCursor& line, std::vector<std::uint32_t>& places);
    bool place(TextCursor& line, std::uint32_t& place);
    void object(std::string_view name);
    void newObject(std::string_view name);
    void newPart(std::string_view name);
    void group(std::string_view name);
    void material(std::string_view name);
    ObjPart& currentPart();
    [[nodiscard]] bool isSound() const;

    std::optional<std::size_t> object_, part_;
    std::map<std::string, std::size_t, std::less<>> objectNames_;
    std::string group_, material_;
    std::vector<std::uint32_t> corners_;                ///< of lines and points, while they are read
    std::uint64_t mostPlaces_ = 0, mostTexcoords_ = 0;  ///< the greatest numbers that faces name, from 1
    bool namesNoTexcoord_ = false, hasSurfaces_ = false, isUnsound_ = false;
};

}  // namespace tessera
