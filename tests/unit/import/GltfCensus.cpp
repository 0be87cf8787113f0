#include <fmt/format.h>

#include <cstring>
#include <functional>
#include <nlohmann/json.hpp>

#include "tests/unit/import/FileCensus.h"

namespace tessera {
namespace {

using Json = nlohmann::json;

/// What is read is shown as it is; of what is not in this list a note must speak.
const std::set<std::string> kShown = {
    "KHR_draco_mesh_compression", "EXT_meshopt_compression",         "EXT_texture_webp",
    "KHR_lights_punctual",        "KHR_mesh_quantization",           "KHR_texture_transform",
    "KHR_materials_unlit",        "KHR_materials_emissive_strength", "KHR_materials_clearcoat",
    "KHR_materials_transmission", "KHR_materials_specular",          "KHR_materials_ior"};
const std::set<std::string> kShownAttributes = {"POSITION", "NORMAL",   "TANGENT",   "TEXCOORD_0", "TEXCOORD_1",
                                                "COLOR_0",  "JOINTS_0", "WEIGHTS_0", "JOINTS_1",   "WEIGHTS_1"};

/// A member, or an empty object.
const Json& at(const Json& object, const std::string& key) {
    static const Json none = Json::object();
    const auto found = object.find(key);
    return found == object.end() ? none : *found;
}

const Json& element(const Json& file, const char* list, int index) {
    static const Json none = Json::object();
    const Json& items = at(file, list);
    return index >= 0 && items.is_array() && static_cast<std::size_t>(index) < items.size()
               ? items[static_cast<std::size_t>(index)]
               : none;
}

std::uint64_t countOf(const Json& file, const Json& accessor) {
    return accessor.is_number() ? element(file, "accessors", accessor.get<int>()).value("count", std::uint64_t{0}) : 0;
}

TextureLine textureLine(const Json& file, const Json& use) {
    static const std::map<int, std::string> words = {{10497, "repeat"},
                                                     {33071, "clamp"},
                                                     {33648, "mirror"},
                                                     {9728, "nearest"},
                                                     {9729, "linear"},
                                                     {9984, "nearest-mipmap-nearest"},
                                                     {9985, "linear-mipmap-nearest"},
                                                     {9986, "nearest-mipmap-linear"},
                                                     {9987, "trilinear"}};
    const Json& sampler =
        element(file, "samplers", element(file, "textures", use.value("index", -1)).value("sampler", -1));
    const auto word = [&](const char* key, int otherwise) { return words.at(sampler.value(key, otherwise)); };
    const Json& place = at(at(use, "extensions"), "KHR_texture_transform");
    const std::vector<double> offset = place.value("offset", std::vector<double>{0, 0});
    const std::vector<double> scale = place.value("scale", std::vector<double>{1, 1});
    return {.texcoordSet = place.value("texCoord", use.value("texCoord", 0)),
            .wrapU = word("wrapS", 10497),
            .wrapV = word("wrapT", 10497),
            .magnification = word("magFilter", 9729),
            .minification = word("minFilter", 9987),
            .offsetU = offset[0],
            .offsetV = offset[1],
            .scaleU = scale[0],
            .scaleV = scale[1],
            .rotation = place.value("rotation", 0.0)};
}

std::string lineOf(const Json& file, const Json& material) {
    const Json& extensions = at(material, "extensions");
    const Json& old = at(extensions, "KHR_materials_pbrSpecularGlossiness");
    const Json& coat = at(extensions, "KHR_materials_clearcoat");
    const Json& pbr = at(material, "pbrMetallicRoughness");
    MaterialLine line;
    const std::string mode = material.value("alphaMode", std::string("OPAQUE"));
    line.alphaMode = mode == "MASK" ? "mask" : mode == "BLEND" ? "blend" : "opaque";
    line.alphaCutoff = mode == "MASK" ? material.value("alphaCutoff", 0.5) : 0.5;
    line.normalScale = at(material, "normalTexture").value("scale", 1.0);
    line.occlusionStrength = at(material, "occlusionTexture").value("strength", 1.0);
    line.clearcoat = coat.value("clearcoatFactor", 0.0);
    line.clearcoatRoughness = coat.value("clearcoatRoughnessFactor", 0.0);
    line.transmission = at(extensions, "KHR_materials_transmission").value("transmissionFactor", 0.0);
    line.doubleSided = material.value("doubleSided", false);
    const Json& specular = at(extensions, "KHR_materials_specular");
    line.specular = specular.value("specularFactor", 1.0);
    const auto color = specular.value("specularColorFactor", std::vector<double>{1, 1, 1});
    line.specularRed = color.at(0);
    line.specularGreen = color.at(1);
    line.specularBlue = color.at(2);
    line.ior = at(extensions, "KHR_materials_ior").value("ior", 1.5);
    if (line.ior == 0) line.ior = 100;
    line.unlit = extensions.contains("KHR_materials_unlit");
    const std::pair<const char*, const Json*> slots[] = {
        {"base color", old.empty() ? &at(pbr, "baseColorTexture") : &at(old, "diffuseTexture")},
        {"metallic roughness", old.empty() ? &at(pbr, "metallicRoughnessTexture") : &at(old, "none")},
        {"normal", &at(material, "normalTexture")},
        {"occlusion", &at(material, "occlusionTexture")},
        {"emissive", &at(material, "emissiveTexture")}};
    for (const auto& [slot, use] : slots)
        if (use->value("index", -1) >= 0) line.textures[slot] = textureLine(file, *use);
    return materialLine(line);
}

class Counter {
public:
    explicit Counter(const Json& file) : file_(file) {}

    FileCensus count() {
        for (const Json& extension : at(file_, "extensionsUsed"))
            if (kShown.count(extension) == 0) census_.toBeNamed.insert(extension);
        if (at(file_, "scenes").size() > 1) census_.toBeNamed.insert("of several scenes");
        if (at(file_, "animations").size() > 1) census_.toBeNamed.insert("of several animations");
        for (const int root : roots()) visit(root, 0);
        for (const Json& animation : at(file_, "animations")) countAnimation(animation);
        for (const int material : materials_)
            census_.materials.insert(lineOf(file_, element(file_, "materials", material)));
        return census_;
    }

private:
    std::vector<int> roots() const {
        if (!at(file_, "scenes").empty())
            return element(file_, "scenes", file_.value("scene", 0)).value("nodes", std::vector<int>());
        std::set<int> held;
        for (const Json& node : at(file_, "nodes"))
            for (const Json& child : at(node, "children")) held.insert(child.get<int>());
        std::vector<int> free;
        for (int i = 0; i < static_cast<int>(at(file_, "nodes").size()); ++i)
            if (held.count(i) == 0) free.push_back(i);
        return free;
    }

    void visit(int index, int depth) {
        const Json& node = element(file_, "nodes", index);
        if (depth > 200) return;
        census_.parts["camera"] += node.contains("camera");
        census_.parts["light"] += at(at(node, "extensions"), "KHR_lights_punctual").contains("light");
        reached_.insert(index);
        for (const Json& primitive : at(element(file_, "meshes", node.value("mesh", -1)), "primitives")) {
            countPart(primitive);
            if (primitive.contains("targets") && primitive.value("mode", 4) >= 4) morphs_.insert(index);
            if (node.contains("skin") && at(primitive, "attributes").contains("JOINTS_0") &&
                primitive.value("mode", 4) >= 4)
                ++census_.parts["joints"];
        }
        for (const Json& child : at(node, "children")) visit(child.get<int>(), depth + 1);
    }

    void countPart(const Json& primitive) {
        const Json& attributes = at(primitive, "attributes");
        if (!attributes.contains("POSITION")) {
            census_.toBeNamed.insert("without positions");
            return;
        }
        const std::uint64_t n =
            countOf(file_, primitive.contains("indices") ? primitive["indices"] : attributes["POSITION"]);
        const int mode = primitive.value("mode", 4);
        const std::uint64_t lines = mode == 1 ? n / 2 : mode == 2 ? n : mode == 3 && n > 0 ? n - 1 : 0;
        const std::uint64_t triangles = mode == 4 ? n / 3 : mode > 4 && n > 2 ? n - 2 : 0;
        census_.lines += lines;
        census_.triangles += triangles;
        census_.points += mode == 0 ? n : 0;
        if (n == 0) return;
        // Without one a surface has the default material, which says nothing of itself.
        if (primitive.contains("material") || mode >= 4) materials_.insert(primitive.value("material", -1));
        for (const auto& [name, accessor] : attributes.items()) {
            // Tangents say nothing of points and lines, nor without normals.
            if (name != "TANGENT" || (mode >= 4 && attributes.contains("NORMAL"))) ++census_.parts[name];
            if (kShownAttributes.count(name) == 0 && name.front() != '_') census_.toBeNamed.insert(name);
        }
        if (!primitive.contains("targets")) return;
        if (mode < 4)
            census_.toBeNamed.insert("morph targets");
        else
            census_.parts["target"] += primitive["targets"].size();
    }

    /// Of channels that can play: of nodes that are shown, and weights of meshes that have targets.
    void countAnimation(const Json& animation) {
        std::uint64_t channels = 0;
        for (const Json& channel : at(animation, "channels")) {
            const Json& target = at(channel, "target");
            const int node = target.value("node", -1);
            const std::string path = target.value("path", "");
            const bool moves = path == "translation" || path == "rotation" || path == "scale";
            channels += reached_.count(node) > 0 && (moves ? !element(file_, "nodes", node).contains("matrix")
                                                           : path == "weights" && morphs_.count(node) > 0);
        }
        census_.parts["animation"] += channels > 0;
        census_.parts["channel"] += channels;
    }

    const Json& file_;
    FileCensus census_;
    std::set<int> materials_, reached_, morphs_;
};

}  // namespace

std::string materialLine(const MaterialLine& m) {
    std::string line = fmt::format(
        "{} {:.4g}, normal {:.4g}, occlusion {:.4g}, coat {:.4g} {:.4g}, transmission {:.4g}, reflects {:.4g} {:.4g} "
        "{:.4g} {:.4g} {:.4g}{}{}",
        m.alphaMode, m.alphaCutoff, m.normalScale, m.occlusionStrength, m.clearcoat, m.clearcoatRoughness,
        m.transmission, m.specular, m.specularRed, m.specularGreen, m.specularBlue, m.ior,
        m.doubleSided ? ", double-sided" : "", m.unlit ? ", unlit" : "");
    for (const auto& [slot, t] : m.textures)
        line += fmt::format("; {}: set {}, {} {}, {} {}, at {:.4g} {:.4g}, times {:.4g} {:.4g}, turned {:.4g}", slot,
                            t.texcoordSet, t.wrapU, t.wrapV, t.magnification, t.minification, t.offsetU, t.offsetV,
                            t.scaleU, t.scaleV, t.rotation);
    return line;
}

std::optional<FileCensus> censusOfGltf(const std::string& bytes) {
    std::string text = bytes;
    if (bytes.starts_with("glTF")) {  // the first chunk is JSON
        std::uint32_t length = 0;
        if (bytes.size() < 20) return std::nullopt;
        std::memcpy(&length, bytes.data() + 12, sizeof(length));
        text = bytes.substr(20, length);
    }
    const Json file = Json::parse(text, nullptr, false);
    if (!file.is_object() || !at(file, "nodes").is_array()) return std::nullopt;  // glTF 1 has objects there
    try {
        return Counter(file).count();
    } catch (const Json::exception&) {  // a number where an object belongs, and the like
        return std::nullopt;
    }
}

}  // namespace tessera
