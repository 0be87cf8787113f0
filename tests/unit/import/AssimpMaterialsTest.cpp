// Materials of the formats that assimp reads.

#include <fmt/format.h>

#include <algorithm>

#include "common/cores/Geometry.h"
#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "tests/support/words/Words.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

/// What one material of a file became.
struct Painted {
    ImportedScene scene;
    std::unique_ptr<ImportedAspect> aspect;
    Material material;

    [[nodiscard]] const Image* image(ObjectId id) const { return (*aspect)->get<Image>(id); }
    [[nodiscard]] const Geometry* geometry() const { return allOf<Geometry>(*aspect).at(0); }
};

Painted importedPaint(const Scratch& scratch, const std::string& name, const std::string& text) {
    scratch.write("red.tga", pictureOf({{255, 0, 0, 0}, {255, 0, 0, 255}}));
    scratch.write("one.tga", pictureOf({{1, 2, 3, 255}}));
    Expected<ImportedScene> scene = importScene(scratch.write(name, text), kRootNode, importOptions());
    EXPECT_TRUE(scene) << messageOf(scene);
    Painted painted;
    if (!scene) return painted;
    painted.scene = *scene;
    painted.aspect = std::make_unique<ImportedAspect>(std::move(*scene));
    for (const Geometry* geometry : allOf<Geometry>(*painted.aspect))
        if (const auto* material = (*painted.aspect)->get<Material>(geometry->material)) painted.material = *material;
    return painted;
}

/// An OBJ file of one triangle with this material.
Painted painted(const std::string& material) {
    const Scratch scratch;
    scratch.write("paint.mtl", "newmtl paint\nKd 1 1 1\n" + material);
    return importedPaint(
        scratch, "model.obj",
        "mtllib paint.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl paint\nf 1/1 2/2 3/3\n");
}

TEST(ObjMaterial, BlendsWhereItIsNotOpaque) {
    EXPECT_EQ(painted("").material.alphaMode, Material::kAutoAlpha);
    const Material glass = painted("d 0.25\n").material;
    EXPECT_EQ(glass.alphaMode, Material::kBlend);
    EXPECT_FLOAT_EQ(glass.baseColor.w(), 0.25f);
}

TEST(ObjMaterial, BlendsWhereOnePictureIsColourAndOpacity) {
    const Painted leaf = painted("map_Kd red.tga\nmap_d red.tga\n");
    EXPECT_EQ(leaf.material.alphaMode, Material::kBlend);
    EXPECT_TRUE(leaf.scene.notes.empty());
    const Painted other = painted("map_Kd red.tga\nmap_d one.tga\n");
    EXPECT_EQ(other.material.alphaMode, Material::kAutoAlpha);
    EXPECT_WORDS(notesIn(other.scene));
}

TEST(ObjMaterial, TakesNormalAndEmissivePicturesAndNamesTheOthers) {
    const Painted lamp = painted("map_Kd red.tga\nnorm one.tga\nmap_Ke one.tga\nbump one.tga\nmap_Ks one.tga\n");
    ASSERT_NE(lamp.image(lamp.material.normalImage), nullptr);
    EXPECT_EQ(lamp.image(lamp.material.normalImage)->widthPx, 1);
    EXPECT_EQ(lamp.material.emissiveImage, lamp.material.normalImage);
    EXPECT_EQ(lamp.material.emissive, Vec3f(1, 1, 1)) << "black beside a picture would leave it dark";
    EXPECT_NE(lamp.material.baseColorImage, lamp.material.normalImage);
    EXPECT_WORDS(notesIn(lamp.scene));
    EXPECT_EQ(lamp.scene.notes.size(), 2u);
    EXPECT_EQ(painted("map_Ke one.tga\nKe 0 0.5 0\n").material.emissive, Vec3f(0, 0.5f, 0));
}

TEST(ObjMaterial, PacksMetalAndRoughnessIntoOnePicture) {
    const Painted iron = painted("map_Pr red.tga\nmap_Pm one.tga\n");
    const Image* packed = iron.image(iron.material.metallicRoughnessImage);
    ASSERT_NE(packed, nullptr);
    const auto pixels = packed->pixels.as<std::uint8_t>();
    EXPECT_EQ(std::vector<std::uint8_t>(pixels.begin(), pixels.end()),
              (std::vector<std::uint8_t>{255, 255, 1, 255, 255, 255, 1, 255}))
        << "green: the red of map_Pr; blue: that of map_Pm, in the size of the larger";
    EXPECT_FLOAT_EQ(iron.material.metallic, 1);
    EXPECT_FLOAT_EQ(iron.material.roughness, 1);
    EXPECT_TRUE(iron.scene.notes.empty()) << iron.scene.notes.front();
    const Painted rough = painted("map_Pr one.tga\nPm 0.5\n");
    ASSERT_NE(rough.image(rough.material.metallicRoughnessImage), nullptr);
    EXPECT_EQ(rough.image(rough.material.metallicRoughnessImage)->pixels.as<std::uint8_t>()[1], 1);
    EXPECT_EQ(rough.image(rough.material.metallicRoughnessImage)->pixels.as<std::uint8_t>()[2], 255);
    EXPECT_FLOAT_EQ(rough.material.metallic, 0.5f);
    const Painted both = painted("map_Pr red.tga\nmap_Pm red.tga\n");
    EXPECT_EQ(both.image(both.material.metallicRoughnessImage)->pixels.as<std::uint8_t>()[1], 0) << "as it is";
}

TEST(ObjMaterial, ClampsAPictureWhereItSaysSo) {
    const Painted repeated = painted("map_Kd red.tga\n"), clamped = painted("map_Kd -clamp on red.tga\n");
    EXPECT_EQ(repeated.image(repeated.material.baseColorImage)->wrapU, Image::kRepeat);
    EXPECT_EQ(clamped.image(clamped.material.baseColorImage)->wrapU, Image::kClamp);
    EXPECT_EQ(clamped.image(clamped.material.baseColorImage)->wrapV, Image::kClamp);
}

/// One triangle with two sets of texture coordinates.
std::string collada(const std::string& texcoord, const std::string& placement) {
    const auto source = [](const char* id, const char* numbers, int width, const char* names) {
        std::string params;
        for (const char* c = names; *c != 0; ++c) params += fmt::format(R"(<param name="{}" type="float"/>)", *c);
        return fmt::format(R"(<source id="{0}"><float_array id="{0}-a" count="{2}">{1}</float_array><technique_common>
            <accessor source="#{0}-a" count="3" stride="{3}">{4}</accessor></technique_common></source>)",
                           id, numbers, 3 * width, width, params);
    };
    return fmt::format(
        R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>
        <up_axis>Y_UP</up_axis></asset>
        <library_images><image id="red"><init_from>red.tga</init_from></image></library_images>
        <library_effects><effect id="e"><profile_COMMON>
          <newparam sid="f"><surface type="2D"><init_from>red</init_from></surface></newparam>
          <newparam sid="s"><sampler2D><source>f</source></sampler2D></newparam>
          <technique sid="t"><lambert><diffuse><texture texture="s" texcoord="{}"><extra>
          <technique profile="MAYA">{}</technique></extra></texture></diffuse></lambert></technique>
        </profile_COMMON></effect></library_effects>
        <library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
        <library_geometries><geometry id="g"><mesh>{}{}{}<vertices id="v"><input semantic="POSITION" source="#p"/>
        </vertices>
          <triangles count="1" material="mm"><input semantic="VERTEX" source="#v" offset="0"/>
          <input semantic="TEXCOORD" source="#t0" offset="0" set="0"/>
          <input semantic="TEXCOORD" source="#t1" offset="0" set="1"/>
          <p>0 1 2</p></triangles></mesh></geometry></library_geometries>
        <library_visual_scenes><visual_scene id="vs"><node id="n"><instance_geometry url="#g"><bind_material>
        <technique_common>
          <instance_material symbol="mm" target="#m">
          <bind_vertex_input semantic="UVSET1" input_semantic="TEXCOORD" input_set="1"/>
          </instance_material></technique_common></bind_material></instance_geometry></node></visual_scene>
          </library_visual_scenes>
        <scene><instance_visual_scene url="#vs"/></scene></COLLADA>)",
        texcoord, placement, source("p", "0 0 0 1 0 0 0 1 0", 3, "XYZ"), source("t0", "0 0 1 0 0 1", 2, "ST"),
        source("t1", "0 0 0.5 0 0 0.5", 2, "ST"));
}

TEST(ObjMaterial, SaysWhichLibrariesAndMaterialsAreNotThereAndWhatOfAnImageIsNotRead) {
    const Scratch scratch;
    scratch.write("there.mtl", "newmtl red\nKd 1 0 0\n map_Kd -s 2 2 1 -o .5 .5 0 one.tga\n");
    const Painted painted =
        importedPaint(scratch, "model.obj",
                      "mtllib there.mtl\nmtllib gone.mtl\nmtllib ../out.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n"
                      "usemtl nope\nf 1 2 3\nusemtl red\nf 3 2 1\n");
    const auto& notes = painted.scene.notes;
    const auto says = [&](const char* what) {
        return std::count_if(notes.begin(), notes.end(),
                             [&](const std::string& note) { return note.find(what) != note.npos; });
    };
    for (const std::string& note : notes) EXPECT_WORDS(note);
    EXPECT_EQ(says("'red'") + says("there.mtl"), 0);
}

TEST(ObjMaterial, LibrariesAreFoundAsToolsOfOtherSystemsNameThem) {
    for (const char* named : {"C:\\Users\\me\\LOOKS.MTL", "Parts/looks.mtl", "..\\looks.Mtl", "/home/me/looks.mtl"}) {
        const Scratch scratch;
        scratch.write("looks.mtl", "newmtl red\nKd 1 0 0\n");
        // One that assimp would take instead, as it has the model's name.
        scratch.write("model.mtl", "newmtl red\nKd 0 1 0\n");
        const Painted painted =
            importedPaint(scratch, "model.obj",
                          std::string("mtllib ") + named + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n");
        EXPECT_EQ(painted.material.baseColor.x(), 1) << named;
        EXPECT_EQ(painted.material.baseColor.y(), 0) << named;
        ASSERT_EQ(painted.scene.notes.size(), 1u) << named;
        EXPECT_WORDS(painted.scene.notes[0]);
    }
}

TEST(ColladaMaterial, TakesTheSecondTextureCoordinatesAndHowAPictureGoesOn) {
    const Scratch scratch;
    const Painted painted =
        importedPaint(scratch, "model.dae", collada("UVSET1", "<wrapU>1</wrapU><mirrorU>1</mirrorU><wrapV>0</wrapV>"));
    const Image* image = painted.image(painted.material.baseColorImage);
    ASSERT_NE(image, nullptr);
    EXPECT_EQ(image->texcoordSet, 1);
    EXPECT_EQ(image->wrapU, Image::kMirror);
    EXPECT_EQ(image->wrapV, Image::kClamp);
    const auto second = painted.geometry()->texcoords1.as<float>();
    EXPECT_EQ(std::vector<float>(second.begin(), second.end()), (std::vector<float>{0, 1, 0.5f, 1, 0, 0.5f}))
        << "from the upper left corner";
}

TEST(ColladaMaterial, PlacesAPictureWhereItSaysSo) {
    const Scratch scratch;
    const Painted painted = importedPaint(
        scratch, "model.dae",
        collada("UVSET0", "<repeatU>2</repeatU><repeatV>4</repeatV><offsetU>0.25</offsetU><offsetV>0.5</offsetV>"));
    const Image* image = painted.image(painted.material.baseColorImage);
    ASSERT_NE(image, nullptr);
    EXPECT_EQ(image->scale, Vec2f(2, 4));
    // From below, (u, v) becomes (2 u + 0.25, 4 v + 0.5); from above, v is 1 - v before and after.
    EXPECT_EQ(image->offset, Vec2f(0.25f, 1 - 4 - 0.5f));
}

}  // namespace
}  // namespace tessera
