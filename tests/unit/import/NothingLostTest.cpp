// All models at hand. Of glTF 2, OBJ, OFF, PLY and STL what was counted in the file is in the scene, or a note speaks
// of it; of other formats something is shown, or a note speaks. What is refused says why.

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "common/cores/Animation.h"
#include "common/cores/Camera.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/Geometry.h"
#include "common/cores/Image.h"
#include "common/cores/Material.h"
#include "common/cores/PointLight.h"
#include "common/cores/Skin.h"
#include "common/cores/SpotLight.h"
#include "common/scene/Action.h"
#include "common/scene/FieldTable.h"
#include "tests/unit/import/FileCensus.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

/// What lies beside models and is none. All other files are imported.
const std::set<std::string> kNoModels = {".png", ".jpg", ".jpeg", ".bmp",  ".tga",  ".txt", ".md",       ".bin",
                                         ".mtl", ".csv", ".glsl", ".frag", ".vert", ".uc",  ".material", ".py"};

std::vector<std::string> modelsBelow(const fs::path& folder) {
    std::vector<std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        std::string extension = entry.path().extension().string();
        std::transform(extension.begin(), extension.end(), extension.begin(),
                       [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        if (entry.is_regular_file() && kNoModels.count(extension) == 0) files.push_back(entry.path().string());
    }
    std::sort(files.begin(), files.end());
    return files;
}

/// The word of a field, as files have it.
template <auto kMember>
std::string wordOf(const typename FieldMember<decltype(kMember)>::Core& object) {
    const FieldEntry& field = *findField(*findType(FieldMember<decltype(kMember)>::Core::kType), fieldId<kMember>);
    return wordOfNumber(field, object.*kMember).value_or("?");
}

TextureLine shownTexture(const Image& image) {
    return {.texcoordSet = static_cast<int>(image.texcoordSet),
            .wrapU = wordOf<&Image::wrapU>(image),
            .wrapV = wordOf<&Image::wrapV>(image),
            .magnification = wordOf<&Image::magnification>(image),
            .minification = wordOf<&Image::minification>(image),
            .offsetU = image.offset.x(),
            .offsetV = image.offset.y(),
            .scaleU = image.scale.x(),
            .scaleV = image.scale.y(),
            .rotation = image.rotation};
}

std::string shownMaterial(const ImportedAspect& aspect, const Material& material) {
    MaterialLine line{.alphaMode = wordOf<&Material::alphaMode>(material),
                      .alphaCutoff = material.alphaCutoff,
                      .normalScale = material.normalScale,
                      .occlusionStrength = material.occlusionStrength,
                      .clearcoat = material.clearcoat,
                      .clearcoatRoughness = material.clearcoatRoughness,
                      .transmission = material.transmission,
                      .specular = material.specular,
                      .specularRed = material.specularColor.x(),
                      .specularGreen = material.specularColor.y(),
                      .specularBlue = material.specularColor.z(),
                      .ior = material.ior,
                      .doubleSided = material.doubleSided,
                      .unlit = material.unlit};
    const std::pair<const char*, ObjectId> slots[] = {{"base color", material.baseColorImage},
                                                      {"metallic roughness", material.metallicRoughnessImage},
                                                      {"normal", material.normalImage},
                                                      {"occlusion", material.occlusionImage},
                                                      {"emissive", material.emissiveImage}};
    for (const auto& [slot, id] : slots)
        if (const auto* image = aspect->get<Image>(id)) line.textures[slot] = shownTexture(*image);
    return materialLine(line);
}

/// The same of a scene. `toBeNamed` stays empty.
FileCensus sceneCensus(const ImportedAspect& aspect) {
    FileCensus census;
    Action action;
    action.on<Geometry>([&](const Visit&, const Geometry& geometry) {
        if (geometry.primitive == Geometry::kPoints)
            census.points += geometry.positions.sizeBytes() / 12;
        else if (geometry.primitive == Geometry::kLines)
            census.lines += geometry.indices.sizeBytes() / 8;
        else
            census.triangles += geometry.indices.sizeBytes() / 12;
        const std::pair<const char*, const Blob*> attributes[] = {{"POSITION", &geometry.positions},
                                                                  {"TEXCOORD_0", &geometry.texcoords},
                                                                  {"TEXCOORD_1", &geometry.texcoords1},
                                                                  {"TANGENT", &geometry.tangents},
                                                                  {"COLOR_0", &geometry.colors}};
        for (const auto& [name, blob] : attributes) census.parts[name] += !blob->empty();
        return Descend::kInto;
    });
    action.on<Skin>([&](const Visit&, const Skin& skin) {
        census.triangles += skin.indices.sizeBytes() / 12;
        const std::pair<const char*, const Blob*> attributes[] = {
            {"POSITION", &skin.positions}, {"TEXCOORD_0", &skin.texcoords}, {"TEXCOORD_1", &skin.texcoords1},
            {"TANGENT", &skin.tangents},   {"COLOR_0", &skin.colors},       {"joints", &skin.jointIndices}};
        for (const auto& [name, blob] : attributes) census.parts[name] += !blob->empty();
        if (!skin.positions.empty())
            census.parts["target"] += skin.morphPositions.sizeBytes() / skin.positions.sizeBytes();
        return Descend::kInto;
    });
    action.on<Animation>([&](const Visit&, const Animation& animation) {
        ++census.parts["animation"];
        // Weights drive each part of a mesh.
        std::set<std::pair<BlobId, BlobId>> channels;
        for (const ObjectId id : animation.channels) {
            const auto& frames = *aspect->get<KeyFrames>(id);
            census.parts["channel"] +=
                frames.field != "weights" || channels.insert({frames.times.id(), frames.values.id()}).second;
        }
        return Descend::kInto;
    });
    action.run(*aspect);
    census.parts["image"] = allOf<Image>(aspect).size();
    census.parts["camera"] = allOf<Camera>(aspect).size();
    census.parts["light"] =
        allOf<DirectionalLight>(aspect).size() + allOf<PointLight>(aspect).size() + allOf<SpotLight>(aspect).size();
    for (const Material* material : allOf<Material>(aspect)) census.materials.insert(shownMaterial(aspect, *material));
    return census;
}

void expectSame(const std::multiset<std::string>& said, const std::multiset<std::string>& is) {
    std::vector<std::string> lost, new_;
    std::set_difference(said.begin(), said.end(), is.begin(), is.end(), std::back_inserter(lost));
    std::set_difference(is.begin(), is.end(), said.begin(), said.end(), std::back_inserter(new_));
    for (const std::string& line : lost) ADD_FAILURE() << "in the file: " << line;
    for (const std::string& line : new_) ADD_FAILURE() << "in the scene: " << line;
}

/// As the notes count them.
std::uint64_t facesLeftOut(const ImportedScene& scene) {
    std::uint64_t sum = 0;
    for (const std::string& note : scene.notes) {
        const std::size_t end = note.find(" left out; the first, "), of = note.rfind(" of ", end);
        if (end != std::string::npos && of != std::string::npos)
            sum += std::stoull(note.substr(note.rfind(' ', of - 1) + 1));
    }
    return sum;
}

void expectNothingLost(const FileCensus& file, const ImportedScene& scene) {
    const ImportedAspect aspect{ImportedScene(scene)};
    const FileCensus shown = sceneCensus(aspect);
    // Faces of vertices that do not exist are counted in a note; each has one triangle at least.
    const std::uint64_t leftOut = facesLeftOut(scene);
    const bool cut = hasNote(scene, "it is cut off");  // how much there is, the note says
    if (cut)
        EXPECT_LE(shown.triangles, file.triangles);
    else if (leftOut > 0)
        EXPECT_LE(shown.triangles, file.triangles - std::min(leftOut, file.triangles));
    else
        EXPECT_EQ(shown.triangles, file.triangles);
    if (cut)
        EXPECT_LE(shown.points, file.points);
    else
        EXPECT_EQ(shown.points, file.points);
    EXPECT_EQ(shown.lines, file.lines);
    for (const std::string& name : file.toBeNamed) EXPECT_TRUE(hasNote(scene, name)) << name;
    const auto unnamed = std::count_if(file.pictures.begin(), file.pictures.end(),
                                       [&](const std::string& picture) { return !hasNote(scene, picture); });
    if (!file.pictures.empty()) {
        EXPECT_EQ(shown.parts.at("image"), static_cast<std::uint64_t>(unnamed));
    }
    if (file.parts.empty()) return;  // what follows is counted of glTF alone
    for (const char* name : {"POSITION", "TEXCOORD_0", "TEXCOORD_1", "COLOR_0", "TANGENT", "camera", "light", "joints",
                             "target", "animation", "channel"}) {
        const auto said = file.parts.find(name), is = shown.parts.find(name);
        EXPECT_EQ(is == shown.parts.end() ? 0 : is->second, said == file.parts.end() ? 0 : said->second) << name;
    }
    // A picture that cannot be had is missing in the scene's line, and named.
    if (!hasNote(scene, "a texture without") && !hasNote(scene, "image ") && !hasNote(scene, "not valid glTF"))
        expectSame(file.materials, shown.materials);
}

/// Whether it could be counted.
bool expectNothingLost(const std::string& path) {
    SCOPED_TRACE(path);
    const Expected<ImportedScene> scene = importScene(path, kRootNode, importOptions());
    if (!scene) {
        EXPECT_TRUE(scene.error().message.starts_with(path + ":")) << scene.error().message;
        EXPECT_GT(scene.error().message.size(), path.size() + 12) << scene.error().message;
        std::fprintf(stderr, "refused: %s\n", scene.error().message.c_str());
        return false;
    }
    EXPECT_TRUE(scene->geometries > 0 || !scene->notes.empty()) << "nothing to be seen, and nothing said";
    const std::optional<FileCensus> counted = censusOf(path);
    if (counted) expectNothingLost(*counted, *scene);
    return counted.has_value();
}

/// Our own, which are always there, and all folders of models but the one whose files are damaged on purpose
/// (RealModelsTest.cpp); each is a test, so that they run beside each other.
std::vector<std::string> foldersOfModels() {
    std::vector<std::string> folders{TESSERA_SOURCE_DIR "/tests/data/models"};
    for (const std::string& around : {testData(), std::string(kDebianModels)}) {
        if (around.empty() || !fs::exists(around)) continue;
        for (const auto& entry : fs::directory_iterator(around))
            if (entry.is_directory() && entry.path().filename() != "malformed")
                folders.push_back(entry.path().string());
    }
    std::sort(folders.begin(), folders.end());
    return folders;
}

class NothingLost : public testing::TestWithParam<std::string> {};

TEST_P(NothingLost, OfAnyModelBelow) {
    std::size_t counted = 0;
    const std::vector<std::string> files = modelsBelow(GetParam());
    for (const std::string& file : files) counted += expectNothingLost(file);
    std::fprintf(stderr, "%zu files, %zu of them counted\n", files.size(), counted);
    EXPECT_TRUE((counted == files.size() && counted > 0) || !GetParam().ends_with("/tests/data/models"))
        << "ours are of formats that are counted";
}

INSTANTIATE_TEST_SUITE_P(Each, NothingLost, testing::ValuesIn(foldersOfModels()), [](const auto& test) {
    const fs::path folder = test.param;
    std::string name = folder.parent_path().filename().string() + "_" + folder.filename().string();
    std::erase_if(name, [](unsigned char c) { return std::isalnum(c) == 0 && c != '_'; });
    return name;
});

}  // namespace
}  // namespace tessera
