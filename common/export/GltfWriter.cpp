// A scene as glTF 2.0: its tree planned first, then meshes, lights, cameras, animations, and at last the nodes.

#include <algorithm>
#include <array>
#include <map>
#include <numbers>

#include "common/base/Version.h"
#include "common/cores/Camera.h"
#include "common/cores/PointLight.h"
#include "common/cores/Skin.h"
#include "common/cores/SpotLight.h"
#include "common/export/Companions.h"
#include "common/export/Formats.h"
#include "common/export/GltfMotions.h"
#include "common/export/GltfShapes.h"
#include "common/export/PlannedTree.h"
#include "common/field/LightSource.h"

namespace tessera {
namespace {

constexpr double kNearestMetres = 0.01;  ///< of what a camera shows, on the wall

class GltfWriter {
public:
    explicit GltfWriter(const LeavingScene& leaving)
        : leaving_(leaving),
          tree_(planTree(leaving.scene, leaving.selection, leaving.notes)),
          looks_(leaving.scene, parts_, leaving.notes),
          meshes_(leaving.scene, leaving.options.tolerance, leaving.notes),
          shapes_(parts_, looks_, meshes_, leaving.notes) {}

    Expected<void> run() {
        for (const PlannedNode& node : tree_.nodes)
            if (Expected<void> added = add(node); !added) return added;
        gatherJoints();
        if (!leaving_.options.still)
            GltfMotions(leaving_.scene, leaving_.selection, tree_, parts_, leaving_.notes).addAll();
        return {};
    }

    /// `uri`: of the buffer; empty: it is the one inside.
    std::string json(const std::string& uri, std::string_view mark) {
        JsonObject asset, file, scene;
        asset.text("version", "2.0").text("generator", versionText("Tessera"));
        if (!mark.empty()) asset.json("extras", JsonObject().text("files", mark).done());
        file.json("asset", asset.done());
        if (!parts_.extensions.empty()) {
            JsonArray used;
            for (const std::string& name : parts_.extensions) used.add(jsonQuoted(name));
            file.json("extensionsUsed", used.done());
        }
        if (!tops_.empty()) scene.numbers("nodes", tops_);
        file.number("scene", 0).json("scenes", '[' + scene.done() + ']');
        const auto list = [&](std::string_view name, const JsonArray& all) {
            if (all.size() > 0) file.json(name, all.done());
        };
        list("nodes", parts_.nodes), list("meshes", parts_.meshes), list("skins", parts_.skins);
        list("animations", parts_.animations), list("cameras", parts_.cameras);
        list("materials", parts_.materials), list("textures", parts_.textures);
        list("samplers", parts_.samplers), list("images", parts_.images);
        list("accessors", parts_.accessors()), list("bufferViews", parts_.views());
        if (parts_.bufferBytes() > 0) {
            JsonObject buffer;
            if (!uri.empty()) buffer.text("uri", uri);
            file.json("buffers", '[' + buffer.number("byteLength", parts_.bufferBytes()).done() + ']');
        }
        if (parts_.lights.size() > 0) {
            JsonObject lights, extension;
            lights.json("lights", parts_.lights.done());
            file.json("extensions", extension.json("KHR_lights_punctual", lights.done()).done());
        }
        return file.done();
    }

    [[nodiscard]] const GltfParts& parts() const { return parts_; }
    [[nodiscard]] LeavingFiles counts() const {
        return {.files = {}, .nodes = tree_.nodes.size(), .triangles = shapes_.triangles()};
    }

private:
    const SelectedNode& selected(std::size_t index) const { return leaving_.selection.nodes[index]; }

    Expected<void> add(const PlannedNode& node) {
        JsonObject made, extensions;
        if (!node.name.empty()) made.text("name", node.name);
        const auto three = [](const Vec3d& v) { return std::array{v[0], v[1], v[2]}; };
        if (node.translation != Vec3d::Zero()) made.numbers("translation", three(node.translation));
        if (std::abs(node.rotation.w()) < 1)
            made.numbers("rotation",
                         std::array{node.rotation.x(), node.rotation.y(), node.rotation.z(), node.rotation.w()});
        if (node.scale != Vec3d::Ones()) made.numbers("scale", three(node.scale));
        if (!node.children.empty()) made.numbers("children", node.children);
        if (Expected<void> done = addMesh(node, made, extensions); !done) return done;
        if (node.light) {
            JsonObject light;
            light.number("light", addLight(selected(*node.light), node.lightName));
            extensions.json("KHR_lights_punctual", light.done());
        }
        if (node.camera) made.number("camera", addCamera(node));
        if (!extensions.empty()) made.json("extensions", extensions.done());
        parts_.nodes.add(made.done());
        return {};
    }

    Expected<void> addMesh(const PlannedNode& node, JsonObject& made, JsonObject& extensions) {
        std::vector<const SelectedNode*> primitives;
        std::size_t times = 1;
        for (const std::size_t shape : node.shapes) primitives.push_back(&selected(shape));
        if (node.glyphs) {
            primitives.push_back(&selected(*node.glyphs));
            const auto instances = shapes_.instances(*primitives.front());
            if (!instances) return tl::unexpected(instances.error());
            if (instances->count == 0) return {};
            extensions.json("EXT_mesh_gpu_instancing", instances->json);
            times = instances->count;
        }
        if (primitives.empty()) return {};
        const auto* skin = primitives.front()->core.as<Skin>();
        const bool skinned = skin && hasItsJoints(*primitives.front(), tree_, leaving_.selection);
        if (skin && !skinned) leaving_.notes.add("skins without their joints stand still", primitives.front()->id);
        const Expected<std::optional<int>> mesh = shapes_.mesh(primitives, skinned, times);
        if (!mesh) return tl::unexpected(mesh.error());
        if (!*mesh) return {};
        made.number("mesh", **mesh);
        if (skinned && !skin->joints.empty() && !skin->jointIndices.empty()) made.number("skin", addSkin(*skin));
        return {};
    }

    int addSkin(const Skin& skin) {
        const auto [known, isNew] = skins_.try_emplace({skin.joints, skin.inverseBinds.id()}, 0);
        if (!isNew) return known->second;
        std::vector<int> joints;
        for (const ObjectId joint : skin.joints) joints.push_back(tree_.inner[leaving_.selection.byId.at(joint)]);
        joints_.insert(joints_.end(), joints.begin(), joints.end());
        JsonObject made;
        made.numbers("joints", joints).number("inverseBindMatrices", shapes_.inverseBinds(skin));
        return known->second = parts_.skins.add(made.done());
    }

    /// glTF wants one node above all joints of a skin: where there is none, one above everything.
    void gatherJoints() {
        tops_ = tree_.tops;
        if (joints_.empty() || tops_.size() < 2) return;
        std::vector<int> topOf(tree_.nodes.size(), -1);
        for (const int top : tops_) {
            std::vector<int> open{top};
            while (!open.empty()) {
                const auto at = static_cast<std::size_t>(open.back());
                open.pop_back();
                topOf[at] = top;
                open.insert(open.end(), tree_.nodes[at].children.begin(), tree_.nodes[at].children.end());
            }
        }
        const int first = topOf[static_cast<std::size_t>(joints_.front())];
        if (std::ranges::all_of(joints_, [&](int joint) { return topOf[static_cast<std::size_t>(joint)] == first; }))
            return;
        JsonObject above;
        tops_ = {parts_.nodes.add(above.text("name", "scene").numbers("children", tops_).done())};
    }

    int addLight(const SelectedNode& node, const std::string& name) {
        const LightSource light = node.core.info().light(node.core.data());
        const bool spot = light.kind == LightSource::Kind::kSpot;
        const bool directional = light.kind == LightSource::Kind::kDirectional;
        JsonObject made;
        if (!name.empty()) made.text("name", name);
        made.text("type", directional ? "directional" : spot ? "spot" : "point");
        // Colours end at 1, intensities do not.
        const float strongest = light.radiance.maxCoeff();
        const auto [color, intensity] = colorOf(node.core);
        const float over = std::max(color.maxCoeff(), 1.0f);
        if (!light.on) leaving_.notes.add("lights that are off have no intensity", node.id);
        if (color != Vec3f::Ones())
            made.numbers("color", std::array{color[0] / over, color[1] / over, color[2] / over});
        made.number("intensity", light.on && strongest > 0 ? intensity * over : 0.0f);
        if (!directional && light.range > 0) made.number("range", light.range);
        if (spot) {
            const double outer = std::clamp<double>(light.outerAngle, 1e-6, std::numbers::pi / 2);
            JsonObject cone;
            cone.number("innerConeAngle", std::min<double>(light.innerAngle, outer * (1 - 1e-9)));
            made.json("spot", cone.number("outerConeAngle", outer).done());
        }
        if (!directional && light.attenuation != Vec3f(0, 0, 1))
            leaving_.notes.add("falloffs of lights become those of nature", node.id);
        if (light.scope) leaving_.notes.add("lights shine on everything: what they are for is left out", node.id);
        if (light.shadows) leaving_.notes.add("which lights cast shadows is left out", node.id);
        parts_.extensions.insert("KHR_lights_punctual");
        return parts_.lights.add(made.done());
    }

    static std::pair<Vec3f, float> colorOf(const Object& core) {
        std::pair<Vec3f, float> said{Vec3f::Ones(), 1.0f};
        for (const FieldEntry& field : core.info().fields) {
            if (field.name == "color") said.first = *field.in<Vec3f>(core.data());
            if (field.name == "intensity") said.second = *field.in<float>(core.data());
        }
        return said;
    }

    int addCamera(const PlannedNode& node) {
        const auto& camera = *selected(*node.camera).core.as<Camera>();
        JsonObject made, perspective;
        perspective.number("yfov", node.yfov);
        perspective.number("znear", kNearestMetres * camera.worldUnitsPerMetre);
        if (!node.cameraName.empty()) made.text("name", node.cameraName);
        made.text("type", "perspective").json("perspective", perspective.done());
        return parts_.cameras.add(made.done());
    }

    const LeavingScene& leaving_;
    GltfParts parts_;
    PlannedTree tree_;
    GltfLooks looks_;
    LeavingMeshes meshes_;
    GltfShapes shapes_;
    std::map<std::pair<RefList, BlobId>, int> skins_;
    std::vector<int> joints_;  ///< of all skins
    std::vector<int> tops_;
};

/// RFC 3986: what a name may not hold in a URI.
std::string percentEncoded(std::string_view name) {
    std::string encoded;
    for (const char c : name) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
                           c == '_' || c == '.' || c == '~';
        encoded += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
    return encoded;
}

}  // namespace

/// glTF 2.0, "GLB File Format": a head of 12 bytes, then chunks of whole 32-bit words, JSON with blanks behind.
Expected<LeavingFiles> writeGlb(const LeavingScene& leaving) {
    GltfWriter writer(leaving);
    if (Expected<void> run = writer.run(); !run) return tl::unexpected(run.error());
    std::string json = writer.json({}, {});
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const std::uint64_t buffer = (writer.parts().bufferBytes() + 3) / 4 * 4;
    const std::uint64_t bytes = 12 + 8 + json.size() + (buffer > 0 ? 8 + buffer : 0);
    if (Expected<void> fits = checkFileBytes(bytes, leaving.options); !fits) return tl::unexpected(fits.error());
    const auto words = [](std::initializer_list<std::uint64_t> list) {
        std::vector<std::uint32_t> narrow;
        for (const std::uint64_t word : list) narrow.push_back(static_cast<std::uint32_t>(word));
        return sliceOf(std::move(narrow));
    };
    constexpr std::uint32_t kMagic = 0x46546C67, kJson = 0x4E4F534A, kBinary = 0x004E4942;
    LeavingFiles files = writer.counts();
    LeavingFile& file = files.files.emplace_back(LeavingFile{.path = leaving.path, .parts = {}});
    file.parts.push_back(words({kMagic, 2, bytes, json.size(), kJson}));
    file.parts.push_back(sliceOfText(std::move(json)));
    if (buffer > 0) {
        file.parts.push_back(words({buffer, kBinary}));
        file.parts.insert(file.parts.end(), writer.parts().buffer().begin(), writer.parts().buffer().end());
        file.parts.push_back(sliceOf(std::vector<std::byte>(buffer - writer.parts().bufferBytes())));
    }
    return files;
}

Expected<LeavingFiles> writeGltf(const LeavingScene& leaving) {
    GltfWriter writer(leaving);
    if (Expected<void> run = writer.run(); !run) return tl::unexpected(run.error());
    if (Expected<void> fits = checkFileBytes(writer.parts().bufferBytes(), leaving.options); !fits)
        return tl::unexpected(fits.error());
    LeavingFiles files = writer.counts();
    Companions companions(leaving.path);
    const std::string beside = companions.name("bin");
    if (writer.parts().bufferBytes() > 0) companions.add("bin", writer.parts().buffer(), files);
    files.files.push_back(
        {.path = leaving.path, .parts = {sliceOfText(writer.json(percentEncoded(beside), companions.mark()) + '\n')}});
    return files;
}

}  // namespace tessera
