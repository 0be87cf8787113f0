#include <algorithm>
#include <bit>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>

#include "tests/unit/import/FileCensus.h"

namespace tessera {
namespace {

void addFace(FileCensus& census, std::size_t corners) {
    if (corners == 1) ++census.points;
    if (corners == 2) ++census.lines;
    if (corners > 2) census.triangles += corners - 2;
}

std::size_t wordsIn(const std::string& line) {
    std::istringstream words(line);
    return static_cast<std::size_t>(std::distance(std::istream_iterator<std::string>(words), {}));
}

/// Of a line: what follows its first word.
std::string restOf(const std::string& line) {
    std::istringstream words(line);
    std::string first, rest;
    words >> first >> std::ws;
    std::getline(words, rest);
    rest.erase(rest.find_last_not_of(" \t\r") + 1);
    return rest;
}

void addTextures(const std::string& library, const std::set<std::string>& materials, FileCensus& census) {
    static const std::map<std::string, std::string> leftOut = {
        {"map_Ka", "Ambient"},  {"map_Ks", "Specular"}, {"map_Ns", "Shininess"},  {"bump", "Height"},
        {"map_bump", "Height"}, {"map_Bump", "Height"}, {"disp", "Displacement"}, {"refl", "Reflection"}};
    std::ifstream in(library);
    bool used = false;
    for (std::string line; std::getline(in, line);) {
        std::string first;
        std::istringstream(line) >> first;
        if (first == "newmtl") used = materials.count(restOf(line)) > 0;
        if (!used || restOf(line).empty()) continue;
        const std::string file = line.substr(line.find_last_of(" \t/\\") + 1);
        for (const char* shown : {"map_Kd", "map_Ke", "norm", "map_Kn"})
            if (first == shown) census.pictures.insert(file.substr(0, file.find_last_not_of("\r") + 1));
        if (leftOut.count(first) > 0) census.toBeNamed.insert("textures of kind " + leftOut.at(first));
    }
}

/// The numbers of a binary PLY, of either order of bytes.
class PlyNumbers {
public:
    PlyNumbers(const std::string& bytes, std::size_t at, bool big) : bytes_(bytes), at_(at), big_(big) {}

    /// Of a type's size; whole numbers alone mean something.
    std::uint64_t take(std::size_t size) {
        std::uint64_t value = 0;
        for (std::size_t i = 0; i < size; ++i) {
            const std::size_t from = big_ ? at_ + i : at_ + size - 1 - i;
            value = value << 8 | (from < bytes_.size() ? static_cast<std::uint8_t>(bytes_[from]) : 0u);
        }
        at_ += size;
        return value;
    }

private:
    const std::string& bytes_;
    std::size_t at_;
    bool big_;
};

std::size_t sizeOfType(const std::string& type) {
    for (const char* one : {"char", "uchar", "int8", "uint8"})
        if (type == one) return 1;
    for (const char* two : {"short", "ushort", "int16", "uint16"})
        if (type == two) return 2;
    return type == "double" || type == "float64" ? 8 : 4;
}

struct PlyProperty {
    std::string count;  ///< of a list: the type of its length
    std::string type, name;
};
struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties;
};

}  // namespace

std::optional<FileCensus> censusOfObj(const std::string& text, const std::string& path) {
    FileCensus census;
    std::set<std::string> libraries, materials;
    std::string material;
    std::uint64_t vertices = 0;
    std::string joined = text;
    for (std::size_t at = joined.find("\\\n"); at != joined.npos; at = joined.find("\\\n")) joined.replace(at, 2, " ");
    std::istringstream lines(joined);
    for (std::string line; std::getline(lines, line);) {
        line = line.substr(0, line.find('#'));
        const std::size_t words = wordsIn(line);
        std::string first;
        std::istringstream(line) >> first;
        if (first == "v") ++vertices;
        if (first == "mtllib") libraries.insert(restOf(line));
        if (first == "usemtl") material = restOf(line);
        if (first == "f" && words > 3) materials.insert(material);
        if (first == "f" && words > 1) addFace(census, words - 1);
        if (first == "p" && words > 1) census.points += words - 1;
        if (first == "l" && words > 2) census.lines += words - 2;
    }
    if (census.triangles + census.points + census.lines == 0) census.points = vertices;
    for (const std::string& library : libraries)
        addTextures(path.substr(0, path.rfind('/') + 1) + library, materials, census);
    return census;
}

std::optional<FileCensus> censusOfOff(const std::string& text) {
    std::istringstream words(text);
    std::string head;
    std::size_t vertices = 0, faces = 0, edges = 0;
    if (!(words >> head >> vertices >> faces >> edges) || head != "OFF") return std::nullopt;
    FileCensus census;
    double number = 0;
    for (std::size_t i = 0; i < 3 * vertices; ++i) words >> number;
    std::string line;
    for (std::size_t i = 0; i < faces; ++i) {
        std::size_t corners = 0;
        if (!(words >> corners)) return std::nullopt;
        std::getline(words, line);
        addFace(census, corners);
    }
    return census;
}

std::optional<FileCensus> censusOfPly(const std::string& bytes) {
    std::istringstream lines(bytes);
    std::vector<PlyElement> elements;
    std::string line, format;
    while (std::getline(lines, line) && !line.starts_with("end_header")) {
        std::istringstream words(line);
        std::string first, second;
        words >> first >> second;
        if (first == "format") format = second;
        if (first == "element") {
            elements.push_back({second, 0, {}});
            words >> elements.back().count;
        }
        if (first == "property" && !elements.empty()) {
            PlyProperty& property = elements.back().properties.emplace_back();
            if (second == "list")
                words >> property.count >> property.type >> property.name;
            else
                property.type = second, words >> property.name;
        }
    }
    const auto start = static_cast<std::size_t>(std::max<std::streamoff>(lines.tellg(), 0));
    PlyNumbers numbers(bytes, start, format == "binary_big_endian");
    const auto take = [&](const std::string& type) {
        if (format != "ascii") return numbers.take(sizeOfType(type));
        double number = 0;
        lines >> number;
        return static_cast<std::uint64_t>(std::max(number, 0.0));
    };
    FileCensus census;
    std::uint64_t vertices = 0;
    for (const PlyElement& element : elements) {
        if (element.name == "vertex") vertices = element.count;
        if (element.name == "tristrips") return std::nullopt;
        for (std::uint64_t i = 0; i < element.count; ++i)
            for (const PlyProperty& property : element.properties) {
                const std::uint64_t length = property.count.empty() ? 1 : take(property.count);
                if (element.name == "face" && property.name.starts_with("vertex_ind")) addFace(census, length);
                for (std::uint64_t k = 0; k < length; ++k) take(property.type);
            }
    }
    if (census.triangles + census.lines == 0) census.points = vertices;
    return census;
}

std::optional<FileCensus> censusOfStl(const std::string& bytes) {
    FileCensus census;
    std::uint32_t triangles = 0;
    if (bytes.size() >= 84) std::memcpy(&triangles, bytes.data() + 80, sizeof(triangles));
    if (bytes.size() >= 84 && bytes.size() == 84 + std::size_t{50} * triangles) {
        census.triangles = triangles;
        return census;
    }
    std::istringstream words(bytes);
    for (std::string word; words >> word;) census.triangles += word == "endfacet";
    return census;
}

std::optional<FileCensus> censusOf(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    std::string extension = path.substr(path.rfind('.') + 1);
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (extension == "gltf" || extension == "glb") return censusOfGltf(bytes);
    if (extension == "obj") return censusOfObj(bytes, path);
    if (extension == "off") return censusOfOff(bytes);
    if (extension == "ply") return censusOfPly(bytes);
    if (extension == "stl") return censusOfStl(bytes);
    return std::nullopt;
}

}  // namespace tessera
