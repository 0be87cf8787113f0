// EXT_mesh_gpu_instancing: a node's mesh at many places, and in many colours.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>

#include "common/confine/Confinement.h"
#include "common/math/Compose.h"
#include "common/math/Srgb.h"
#include "server/import/reader/GltfReader.h"
#include "server/import/reader/GlyphPlaces.h"

namespace tessera {
namespace {

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";
/// Of one node: each becomes a node, with a part for each primitive, or a glyph of each.
constexpr std::size_t kMostInstances = 1'000'000;
constexpr std::uint32_t kWhite = 0xffffffff;

}  // namespace

Affine3d GltfReader::Instance::matrix() const {
    return composeTransform(translation, rotation.normalized(), scale);
}

Expected<std::vector<GltfReader::Instance>> GltfReader::instances(const tinygltf::Node& node) {
    const auto found = node.extensions.find(kInstancing);
    if (found == node.extensions.end() || !found->second.Has("attributes")) return std::vector<Instance>();
    const tinygltf::Value& attributes = found->second.Get("attributes");
    std::size_t count = 0;
    bool haveBytes = false;
    std::vector<float> values[4];
    // The last is no word of the extension: what exporters write, and three.js shows.
    const std::pair<const char*, int> known[] = {{"TRANSLATION", 3}, {"ROTATION", 4}, {"SCALE", 3}, {"_COLOR_0", 4}};
    for (std::size_t i = 0; i < std::size(known); ++i) {
        const auto& [name, components] = known[i];
        const int accessor = static_cast<int>(gltfNumber(attributes, name, -1));
        if (accessor < 0) continue;
        const std::size_t said = accessors_.count(accessor);
        if (said > kMostInstances)
            return fail(ErrorCode::kLimit,
                        fmt::format("a node has {} instances, {} at most are read", said, kMostInstances));
        // Before they are read: many nodes may name one accessor.
        if (Expected<void> room = hasRoomForNodes(said / ReadLimits::kGlyphsPerNode); !room)
            return tl::unexpected(room.error());
        Expected<std::vector<float>> read = accessors_.floats(accessor, components, i == 3 ? 1.0f : 0.0f);
        if (!read) return tl::unexpected(read.error());
        const std::size_t elements = read->size() / static_cast<std::size_t>(components);
        if (count > 0 && elements != count)
            return fail(ErrorCode::kBadInput, fmt::format("the {} of {} instances are {}", name, count, elements));
        for (const float value : *read)
            if (!std::isfinite(value))
                return fail(ErrorCode::kBadInput, fmt::format("the {} of an instance is not finite", name));
        count = elements;
        values[i] = std::move(*read);
        const tinygltf::Accessor& stored = model_.accessors[static_cast<std::size_t>(accessor)];
        haveBytes = haveBytes || stored.bufferView >= 0 || stored.sparse.isSparse;
    }
    // A few letters may say a million instances that all are the same one.
    if (count > 1 && !haveBytes) {
        scene_.note(fmt::format("its {} instances of no values stand at one place: one of them is shown", count));
        count = 1;
    }
    for (const std::string& name : attributes.Keys())
        if (std::none_of(std::begin(known), std::end(known), [&](const auto& one) { return name == one.first; }))
            scene_.note(fmt::format("the attribute {} of instances is left out", name));
    std::vector<Instance> all(count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto three = [&](const std::vector<float>& from) {
            return Vec3d(from[3 * i], from[3 * i + 1], from[3 * i + 2]);
        };
        if (!values[0].empty()) all[i].translation = three(values[0]);
        if (!values[2].empty()) all[i].scale = three(values[2]);
        for (std::size_t k = 0; k < 4 && !values[3].empty(); ++k) {
            const float part = values[3][4 * i + k];
            const float signal = std::clamp(k == 3 ? part : srgbOfLinear(std::max(part, 0.0f)), 0.0f, 1.0f);
            all[i].color = all[i].color << 8 | static_cast<std::uint32_t>(std::lround(signal * 255.0f));
        }
        if (values[1].empty()) continue;
        const float* turn = &values[1][4 * i];
        const Quatd rotation(turn[3], turn[0], turn[1], turn[2]);
        if (rotation.norm() > 1e-12) all[i].rotation = rotation;
    }
    return all;
}

void GltfReader::addParts(const std::vector<Part>& parts, proto::scene::Node& node) {
    for (std::size_t i = 0; i < parts.size(); ++i) {
        proto::scene::Node* child = node.add_node();
        child->set_name(fmt::format("part {}", i));
        child->mutable_geometry()->set_mesh(parts[i].mesh);
        child->mutable_geometry()->set_material(parts[i].material);
    }
}

std::vector<std::size_t> GltfReader::withoutGlyphs(const std::string& name, const std::vector<Part>& parts,
                                                   const std::vector<Instance>& places, proto::scene::Node& placed) {
    std::vector<std::size_t> all(places.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    // Files of our own have glyphs so.
    const bool ours = scene_.file.by_tessera() && parts.size() == 1;
    const bool colored = std::ranges::any_of(places, [](const Instance& one) { return one.color != kWhite; });
    if (places.empty() || parts.empty() || !(ours || colored || areVeryMany(places.size(), parts.size()))) return all;
    const auto areNodes = [&](std::size_t count, std::string_view why) {
        if (colored)
            scene_.note(fmt::format("{}: colours of {} instances are left out: {}", name, count, why));
        else
            scene_.note(noteOfPlacedNodes(name, count, why));
    };
    std::vector<GlyphPart> glyphs;
    for (const Part& part : parts) {
        Expected<GlyphPart> glyph = glyphOf(scene_, part.mesh, part.material, Affine3d::Identity());
        if (!glyph) {
            areNodes(all.size(), fmt::format("its mesh {}", glyph.error().message));
            return all;
        }
        glyphs.push_back(std::move(*glyph));
    }
    const auto placeOf = [&](std::size_t i) {
        return CopyPlace{places[i].translation, places[i].rotation, places[i].scale, places[i].color};
    };
    noteUnsorted(scene_, name, glyphs);
    std::vector<std::size_t> left = addGlyphs(all, placeOf, glyphs, [&](std::size_t first, std::size_t part) {
        proto::scene::Node* const node = placed.add_node();
        node->set_name(ours && first == 0 ? "part 0" : instancesName(first, part));
        return node;
    });
    if (!left.empty()) areNodes(left.size(), kOddScales);
    return left;
}

Expected<void> GltfReader::hasRoomForNodes(std::size_t more) const {
    const std::size_t nodes = placedNodes_ + more;
    if (nodes <= limits_.nodesOf(bytesGranted())) return {};
    return fail(ErrorCode::kLimit, limits_.tooManyNodes(bytesGranted()));
}

Expected<void> GltfReader::addMesh(const tinygltf::Node& node, proto::scene::Node& placed) {
    const Expected<std::vector<Part>> parts = meshParts(node);
    if (!parts) return tl::unexpected(parts.error());
    const Expected<std::vector<Instance>> places = instances(node);
    if (!places) return tl::unexpected(places.error());
    if (places->empty()) addParts(*parts, placed);
    if (Expected<void> room = hasRoomForNodes(places->size() * parts->size() / ReadLimits::kGlyphsPerNode); !room)
        return room;
    const std::vector<std::size_t> nodes = withoutGlyphs(placed.name(), *parts, *places, placed);
    const std::size_t glyphs = (places->size() - nodes.size()) * parts->size();
    const std::size_t more = nodes.size() * (parts->size() + 1) + glyphs / ReadLimits::kGlyphsPerNode;
    if (Expected<void> room = hasRoomForNodes(more); !room) return room;
    placedNodes_ += more;
    for (const std::size_t i : nodes) {
        const Instance& instance = (*places)[i];
        proto::scene::Node* child = placed.add_node();
        child->set_name(fmt::format("instance {}", i));
        setTransform(*child->mutable_transform(), instance.translation, instance.rotation.normalized(), instance.scale);
        addParts(*parts, *child);
    }
    return {};
}

}  // namespace tessera
