/// Formats without a tree: as many triangles in the same places, and of OBJ names, looks and pictures.
#include <set>

#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/drawable/Drawable.h"
#include "common/drawable/SceneBounds.h"
#include "tests/unit/export/BuiltScene.h"
#include "tests/unit/export/ExportFixture.h"

namespace tessera {
namespace {

const std::string kModels = std::string(TESSERA_SOURCE_DIR) + "/tests/data/models/";

/// All triangles in the world, each from its least corner, in order; rounded to what formats in text keep.
std::vector<std::array<float, 9>> trianglesOf(const Aspect& scene) {
    std::vector<std::array<float, 9>> all;
    Action action;
    action.onNode([&](const Visit& visit) {
        const Drawable drawable = drawableOf(scene, visit.node);
        if (!drawable) return Descend::kInto;
        const MeshArrays arrays = drawable.arrays();
        if (arrays.kind != MeshKind::kTriangles) return Descend::kInto;
        const std::span<const std::uint32_t> corners = arrays.indices.as<std::uint32_t>();
        const bool mirrors = visit.world_T_node.linear().determinant() < 0;
        for (std::size_t i = 0; i + 3 <= corners.size(); i += 3) {
            std::array<std::array<float, 3>, 3> t{};
            for (std::size_t k = 0; k < 3; ++k) {
                const float* p = arrays.positions.as<float>().data() + 3 * corners[i + (mirrors ? 2 - k : k)];
                const Vec3f at = (visit.world_T_node * Vec3d(p[0], p[1], p[2])).cast<float>();
                t[k] = {at[0] + 0.0f, at[1] + 0.0f, at[2] + 0.0f};
            }
            std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
            std::array<float, 9> flat{};
            for (std::size_t k = 0; k < 9; ++k) flat[k] = t[k / 3][k % 3];
            all.push_back(flat);
        }
        return Descend::kInto;
    });
    action.run(scene);
    std::sort(all.begin(), all.end());
    return all;
}

void expectSameTriangles(const std::string& model, const std::string& ending) {
    const Scratch scratch;
    const ImportedAspect scene = readBack(model);
    const std::string out = scratch.path("out" + ending);
    const Expected<ExportReport> report = exportScene(out, *scene);
    ASSERT_TRUE(report) << model << ": " << (report ? "" : report.error().message);
    const auto before = trianglesOf(*scene);
    EXPECT_EQ(report->triangles, before.size());
    // Formats that do not say which axis is up stand as they are.
    const ImportedAspect again = readBack(out);
    EXPECT_EQ(trianglesOf(*again), before) << model << ending;
}

TEST(MeshFormats, KeepEveryTriangle) {
    for (const char* ending : {".ply", ".stl", ".obj"})
        for (const char* model : {"sunlit.glb", "stall.gltf", "wedge.stl", "rim.stl", "shell.ply", "vane.off"})
            expectSameTriangles(kModels + model, ending);
}

TEST(MeshFormats, UsdAndVrmlHaveAsManyTrianglesInTheSameBox) {
    for (const char* ending : {".usda", ".wrl"})
        for (const std::string& model :
             {kModels + "sunlit.glb", kModels + "stall.gltf", kModels + "arm.glb", kModels + "wedge.stl",
              std::string(TESSERA_SOURCE_DIR) + "/deploy/scenes/gallery/15-subdivision.tsct"}) {
            const Scratch scratch;
            const ImportedAspect scene = readBack(model);
            const std::string out = scratch.path(std::string("out") + ending);
            ASSERT_TRUE(exportScene(out, *scene)) << model;
            const ImportedAspect again = readBack(out);
            const Box before = sceneBounds(*scene), after = sceneBounds(*again);
            const double margin = 1e-3 * before.size().norm();
            EXPECT_LT((before.lower - after.lower).norm(), margin) << model << ending;
            EXPECT_LT((before.upper - after.upper).norm(), margin) << model << ending;
            EXPECT_EQ(trianglesOf(*again).size(), trianglesOf(*scene).size()) << model << ending;
        }
}

TEST(MeshFormats, KeepTheColoursOfAPly) {
    const Scratch scratch;
    BuiltScene built;
    Material red;
    red.baseColor = Vec4f(1, 0, 0, 1);
    Geometry geometry = triangleGeometry();
    geometry.material = built.add(red);
    built.node("red", built.add(geometry));
    geometry.material = {};
    geometry.colors = blobOf<std::uint8_t>({0, 255, 0, 255, 0, 255, 0, 255, 0, 255, 0, 255});
    Material white;
    white.baseColor = Vec4f::Ones();
    geometry.material = built.add(white);
    built.node("green", built.add(geometry));
    const Aspect scene = built.take();
    ASSERT_TRUE(exportScene(scratch.path("out.ply"), scene));
    const ImportedAspect again = readBack(scratch.path("out.ply"));
    std::vector<std::uint8_t> colors;
    for (const ObjectId id : again->ids())
        if (const auto* read = again->get<Geometry>(id)) {
            const auto bytes = read->colors.as<std::uint8_t>();
            colors.assign(bytes.begin(), bytes.end());
        }
    ASSERT_EQ(colors.size(), 24u);
    EXPECT_EQ(std::vector<std::uint8_t>(colors.begin(), colors.begin() + 4),
              (std::vector<std::uint8_t>{255, 0, 0, 255}));
    EXPECT_EQ(std::vector<std::uint8_t>(colors.end() - 4, colors.end()), (std::vector<std::uint8_t>{0, 255, 0, 255}));
}

TEST(MeshFormats, KeepPointsWhereThereIsNothingElse) {
    const Scratch scratch;
    const ImportedAspect scene = readBack(kModels + "swarm.ply");
    for (const char* ending : {".ply", ".obj"}) {
        const std::string out = scratch.path(std::string("out") + ending);
        ASSERT_TRUE(exportScene(out, *scene));
        const ImportedAspect again = readBack(out);
        const Box before = sceneBounds(*scene), after = sceneBounds(*again);
        EXPECT_TRUE(before.size().isApprox(after.size(), 0.05)) << ending;
    }
}

TEST(MeshFormats, AnObjHasNamesMaterialsAndPictures) {
    const Scratch scratch;
    BuiltScene built;
    Image image;
    image.pixels = blobOf<std::uint8_t>({255, 0, 0, 255, 0, 255, 0, 255});
    image.widthPx = 2;
    image.heightPx = 1;
    image.scale = Vec2f(2, 1);
    Material material;
    material.baseColor = Vec4f(0.5f, 0.25f, 1, 0.5f);
    material.metallic = 0.75f;
    material.roughness = 0.25f;
    material.baseColorImage = built.add(image);
    Geometry geometry = triangleGeometry();
    geometry.texcoords = blobOf<float>({0, 0, 0.5f, 0, 0, 0.25f});
    geometry.material = built.add(material);
    const ObjectId core = built.add(geometry);
    built.node("lid", core);
    built.node("lid", core);
    const Aspect scene = built.take();
    const Expected<ExportReport> report = exportScene(scratch.path("my box.obj"), scene);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->files, (std::vector<std::string>{scratch.path("my_box.obj.0.png"), scratch.path("my_box.obj.mtl"),
                                                       scratch.path("my box.obj")}));
    const ImportedAspect again = readBack(scratch.path("my box.obj"));
    std::set<std::string> names;
    const Material* looks = nullptr;
    const Geometry* mesh = nullptr;
    for (const ObjectId id : again->ids()) {
        if (const auto* node = again->get<Node>(id)) names.insert(node->name);
        if (const auto* read = again->get<Material>(id)) looks = read;
        if (const auto* read = again->get<Geometry>(id)) mesh = read;
    }
    EXPECT_TRUE(names.contains("lid") && names.contains("lid.2"));
    ASSERT_TRUE(looks && mesh);
    EXPECT_TRUE(looks->baseColor.isApprox(material.baseColor, 1e-5f)) << looks->baseColor.transpose();
    EXPECT_FLOAT_EQ(looks->metallic, 0.75f);
    EXPECT_FLOAT_EQ(looks->roughness, 0.25f);
    const Image* picture = again->get<Image>(looks->baseColorImage);
    ASSERT_NE(picture, nullptr);
    EXPECT_EQ(picture->pixels, image.pixels);
    // What moves the picture on the surface is in the coordinates now.
    const auto uv = mesh->texcoords.as<float>();
    EXPECT_TRUE(std::find(uv.begin(), uv.end(), 1.0f) != uv.end());
}

TEST(MeshFormats, ATreeIsATable) {
    const Scratch scratch;
    BuiltScene built;
    Transform place;
    place.translation = Vec3d(1, 2, 3);
    built.node("say \"a,b\"", built.add(triangleGeometry()), built.node("hall", built.add(place)));
    Geometry points = triangleGeometry();
    points.indices = {};
    points.primitive = Geometry::kPoints;
    points.pointRadius = 0.5;
    built.node("points", built.add(points));
    const Aspect scene = built.take();
    const Expected<ExportReport> report = exportScene(scratch.path("out.csv"), scene);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->triangles, 1u);
    std::ifstream file(scratch.path("out.csv"), std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    EXPECT_EQ(text,
              "path,type,x,y,z,size_x,size_y,size_z,triangles,material\r\n"
              "/hall,Transform,1,2,3,1,1,0,0,\r\n"
              "\"/hall/say \"\"a,b\"\"\",Geometry,1,2,3,1,1,0,1,#e7e7e7 metallic 0 roughness 0.6\r\n"
              "/points,Geometry,0,0,0,2,2,1,0,#e7e7e7 metallic 0 roughness 0.6\r\n");
}

}  // namespace
}  // namespace tessera
