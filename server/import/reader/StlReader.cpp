// STL in text and in bytes. What is wrong in one is mended first, and named (CutMeshes.cpp).

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "common/base/Utf8.h"
#include "server/import/reader/BeforeAssimp.h"
#include "server/import/reader/MappedFile.h"
#include "server/import/reader/PlaceTable.h"
#include "server/import/reader/ReadProgress.h"
#include "server/import/reader/ReadScene.h"
#include "server/import/reader/SmoothNormals.h"
#include "server/import/reader/SoundParts.h"
#include "server/import/reader/TextCursor.h"
#include "server/import/reader/TextEncoding.h"

namespace tessera {
namespace {

constexpr std::size_t kHead = 84, kFacet = 50, kCountAt = 80;
/// Of more facets each corner cannot have a vertex of its own.
constexpr std::size_t kMostFlat = 16'000'000;

using FacetPlaces = std::array<float, 9>;

/// One solid: a mesh of facets, each with its own normal and colour. Corners with the same are one vertex.
class StlSolid {
public:
    /// `facets`: as many as there may be; `isColored`: facets have colours.
    StlSolid(std::string name, bool isColored, std::size_t facets)
        : name_(std::move(name)), isSmooth_(facets > kMostFlat), isColored_(isColored) {
        indices_.reserve(3 * facets);
    }

    /// `number`: of the solid's mesh, for what is left out.
    void add(const float* normal, const FacetPlaces& places, std::uint32_t color, std::size_t number) {
        const auto first = static_cast<std::uint32_t>(3 * facets_++);
        if (!leftOut_) leftOut_.emplace(fmt::format("mesh {}{}{}", number, name_.empty() ? "" : " ", name_), "faces");
        const std::array<std::uint32_t, 3> corners = {first, first + 1, first + 2};
        if (!leftOut_->keeps(corners, first + std::size_t{3},
                             [&](std::uint32_t corner) { return stands(&places[3 * (corner - first)]); }))
            return;
        const Vec3f facing = isSmooth_ ? Vec3f(Vec3f::Zero()) : normalOf(normal, places);
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const std::uint32_t place = table_.numberOf(&places[3 * corner]);
            indices_.push_back(chains_.vertexAt(place, [&](std::uint32_t vertex) {
                return (isSmooth_ || std::equal(facing.begin(), facing.end(), &normals_[std::size_t{3} * vertex])) &&
                       (!isColored_ || colors_[vertex] == color);
            }));
            if (chains_.size() == places_.size()) continue;
            places_.push_back(place);
            if (!isSmooth_) normals_.insert(normals_.end(), facing.begin(), facing.end());
            if (isColored_) colors_.push_back(color);
        }
    }
    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] std::size_t corners() const { return indices_.size(); }
    [[nodiscard]] bool isSmooth() const { return isSmooth_; }
    /// Of facets that cannot be shown, for a note; empty: there are none.
    [[nodiscard]] std::string leftOut() const { return leftOut_ ? leftOut_->text() : std::string(); }

    [[nodiscard]] MeshData mesh() && {
        MeshData mesh;
        mesh.positions.reserve(3 * places_.size());
        for (const std::uint32_t place : places_) table_.appendPlace(place, mesh.positions);
        mesh.normals = std::move(normals_);
        for (const std::uint32_t color : colors_)
            for (int byte = 0; byte < 4; ++byte) mesh.colors.push_back(static_cast<std::uint8_t>(color >> 8 * byte));
        mesh.indices = std::move(indices_);
        table_ = {};
        chains_ = {};
        std::vector<std::uint32_t>().swap(places_);
        if (isSmooth_) setSmoothNormals(mesh);
        return mesh;
    }

private:
    /// The file's, or, where that has no direction, the triangle's.
    static Vec3f normalOf(const float* said, const FacetPlaces& places) {
        const Vec3f normal(said[0], said[1], said[2]);
        const float length = normal.norm();
        if (length > 1e-20f && std::isfinite(length)) return normal / length;
        return facetNormal(&places[0], &places[3], &places[6]);
    }

    std::string name_;
    bool isSmooth_, isColored_;
    PlaceTable table_;
    VertexChains chains_;
    std::vector<std::uint32_t> places_;  ///< of each vertex, in the table
    std::vector<float> normals_;         ///< xyz of each vertex, unless it is smooth
    std::vector<std::uint32_t> colors_;  ///< of each vertex, where it is coloured
    std::vector<std::uint32_t> indices_;
    std::size_t facets_ = 0;
    std::optional<LeftOutParts> leftOut_;
};

/// Colours of facets, in the two bytes behind each. VisCAM and SolidView: bit 15 says that there is one, blue is in the
/// lowest five bits. Magics has one for all in the header, behind "COLOR=", and red in the lowest five bits; there bit
/// 15 says that a facet has the common one, and so does 0.
class FacetColors {
public:
    explicit FacetColors(std::string_view bytes) {
        const std::size_t at = bytes.substr(0, kCountAt).find("COLOR=");
        isMagics_ = at != bytes.npos && at + 10 <= kCountAt;
        if (isMagics_) std::memcpy(&common_, bytes.data() + at + 6, sizeof(common_));
    }
    [[nodiscard]] bool isSaid(std::uint16_t attribute) const {
        return isMagics_ ? attribute != 0 && (attribute & 0x8000) == 0 : (attribute & 0x8000) != 0;
    }
    /// RGBA, red in the lowest byte.
    [[nodiscard]] std::uint32_t colorOf(std::uint16_t attribute) const {
        if (!isSaid(attribute)) return isMagics_ ? common_ : 0xff999999;
        std::uint32_t color = 0xff000000;
        for (unsigned channel = 0; channel < 3; ++channel) {
            const unsigned five = attribute >> 5 * channel & 31;
            color |= (five * 255 + 15) / 31 << 8 * (isMagics_ ? channel : 2 - channel);
        }
        return color;
    }
    [[nodiscard]] std::optional<std::uint32_t> common() const {
        return isMagics_ ? std::optional(common_) : std::nullopt;
    }

private:
    bool isMagics_ = false;
    std::uint32_t common_ = 0xff999999;
};

class StlScene {
public:
    StlScene(PlainScene& scene, const ReadLimits& limits) : scene_(scene), limits_(limits) {}

    /// False: it is not sound. `file`: where the bytes are, or null.
    bool readBytes(std::string_view bytes, const MappedFile* file) {
        if (bytes.size() < kHead) return false;
        std::uint32_t count = 0;
        std::memcpy(&count, bytes.data() + kCountAt, sizeof(count));
        if (count == 0 || bytes.size() != kHead + std::size_t{count} * kFacet) return false;
        const FacetColors colors(bytes);
        const char* const facets = bytes.data() + kHead;
        const auto attributeOf = [&](std::size_t facet) {
            std::uint16_t attribute = 0;
            std::memcpy(&attribute, facets + facet * kFacet + 48, sizeof(attribute));
            return attribute;
        };
        bool isColored = false;
        for (std::size_t facet = 0; facet < count && !isColored; ++facet) isColored = colors.isSaid(attributeOf(facet));
        if (file != nullptr) file->passed(bytes.size());
        StlSolid& solid = solids_.emplace_back("", isColored, count);
        for (std::size_t facet = 0; facet < count; ++facet) {
            constexpr std::size_t kSome = std::size_t{1} << 20;
            if (file != nullptr && facet % kSome == 0) file->passed(kHead + facet * kFacet);
            std::array<float, 12> numbers{};
            std::memcpy(numbers.data(), facets + facet * kFacet, sizeof(numbers));
            FacetPlaces places{};
            std::copy(numbers.begin() + 3, numbers.end(), places.begin());
            solid.add(numbers.data(), places, isColored ? colors.colorOf(attributeOf(facet)) : 0, 0);
        }
        if (!isColored) common_ = colors.common();
        return true;
    }

    /// False: it is not sound.
    bool readText(std::string_view text) {
        Words words(text);
        for (std::string_view word; words.next(word);) {
            if (!isStlWord(word, "solid")) return false;
            const std::string_view whole = words.name();
            constexpr std::size_t kLongest = 1000;
            const std::string name(cutUtf8(whole, kLongest));
            if (name.size() < whole.size())
                scene_.note(fmt::format("a solid's name of {} letters is cut", whole.size()));
            StlSolid& solid = solids_.emplace_back(name, false, 0);
            if (!readSolid(words, solid, solids_.size() - 1)) return false;
        }
        return !solids_.empty();
    }

    Expected<void> build() && {
        std::size_t number = 0;
        std::string said;
        for (const StlSolid& solid : solids_) scene_.cornersToCome += solid.corners();
        for (StlSolid& solid : solids_) {
            const std::size_t own = number++;
            const std::string name = solid.name(), leftOut = solid.leftOut();
            if (!leftOut.empty()) scene_.noteMissing(leftOut);
            if (solid.isSmooth())
                scene_.note(
                    fmt::format("of so many facets (more than {} million) edges below 60 degrees are shown "
                                "smooth",
                                kMostFlat / 1'000'000));
            MeshData mesh = std::move(solid).mesh();
            if (2 * own + 2 > limits_.maxNodes)
                return fail(ErrorCode::kLimit, fmt::format("the scene has more than {} nodes", limits_.maxNodes));
            if (mesh.empty() && leftOut.empty())
                scene_.note(fmt::format("the solid '{}' has no triangle", foreignName(name, "")));
            if (said.empty()) said = leftOut;
            proto::scene::Node& node = *scene_.file.add_node();
            node.set_name(foreignName(name, "node"));
            if (mesh.empty()) continue;
            proto::scene::Node& part = *node.add_node();
            part.set_name(foreignName(name, "part"));
            part.mutable_geometry()->set_mesh(fmt::format("mesh {}", own));
            part.mutable_geometry()->set_material(material());
            scene_.addModelMesh(fmt::format("mesh {}", own), std::move(mesh), limits_);
        }
        if (scene_.file.mesh().empty()) return fail(ErrorCode::kBadInput, said.empty() ? "it holds no triangle" : said);
        return {};
    }

private:
    /// Words, whatever lines they stand in.
    class Words {
    public:
        explicit Words(std::string_view text) : begin_(text.data()), at_(begin_), end_(at_ + text.size()) {}
        void tellPassed() const {
            sayProgress(static_cast<std::uint64_t>(at_ - begin_), static_cast<std::uint64_t>(end_ - begin_));
        }
        bool next(std::string_view& word) {
            TextCursor cursor(at_, end_, false);
            word = cursor.toWord() ? cursor.word() : std::string_view();
            at_ = cursor.at();
            return !word.empty();
        }
        bool pass(std::string_view expected) {
            std::string_view word;
            return next(word) && isStlWord(word, expected);
        }
        bool numbers(float* xyz) {
            TextCursor cursor(at_, end_, false);
            for (int axis = 0; axis < 3; ++axis)
                if (!cursor.number(xyz[axis])) return false;
            at_ = cursor.at();
            return true;
        }
        /// Of a solid, its first word; all goes to the end of the line, or to the first facet in it.
        std::string_view name() {
            const char* const begin = at_;
            skipLine();
            std::string_view line(begin, static_cast<std::size_t>(at_ - begin));
            for (const char* const triangle : {" facet normal ", " FACET NORMAL "})
                if (const std::size_t facet = line.find(triangle); facet != line.npos) {
                    at_ = begin + facet;
                    line = line.substr(0, facet);
                }
            TextCursor cursor(line.data(), line.data() + line.size(), false);
            return cursor.toWord() ? cursor.word() : std::string_view();
        }
        void skipLine() {
            while (at_ < end_ && *at_ != '\n' && *at_ != '\r') ++at_;
        }

    private:
        const char* begin_;
        const char* at_;
        const char* end_;
    };

    static bool readSolid(Words& words, StlSolid& solid, std::size_t number) {
        std::array<float, 3> normal{};
        FacetPlaces places{};
        for (std::string_view word; words.next(word);) {
            if (isStlWord(word, "endsolid")) {
                words.skipLine();
                return true;
            }
            if (!isStlWord(word, "facet") || !words.pass("normal") || !words.numbers(normal.data()) ||
                !words.pass("outer") || !words.pass("loop"))
                return false;
            for (std::size_t corner = 0; corner < 3; ++corner)
                if (!words.pass("vertex") || !words.numbers(&places[3 * corner])) return false;
            if (!words.pass("endloop") || !words.pass("endfacet")) return false;
            solid.add(normal.data(), places, 0, number);
            constexpr std::size_t kSome = 4096;
            if (solid.corners() % kSome == 0) words.tellPassed();
        }
        return false;  // without its end
    }

    std::string material() {
        if (!common_) return scene_.plainMaterial();
        if (material_.empty()) {
            material_ = "header";
            proto::scene::Material& message = *scene_.file.add_material();
            message.set_name(material_);
            message.set_double_sided(true);
            proto::scene::Color& color = *message.mutable_base_color();
            const auto part = [&](int byte) { return static_cast<float>(*common_ >> 8 * byte & 255) / 255.0f; };
            color.set_r(part(0));
            color.set_g(part(1));
            color.set_b(part(2));
            color.set_a(part(3));
            if (part(3) < 1) message.set_alpha_mode(proto::scene::Material::BLEND);
        }
        return material_;
    }

    PlainScene& scene_;
    const ReadLimits& limits_;
    std::vector<StlSolid> solids_;
    std::optional<std::uint32_t> common_;  ///< the colour of all facets
    std::string material_;
};

bool readInto(StlScene& stl, std::string_view bytes, const MappedFile* file) {
    if (isTextStl(bytes) && bytes.starts_with("\xef\xbb\xbf")) bytes.remove_prefix(3);
    return isTextStl(bytes) ? stl.readText(bytes) : stl.readBytes(bytes, file);
}

}  // namespace

Expected<PlainScene> readStl(const std::string& path, const ReadLimits& limits) {
    Expected<MappedFile> file = MappedFile::open(path, limits.maxFileBytes);
    if (!file) return tl::unexpected(file.error());
    if (Expected<void> letters = checkLetters(file->text()); !letters) return tl::unexpected(letters.error());
    PlainScene scene;
    std::optional<StlScene> stl(std::in_place, scene, limits);
    bool isRead = readInto(*stl, file->text(), &*file);
    if (!isRead) {
        Bytes mended(file->bytes().begin(), file->bytes().end());
        file->close();
        const Expected<bool> changed = mendStl(mended, scene.notes, &scene.missing);
        stl.emplace(scene, limits);
        isRead = changed && readInto(*stl, asText(mended), nullptr);
    }
    file->close();
    if (!isRead) return fail(ErrorCode::kUnsupported, "no STL that is sound");
    if (Expected<void> built = std::move(*stl).build(); !built) return tl::unexpected(built.error());
    return scene;
}

}  // namespace tessera
