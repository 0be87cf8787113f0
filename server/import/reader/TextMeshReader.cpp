// Meshes in text as bare geometry, number by number: what assimp makes of text may be off by a unit in the last place,
// and its polygons are divided to look right.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string_view>
#include <vector>

#include "server/import/reader/BeforeAssimp.h"
#include "server/import/reader/FolderFiles.h"
#include "server/import/reader/ReadScene.h"

namespace tessera {
namespace {

constexpr std::string_view kBlank = " \t\r\v\f";
constexpr std::size_t kMaxVertices = MeshLimits{}.maxVertices;

/// Words of the lines of a text, with the number of the line.
class Lines {
public:
    explicit Lines(std::string_view text) : rest_(text) {}

    /// The next line that has words, or false at the end. `#` begins a comment; a backslash at its end joins the next
    /// line.
    bool next(std::vector<std::string_view>& words) {
        words.clear();
        while (!rest_.empty()) {
            ++line_;
            std::string_view line = rest_.substr(0, rest_.find('\n'));
            rest_.remove_prefix(std::min(line.size() + 1, rest_.size()));
            line = line.substr(0, line.find('#'));
            const auto last = line.find_last_not_of(kBlank);
            const bool goesOn = last != line.npos && line[last] == '\\';
            split(goesOn ? line.substr(0, last) : line, words);
            if (!words.empty() && !goesOn) return true;
        }
        return !words.empty();
    }
    [[nodiscard]] std::size_t line() const { return line_; }
    /// Whether it ends right behind that word.
    [[nodiscard]] bool endsBehind(std::string_view word) const {
        return rest_.empty() && word.data() + word.size() == rest_.data();
    }

private:
    static void split(std::string_view line, std::vector<std::string_view>& words) {
        for (auto at = line.find_first_not_of(kBlank); at != line.npos; at = line.find_first_not_of(kBlank)) {
            line.remove_prefix(at);
            words.push_back(line.substr(0, line.find_first_of(kBlank)));
            line.remove_prefix(words.back().size());
        }
    }

    std::string_view rest_;
    std::size_t line_ = 0;
};

/// Rounded to float once.
Expected<float> coordinate(std::string_view word) {
    const std::string_view digits = word.size() > 1 && word[0] == '+' && word[1] != '-' ? word.substr(1) : word;
    const char* end = digits.data() + digits.size();
    float value = 0;
    auto [stopped, error] = std::from_chars(digits.data(), end, value);
    if (error == std::errc::result_out_of_range) {
        // Too small for a float, or too large.
        double wide = 0;
        const auto again = std::from_chars(digits.data(), end, wide);
        if (again.ec == std::errc() && std::abs(wide) < 1) value = static_cast<float>(wide), error = std::errc();
    }
    if (error != std::errc() || stopped != end || !std::isfinite(value))
        return fail(ErrorCode::kBadInput, fmt::format("'{}' is not a coordinate", word));
    return value;
}

template <typename Integer>
bool whole(std::string_view word, Integer& value) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size();
}

class MeshBuilder {
public:
    Expected<void> vertex(std::span<const std::string_view> words) {
        if (words.size() < 3)
            return fail(ErrorCode::kBadInput, fmt::format("a vertex with {} coordinates", words.size()));
        if (vertices() >= kMaxVertices)
            return fail(ErrorCode::kLimit, fmt::format("more than {} vertices", kMaxVertices));
        for (std::size_t i = 0; i < 3; ++i) {
            const Expected<float> x = coordinate(words[i]);
            if (!x) return tl::unexpected(x.error());
            mesh_.positions.push_back(*x);
        }
        return {};
    }
    void corner(std::uint32_t index) { corners_.push_back(index); }
    void endFace() {
        for (std::size_t i = 2; i < corners_.size(); ++i)
            mesh_.indices.insert(mesh_.indices.end(), {corners_[0], corners_[i - 1], corners_[i]});
        corners_.clear();
    }
    [[nodiscard]] std::size_t vertices() const { return mesh_.positions.size() / 3; }
    /// `word` is the last that was needed.
    void endsWith(std::string_view word, const Lines& lines) {
        if (lines.endsBehind(word)) doubtfulLine_ = lines.line();
    }

    PlainScene scene(const std::string& name) {
        PlainScene out;
        if (mesh_.indices.empty()) return out;
        if (doubtfulLine_ > 0) out.note(doubtOfLastLine(doubtfulLine_));
        proto::scene::Node* node = out.file.add_node();
        node->set_name(name);
        node->mutable_geometry()->set_mesh("mesh 0");
        out.addMesh("mesh 0", std::move(mesh_));
        return out;
    }

private:
    MeshData mesh_;
    std::vector<std::uint32_t> corners_;
    std::size_t doubtfulLine_ = 0;
};

/// f a b c …, each a number from 1, or back from -1, with texture and normal numbers behind slashes.
Expected<void> objFace(std::span<const std::string_view> words, MeshBuilder& mesh) {
    for (const std::string_view word : words) {
        std::int64_t number = 0;
        const auto count = static_cast<std::int64_t>(mesh.vertices());
        const bool read = whole(word.substr(0, word.find('/')), number);
        const std::int64_t index = number > 0 ? number - 1 : count + number;
        if (!read || number == 0 || index < 0 || index >= count)
            return fail(ErrorCode::kBadInput, fmt::format("'{}' names none of the {} vertices so far", word, count));
        mesh.corner(static_cast<std::uint32_t>(index));
    }
    mesh.endFace();
    return {};
}

Expected<void> readObj(Lines& lines, MeshBuilder& mesh) {
    std::vector<std::string_view> words;
    while (lines.next(words)) {
        const std::span<const std::string_view> rest = std::span(words).subspan(1);
        const Expected<void> done = words[0] == "v"   ? mesh.vertex(rest)
                                    : words[0] == "f" ? objFace(rest, mesh)
                                                      : Expected<void>{};
        if (!done) return done;
        if (words[0] == "v" || words[0] == "f") mesh.endsWith(words.back(), lines);
    }
    return {};
}

/// The number of corners, then the vertex of each, from 0. More may follow.
Expected<void> countedFace(std::span<const std::string_view> words, MeshBuilder& mesh) {
    std::size_t corners = 0;
    if (!whole(words[0], corners) || corners > words.size() - 1)
        return fail(ErrorCode::kBadInput, "a face with fewer corners than it says");
    for (const std::string_view word : words.subspan(1, corners)) {
        std::uint32_t index = 0;
        if (!whole(word, index) || index >= mesh.vertices())
            return fail(ErrorCode::kBadInput, fmt::format("'{}' names none of the {} vertices", word, mesh.vertices()));
        mesh.corner(index);
    }
    mesh.endFace();
    return {};
}

/// OFF, counts of vertices, faces and edges, then a vertex or a face per line; what follows a face is its colour.
Expected<void> readOff(Lines& lines, MeshBuilder& mesh) {
    std::vector<std::string_view> words;
    if (!lines.next(words) || words[0] != "OFF") return fail(ErrorCode::kBadInput, "it does not begin with OFF");
    words.erase(words.begin());
    if (words.empty() && !lines.next(words)) return fail(ErrorCode::kBadInput, "it has no counts");
    std::size_t vertices = 0, faces = 0;
    if (words.size() < 2 || !whole(words[0], vertices) || !whole(words[1], faces))
        return fail(ErrorCode::kBadInput, "it has no counts of vertices and faces");
    for (std::size_t v = 0; v < vertices; ++v) {
        if (!lines.next(words)) return fail(ErrorCode::kBadInput, fmt::format("it ends after {} vertices", v));
        if (const Expected<void> done = mesh.vertex(words); !done) return done;
    }
    for (std::size_t f = 0; f < faces; ++f) {
        if (!lines.next(words)) return fail(ErrorCode::kBadInput, fmt::format("it ends after {} faces", f));
        if (const Expected<void> done = countedFace(words, mesh); !done) return done;
        std::size_t corners = 0;
        if (f + 1 == faces && whole(words[0], corners)) mesh.endsWith(words[corners], lines);
    }
    return {};
}

/// An element of a PLY file: so many lines, each with its properties in order.
struct TextPlyElement {
    std::string name;
    std::size_t count = 0;
    std::vector<std::string> properties;
    bool list = false;  ///< its first property is a list
};

Expected<std::vector<TextPlyElement>> readPlyHeader(Lines& lines) {
    std::vector<TextPlyElement> elements;
    std::vector<std::string_view> words;
    while (lines.next(words)) {
        if (words[0] == "end_header") return elements;
        if (words[0] == "element" && words.size() == 3) {
            elements.push_back({.name = std::string(words[1])});
            if (!whole(words[2], elements.back().count))
                return fail(ErrorCode::kBadInput, "an element without a count");
        } else if (words[0] == "property" && words.size() >= 3 && !elements.empty()) {
            if (elements.back().properties.empty()) elements.back().list = words[1] == "list";
            elements.back().properties.emplace_back(words.back());
        }
    }
    return fail(ErrorCode::kBadInput, "its header does not end");
}

Expected<void> readPly(Lines& lines, MeshBuilder& mesh) {
    const Expected<std::vector<TextPlyElement>> elements = readPlyHeader(lines);
    if (!elements) return tl::unexpected(elements.error());
    std::vector<std::string_view> words;
    for (const TextPlyElement& element : *elements) {
        const bool vertices = element.name == "vertex", faces = element.name == "face";
        std::array<std::size_t, 3> xyz{};
        for (std::size_t i = 0; vertices && i < 3; ++i) {
            const auto at = std::find(element.properties.begin(), element.properties.end(), std::string(1, "xyz"[i]));
            if (at == element.properties.end()) return fail(ErrorCode::kBadInput, "vertices without x, y and z");
            xyz[i] = static_cast<std::size_t>(at - element.properties.begin());
        }
        if (faces && !element.list) return fail(ErrorCode::kUnsupported, "faces whose corners do not come first");
        if (element.name == "tristrips" && element.count > 0) return fail(ErrorCode::kUnsupported, "strips");
        for (std::size_t i = 0; i < element.count; ++i) {
            if (!lines.next(words))
                return fail(ErrorCode::kBadInput,
                            fmt::format("it ends after {} of {} {}", i, element.count, element.name));
            Expected<void> done;
            if (vertices) {
                if (words.size() < element.properties.size())
                    return fail(ErrorCode::kBadInput, fmt::format("a vertex with {} numbers", words.size()));
                done = mesh.vertex(std::array{words[xyz[0]], words[xyz[1]], words[xyz[2]]});
            } else if (faces) {
                done = countedFace(words, mesh);
            }
            if (!done) return done;
            if (i + 1 == element.count) mesh.endsWith(words.back(), lines);
        }
    }
    return {};
}

Expected<void> readStl(Lines& lines, MeshBuilder& mesh) {
    std::vector<std::string_view> words;
    bool ended = true;
    while (lines.next(words)) {
        // Behind a solid's name a triangle may begin, and all may stand in one line.
        const bool isNamed = isStlWord(words[0], "solid");
        ended = isStlWord(words[0], "endsolid");
        if (ended) continue;  // with a name, whatever that is
        const auto isFacet = [](std::string_view word) { return isStlWord(word, "facet"); };
        for (auto word = isNamed ? std::ranges::find_if(words, isFacet) : words.begin(); word != words.end(); ++word) {
            ended = isStlWord(*word, "endsolid");
            if (ended) break;
            if (isStlWord(*word, "endloop")) mesh.endFace();
            if (!isStlWord(*word, "vertex")) continue;
            const Expected<void> done = mesh.vertex(std::span(word + 1, words.end()));
            if (!done) return done;
            mesh.corner(static_cast<std::uint32_t>(mesh.vertices() - 1));
        }
    }
    return ended ? Expected<void>() : fail(ErrorCode::kBadInput, "it ends without 'endsolid': it is cut off");
}

bool isTextPly(std::string_view bytes) {
    return bytes.starts_with("ply") && bytes.substr(0, bytes.find("end_header")).find("\nformat ascii") != bytes.npos;
}

}  // namespace

Expected<PlainScene> readTextMesh(const std::string& path, const std::string& extension, const ReadLimits& limits) {
    const bool known = extension == "obj" || extension == "off" || extension == "ply" || extension == "stl";
    if (!known) return fail(ErrorCode::kUnsupported, "no mesh in text");
    const Expected<Bytes> bytes = readOrdinaryFile(path, limits.maxFileBytes);
    if (!bytes) return tl::unexpected(bytes.error());
    const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    if ((extension == "ply" && !isTextPly(text)) || (extension == "stl" && !isTextStl(text)))
        return fail(ErrorCode::kUnsupported, "no mesh in text");
    Lines lines(text);
    MeshBuilder mesh;
    const Expected<void> done = extension == "obj"   ? readObj(lines, mesh)
                                : extension == "off" ? readOff(lines, mesh)
                                : extension == "ply" ? readPly(lines, mesh)
                                                     : readStl(lines, mesh);
    if (!done) return failWith(fmt::format("line {}", lines.line()), done.error());
    return mesh.scene("mesh");
}

}  // namespace tessera
