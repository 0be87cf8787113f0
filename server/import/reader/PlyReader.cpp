// PLY in text and in bytes of either order. What is wrong in one is mended first, and named (PlyMending.cpp).

#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "common/geometry/Primitives.h"
#include "server/import/reader/AssimpFiles.h"
#include "server/import/reader/AssimpMaterials.h"
#include "server/import/reader/BeforeAssimp.h"
#include "server/import/reader/MappedFile.h"
#include "server/import/reader/PlaceTable.h"
#include "server/import/reader/PlyFile.h"
#include "server/import/reader/PlyNumbers.h"
#include "server/import/reader/ReadProgress.h"
#include "server/import/reader/ReadScene.h"
#include "server/import/reader/SmoothNormals.h"
#include "server/import/reader/SoundParts.h"
#include "server/import/reader/TextEncoding.h"

namespace tessera {
namespace {

/// What a property of a vertex is for.
enum class Slot : std::uint8_t { kX, kY, kZ, kNx, kNy, kNz, kRed, kGreen, kBlue, kAlpha, kU, kV, kNone };
constexpr std::size_t kSlots = 12;

Slot slotOf(const PlyProperty& property) {
    static constexpr std::pair<std::string_view, Slot> kSlotNames[] = {
        {"x", Slot::kX},         {"y", Slot::kY},     {"z", Slot::kZ},       {"nx", Slot::kNx},
        {"ny", Slot::kNy},       {"nz", Slot::kNz},   {"red", Slot::kRed},   {"r", Slot::kRed},
        {"green", Slot::kGreen}, {"g", Slot::kGreen}, {"blue", Slot::kBlue}, {"b", Slot::kBlue},
        {"alpha", Slot::kAlpha}, {"u", Slot::kU},     {"s", Slot::kU},       {"tx", Slot::kU},
        {"texture_u", Slot::kU}, {"v", Slot::kV},     {"t", Slot::kV},       {"ty", Slot::kV},
        {"texture_v", Slot::kV}};
    if (property.isList) return Slot::kNone;
    const auto* const known =
        std::ranges::find(kSlotNames, property.name, [](const auto& name) { return std::string_view(name.first); });
    return known == std::end(kSlotNames) ? Slot::kNone : known->second;
}

/// Of a channel of that type what its greatest number stands for.
double brightestOf(const PlyType& type) {
    if (type.isFloat) return 1;
    return std::pow(2.0, 8.0 * static_cast<double>(type.bytes) - (type.isSigned ? 1 : 0)) - 1;
}

/// What is in a file, as its rows say it.
struct PlyMesh {
    bool hasFaces = false, hasNormals = false, hasColors = false, hasTexcoords = false;
    std::vector<float> positions, normals, texcoords;
    std::vector<std::uint8_t> colors;
    std::vector<std::uint32_t> corners, lengths;  ///< of faces of two corners or more; no lengths: all are triangles
    std::vector<float> cornerTexcoords;           ///< uv of each corner, or empty
    bool isSigned = false;                        ///< numbers of corners may be negative
};

/// Strict: every row is as the header says, and nothing is besides. Else what mendPly has let pass.
class PlyRows {
public:
    PlyRows(const PlyFile& file, std::string_view rows, bool isStrict)
        : file_(file), bytes_(rows.size()), numbers_(rows, file.isText(), file.isBigEndian()), isStrict_(isStrict) {}

    bool read(PlyMesh& mesh) {
        for (const PlyElement& element : file_.elements()) {
            const bool isRead = element.isOfVertices()   ? readVertices(element, mesh)
                                : element.name == "face" ? readFaces(element, mesh)
                                                         : skip(element);
            if (!isRead) return false;
        }
        if (!isStrict_) return true;
        return file_.isText() ? !numbers_.beginRow() : numbers_.rest().empty();
    }

private:
    void sayRow(std::uint64_t row) const {
        constexpr std::uint64_t kSome = 1 << 14;
        if (row % kSome == 0) sayProgress(bytes_ - numbers_.rest().size(), bytes_);
    }
    /// False: the row ends before, or a number is none.
    bool skipList(const PlyProperty& property) {
        std::uint64_t length = 0;
        double ignored = 0;
        if (!numbers_.nextLength(property.length, length)) return false;
        for (std::uint64_t i = 0; i < length; ++i)
            if (!numbers_.next(property.number, ignored)) return false;
        return true;
    }
    bool skip(const PlyElement& element) {
        for (std::uint64_t row = 0; row < element.count; ++row) {
            if (!numbers_.beginRow()) return false;
            double ignored = 0;
            for (const PlyProperty& property : element.properties)
                if (!file_.isText() &&
                    !(property.isList ? skipList(property) : numbers_.next(property.number, ignored)))
                    return false;
            (void)numbers_.endRow();
        }
        return true;
    }

    bool readVertices(const PlyElement& element, PlyMesh& mesh) {
        std::vector<Slot> slots;
        std::array<double, kSlots> scales{};
        std::array<bool, kSlots> has{};
        for (const PlyProperty& property : element.properties) {
            slots.push_back(slotOf(property));
            if (slots.back() == Slot::kNone) continue;
            has[static_cast<std::size_t>(slots.back())] = true;
            scales[static_cast<std::size_t>(slots.back())] = brightestOf(property.number);
        }
        const auto hasSlot = [&](Slot slot) { return has[static_cast<std::size_t>(slot)]; };
        if (!hasSlot(Slot::kX) || !hasSlot(Slot::kY) || !hasSlot(Slot::kZ)) return element.count == 0;
        mesh.hasNormals = hasSlot(Slot::kNx) || hasSlot(Slot::kNy) || hasSlot(Slot::kNz);
        mesh.hasTexcoords = hasSlot(Slot::kU) || hasSlot(Slot::kV);
        for (const Slot slot : {Slot::kRed, Slot::kGreen, Slot::kBlue, Slot::kAlpha})
            mesh.hasColors = mesh.hasColors || hasSlot(slot);
        // A row of text takes a letter and a break for each number, one in bytes what its types say.
        const std::size_t most = std::min<std::size_t>(element.count, numbers_.rest().size() / 3);
        mesh.positions.reserve(3 * most);
        if (mesh.hasNormals) mesh.normals.reserve(3 * most);
        if (mesh.hasTexcoords) mesh.texcoords.reserve(2 * most);
        if (mesh.hasColors) mesh.colors.reserve(4 * most);
        const bool isEven = std::ranges::none_of(element.properties, &PlyProperty::isList);
        if (!file_.isText() && isEven) return readEvenRows(element, slots, scales, hasSlot(Slot::kAlpha), mesh);
        for (std::uint64_t row = 0; row < element.count; ++row) {
            sayRow(row);
            std::array<double, kSlots + 1> values{};  // the last takes what nobody wants
            if (!numbers_.beginRow()) return false;
            for (std::size_t p = 0; p < slots.size(); ++p) {
                const PlyProperty& property = element.properties[p];
                if (property.isList ? skipList(property)
                                    : numbers_.next(property.number, values[static_cast<std::size_t>(slots[p])]))
                    continue;
                if (isStrict_ || !file_.isText()) return false;
                break;  // of what a row lacks, there is a note
            }
            if (numbers_.endRow() && isStrict_) return false;
            append(values, scales, hasSlot(Slot::kAlpha), mesh);
        }
        return true;
    }
    /// Vertices of bytes, all of the same length.
    bool readEvenRows(const PlyElement& element, const std::vector<Slot>& slots,
                      const std::array<double, kSlots>& scales, bool hasAlpha, PlyMesh& mesh) {
        struct Column {
            std::size_t offset;
            PlyType type;
            std::size_t slot;
        };
        std::vector<Column> columns;
        std::size_t length = 0;
        for (std::size_t p = 0; p < slots.size(); ++p) {
            const PlyType& type = element.properties[p].number;
            if (slots[p] != Slot::kNone) columns.push_back({length, type, static_cast<std::size_t>(slots[p])});
            length += type.bytes;
        }
        if (isPlaces(columns.size(), slots, element)) {
            if (element.count > numbers_.rest().size() / length) return false;
            const char* const rows = numbers_.pass(element.count * length);
            mesh.positions.resize(3 * element.count);
            for (std::uint64_t row = 0; row < element.count; ++row)
                std::memcpy(&mesh.positions[3 * row], rows + row * length, kPlace);
            return true;
        }
        std::array<double, kSlots + 1> values{};
        for (std::uint64_t row = 0; row < element.count; ++row) {
            const char* const begin = numbers_.pass(length);
            if (begin == nullptr) return false;
            for (const Column& column : columns)
                values[column.slot] = numbers_.numberAt(begin + column.offset, column.type);
            append(values, scales, hasAlpha, mesh);
        }
        return true;
    }
    static constexpr std::size_t kPlace = 3 * sizeof(float);
    /// Whether nothing else is wanted, and x, y and z stand in front, as they are in memory.
    [[nodiscard]] bool isPlaces(std::size_t wanted, const std::vector<Slot>& slots, const PlyElement& element) const {
        if (file_.isBigEndian() || wanted != 3) return false;
        for (std::size_t p = 0; p < 3; ++p) {
            const PlyType& type = element.properties[p].number;
            if (slots[p] != static_cast<Slot>(p) || !type.isFloat || type.bytes != sizeof(float)) return false;
        }
        return true;
    }
    static void append(const std::array<double, kSlots + 1>& values, const std::array<double, kSlots>& scales,
                       bool hasAlpha, PlyMesh& mesh) {
        const auto at = [&](Slot slot) { return values[static_cast<std::size_t>(slot)]; };
        for (const Slot slot : {Slot::kX, Slot::kY, Slot::kZ}) mesh.positions.push_back(static_cast<float>(at(slot)));
        if (mesh.hasNormals) {
            const Vec3d normal(at(Slot::kNx), at(Slot::kNy), at(Slot::kNz));
            const double length = normal.norm();
            const Vec3d unit = length > 1e-20 && std::isfinite(length) ? Vec3d(normal / length) : Vec3d(Vec3d::UnitY());
            for (const double part : unit) mesh.normals.push_back(static_cast<float>(part));
        }
        if (mesh.hasTexcoords)
            mesh.texcoords.insert(mesh.texcoords.end(),
                                  {static_cast<float>(at(Slot::kU)), 1.0f - static_cast<float>(at(Slot::kV))});
        if (!mesh.hasColors) return;
        for (const Slot slot : {Slot::kRed, Slot::kGreen, Slot::kBlue, Slot::kAlpha}) {
            const double share = at(slot) / scales[static_cast<std::size_t>(slot)];
            const bool isOpaque = slot == Slot::kAlpha && !hasAlpha;
            mesh.colors.push_back(isOpaque || !(share < 1)
                                      ? std::uint8_t{255}
                                      : static_cast<std::uint8_t>(std::lround(std::max(share, 0.0) * 255.0)));
        }
    }

    static bool namesCorners(const PlyProperty& property) {
        return property.isList && (property.name == "vertex_index" || property.name == "vertex_indices");
    }
    /// Most files have nothing else: numbers of four bytes as this machine has them, behind how many there are.
    template <typename Length>
    bool readPlainFaces(const PlyElement& element, PlyMesh& mesh) {
        constexpr std::size_t kCorner = sizeof(std::uint32_t);
        mesh.isSigned = mesh.isSigned || element.properties.front().number.isSigned;
        for (std::uint64_t row = readTriangles<Length>(element, mesh); row < element.count; ++row) {
            Length corners = 0;
            const char* const said = numbers_.pass(sizeof(corners));
            if (said == nullptr) return false;
            std::memcpy(&corners, said, sizeof(corners));
            const char* const named = numbers_.pass(std::uint64_t{corners} * kCorner);
            if (named == nullptr || corners < 2) return false;
            const std::size_t before = mesh.corners.size();
            mesh.corners.resize(before + corners);
            std::memcpy(&mesh.corners[before], named, corners * kCorner);
            addLength(before, corners, mesh);
        }
        return true;
    }
    /// Those in front, while there has been nothing else; how many.
    template <typename Length>
    std::uint64_t readTriangles(const PlyElement& element, PlyMesh& mesh) {
        constexpr std::size_t kCorners = 3 * sizeof(std::uint32_t), kRow = sizeof(Length) + kCorners;
        if (!mesh.lengths.empty()) return 0;
        const std::string_view rows = numbers_.rest();
        const std::uint64_t most = std::min<std::uint64_t>(element.count, rows.size() / kRow);
        const std::size_t before = mesh.corners.size();
        mesh.corners.resize(before + 3 * most);
        std::uint64_t triangles = 0;
        for (const char* row = rows.data(); triangles < most; ++triangles, row += kRow) {
            Length corners = 0;
            std::memcpy(&corners, row, sizeof(corners));
            if (corners != 3) break;
            std::memcpy(&mesh.corners[before + 3 * triangles], row + sizeof(corners), kCorners);
        }
        mesh.corners.resize(before + 3 * triangles);
        (void)numbers_.pass(triangles * kRow);
        return triangles;
    }
    static void addLength(std::size_t before, std::size_t corners, PlyMesh& mesh) {
        if (corners != 3 && mesh.lengths.empty()) mesh.lengths.assign(before / 3, 3);
        if (corners != 3 || !mesh.lengths.empty()) mesh.lengths.push_back(static_cast<std::uint32_t>(corners));
    }

    bool readFaces(const PlyElement& element, PlyMesh& mesh) {
        mesh.hasFaces = mesh.hasFaces || element.count > 0;
        // A face takes three numbers at least, of a byte each; in text with a blank behind each.
        mesh.corners.reserve(3 * std::min<std::size_t>(element.count, numbers_.rest().size() / 4));
        const bool isPlain = !file_.isText() && !file_.isBigEndian() && element.properties.size() == 1 &&
                             namesCorners(element.properties.front()) && mesh.cornerTexcoords.empty();
        if (isPlain) {
            const PlyType &length = element.properties.front().length, &number = element.properties.front().number;
            const bool isWhole = number.bytes == sizeof(std::uint32_t) && !number.isFloat && !length.isFloat;
            if (isWhole && length.bytes == 1 && !length.isSigned) return readPlainFaces<std::uint8_t>(element, mesh);
            if (isWhole && length.bytes == 4) return readPlainFaces<std::uint32_t>(element, mesh);
        }
        enum class Use : std::uint8_t { kCorners, kTexcoords, kNone };
        std::vector<Use> uses;
        for (const PlyProperty& property : element.properties)
            uses.push_back(namesCorners(property)                           ? Use::kCorners
                           : property.isList && property.name == "texcoord" ? Use::kTexcoords
                                                                            : Use::kNone);
        std::vector<float> texcoords;
        for (std::uint64_t row = 0; row < element.count; ++row) {
            sayRow(row);
            if (!numbers_.beginRow()) return false;
            const std::size_t before = mesh.corners.size();
            texcoords.clear();
            for (std::size_t p = 0; p < uses.size(); ++p) {
                const PlyProperty& property = element.properties[p];
                double ignored = 0;
                const bool isRead = uses[p] == Use::kCorners     ? readCorners(property, mesh)
                                    : uses[p] == Use::kTexcoords ? readTexcoords(property, texcoords)
                                    : property.isList            ? skipList(property)
                                                                 : numbers_.next(property.number, ignored);
                if (!isRead) return false;
            }
            if (numbers_.endRow() && isStrict_) return false;
            const std::size_t corners = mesh.corners.size() - before;
            if (corners < 2) return false;
            addLength(before, corners, mesh);
            if (texcoords.size() != 2 * corners && mesh.cornerTexcoords.empty()) continue;
            mesh.cornerTexcoords.resize(2 * before, 0);
            texcoords.resize(2 * corners, 0);
            mesh.cornerTexcoords.insert(mesh.cornerTexcoords.end(), texcoords.begin(), texcoords.end());
        }
        return true;
    }
    bool readCorners(const PlyProperty& property, PlyMesh& mesh) {
        std::uint64_t length = 0;
        if (!numbers_.nextLength(property.length, length)) return false;
        for (std::uint64_t i = 0; i < length; ++i) {
            double corner = 0;
            if (!numbers_.next(property.number, corner)) return false;
            // What is no number of a vertex is one that does not exist.
            constexpr double kLeast = -2147483648.0;
            const bool isOne = corner >= 0 && corner < 0xffffffff, isNegative = corner < 0 && corner >= kLeast;
            mesh.isSigned = mesh.isSigned || isNegative;
            mesh.corners.push_back(isOne        ? static_cast<std::uint32_t>(corner)
                                   : isNegative ? static_cast<std::uint32_t>(static_cast<std::int32_t>(corner))
                                                : 0xffffffffu);
        }
        return true;
    }
    bool readTexcoords(const PlyProperty& property, std::vector<float>& texcoords) {
        std::uint64_t length = 0;
        if (!numbers_.nextLength(property.length, length)) return false;
        for (std::uint64_t i = 0; i < length; ++i) {
            double value = 0;
            if (!numbers_.next(property.number, value)) return false;
            texcoords.push_back(std::isfinite(value) ? static_cast<float>(i % 2 == 0 ? value : 1 - value) : 0.0f);
        }
        return true;
    }

    const PlyFile& file_;
    std::size_t bytes_;  ///< of all rows
    PlyNumbers numbers_;
    bool isStrict_;
};

class PlyScene {
public:
    PlyScene(PlyMesh mesh, PlainScene& scene, const ReadLimits& limits)
        : source_(std::move(mesh)), scene_(scene), limits_(limits) {}

    Expected<void> build(const std::string& path, std::string_view header) {
        proto::scene::Node& node = *scene_.file.add_node();
        node.set_name("node");
        const std::string material = materialOf(path, header);
        if (!source_.hasFaces) {
            MeshData points = vertices();
            points.primitive = Primitive::kPoints;
            if (const std::string leftOut = keepSoundParts(points, "mesh 0"); !leftOut.empty())
                scene_.noteMissing(leftOut);
            addMesh(node, std::move(points), material);
            return {};
        }
        const std::string leftOut = keepSoundFaces();
        if (!leftOut.empty()) scene_.noteMissing(leftOut);
        if (!lines_.empty()) {
            MeshData lines = vertices();
            lines.normals.clear();
            lines.primitive = Primitive::kLines;
            lines.lines = std::move(lines_);
            addMesh(node, std::move(lines), material);
        }
        if (!source_.corners.empty()) {
            scene_.cornersToCome = source_.corners.size();
            sayConverting(0, scene_.cornersToCome);
            Expected<MeshData> mesh = triangles();
            if (!mesh) return tl::unexpected(mesh.error());
            addMesh(node, std::move(*mesh), material);
        }
        if (meshes_ == 0) return fail(ErrorCode::kBadInput, leftOut.empty() ? "it holds no face" : leftOut);
        return {};
    }

private:
    [[nodiscard]] MeshData vertices() const {
        MeshData mesh;
        mesh.positions = source_.positions;
        mesh.normals = source_.normals;
        mesh.texcoords = source_.texcoords;
        mesh.colors = source_.colors;
        return mesh;
    }
    void addMesh(proto::scene::Node& parent, MeshData mesh, const std::string& material) {
        if (mesh.empty()) return;
        const std::string name = fmt::format("mesh {}", meshes_++);
        proto::scene::Node& part = *parent.add_node();
        part.set_name("part");
        part.mutable_geometry()->set_mesh(name);
        part.mutable_geometry()->set_material(material);
        scene_.addModelMesh(name, std::move(mesh), limits_);
    }

    /// Of faces: those of vertices that exist and stand somewhere stay; those of two corners become lines. Vertices
    /// that stand nowhere are moved to one that does: nothing names them any more, and they extend nothing.
    std::string keepSoundFaces() {
        const std::size_t count = source_.positions.size() / 3;
        const auto stood = [&](std::size_t vertex) { return stands(&source_.positions[3 * vertex]); };
        LeftOutParts leftOut("mesh 0", "faces",
                             source_.isSigned ? LeftOutParts::Numbers::kSigned : LeftOutParts::Numbers::kPlain);
        const bool hasLengths = !source_.lengths.empty(), hasTexcoords = !source_.cornerTexcoords.empty();
        const std::size_t faces = hasLengths ? source_.lengths.size() : source_.corners.size() / 3;
        std::size_t from = 0, to = 0, kept = 0;
        for (std::size_t face = 0; face < faces; ++face) {
            const std::size_t corners = hasLengths ? source_.lengths[face] : 3;
            const std::span<const std::uint32_t> named = std::span(source_.corners).subspan(from, corners);
            const std::size_t begin = std::exchange(from, from + corners);
            if (!leftOut.keeps(named, count, stood)) continue;
            if (corners == 2) {
                lines_.insert(lines_.end(), named.begin(), named.end());
                continue;
            }
            for (std::size_t i = 0; i < corners; ++i) {
                source_.corners[to + i] = source_.corners[begin + i];
                for (std::size_t k = 0; k < 2 && hasTexcoords; ++k)
                    source_.cornerTexcoords[2 * (to + i) + k] = source_.cornerTexcoords[2 * (begin + i) + k];
            }
            if (hasLengths) source_.lengths[kept++] = static_cast<std::uint32_t>(corners);
            to += corners;
        }
        source_.corners.resize(to);
        source_.cornerTexcoords.resize(hasTexcoords ? 2 * to : 0);
        source_.lengths.resize(kept);
        std::array<float, 3> somewhere = {0, 0, 0};
        std::size_t vertex = 0;
        while (vertex < count && !stood(vertex)) ++vertex;
        if (vertex < count) std::copy_n(&source_.positions[3 * vertex], 3, somewhere.begin());
        for (std::size_t v = 0; v < count; ++v)
            if (!stood(v)) std::ranges::copy(somewhere, &source_.positions[3 * v]);
        return leftOut.text();
    }

    [[nodiscard]] Expected<MeshData> triangles() {
        if (!source_.cornerTexcoords.empty()) splitByTexcoords();
        MeshData mesh;
        mesh.positions = std::move(source_.positions);
        mesh.normals = std::move(source_.normals);
        mesh.texcoords = std::move(source_.texcoords);
        mesh.colors = std::move(source_.colors);
        if (source_.lengths.empty()) {
            mesh.indices = std::move(source_.corners);
        } else {
            Expected<std::vector<std::uint32_t>> cut = assembleRuns({.kind = RunKind::kPolygons,
                                                                     .positions = mesh.positions,
                                                                     .indices = source_.corners,
                                                                     .lengths = source_.lengths});
            if (!cut) return tl::unexpected(cut.error());
            mesh.indices = std::move(*cut);
        }
        if (mesh.normals.empty()) setSmoothNormals(mesh);
        return mesh;
    }
    /// Corners of one vertex with other texture coordinates are another vertex.
    void splitByTexcoords() {
        VertexChains chains;
        std::vector<std::uint32_t> sources;
        std::vector<float> texcoords;
        for (std::size_t corner = 0; corner < source_.corners.size(); ++corner) {
            const std::uint32_t vertex = source_.corners[corner];
            const float* const uv = &source_.cornerTexcoords[2 * corner];
            source_.corners[corner] = chains.vertexAt(vertex, [&](std::uint32_t made) {
                return texcoords[std::size_t{2} * made] == uv[0] && texcoords[std::size_t{2} * made + 1] == uv[1];
            });
            if (chains.size() == sources.size()) continue;
            sources.push_back(vertex);
            texcoords.insert(texcoords.end(), {uv[0], uv[1]});
        }
        PlyMesh split;
        const auto take = [](const auto& from, std::size_t each, std::uint32_t vertex, auto& to) {
            if (from.empty()) return;
            const auto begin = from.begin() + static_cast<std::ptrdiff_t>(each * vertex);
            to.insert(to.end(), begin, begin + static_cast<std::ptrdiff_t>(each));
        };
        for (const std::uint32_t source : sources) {
            take(source_.positions, 3, source, split.positions);
            take(source_.normals, 3, source, split.normals);
            take(source_.colors, 4, source, split.colors);
        }
        source_.positions = std::move(split.positions);
        source_.normals = std::move(split.normals);
        source_.colors = std::move(split.colors);
        source_.texcoords = std::move(texcoords);
    }

    /// The picture that a comment names, as assimp reads it of a file of one triangle; else plain, and white where
    /// vertices have colours, which are as they are.
    std::string materialOf(const std::string& path, std::string_view header) {
        constexpr std::string_view kPicture = "\ncomment TextureFile ";
        if (const std::size_t at = header.find(kPicture); at != header.npos) {
            const std::string_view line = header.substr(at, header.find_first_of("\r\n", at + 1) - at);
            const std::string text = fmt::format(
                "ply\nformat ascii 1.0{}\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                "property float s\nproperty float t\nelement face 1\nproperty list uchar int vertex_indices\n"
                "end_header\n0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n",
                line);
            const FolderFiles files(path.substr(0, std::max<std::size_t>(path.rfind('/'), 1)), limits_.maxFileBytes);
            // Never deleted, as in AssimpReader.cpp: what it holds is looked at until the process ends.
            Assimp::Importer& importer = *new Assimp::Importer;
            importer.SetIOHandler(new InPlaceOf(files, path, text));
            const aiScene* const read = importer.ReadFile(path, 0);
            if (read != nullptr && read->mNumMeshes > 0) {
                AssimpMaterials materials(*read, files, limits_, true, scene_);
                const std::string name = materials.name(read->mMeshes[0]->mMaterialIndex);
                materials.finish();
                if (!name.empty()) return name;
            }
        }
        if (!source_.hasColors) return scene_.plainMaterial();
        proto::scene::Material& message = *scene_.file.add_material();
        message.set_name("white");
        message.set_double_sided(true);
        for (const auto set : {&proto::scene::Color::set_r, &proto::scene::Color::set_g, &proto::scene::Color::set_b,
                               &proto::scene::Color::set_a})
            (message.mutable_base_color()->*set)(1.0f);
        return message.name();
    }

    PlyMesh source_;
    PlainScene& scene_;
    const ReadLimits& limits_;
    std::vector<std::uint32_t> lines_;
    std::size_t meshes_ = 0;
};

/// False: it is not sound, or has what others read.
bool readInto(std::string_view bytes, bool isStrict, PlyMesh& mesh, std::string& header,
              std::vector<std::string>& notes) {
    PlyFile file(bytes);
    if (!file.readHeader() || file.joinsFaces()) return false;
    const auto isMaterial = [](const PlyElement& element) { return element.name == "material" && element.count > 0; };
    if (std::ranges::any_of(file.elements(), isMaterial)) return false;
    // Of a text's last number without a line break nobody knows whether it is whole.
    if (isStrict && file.isText() && !bytes.ends_with('\n')) return false;
    if (isStrict && !notePlyHeader(file, notes)) return false;
    header = bytes.substr(0, file.bodyBegin());
    return PlyRows(file, bytes.substr(file.bodyBegin()), isStrict).read(mesh) && !mesh.positions.empty();
}

}  // namespace

Expected<PlainScene> readPly(const std::string& path, const ReadLimits& limits) {
    Expected<MappedFile> file = MappedFile::open(path, limits.maxFileBytes);
    if (!file) return tl::unexpected(file.error());
    if (Expected<void> letters = checkLetters(file->text()); !letters) return tl::unexpected(letters.error());
    PlainScene scene;
    PlyMesh mesh;
    std::string header;
    bool isRead = readInto(file->text(), true, mesh, header, scene.notes);
    if (!isRead) {
        Bytes mended(file->bytes().begin(), file->bytes().end());
        file->close();
        scene.notes.clear();
        mesh = {};
        const Expected<bool> changed = mendPly(mended, scene.notes, &scene.missing);
        isRead = changed && readInto(asText(mended), false, mesh, header, scene.notes);
    }
    file->close();
    if (!isRead) return fail(ErrorCode::kUnsupported, "no PLY that is sound");
    if (Expected<void> built = PlyScene(std::move(mesh), scene, limits).build(path, header); !built)
        return tl::unexpected(built.error());
    return scene;
}

}  // namespace tessera
