#include "server/import/reader/ObjText.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "server/import/reader/BeforeAssimp.h"
#include "server/import/reader/ReadProgress.h"
#include "server/import/reader/TextCursor.h"

namespace tessera {
namespace {

std::uint8_t colorOf(float part) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(part, 0.0f, 1.0f) * 255.0f));
}

/// From 1, or back from -1; 0: it names nothing.
std::uint64_t numberOf(std::int64_t said, std::size_t soFar) {
    const std::int64_t number = said > 0 ? said : said < 0 ? static_cast<std::int64_t>(soFar) + said + 1 : 0;
    return number > 0 && number < ObjPart::kNone ? static_cast<std::uint64_t>(number) : 0;
}

/// Appended to one that may not have begun yet, while the part has so many corners besides.
void append(std::vector<std::uint32_t>& numbers, std::size_t corners, std::uint64_t number) {
    if (number == 0 && numbers.empty()) return;
    if (numbers.size() != corners) numbers.resize(corners, ObjPart::kNone);
    numbers.push_back(number == 0 ? ObjPart::kNone : static_cast<std::uint32_t>(number - 1));
}

}  // namespace

ObjText::Outcome ObjText::read(std::string_view text) {
    *this = ObjText();
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
    std::string joined;
    const char *at = text.data(), *const end = at + text.size();
    for (std::size_t lines = 0; at < end; ++lines) {
        constexpr std::size_t kSome = 1 << 14;
        if (lines % kSome == 0) sayProgress(text.size() - static_cast<std::size_t>(end - at), text.size());
        const char* next = static_cast<const char*>(std::memchr(at, '\n', static_cast<std::size_t>(end - at)));
        if (next == nullptr) next = end;
        const char* last = next;
        if (last > at && last[-1] == '\r') --last;
        // A remark ends with its line: some end with the name of a folder.
        const bool goesOn =
            last > at && last[-1] == '\\' && !(joined.empty() && *TextCursor::toLetter(at, last) == '#');
        if (goesOn || !joined.empty()) {
            joined.append(at, goesOn ? last - 1 : last).push_back(' ');
            if (!goesOn || next == end) {
                take(joined.data(), joined.data() + joined.size());
                joined.clear();
            }
        } else {
            take(at, last);
        }
        if (hasSurfaces_) return Outcome::kSurfaces;
        at = next == end ? end : next + 1;
    }
    return !isUnsound_ && isSound() ? Outcome::kRead : Outcome::kUnsound;
}

void ObjText::take(const char* begin, const char* end) {
    TextCursor line(begin, end, true);
    if (!line.toWord()) return;
    const std::string_view key = line.word();
    // Once something is wrong, all that is still asked is whether somebody else shall read it.
    if (!isUnsound_) isUnsound_ = !statement(key, line, end);
    hasSurfaces_ = key == "surf";
}

bool ObjText::isSound() const {
    const std::size_t places = positions.size() / 3, coordinates = texcoords.size() / 2;
    return mostPlaces_ <= places && (coordinates == 0 || (mostTexcoords_ <= coordinates && !namesNoTexcoord_));
}

bool ObjText::statement(std::string_view key, TextCursor& line, const char* end) {
    if (key == "v") return vertex(line);
    if (key == "f") return face(line);
    if (key == "vt") return texcoord(line);
    if (key == "vn") return normal(line);
    if (key == "l" || key == "p") {
        if (!placesOf(line, corners_)) return false;
        if (corners_.empty()) return true;
        ObjPart& part = currentPart();
        if (key == "p") part.points.insert(part.points.end(), corners_.begin(), corners_.end());
        for (std::size_t i = 1; key == "l" && i < corners_.size(); ++i)
            part.lines.insert(part.lines.end(), {corners_[i - 1], corners_[i]});
        return true;
    }
    // Names go to the end of their lines, and may hold any letters.
    TextCursor called(line.at(), end, false);
    if (key == "g") {
        group(called.rest());
    } else if (key == "o") {
        object(called.toWord() ? called.word() : std::string_view());
    } else if (key == "usemtl") {
        material(called.rest());
    } else if (key == "mtllib") {
        const std::string_view library = called.rest();
        if (!library.empty() && names.libraries.emplace(library).second) libraries.emplace_back(library);
    }
    return !isOfFreeform(key);
}

bool ObjText::vertex(TextCursor& line) {
    std::array<float, 7> numbers{};
    std::size_t count = 0;
    while (line.toWord()) {
        float ignored = 0;
        if (!line.number(count < numbers.size() ? numbers[count] : ignored)) return false;
        ++count;
    }
    if (count < 3) return false;
    // The fourth of four divides the others; six are a place and a colour.
    if (count == 4 && numbers[3] != 1) {
        if (numbers[3] == 0) return false;
        for (std::size_t axis = 0; axis < 3; ++axis) numbers[axis] /= numbers[3];
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (!std::isfinite(numbers[axis])) return false;
    positions.insert(positions.end(), numbers.begin(), numbers.begin() + 3);
    const bool colored = count > 5;
    if (!colored && colors.empty()) return true;
    colors.resize(positions.size() / 3 * 4, 0);
    if (!colored) return true;
    for (std::size_t i = 0; i < 3; ++i) colors[colors.size() - 4 + i] = colorOf(numbers[3 + i]);
    colors.back() = 255;
    return true;
}

bool ObjText::texcoord(TextCursor& line) {
    std::array<float, 2> uv{};
    for (std::size_t i = 0; i < uv.size() && line.toWord(); ++i) {
        if (!line.number(uv[i])) return false;
        if (!std::isfinite(uv[i])) uv[i] = 0;
    }
    texcoords.insert(texcoords.end(), uv.begin(), uv.end());
    return true;
}

bool ObjText::normal(TextCursor& line) {
    std::array<float, 3> xyz{};
    for (float& part : xyz)
        if (!line.number(part)) return false;
    normals.insert(normals.end(), xyz.begin(), xyz.end());
    return true;
}

bool ObjText::place(TextCursor& line, std::uint32_t& place) {
    std::int64_t said = 0;
    if (!line.digits(said)) return false;
    const std::uint64_t number = numberOf(said, positions.size() / 3);
    if (number == 0) return false;
    mostPlaces_ = std::max(mostPlaces_, number);
    place = static_cast<std::uint32_t>(number - 1);
    return true;
}

bool ObjText::placesOf(TextCursor& line, std::vector<std::uint32_t>& places) {
    places.clear();
    while (line.toWord()) {
        std::int64_t ignored = 0;
        if (!place(line, places.emplace_back())) return false;
        if (line.past('/')) (void)line.digits(ignored);
        if (line.past('/')) (void)line.digits(ignored);
        if (!line.isAtWordEnd()) return false;
    }
    return true;
}

/// f PLACE PLACE/TEXTURE PLACE/TEXTURE/NORMAL PLACE//NORMAL …
bool ObjText::face(TextCursor& line) {
    if (!line.toWord()) return true;
    ObjPart& part = currentPart();
    const std::size_t before = part.places.size();
    while (line.toWord()) {
        std::uint32_t where = 0;
        std::int64_t texture = 0, normal = 0;
        if (!place(line, where)) return false;
        const bool hasTexture = line.past('/') && line.digits(texture);
        bool hasNormal = line.past('/') && line.digits(normal);
        if (!line.isAtWordEnd()) return false;
        std::uint64_t coordinate = hasTexture ? numberOf(texture, texcoords.size() / 2) : 0;
        if (hasTexture && !hasNormal && texcoords.empty() && !normals.empty()) {
            // Where there are no texture coordinates, the second number is a normal's.
            normal = texture;
            hasNormal = true;
            coordinate = 0;
        } else if (hasTexture) {
            namesNoTexcoord_ = namesNoTexcoord_ || coordinate == 0;
            mostTexcoords_ = std::max(mostTexcoords_, coordinate);
        }
        const std::size_t corner = part.places.size();
        append(part.texcoords, corner, coordinate);
        append(part.normals, corner, hasNormal ? numberOf(normal, normals.size() / 3) : 0);
        part.places.push_back(where);
    }
    const std::size_t corners = part.places.size() - before;
    if (corners < 3) {  // a line or a point
        std::vector<std::uint32_t>& into = corners == 2 ? part.lines : part.points;
        into.insert(into.end(), part.places.end() - static_cast<std::ptrdiff_t>(corners), part.places.end());
        for (std::vector<std::uint32_t>* numbers : {&part.places, &part.texcoords, &part.normals})
            numbers->resize(std::min(numbers->size(), before));
        return true;
    }
    if (corners > 3 && part.lengths.empty()) part.lengths.assign(before / 3, 3);
    if (corners > 3 || !part.lengths.empty()) part.lengths.push_back(static_cast<std::uint32_t>(corners));
    return true;
}

ObjPart& ObjText::currentPart() {
    if (!object_) newObject("defaultobject");
    return parts[*part_];
}

void ObjText::newPart(std::string_view name) {
    part_ = parts.size();
    parts.push_back({.name = std::string(name), .material = material_});
    objects[*object_].parts.push_back(*part_);
}

void ObjText::newObject(std::string_view name) {
    object_ = objects.size();
    objects.push_back({.name = std::string(name), .parts = {}});
    objectNames_.emplace(name, *object_);
    newPart(name);
}

void ObjText::object(std::string_view name) {
    if (name.empty()) return;
    const auto known = objectNames_.find(name);
    if (known == objectNames_.end()) return newObject(name);
    object_ = known->second;
    newPart(name);
}

void ObjText::group(std::string_view name) {
    if (name == group_) return;
    newObject(name);
    group_ = name;
}

void ObjText::material(std::string_view name) {
    if (name.empty()) return;
    names.used.emplace(name);
    if (name == material_) return;
    material_ = name;
    if (!object_) return;
    if (!parts[*part_].empty()) newPart(name);
    parts[*part_].material = name;
}

}  // namespace tessera
