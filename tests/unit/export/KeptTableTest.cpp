/// What each format keeps of each kind of content: one small scene each, written, and read back by our importer; the
/// table of the tree, which it does not read, is looked into. FORMATS.md has the table ("Out").
#include <functional>
#include <sstream>

#include "common/cores/Camera.h"
#include "common/cores/Glyphs.h"
#include "common/cores/Image.h"
#include "common/cores/MaterialGroup.h"
#include "common/cores/PointLight.h"
#include "common/cores/Skin.h"
#include "common/cores/SubdivisionSurface.h"
#include "common/cores/Volume.h"
#include "common/drawable/SceneBounds.h"
#include "common/export/LeavingMotions.h"
#include "tests/unit/export/BuiltScene.h"
#include "tests/unit/export/ExportFixture.h"

namespace tessera {
namespace {

constexpr const char *kYes = "yes", *kTriangles = "triangles", *kNo = "-";

template <typename T>
std::vector<const T*> allOf(const Aspect& scene) {
    std::vector<const T*> found;
    for (const ObjectId id : scene.ids())
        if (const T* object = scene.get<T>(id)) found.push_back(object);
    return found;
}
const char* yesIf(bool kept) {
    return kept ? kYes : kNo;
}
bool hasNode(const Aspect& scene, std::string_view name, std::string_view parent = {}) {
    for (const Node* node : allOf<Node>(scene)) {
        const Node* above = scene.get<Node>(node->parent);
        if (node->name == name && (parent.empty() || (above && above->name == parent))) return true;
    }
    return false;
}
bool hasTriangles(const Aspect& scene) {
    return !sceneBounds(scene).empty();
}
Geometry firstGeometry(const Aspect& scene) {
    const std::vector<const Geometry*> all = allOf<Geometry>(scene);
    return all.empty() ? Geometry() : *all.front();
}

struct Kind {
    const char* name;
    std::function<void(BuiltScene&)> build;
    /// Of what came back.
    std::function<const char*(const Aspect&)> kept;
    /// What the table of the tree has where it is kept; null: it is not.
    const char* csv;
};

ObjectId worn(BuiltScene& built, Geometry geometry, const Material& material) {
    geometry.material = built.add(material);
    return built.add(geometry);
}

Image twoPixels() {
    Image image;
    image.pixels = blobOf<std::uint8_t>({255, 0, 0, 255, 0, 255, 0, 128});
    image.widthPx = 2;
    image.heightPx = 1;
    return image;
}

Geometry mapped() {
    Geometry geometry = triangleGeometry();
    geometry.texcoords = blobOf<float>({0, 0, 0.25f, 0, 0, 0.75f});
    return geometry;
}

Skin barSkin(BuiltScene& built) {
    Skin skin;
    skin.positions = triangleGeometry().positions;
    skin.indices = triangleGeometry().indices;
    skin.joints = {built.node("bone", built.add(Transform()))};
    skin.jointIndices = blobOf<std::uint16_t>({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
    skin.jointWeights = blobOf<float>({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
    skin.inverseBinds = blobOf<float>({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0});
    skin.pose = skin.inverseBinds;
    return skin;
}

/// A voxel that stands out.
Volume smallVolume() {
    Volume volume;
    std::vector<std::uint8_t> voxels(27);
    voxels[13] = 255;
    volume.voxels = Blob::of(std::span<const std::uint8_t>(voxels));
    volume.sizeX = volume.sizeY = volume.sizeZ = 3;
    volume.surfaceValue = 128;
    return volume;
}

/// A triangle that moves by an animation of its own.
void addRide(BuiltScene& built, Animation animation, double length = 1) {
    KeyFrames keys;
    keys.target = built.add(Transform());
    keys.field = "translation";
    keys.times = blobOf<double>({0, length});
    keys.values = blobOf<double>({0, 0, 0, 1, 2, 3});
    animation.channels = {built.add(keys)};
    built.node("a", built.add(triangleGeometry()), built.node("place", keys.target));
    built.node("ride", built.add(animation));
}

std::vector<Kind> kinds() {
    const auto nested = [](BuiltScene& built) {
        Transform place;
        place.translation = Vec3d(1, 2, 3);
        built.node("hook", built.add(triangleGeometry()), built.node("crane", built.add(place)));
    };
    return {
        {"hierarchy", nested, [](const Aspect& s) { return yesIf(hasNode(s, "hook", "crane")); }, "/crane/hook"},
        {"names", nested, [](const Aspect& s) { return yesIf(hasNode(s, "hook")); }, "hook"},
        {"places", nested, [](const Aspect& s) { return yesIf(sceneBounds(s).lower.isApprox(Vec3d(1, 2, 3), 1e-6)); },
         ",1,2,3,"},
        {"shared meshes",
         [](BuiltScene& built) {
             const ObjectId core = built.add(triangleGeometry());
             built.node("a", core), built.node("b", core);
         },
         [](const Aspect& s) { return yesIf(allOf<Geometry>(s).size() == 1 && hasNode(s, "b")); }, nullptr},
        {"normals",
         [](BuiltScene& built) {
             Geometry geometry = triangleGeometry();
             geometry.normals = blobOf<float>({0, 0.6f, 0.8f, 0, 0.6f, 0.8f, 0, 0.6f, 0.8f});
             built.node("a", built.add(geometry));
         },
         [](const Aspect& s) {
             const auto normals = firstGeometry(s).normals.as<float>();
             return yesIf(normals.size() == 9 && std::abs(normals[1] - 0.6f) < 1e-3f);
         },
         nullptr},
        {"texture coordinates",
         [](BuiltScene& built) {
             Material material;  // readers drop coordinates that no image asks for
             material.baseColorImage = built.add(twoPixels());
             built.node("a", worn(built, mapped(), material));
         },
         [](const Aspect& s) {
             const auto uv = firstGeometry(s).texcoords.as<float>();
             return yesIf(uv.size() == 6 && std::find(uv.begin(), uv.end(), 0.75f) != uv.end());
         },
         nullptr},
        {"colours of vertices",
         [](BuiltScene& built) {
             Geometry geometry = triangleGeometry();
             geometry.colors = blobOf<std::uint8_t>({255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255});
             Material white;
             white.baseColor = Vec4f::Ones();
             built.node("a", worn(built, geometry, white));
         },
         [](const Aspect& s) { return yesIf(firstGeometry(s).colors.sizeBytes() == 12); }, nullptr},
        {"opacities of vertices",
         [](BuiltScene& built) {
             Geometry geometry = triangleGeometry();
             geometry.colors = blobOf<std::uint8_t>({255, 0, 0, 51, 0, 255, 0, 51, 0, 0, 255, 51});
             Material white;
             white.baseColor = Vec4f::Ones();
             white.alphaMode = Material::kBlend;
             built.node("a", worn(built, geometry, white));
         },
         [](const Aspect& s) {
             const auto colors = firstGeometry(s).colors.as<std::uint8_t>();
             return yesIf(colors.size() == 12 && colors[3] == 51);
         },
         nullptr},
        {"materials",
         [](BuiltScene& built) {
             Material material;
             material.baseColor = Vec4f(0.5f, 0.25f, 1, 1);
             material.roughness = 0.25f;
             material.metallic = 0.75f;
             built.node("a", worn(built, triangleGeometry(), material));
         },
         [](const Aspect& s) {
             for (const Material* m : allOf<Material>(s))
                 if (m->baseColor.isApprox(Vec4f(0.5f, 0.25f, 1, 1), 1e-4f) && std::abs(m->metallic - 0.75f) < 1e-4f)
                     return kYes;
             return kNo;
         },
         "metallic 0.75 roughness 0.25"},
        {"images",
         [](BuiltScene& built) {
             Material material;
             material.baseColor = Vec4f::Ones();  // VRML has colours in the picture
             material.baseColorImage = built.add(twoPixels());
             built.node("a", worn(built, mapped(), material));
         },
         [](const Aspect& s) {
             const auto images = allOf<Image>(s);
             return yesIf(images.size() == 1 && images.front()->pixels == twoPixels().pixels);
         },
         nullptr},
        {"materials of groups",
         [](BuiltScene& built) {
             Material red;
             red.baseColor = Vec4f(0.5f, 0.25f, 1, 1);
             MaterialGroup group;
             group.material = built.add(red);
             built.node("a", built.add(triangleGeometry()), built.node("group", built.add(group)));
         },
         [](const Aspect& s) {
             for (const Material* m : allOf<Material>(s))
                 if (m->baseColor.isApprox(Vec4f(0.5f, 0.25f, 1, 1), 1e-4f)) return kYes;
             return kNo;
         },
         "#bc89ff"},
        {"shadows of lights",
         [](BuiltScene& built) {
             PointLight lamp;
             lamp.shadows = true;
             built.node("lamp", built.add(lamp));
             built.node("a", built.add(triangleGeometry()));
         },
         [](const Aspect& s) {
             const auto lights = allOf<PointLight>(s);
             return yesIf(!lights.empty() && lights.front()->shadows);
         },
         nullptr},
        {"lights",
         [](BuiltScene& built) {
             built.node("lamp", built.add(PointLight()));
             built.node("a", built.add(triangleGeometry()));
         },
         [](const Aspect& s) { return yesIf(!allOf<PointLight>(s).empty()); }, "PointLight"},
        {"cameras",
         [](BuiltScene& built) {
             built.node("view", built.add(Camera()));
             built.node("a", built.add(triangleGeometry()));
         },
         [](const Aspect& s) { return yesIf(!allOf<Camera>(s).empty()); }, "Camera"},
        {"animations of places", [](BuiltScene& built) { addRide(built, Animation()); },
         [](const Aspect& s) { return yesIf(!allOf<KeyFrames>(s).empty()); }, nullptr},
        {"speeds of animations", [](BuiltScene& built) { addRide(built, {.channels = {}, .speed = 4}); },
         [](const Aspect& s) {
             for (const Animation* a : allOf<Animation>(s))
                 if (std::abs(Playing::of(s, *a).length / a->speed - 0.25) < 1e-4) return kYes;
             return kNo;
         },
         nullptr},
        {"lengths of animations",
         [](BuiltScene& built) {
             addRide(built, Animation());
             addRide(built, Animation(), 3);
         },
         [](const Aspect& s) {
             double shortest = 1e9;
             for (const Animation* a : allOf<Animation>(s)) shortest = std::min(shortest, Playing::of(s, *a).length);
             return yesIf(std::abs(shortest - 1) < 1e-4);
         },
         nullptr},
        {"modes of animations", [](BuiltScene& built) { addRide(built, {.channels = {}, .mode = Animation::kOnce}); },
         [](const Aspect& s) {
             const auto all = allOf<Animation>(s);
             return yesIf(!all.empty() && all.front()->mode == Animation::kOnce);
         },
         nullptr},
        {"pauses of animations", [](BuiltScene& built) { addRide(built, {.channels = {}, .playing = false}); },
         [](const Aspect& s) {
             const auto all = allOf<Animation>(s);
             return yesIf(!all.empty() && !all.front()->playing);
         },
         nullptr},
        {"skins", [](BuiltScene& built) { built.node("a", built.add(barSkin(built))); },
         [](const Aspect& s) {
             const auto skins = allOf<Skin>(s);
             return !skins.empty() && skins.front()->joints.size() == 1 ? kYes : hasTriangles(s) ? kTriangles : kNo;
         },
         nullptr},
        {"morph targets",
         [](BuiltScene& built) {
             Skin skin;
             skin.positions = triangleGeometry().positions;
             skin.indices = triangleGeometry().indices;
             skin.morphPositions = blobOf<float>({0, 0, 1, 0, 0, 1, 0, 0, 1});
             skin.weights = blobOf<float>({0.5f});
             built.node("a", built.add(skin));
         },
         [](const Aspect& s) {
             const auto skins = allOf<Skin>(s);
             return !skins.empty() && !skins.front()->morphPositions.empty() ? kYes
                    : hasTriangles(s)                                        ? kTriangles
                                                                             : kNo;
         },
         nullptr},
        {"points",
         [](BuiltScene& built) {
             Geometry points = triangleGeometry();
             points.indices = {};
             points.primitive = Geometry::kPoints;
             points.pointRadius = 0.1;
             built.node("a", built.add(points));
         },
         [](const Aspect& s) {
             for (const Geometry* g : allOf<Geometry>(s))
                 if (g->primitive == Geometry::kPoints) return kYes;
             return kNo;
         },
         nullptr},
        {"lines",
         [](BuiltScene& built) {
             Geometry lines = triangleGeometry();
             lines.indices = {};
             lines.primitive = Geometry::kLineLoop;
             built.node("a", built.add(lines));
             built.node("b", built.add(triangleGeometry()));
         },
         [](const Aspect& s) {
             for (const Geometry* g : allOf<Geometry>(s))
                 if (g->primitive == Geometry::kLines) return kYes;
             return kNo;
         },
         nullptr},
        {"glyphs",
         [](BuiltScene& built) {
             Glyphs glyphs;
             glyphs.positions = blobOf<float>({0, 0, 0, 1, 0, 0, 2, 0, 0});
             glyphs.shape = Glyphs::kBox;
             built.node("a", built.add(glyphs));
         },
         [](const Aspect& s) {
             if (!allOf<Glyphs>(s).empty()) return kYes;
             std::size_t bearers = 0;
             for (const Node* node : allOf<Node>(s)) bearers += s.coreOf<Geometry>(*node) != nullptr;
             return bearers == 3 && allOf<Geometry>(s).size() == 1 ? kYes : hasTriangles(s) ? kTriangles : kNo;
         },
         nullptr},
        {"volumes", [](BuiltScene& built) { built.node("a", built.add(smallVolume())); },
         [](const Aspect& s) { return hasTriangles(s) ? kTriangles : kNo; }, nullptr},
        {"subdivision surfaces",
         [](BuiltScene& built) {
             SubdivisionSurface surface;
             surface.points = blobOf<float>({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
             surface.faceSizes = blobOf<std::uint32_t>({4});
             surface.faceVertices = blobOf<std::uint32_t>({0, 1, 2, 3});
             built.node("a", built.add(surface));
         },
         [](const Aspect& s) {
             return !allOf<SubdivisionSurface>(s).empty() ? kYes : hasTriangles(s) ? kTriangles : kNo;
         },
         nullptr},
    };
}

std::string cell(const Kind& kind, const std::string& ending) {
    const Scratch scratch;
    BuiltScene built;
    kind.build(built);
    const std::string path = scratch.path("out." + ending);
    const Aspect scene = built.take();
    if (const Expected<ExportReport> report = exportScene(path, scene); !report) {
        const std::string& why = report.error().message;
        return why.find("nothing of the scene can be written") != std::string::npos ? "-" : why;
    }
    if (ending == "csv") {
        std::ifstream file(path, std::ios::binary);
        const std::string text{std::istreambuf_iterator<char>(file), {}};
        if (kind.csv != nullptr && text.find(kind.csv) == std::string::npos) return "lacks " + std::string(kind.csv);
        return yesIf(kind.csv != nullptr);
    }
    Expected<ImportedScene> again = importScene(path, kRootNode, importOptions());
    if (!again) return kNo;  // nothing that can be drawn
    const ImportedAspect read(std::move(*again));
    return hasTriangles(*read) ? kind.kept(*read) : kNo;
}

std::string tableText() {
    std::string text = fmt::format("{:<22}", "");
    for (const ExportFormat& format : exportFormats()) text += fmt::format("{:<11}", format.endings);
    const auto trimmed = [](std::string line) {
        line.resize(line.find_last_not_of(' ') + 1);
        return line + '\n';
    };
    text = trimmed(text);
    for (const Kind& kind : kinds()) {
        std::string line = fmt::format("{:<22}", kind.name);
        for (const ExportFormat& format : exportFormats())
            line += fmt::format("{:<11}", cell(kind, std::string(format.endings)));
        text += trimmed(line);
    }
    return text;
}

/// Between the n-th pair of fences of the page, from 0.
std::string fenced(std::size_t n) {
    std::ifstream page(TESSERA_SOURCE_DIR "/server/import/FORMATS.md");
    std::string text{std::istreambuf_iterator<char>(page), {}};
    const std::string fence = "```\n";
    for (std::size_t i = 0;; ++i) {
        const std::size_t begin = text.find(fence);
        const std::size_t end = begin == std::string::npos ? begin : text.find(fence, begin + fence.size());
        if (end == std::string::npos) return "nothing";
        if (i == n) return text.substr(begin + fence.size(), end - begin - fence.size());
        text.erase(0, end + fence.size());
    }
}

/// Whoever changes what a format keeps puts what this says between the fences.
TEST(KeptTable, IsWhatEachFormatKeeps) {
    const std::string made = tableText();
    EXPECT_EQ(fenced(2), made) << made;
}

TEST(KeptTable, StandsBesideWhatTheCommandsSay) {
    const std::string said = exportFormatsText();
    EXPECT_EQ(fenced(1), said) << said;
    std::istringstream lines(said);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80u) << line;
}

}  // namespace
}  // namespace tessera
