// What arrives of all files that others wrote in the formats that assimp reads: as FORMATS.md has it.

#include <fmt/format.h>

#include <algorithm>

#include "common/cores/Animation.h"
#include "common/cores/Camera.h"
#include "common/cores/DirectionalLight.h"
#include "common/cores/Geometry.h"
#include "common/cores/Material.h"
#include "common/cores/PointLight.h"
#include "common/cores/Skin.h"
#include "common/cores/SpotLight.h"
#include "common/scene/Action.h"
#include "server/import/FormatTable.h"
#include "tests/unit/import/Picture.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

struct Arrived {
    std::size_t files = 0, shown = 0, nodes = 0, triangles = 0, lines = 0, materials = 0, lights = 0, cameras = 0,
                animations = 0, joints = 0;
};

void add(const ImportedScene& scene, Arrived& to) {
    ++to.shown;
    const ImportedAspect aspect{ImportedScene(scene)};
    to.nodes += allOf<Node>(aspect).size();
    to.materials += allOf<Material>(aspect).size();
    to.lights +=
        allOf<PointLight>(aspect).size() + allOf<SpotLight>(aspect).size() + allOf<DirectionalLight>(aspect).size();
    to.cameras += allOf<Camera>(aspect).size();
    to.animations += allOf<Animation>(aspect).size();
    for (const Skin* skin : allOf<Skin>(aspect)) to.joints += skin->joints.size();
    Action action;
    action.on<Geometry>([&](const Visit&, const Geometry& geometry) {
        if (geometry.primitive == Geometry::kTriangles) to.triangles += geometry.indices.sizeBytes() / 12;
        if (geometry.primitive == Geometry::kLines) to.lines += geometry.indices.sizeBytes() / 8;
        return Descend::kInto;
    });
    action.on<Skin>([&](const Visit&, const Skin& skin) {
        to.triangles += skin.indices.sizeBytes() / 12;
        return Descend::kInto;
    });
    action.run(*aspect);
}

/// In lower case, without its dot.
std::string endingOf(const fs::path& path) {
    std::string ending = path.extension().string();
    std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return ending.empty() ? ending : ending.substr(1);
}

std::string censusText() {
    std::string text =
        fmt::format("{:<7}{:>6}{:>6}{:>7}{:>10}{:>7}{:>10}{:>7}{:>8}{:>11}{:>7}\n", "", "files", "read", "nodes",
                    "triangles", "lines", "materials", "lights", "cameras", "animations", "joints");
    std::map<std::string, std::vector<std::string>> byEnding;
    for (const auto& entry : fs::recursive_directory_iterator(kDebianModels))
        if (entry.is_regular_file() && entry.path().string().find("/invalid/") == std::string::npos)
            byEnding[endingOf(entry.path())].push_back(entry.path().string());
    for (const char* ending :
         {"fbx", "dae", "zae", "blend", "3ds", "ase", "lws", "lwo", "lxo",     "x",       "ogex", "3mf", "amf",  "ac",
          "ifc", "dxf", "bvh", "csm",   "smd", "md2", "md3", "mdc", "mdl",     "md5mesh", "iqm",  "hmp", "ms3d", "b3d",
          "cob", "xgl", "zgl", "sib",   "q3o", "q3s", "nff", "irr", "irrmesh", "3d",      "ter",  "raw"}) {
        Arrived sum;
        std::vector<std::string>& files = byEnding[ending];
        std::ranges::sort(files);
        for (const std::string& file : files) {
            ++sum.files;
            if (const Expected<ImportedScene> scene = importScene(file, kRootNode, importOptions())) add(*scene, sum);
        }
        if (sum.files > 0)
            text += fmt::format("{:<7}{:>6}{:>6}{:>7}{:>10}{:>7}{:>10}{:>7}{:>8}{:>11}{:>7}\n", ending, sum.files,
                                sum.shown, sum.nodes, sum.triangles, sum.lines, sum.materials, sum.lights, sum.cameras,
                                sum.animations, sum.joints);
    }
    return text;
}

/// Whoever changes what arrives puts what this prints between the fences.
TEST(FormatCensus, IsAsThePageOfFormatsHasIt) {
    if (!fs::exists(kDebianModels)) GTEST_SKIP() << "package assimp-testmodels is not here";
    const std::string is = censusText(), page = contentOf(TESSERA_SOURCE_DIR "/server/import/FORMATS.md");
    EXPECT_NE(page.find("```\n" + is + "```\n"), std::string::npos) << "FORMATS.md has not:\n" << is;
}

}  // namespace
}  // namespace tessera
