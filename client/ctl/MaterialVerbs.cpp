#include "client/ctl/MaterialVerbs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "client/ctl/TextTable.h"
#include "common/cores/Node.h"
#include "common/math/Srgb.h"
#include "common/scene/FieldTable.h"

namespace tessera {
namespace {

/// The word that a person would say first.
std::string nameOfColour(float red, float green, float blue) {
    const float most = std::max({red, green, blue}), least = std::min({red, green, blue}), range = most - least;
    if (most < 0.1f) return "black";
    if (range < 0.12f * most || range < 0.04f)
        return most > 0.93f ? "white" : most > 0.66f ? "light grey" : most > 0.33f ? "grey" : "dark grey";
    float hue = most == red     ? (green - blue) / range
                : most == green ? 2 + (blue - red) / range
                                : 4 + (red - green) / range;
    hue = 60 * (hue < 0 ? hue + 6 : hue);
    struct Hue {
        float upTo;
        std::string_view name;
    };
    constexpr std::array kHues = {Hue{14, "red"},   Hue{42, "orange"}, Hue{68, "yellow"},  Hue{165, "green"},
                                  Hue{195, "cyan"}, Hue{255, "blue"},  Hue{290, "purple"}, Hue{345, "pink"}};
    const auto found = std::ranges::find_if(kHues, [&](const Hue& one) { return hue < one.upTo; });
    std::string name(found == kHues.end() ? "red" : found->name);
    if (name == "orange" && most < 0.7f) return most < 0.35f ? "dark brown" : "brown";
    if (most < 0.45f) return "dark " + name;
    return range < 0.35f * most ? "pale " + name : name;
}

struct Users {
    std::set<ObjectId> nodes;
    std::size_t others = 0;  ///< objects that are no cores of nodes: other materials
};

std::string usersText(const Aspect& scene, const Users& users) {
    constexpr std::size_t kNamed = 3;
    std::string text;
    std::size_t named = 0;
    for (const ObjectId node : users.nodes) {
        if (named == kNamed) break;
        text += (named++ > 0 ? ", " : "") + pathOf(scene, node);
    }
    const std::size_t more = users.nodes.size() - named;
    if (more > 0) text += fmt::format(" and {} more", more);
    if (users.others > 0)
        text +=
            fmt::format("{}{} other material{}", text.empty() ? "" : "; ", users.others, users.others == 1 ? "" : "s");
    return text.empty() ? "nobody" : text;
}

}  // namespace

std::string lookOf(const Material& material) {
    const float red = srgbOfLinear(material.baseColor[0]), green = srgbOfLinear(material.baseColor[1]),
                blue = srgbOfLinear(material.baseColor[2]);
    std::string text = nameOfColour(red, green, blue);
    if (material.baseColorImage) text = text == "white" ? "a picture" : "a picture in " + text;
    if (material.unlit) text += ", unlit";
    const bool metal = material.metallic > 0.5f;
    const std::string_view surface = material.roughness < 0.2f            ? "mirroring"
                                     : material.roughness < 0.45f         ? "glossy"
                                     : metal && material.roughness > 0.7f ? "rough"
                                                                          : "";
    if (!material.unlit && material.shading == Material::kMetalRoughness) {
        if (!surface.empty()) text += fmt::format(", {}", surface);
        if (metal) text += surface.empty() ? ", metal" : " metal";
    }
    if (material.clearcoat > 0) text += ", lacquered";
    const bool blends = material.alphaMode == Material::kBlend || material.alphaMode == Material::kAutoAlpha;
    if (material.transmission > 0 || (blends && material.baseColor[3] < 1)) text += ", see-through";
    if (material.emissive.maxCoeff() > 0) text += ", glows";
    if (material.fill == Material::kEdges) text += ", edges alone";
    if (material.fill == Material::kCorners) text += ", corners alone";
    if (material.program) text += ", by a program";
    return text;
}

Expected<Answer> run(Application& application, const verb::Materials&) {
    const Aspect& scene = application.scene();
    std::map<ObjectId, Users> materials;
    std::map<ObjectId, std::vector<ObjectId>> cores;  ///< that name a material, with what they name
    const std::vector<ObjectId> ids = scene.ids();
    for (const ObjectId id : ids)
        if (scene.get<Material>(id) != nullptr) materials[id];
    for (const ObjectId id : ids) {
        const Object object = scene.find(id);
        if (object.is<Node>() || !object.info().refers) continue;
        forEachRef(object, [&](ObjectId to) {
            const auto named = materials.find(to);
            if (named == materials.end()) return;
            if (object.info().isCore)
                cores[id].push_back(to);
            else
                ++named->second.others;
        });
    }
    for (const ObjectId id : ids) {
        const Node* node = scene.get<Node>(id);
        if (node == nullptr || !node->core) continue;
        const auto names = cores.find(node->core);
        if (names == cores.end()) continue;
        for (const ObjectId material : names->second) materials[material].nodes.insert(id);
    }
    TextTable table({"material", "colour", "looks", "used by"});
    Answer answer;
    answer.json = {{"materials", Json::array()}};
    for (const auto& [id, users] : materials) {
        const Material& material = *scene.get<Material>(id);
        const auto byte = [&](int i) {
            return std::lround(255 * std::clamp(srgbOfLinear(material.baseColor[i]), 0.0f, 1.0f));
        };
        const std::string colour = fmt::format("#{:02x}{:02x}{:02x}", byte(0), byte(1), byte(2));
        const std::string looks = lookOf(material);
        table.add({numberOf(id), colour, looks, usersText(scene, users)});
        Json paths = Json::array();
        for (const ObjectId node : users.nodes) paths.push_back(pathOf(scene, node));
        answer.json["materials"].push_back({{"material", id.value},
                                            {"colour", colour},
                                            {"looks", looks},
                                            {"nodes", std::move(paths)},
                                            {"other_materials", users.others}});
    }
    answer.text =
        materials.empty() ? std::string("the scene has no materials: all is shown in the default one\n") : table.text();
    return answer;
}

}  // namespace tessera
