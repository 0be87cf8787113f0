// OBJ files of polygons, lines and points. What is wrong in one is blanked out first, and named (ObjMending.cpp).

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "common/geometry/Primitives.h"
#include "server/import/reader/BeforeAssimp.h"
#include "server/import/reader/MappedFile.h"
#include "server/import/reader/ObjText.h"
#include "server/import/reader/PlaceTable.h"
#include "server/import/reader/ReadProgress.h"
#include "server/import/reader/ReadScene.h"
#include "server/import/reader/SmoothNormals.h"
#include "server/import/reader/TextEncoding.h"

namespace tessera {
namespace {

/// Beyond the free ones. A group of more than a triangle takes more than that.
constexpr std::size_t kBytesPerNode = 256;

class ObjScene {
public:
    ObjScene(ObjText text, std::size_t fileBytes, PlainScene& scene, const ReadLimits& limits)
        : text_(std::move(text)),
          scene_(scene),
          limits_(limits),
          mostNodes_(std::min(limits.maxNodes, limits.freeNodes / 2 + fileBytes / kBytesPerNode)) {}

    Expected<void> build(const std::string& path) {
        const std::string folder = path.substr(0, std::max<std::size_t>(path.rfind('/'), 1));
        const FolderFiles files(folder, limits_.maxFileBytes);
        // Before any is made.
        const auto parts = std::ranges::count_if(text_.parts, [](const ObjPart& part) { return !part.empty(); });
        if (text_.objects.size() + static_cast<std::size_t>(parts) > mostNodes_) return tooMany();
        std::vector<std::string> used;
        std::set<std::string_view> known;
        for (const ObjPart& part : text_.parts)
            if (!part.empty() && !part.material.empty() && known.insert(part.material).second)
                used.push_back(part.material);
        materials_ = readObjMaterials(text_.libraries, used, path, files, limits_, scene_);
        if (std::ranges::all_of(text_.parts, &ObjPart::empty)) {
            proto::scene::Node& node = *scene_.file.add_node();
            node.set_name(foreignName(path.substr(path.rfind('/') + 1), "node"));
            addMesh(node, "", barePoints(), "");
        } else {
            if (Expected<void> built = buildObjects(); !built) return built;
        }
        noteObjMaterials(text_.names, path, files, scene_);
        return {};
    }

private:
    Expected<void> buildObjects() {
        for (const ObjPart& part : text_.parts) scene_.cornersToCome += part.places.size();
        sayConverting(0, scene_.cornersToCome);
        for (const ObjObject& object : text_.objects) {
            if (++nodes_ > mostNodes_) return tooMany();
            proto::scene::Node& node = *scene_.file.add_node();
            node.set_name(foreignName(object.name, "node"));
            for (const std::size_t number : object.parts) {
                ObjPart part = std::exchange(text_.parts[number], {});
                if (!part.points.empty()) addMesh(node, part.name, points(part.points), part.material);
                if (!part.lines.empty()) addMesh(node, part.name, lines(part.lines), part.material);
                if (!part.places.empty()) {
                    const std::string name = part.name, material = part.material;
                    Expected<MeshData> mesh = triangles(std::move(part));
                    if (!mesh) return failWith(fmt::format("'{}'", foreignName(name, "part")), mesh.error());
                    addMesh(node, name, std::move(*mesh), material);
                }
                if (nodes_ > mostNodes_) return tooMany();
            }
        }
        return {};
    }
    [[nodiscard]] tl::unexpected<Error> tooMany() const {
        return fail(ErrorCode::kLimit,
                    mostNodes_ == limits_.maxNodes
                        ? fmt::format("the scene has more than {} nodes", mostNodes_)
                        : fmt::format("its groups and materials become more than {} nodes, as many as are read of so "
                                      "few bytes: join small ones, save it in parts, or give it more by "
                                      "--import-memory",
                                      mostNodes_));
    }

    void addMesh(proto::scene::Node& parent, const std::string& name, MeshData mesh, const std::string& material) {
        if (mesh.empty()) return;
        ++nodes_;
        proto::scene::Node& node = *parent.add_node();
        node.set_name(foreignName(name, "part"));
        const std::string called = fmt::format("mesh {}", meshes_++);
        node.mutable_geometry()->set_mesh(called);
        const auto known = materials_.find(material);
        node.mutable_geometry()->set_material(known == materials_.end() ? scene_.plainMaterial() : known->second);
        scene_.addModelMesh(called, std::move(mesh), limits_);
    }

    /// Colours of vertices at these places, where the file says some; white where it says none.
    void appendColors(std::uint32_t place, std::size_t vertex, std::vector<std::uint8_t>& colors) const {
        const std::uint8_t* const said =
            4 * std::size_t{place} < text_.colors.size() ? &text_.colors[4 * std::size_t{place}] : nullptr;
        const bool isSaid = said != nullptr && said[3] != 0;
        if (!isSaid && colors.empty()) return;
        colors.resize(4 * vertex, 255);
        for (std::size_t i = 0; i < 4; ++i) colors.push_back(isSaid ? said[i] : 255);
    }
    void appendVertex(std::uint32_t place, MeshData& mesh) const {
        appendColors(place, mesh.positions.size() / 3, mesh.colors);
        const auto from = text_.positions.begin() + std::ptrdiff_t{3} * place;
        mesh.positions.insert(mesh.positions.end(), from, from + 3);
    }

    [[nodiscard]] MeshData barePoints() const {
        MeshData mesh;
        mesh.primitive = Primitive::kPoints;
        const std::size_t all = text_.positions.size() / 3;
        for (std::uint32_t place = 0; place < all; ++place) appendVertex(place, mesh);
        if (text_.normals.size() == text_.positions.size())
            for (std::size_t at = 0; at < text_.normals.size(); at += 3) appendUnit(&text_.normals[at], mesh.normals);
        return mesh;
    }
    [[nodiscard]] MeshData points(const std::vector<std::uint32_t>& places) const {
        MeshData mesh;
        mesh.primitive = Primitive::kPoints;
        for (const std::uint32_t place : places) appendVertex(place, mesh);
        return mesh;
    }
    [[nodiscard]] MeshData lines(const std::vector<std::uint32_t>& ends) {
        MeshData mesh;
        mesh.primitive = Primitive::kLines;
        for (const std::uint32_t place : ends) {
            mesh.lines.push_back(chains_.vertexAt(place, [](std::uint32_t) { return true; }));
            if (mesh.lines.back() == mesh.positions.size() / 3) appendVertex(place, mesh);
        }
        chains_.clear(ends);
        return mesh;
    }
    static bool hasDirection(const float* xyz) {
        const float length = Vec3f(xyz[0], xyz[1], xyz[2]).norm();
        return length > 1e-20f && std::isfinite(length);
    }
    /// False: it has no direction.
    static bool appendUnit(const float* xyz, std::vector<float>& normals) {
        const bool points = hasDirection(xyz);
        const Vec3f unit = points ? Vec3f(Vec3f(xyz[0], xyz[1], xyz[2]).normalized()) : Vec3f(Vec3f::UnitY());
        normals.insert(normals.end(), unit.begin(), unit.end());
        return points;
    }

    [[nodiscard]] Expected<MeshData> triangles(ObjPart part) {
        const bool hasTexcoords = !part.texcoords.empty() && !text_.texcoords.empty();
        const bool hasNormals = std::ranges::any_of(part.normals, [&](std::uint32_t normal) {
            const std::size_t at = 3 * std::size_t{normal};
            return at + 2 < text_.normals.size() && hasDirection(&text_.normals[at]);
        });
        // Corners that name the same become one vertex: these are what its vertices name.
        std::vector<std::uint32_t> places, texcoords, normals;
        for (std::size_t corner = 0; corner < part.places.size(); ++corner) {
            const std::uint32_t place = part.places[corner];
            part.places[corner] = chains_.vertexAt(place, [&](std::uint32_t vertex) {
                return (!hasTexcoords || texcoords[vertex] == part.texcoords[corner]) &&
                       (!hasNormals || normals[vertex] == part.normals[corner]);
            });
            if (chains_.size() == places.size()) continue;
            places.push_back(place);
            if (hasTexcoords) texcoords.push_back(part.texcoords[corner]);
            if (hasNormals) normals.push_back(part.normals[corner]);
        }
        chains_.clear(places);
        std::vector<std::uint32_t>().swap(part.texcoords);
        std::vector<std::uint32_t>().swap(part.normals);
        MeshData mesh;
        mesh.positions.reserve(3 * places.size());
        std::vector<std::uint32_t> without;  // vertices that have no normal
        for (std::size_t vertex = 0; vertex < places.size(); ++vertex) {
            appendVertex(places[vertex], mesh);
            if (hasTexcoords) {
                const std::size_t uv = 2 * std::size_t{texcoords[vertex]};
                const bool isSaid = uv + 1 < text_.texcoords.size();
                mesh.texcoords.insert(mesh.texcoords.end(), {isSaid ? text_.texcoords[uv] : 0.0f,
                                                             1.0f - (isSaid ? text_.texcoords[uv + 1] : 0.0f)});
            }
            if (!hasNormals) continue;
            const std::size_t xyz = 3 * std::size_t{normals[vertex]};
            constexpr std::array<float, 3> kNone{};
            if (!appendUnit(xyz + 2 < text_.normals.size() ? &text_.normals[xyz] : kNone.data(), mesh.normals))
                without.push_back(static_cast<std::uint32_t>(vertex));
        }
        if (part.lengths.empty()) {
            mesh.indices = std::move(part.places);
        } else {
            Expected<std::vector<std::uint32_t>> cut = assembleRuns({.kind = RunKind::kPolygons,
                                                                     .positions = mesh.positions,
                                                                     .indices = part.places,
                                                                     .lengths = part.lengths});
            if (!cut) return tl::unexpected(cut.error());
            mesh.indices = std::move(*cut);
        }
        if (!hasNormals) {
            setSmoothNormals(mesh);
        } else if (!without.empty()) {
            MeshData bare;
            bare.positions = mesh.positions;
            bare.indices = mesh.indices;
            computeNormals(bare);
            for (const std::uint32_t vertex : without)
                std::copy_n(&bare.normals[std::size_t{3} * vertex], 3, &mesh.normals[std::size_t{3} * vertex]);
        }
        return mesh;
    }

    ObjText text_;
    PlainScene& scene_;
    const ReadLimits& limits_;
    std::map<std::string, std::string> materials_;  ///< by their names in the file
    VertexChains chains_;                           ///< of one part after the other: none costs as much as all vertices
    std::size_t mostNodes_;
    std::size_t nodes_ = 0, meshes_ = 0;
};

}  // namespace

Expected<PlainScene> readObj(const std::string& path, const ReadLimits& limits) {
    const auto others = fail(ErrorCode::kUnsupported, "no OBJ of polygons that are sound");
    Expected<MappedFile> file = MappedFile::open(path, limits.maxFileBytes);
    if (!file) return tl::unexpected(file.error());
    if (!checkLetters(file->text())) return others;  // assimp reads those
    PlainScene scene;
    ObjText text;
    ObjText::Outcome outcome = text.read(file->text());
    if (outcome == ObjText::Outcome::kUnsound) {
        Bytes mended(file->bytes().begin(), file->bytes().end());
        file->close();
        mendObj(mended, scene.notes, &scene.missing);
        outcome = text.read(asText(mended));
    }
    const std::size_t fileBytes = file->bytes().size();
    file->close();
    if (outcome != ObjText::Outcome::kRead || text.positions.empty()) return others;
    if (Expected<void> built = ObjScene(std::move(text), fileBytes, scene, limits).build(path); !built)
        return tl::unexpected(built.error());
    return scene;
}

}  // namespace tessera
