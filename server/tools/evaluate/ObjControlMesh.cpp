#include "server/tools/evaluate/ObjControlMesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>

namespace tessera {
namespace {

/// The words of a line, one after the other.
class ObjWords {
public:
    explicit ObjWords(std::string_view line) : rest_(line) {}
    std::string_view next() {
        const std::size_t begin = rest_.find_first_not_of(kSpace);
        if (begin == std::string_view::npos) {
            rest_ = {};
            return {};
        }
        const std::size_t end = std::min(rest_.find_first_of(kSpace, begin), rest_.size());
        const std::string_view word = rest_.substr(begin, end - begin);
        rest_.remove_prefix(end);
        return word;
    }

private:
    static constexpr std::string_view kSpace = " \t\r\v\f";
    std::string_view rest_;
};

template <typename Number>
std::optional<Number> numberOf(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    Number value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size() || word.empty()) return std::nullopt;
    return value;
}

struct ObjTag {
    std::string_view name;
    std::vector<std::uint32_t> ints;
    std::vector<float> floats;
    std::vector<std::string_view> strings;
};

class ObjControlMeshParser {
public:
    ObjControlMeshParser(std::string_view file, SubdivisionScheme scheme) : file_(file) { out_.mesh.scheme = scheme; }

    Expected<ObjControlMesh> parse(std::string_view text) {
        while (!text.empty()) {
            ++line_;
            const std::size_t end = std::min(text.find('\n'), text.size());
            if (const auto good = readLine(text.substr(0, end)); !good) return tl::unexpected(good.error());
            text.remove_prefix(std::min(end + 1, text.size()));
        }
        if (out_.mesh.faceSizes.empty())
            return fail(ErrorCode::kBadInput, fmt::format("{}: there are no faces", file_));
        for (const std::string_view name : ignoredTags_)
            out_.notes.push_back(fmt::format("the tag '{}' is passed over", name));
        return std::move(out_);
    }

private:
    tl::unexpected<Error> wrong(const std::string& what) const {
        return fail(ErrorCode::kBadInput, fmt::format("{}:{}: {}", file_, line_, what));
    }

    Expected<void> readLine(std::string_view line) {
        ObjWords words(line);
        const std::string_view what = words.next();
        if (what == "v") return readVertex(words);
        if (what == "f") return readFace(words);
        if (what == "t") return readTag(words);
        return {};
    }

    Expected<void> readVertex(ObjWords& words) {
        Vec3d p;
        for (int i = 0; i < 3; ++i) {
            const std::string_view word = words.next();
            const std::optional<double> value = numberOf<double>(word);
            if (!value)
                return wrong(word.empty() ? "a vertex needs three coordinates"
                                          : fmt::format("'{}' is no number", word.substr(0, 40)));
            p[i] = *value;
        }
        if (!p.allFinite()) return wrong("a coordinate is not finite");
        out_.mesh.positions.push_back(p);
        return {};
    }

    Expected<void> readFace(ObjWords& words) {
        std::uint32_t size = 0;
        for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
            const std::string_view vertex = word.substr(0, word.find('/'));
            const std::optional<std::int64_t> index = numberOf<std::int64_t>(vertex);
            const auto count = static_cast<std::int64_t>(out_.mesh.positions.size());
            if (!index || *index == 0) return wrong(fmt::format("'{}' is no number of a vertex", word.substr(0, 40)));
            // Vertices may come after the faces that name them; what is never defined, the topology refuses.
            if (*index < -count || *index > std::int64_t{0x7fffffff})
                return wrong(fmt::format("there is no vertex {}", *index));
            out_.mesh.faceVertices.push_back(static_cast<std::uint32_t>(*index > 0 ? *index - 1 : count + *index));
            ++size;
        }
        if (size < 3) return wrong("a face needs three vertices or more");
        out_.mesh.faceSizes.push_back(size);
        return {};
    }

    Expected<ObjTag> readTagWords(ObjWords& words) const {
        ObjTag tag{.name = words.next(), .ints = {}, .floats = {}, .strings = {}};
        std::string_view counts = words.next();
        std::array<std::uint32_t, 3> count{};
        for (std::size_t i = 0; i < 3; ++i) {
            const std::size_t end = std::min(counts.find('/'), counts.size());
            const std::optional<std::uint32_t> value = numberOf<std::uint32_t>(counts.substr(0, end));
            if (!value || (i < 2) != (end < counts.size()))
                return wrong("a tag needs its counts as INTS/FLOATS/STRINGS after its name");
            count[i] = *value;
            counts.remove_prefix(std::min(end + 1, counts.size()));
        }
        const auto bad = [&](std::string_view word) {
            return wrong(
                word.empty()
                    ? fmt::format("the tag '{}' has fewer values than it says", tag.name.substr(0, 40))
                    : fmt::format("'{}' is not what the tag '{}' needs", word.substr(0, 40), tag.name.substr(0, 40)));
        };
        for (std::uint32_t i = 0; i < count[0]; ++i) {
            const std::string_view word = words.next();
            const std::optional<std::uint32_t> value = numberOf<std::uint32_t>(word);
            if (!value) return bad(word);
            tag.ints.push_back(*value);
        }
        for (std::uint32_t i = 0; i < count[1]; ++i) {
            const std::string_view word = words.next();
            const std::optional<float> value = numberOf<float>(word);
            if (!value) return bad(word);
            tag.floats.push_back(*value);
        }
        for (std::uint32_t i = 0; i < count[2]; ++i) {
            const std::string_view word = words.next();
            if (word.empty()) return bad(word);
            tag.strings.push_back(word);
        }
        return tag;
    }

    Expected<void> readTag(ObjWords& words) {
        ObjWords copy = words;
        const std::string_view name = copy.next();
        static constexpr std::array<std::string_view, 6> kKnown{
            "crease", "corner", "hole", "interpolateboundary", "creasemethod", "smoothtriangles"};
        if (std::find(kKnown.begin(), kKnown.end(), name) == kKnown.end()) {
            if (ignoredTags_.size() < 100) ignoredTags_.insert(std::string(name.substr(0, 40)));
            return {};
        }
        const Expected<ObjTag> tag = readTagWords(words);
        if (!tag) return tl::unexpected(tag.error());
        if (name == "crease" || name == "corner") return addSharpness(*tag);
        if (name == "hole") {
            out_.mesh.holes.insert(out_.mesh.holes.end(), tag->ints.begin(), tag->ints.end());
            return {};
        }
        return setOption(*tag);
    }

    Expected<void> addSharpness(const ObjTag& tag) {
        const std::size_t each = tag.name == "crease" ? 2 : 1, count = tag.ints.size() / each;
        if (tag.ints.size() % each != 0) return wrong("a crease needs pairs of vertices");
        if (count > 0 && tag.floats.size() != 1 && tag.floats.size() != count)
            return wrong(fmt::format("a {} needs one sharpness, or one each", tag.name));
        for (std::size_t i = 0; i < count; ++i) {
            const float sharpness = tag.floats[tag.floats.size() == 1 ? 0 : i];
            if (each == 2)
                out_.mesh.creases.push_back({tag.ints[2 * i], tag.ints[2 * i + 1], sharpness});
            else
                out_.mesh.corners.push_back({tag.ints[i], sharpness});
        }
        return {};
    }

    Expected<void> setOption(const ObjTag& tag) {
        const std::string_view word = tag.strings.empty() ? std::string_view() : tag.strings.front();
        if (tag.name == "interpolateboundary") {
            if (tag.ints.size() != 1 || tag.ints[0] > 2)
                return wrong("interpolateboundary is 0 (none), 1 (edges and corners) or 2 (edges)");
            constexpr std::array kBoundaries{BoundaryInterpolation::kNone, BoundaryInterpolation::kEdgeAndCorner,
                                             BoundaryInterpolation::kEdgeOnly};
            out_.mesh.boundary = kBoundaries[tag.ints[0]];
        } else if (tag.name == "creasemethod") {
            if (word != "normal" && word != "chaikin") return wrong("creasemethod is normal or chaikin");
            out_.mesh.creaseMethod = word == "chaikin" ? CreaseMethod::kChaikin : CreaseMethod::kUniform;
        } else {
            if (word != "catmark" && word != "smooth") return wrong("smoothtriangles is catmark or smooth");
            out_.mesh.triangles = word == "smooth" ? TriangleRule::kSmooth : TriangleRule::kPolygon;
        }
        return {};
    }

    std::string_view file_;
    std::size_t line_ = 0;
    ObjControlMesh out_;
    std::set<std::string> ignoredTags_;
};

}  // namespace

Expected<ObjControlMesh> parseObjControlMesh(std::string_view text, std::string_view file, SubdivisionScheme scheme) {
    return ObjControlMeshParser(file, scheme).parse(text);
}

Expected<std::string> readSurfaceText(const std::string& path) {
    std::error_code error;
    if (std::filesystem::is_directory(path, error)) return fail(ErrorCode::kBadInput, path + ": it is a folder");
    std::ifstream in(path, std::ios::binary);
    if (!in) return fail(ErrorCode::kNotFound, path + ": it cannot be opened");
    constexpr std::size_t kMost = std::size_t{1} << 30;
    std::string text;
    std::vector<char> chunk(1 << 16);
    while (in.read(chunk.data(), static_cast<std::streamsize>(chunk.size())) || in.gcount() > 0) {
        text.append(chunk.data(), static_cast<std::size_t>(in.gcount()));
        if (text.size() > kMost) return fail(ErrorCode::kLimit, path + ": it is larger than 1 GiB");
    }
    if (in.bad()) return fail(ErrorCode::kBadInput, path + ": it cannot be read");
    if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
    return text;
}

}  // namespace tessera
