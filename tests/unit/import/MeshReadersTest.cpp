/// OBJ, STL and PLY by our own readers beside assimp, over all models at hand: the same nodes, the same triangles,
/// lines and points, and each vertex of assimp's is one of ours, with what it has. Where that is not so, it is said
/// here by name.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <span>

#include "common/base/LowerCase.h"
#include "common/cores/Geometry.h"
#include "common/geometry/Mesh.h"
#include "server/import/reader/ReadScene.h"
#include "tests/unit/import/ImportFixture.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

/// A mesh as it is placed: its node's path, and its arrays.
struct PlacedMesh {
    std::string node;
    MeshData data;
    std::string material;  ///< what the message says of it, without its name
};

template <typename Number>
void take(const PlainScene& scene, std::uint32_t blob, std::vector<Number>& numbers) {
    if (blob == 0) return;
    const Bytes& bytes = scene.blobs.at(blob - 1);
    numbers.resize(bytes.size() / sizeof(Number));
    std::memcpy(numbers.data(), bytes.data(), bytes.size());
}

class PlacedMeshes {
public:
    explicit PlacedMeshes(const PlainScene& scene) : scene_(scene) {
        for (const proto::scene::Node& node : scene.file.node()) visit(node, "");
    }
    std::vector<PlacedMesh> meshes;
    std::vector<std::string> nodes;

private:
    void visit(const proto::scene::Node& node, const std::string& above) {
        const std::string path = above + "/" + node.name();
        nodes.push_back(path);
        if (node.has_geometry()) add(node.geometry(), path);
        for (const proto::scene::Node& child : node.node()) visit(child, path);
    }
    void add(const proto::scene::Geometry& geometry, const std::string& path) {
        const auto found = std::ranges::find(scene_.file.mesh(), geometry.mesh(), &proto::scene::Mesh::name);
        ASSERT_NE(found, scene_.file.mesh().end());
        PlacedMesh mesh{.node = path, .data = {}, .material = {}};
        take(scene_, found->positions_blob(), mesh.data.positions);
        take(scene_, found->normals_blob(), mesh.data.normals);
        take(scene_, found->texcoords_blob(), mesh.data.texcoords);
        take(scene_, found->colors_blob(), mesh.data.colors);
        take(scene_, found->indices_blob(), mesh.data.indices);
        if (found->primitive() == proto::scene::Mesh::POINTS) mesh.data.primitive = Primitive::kPoints;
        if (found->primitive() == proto::scene::Mesh::LINES) mesh.data.primitive = Primitive::kLines;
        for (proto::scene::Material material : scene_.file.material()) {
            if (material.name() != geometry.material()) continue;
            material.clear_name();
            for (const auto clear :
                 {&proto::scene::Material::clear_base_color_image, &proto::scene::Material::clear_normal_image,
                  &proto::scene::Material::clear_emissive_image, &proto::scene::Material::clear_occlusion_image,
                  &proto::scene::Material::clear_metallic_roughness_image})
                (material.*clear)();
            mesh.material = material.ShortDebugString();
        }
        meshes.push_back(std::move(mesh));
    }
    const PlainScene& scene_;
};

/// Of a triangle twice its area along its normal: whichever way polygons are cut, the sum is the same.
Vec3d areaOf(const MeshData& mesh) {
    Vec3d sum = Vec3d::Zero();
    const auto at = [&](std::size_t corner) {
        const float* const p = &mesh.positions[std::size_t{3} * mesh.indices[corner]];
        return Vec3d(p[0], p[1], p[2]);
    };
    for (std::size_t i = 0; i + 3 <= mesh.indices.size(); i += 3) sum += (at(i + 1) - at(i)).cross(at(i + 2) - at(i));
    return sum;
}

/// Vertices that something names, by cells of space.
class Vertices {
public:
    Vertices(const MeshData& mesh, double cell) : mesh_(mesh), cell_(cell) {
        for (std::uint32_t v = 0; v < mesh.positions.size() / 3; ++v) at_.emplace(cellOf(v, mesh), v);
    }
    /// One in the same cell or beside it, with the same texture coordinates and colours, and a normal of at least that
    /// cosine to it.
    [[nodiscard]] bool has(const MeshData& other, std::uint32_t vertex, double normalsDot) const {
        const std::array<std::int64_t, 3> middle = cellOf(vertex, other);
        for (int n = 0; n < 27; ++n) {
            const auto [from, to] =
                at_.equal_range({middle[0] + n % 3 - 1, middle[1] + n / 3 % 3 - 1, middle[2] + n / 9 - 1});
            for (auto found = from; found != to; ++found)
                if (isSame(found->second, other, vertex, normalsDot)) return true;
        }
        return false;
    }

private:
    [[nodiscard]] std::array<std::int64_t, 3> cellOf(std::uint32_t vertex, const MeshData& mesh) const {
        std::array<std::int64_t, 3> cell{};
        for (std::size_t axis = 0; axis < 3; ++axis)
            cell[axis] = std::llround(std::floor(mesh.positions[std::size_t{3} * vertex + axis] / cell_));
        return cell;
    }
    static bool isNear(const std::vector<float>& ours, const std::vector<float>& theirs, std::size_t each,
                       std::uint32_t our, std::uint32_t their) {
        for (std::size_t i = 0; i < each && !ours.empty() && !theirs.empty(); ++i) {
            const double a = ours[each * our + i], b = theirs[each * their + i];
            if (!(std::abs(a - b) <= 1e-5 * (1 + std::abs(b)))) return false;
        }
        return true;
    }
    [[nodiscard]] bool isSame(std::uint32_t own, const MeshData& other, std::uint32_t vertex, double normalsDot) const {
        if (!isNear(mesh_.texcoords, other.texcoords, 2, own, vertex)) return false;
        for (std::size_t i = 0; i < 4 && !mesh_.colors.empty() && !other.colors.empty(); ++i)
            if (std::abs(mesh_.colors[4 * std::size_t{own} + i] - other.colors[4 * std::size_t{vertex} + i]) > 1)
                return false;
        if (mesh_.normals.empty() || other.normals.empty()) return true;
        double dot = 0;
        for (std::size_t i = 0; i < 3; ++i)
            dot += static_cast<double>(mesh_.normals[std::size_t{3} * own + i]) *
                   other.normals[std::size_t{3} * vertex + i];
        return dot >= normalsDot;
    }
    const MeshData& mesh_;
    double cell_;
    std::multimap<std::array<std::int64_t, 3>, std::uint32_t> at_;
};

std::string endingOf(const std::string& path) {
    return lowerCase(fs::path(path).extension().string());
}

/// Where ours is not as assimp's, and why.
struct Difference {
    std::string_view file;
    bool normals = false, notes = false;  ///< that differ
};
constexpr Difference kDifferences[] = {
    // Blender wrote normals of length 0: assimp leaves them, and all facets faced upwards. Ours are the triangles'.
    {.file = "STL/Wuson.stl", .normals = true},
    // Line breaks were changed among its bytes: of normals longer than any float the directions are still ours.
    {.file = "PLY/pond.0.ply", .normals = true},
    // A solid without a facet is a fault to assimp, which drops its normals besides. Ours names it.
    {.file = "STL/triangle_with_empty_solid.stl", .notes = true},
};
Difference differenceOf(const std::string& path) {
    for (const Difference& difference : kDifferences)
        if (path.ends_with(difference.file)) return difference;
    return {};
}

void expectSame(const PlacedMesh& ours, const PlacedMesh& theirs, double normalsDot) {
    SCOPED_TRACE(ours.node);
    EXPECT_EQ(ours.data.primitive, theirs.data.primitive);
    EXPECT_EQ(ours.data.indices.size(), theirs.data.indices.size());
    EXPECT_EQ(ours.material, theirs.material);
    EXPECT_EQ(ours.data.texcoords.empty(), theirs.data.texcoords.empty());
    EXPECT_EQ(ours.data.colors.empty(), theirs.data.colors.empty());
    const Box own = boundsOf(ours.data.positions), other = boundsOf(theirs.data.positions);
    const double size = std::max(own.size().maxCoeff(), 1e-30),
                 farthest = std::max({size, own.lower.cwiseAbs().maxCoeff(), own.upper.cwiseAbs().maxCoeff()});
    EXPECT_LE((own.lower - other.lower).norm() + (own.upper - other.upper).norm(), 1e-6 * farthest);
    if (ours.data.primitive == Primitive::kTriangles)
        EXPECT_LE((areaOf(ours.data) - areaOf(theirs.data)).norm(), 1e-4 * size * farthest);
    const Vertices all(ours.data, 2e-6 * farthest);
    std::size_t lost = 0;
    const std::uint32_t count = static_cast<std::uint32_t>(theirs.data.positions.size() / 3);
    for (std::uint32_t v = 0; v < count; ++v) lost += !all.has(theirs.data, v, normalsDot);
    EXPECT_EQ(lost, 0u) << "of " << count << " vertices, where ours are " << ours.data.positions.size() / 3;
}

/// Whether a file says normals that have a direction.
bool hasNormals(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    for (std::size_t at = bytes.find("\nvn "); at != bytes.npos; at = bytes.find("\nvn ", at + 1))
        if (bytes.substr(at + 4, bytes.find('\n', at + 1) - at - 4).find_first_of("123456789") != bytes.npos)
            return true;
    return endingOf(path) == ".stl" || bytes.find("property float nx") != bytes.npos;
}

void expectAsAssimp(const std::string& path) {
    SCOPED_TRACE(path);
    const Difference known = differenceOf(path);
    const std::string ending = endingOf(path);
    const Expected<PlainScene> ours = ending == ".obj"   ? readObj(path, {})
                                      : ending == ".stl" ? readStl(path, {})
                                                         : readPly(path, {});
    if (!ours && ours.error().code == ErrorCode::kUnsupported) {
        std::fprintf(stderr, "left to assimp: %s\n", path.c_str());
        return;
    }
    const Expected<PlainScene> theirs = readWithAssimp(path, {});
    if (!theirs) {
        std::fprintf(stderr, "assimp refuses %s: %s\n", path.c_str(), theirs.error().message.c_str());
        return;
    }
    ASSERT_TRUE(ours) << ours.error().message;
    const PlacedMeshes own(*ours), other(*theirs);
    ASSERT_EQ(own.nodes, other.nodes);
    ASSERT_EQ(own.meshes.size(), other.meshes.size());
    // The file's are the same. Others are made as SmoothNormalsTest.cpp has it: assimp's depend on how polygons are
    // cut, and of a PLY's faces, which share vertices, they are the last one's.
    const double dot = !known.normals && hasNormals(path) ? 0.9999 : -2;
    for (std::size_t i = 0; i < own.meshes.size(); ++i) expectSame(own.meshes[i], other.meshes[i], dot);
    if (known.notes) return;
    for (const std::string& note : theirs->notes)
        EXPECT_TRUE(std::ranges::find(ours->notes, note) != ours->notes.end()) << note;
    EXPECT_EQ(ours->notes.size(), theirs->notes.size());
}

std::vector<std::string> folders() {
    std::vector<std::string> all{TESSERA_SOURCE_DIR "/tests/data/models"};
    for (const std::string& around : {testData(), std::string(kDebianModels)})
        for (const auto& entry :
             around.empty() || !fs::exists(around) ? fs::directory_iterator() : fs::directory_iterator(around))
            if (entry.is_directory()) all.push_back(entry.path().string());
    std::ranges::sort(all);
    return all;
}

class MeshReaders : public testing::TestWithParam<std::string> {};

TEST_P(MeshReaders, GiveWhatAssimpGives) {
    std::size_t compared = 0;
    for (const auto& entry : fs::recursive_directory_iterator(GetParam())) {
        const std::string ending = endingOf(entry.path().string());
        if (!entry.is_regular_file() || (ending != ".obj" && ending != ".stl" && ending != ".ply")) continue;
        expectAsAssimp(entry.path().string());
        ++compared;
    }
    std::fprintf(stderr, "%zu files\n", compared);
}

INSTANTIATE_TEST_SUITE_P(Each, MeshReaders, testing::ValuesIn(folders()), [](const auto& test) {
    const fs::path folder = test.param;
    std::string name = folder.parent_path().filename().string() + "_" + folder.filename().string();
    std::erase_if(name, [](unsigned char c) { return std::isalnum(c) == 0 && c != '_'; });
    return name;
});

TEST(ObjReader, ARemarkEndsWithItsLine) {
    const Scratch scratch;
    const Expected<ImportedScene> scene =
        importScene(scratch.write("a.obj", "# from C:\\models\\\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 \\\n3\n"), kRootNode,
                    importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    EXPECT_EQ(scene->triangles, 1u);
    EXPECT_TRUE(scene->notes.empty()) << scene->notes.front();
}

TEST(ObjReader, AByteOrderMarkIsNoPartOfTheFirstLine) {
    const Scratch scratch;
    const Expected<ImportedScene> scene =
        importScene(scratch.write("mark.obj", "\xef\xbb\xbfv 5 0 0\nv 1 0 0\nv 0 1 0\nv 9 9 9\nf 1 2 3\n"), kRootNode,
                    importOptions());
    ASSERT_TRUE(scene) << messageOf(scene);
    const ImportedAspect aspect{ImportedScene(*scene)};
    float most = 0;
    for (const ObjectId id : aspect->ids())
        if (const auto* geometry = aspect->get<Geometry>(id))
            for (const float x : geometry->positions.as<float>()) most = std::max(most, x);
    EXPECT_EQ(most, 5);
}

}  // namespace
}  // namespace tessera
