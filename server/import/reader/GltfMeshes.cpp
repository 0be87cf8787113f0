#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/math/Srgb.h"
#include "server/import/reader/GltfReader.h"
#include "server/import/reader/SoundParts.h"

namespace tessera {
namespace {

int attribute(const tinygltf::Primitive& primitive, const char* name) {
    const auto found = primitive.attributes.find(name);
    return found == primitive.attributes.end() ? -1 : found->second;
}

/// glTF's vertex colours are linear, ours are sRGB.
std::uint8_t toSrgbByte(float linear) {
    return static_cast<std::uint8_t>(std::lround(srgbOfLinear(std::clamp(linear, 0.0f, 1.0f)) * 255.0f));
}

bool isLines(const tinygltf::Primitive& primitive) {
    return primitive.mode == TINYGLTF_MODE_LINE || primitive.mode == TINYGLTF_MODE_LINE_LOOP ||
           primitive.mode == TINYGLTF_MODE_LINE_STRIP;
}

/// Two vertices a line.
std::vector<std::uint32_t> linesOf(const tinygltf::Primitive& primitive, const std::vector<std::uint32_t>& order) {
    const bool single = primitive.mode == TINYGLTF_MODE_LINE;
    std::vector<std::uint32_t> lines;
    for (std::size_t i = 0; i + 1 < order.size(); i += single ? 2 : 1)
        lines.insert(lines.end(), {order[i], order[i + 1]});
    if (primitive.mode == TINYGLTF_MODE_LINE_LOOP && order.size() > 1)
        lines.insert(lines.end(), {order.back(), order.front()});
    return lines;
}

/// The first three of `each` numbers; in place of what has no length, `instead`.
void normalise(std::vector<float>& vectors, std::size_t each, const Vec3f& instead) {
    for (std::size_t i = 0; i + each <= vectors.size(); i += each) {
        Vec3f vector(vectors[i], vectors[i + 1], vectors[i + 2]);
        const float length = vector.norm();
        vector = length > 1e-20f && std::isfinite(length) ? Vec3f(vector / length) : instead;
        std::copy(vector.begin(), vector.end(), vectors.begin() + static_cast<std::ptrdiff_t>(i));
    }
}

/// What an author says of points; 0: nothing.
double radiusIn(const tinygltf::Value& extras) {
    constexpr const char* kName = "pointRadius";
    if (!extras.IsObject() || !extras.Has(kName) || !extras.Get(kName).IsNumber()) return 0;
    const double radius = extras.Get(kName).GetNumberAsDouble();
    return radius > 0 && radius <= MeshLimits().maxPointRadius ? radius : 0;
}

/// These vertices alone, in this order, each once: a point that is drawn twice is one point.
MeshData pickedVertices(const MeshData& from, const std::vector<std::uint32_t>& order) {
    MeshData to;
    const auto append = [](const auto& all, auto& picked, std::size_t vertex, std::size_t each) {
        if (!all.empty()) picked.insert(picked.end(), all.data() + vertex * each, all.data() + (vertex + 1) * each);
    };
    std::vector<bool> taken(from.positions.size() / 3);
    for (const std::uint32_t vertex : order) {
        if (taken[vertex]) continue;
        taken[vertex] = true;
        append(from.positions, to.positions, vertex, 3);
        append(from.normals, to.normals, vertex, 3);
        append(from.texcoords, to.texcoords, vertex, 2);
        append(from.texcoords1, to.texcoords1, vertex, 2);
        append(from.colors, to.colors, vertex, 4);
    }
    return to;
}

/// How far each morph target is gone to: a node may say otherwise than its mesh.
const std::vector<double>& weightsOf(const tinygltf::Node& node, const tinygltf::Mesh& mesh) {
    return node.weights.empty() ? mesh.weights : node.weights;
}

/// Adds weight · delta where the target has the attribute with the same number of vertices.
Expected<void> addTarget(const GltfAccessors& accessors, const std::map<std::string, int>& target, const char* name,
                         double weight, std::vector<float>& values, std::size_t each) {
    const auto found = target.find(name);
    if (found == target.end() || values.empty()) return {};
    const Expected<std::vector<float>> delta = accessors.floats(found->second, 3);
    if (!delta) return tl::unexpected(delta.error());
    if (delta->size() / 3 != values.size() / each)
        return fail(ErrorCode::kBadInput, "a morph target has another number of vertices");
    for (std::size_t i = 0; i < delta->size(); ++i)
        values[i / 3 * each + i % 3] += static_cast<float>(weight) * (*delta)[i];
    return {};
}

}  // namespace

bool isSurface(const tinygltf::Primitive& primitive) {
    return primitive.mode < 0 || primitive.mode >= TINYGLTF_MODE_TRIANGLES;
}

bool GltfReader::isLeftOut(const tinygltf::Primitive& primitive) const {
    return attribute(primitive, "POSITION") < 0;
}

void GltfReader::countLeftOut(int mesh) {
    if (static_cast<std::size_t>(mesh) >= model_.meshes.size()) return;
    for (const tinygltf::Primitive& primitive : model_.meshes[static_cast<std::size_t>(mesh)].primitives) {
        if (isLeftOut(primitive)) ++withoutPositions_;
    }
}

void GltfReader::noteLeftOut() {
    if (withoutPositions_ > 0)
        scene_.noteMissing(fmt::format("{} parts of meshes without positions are left out", withoutPositions_));
}

void GltfReader::noteAttributes(const tinygltf::Primitive& primitive) {
    static const std::set<std::string> understood = {"POSITION",   "NORMAL",     "TANGENT",
                                                     "TEXCOORD_0", "TEXCOORD_1", "COLOR_0"};
    for (const auto& [name, accessor] : primitive.attributes)  // a leading underscore: an application's own
        if (understood.count(name) == 0 && !name.starts_with('_') && !name.starts_with("JOINTS_") &&
            !name.starts_with("WEIGHTS_"))
            scene_.note(fmt::format("the attribute {} of vertices is left out", name));
    for (const auto& [name, value] : primitive.extensions) noteExtension(name);
}

Expected<std::vector<std::uint32_t>> GltfReader::vertexOrder(const tinygltf::Primitive& primitive,
                                                             std::size_t vertices) {
    std::vector<std::uint32_t> order;
    if (primitive.indices >= 0) {
        Expected<std::vector<std::uint32_t>> indices = accessors_.integers(primitive.indices, 1);
        if (!indices) return indices;
        order = std::move(*indices);
    } else {
        order.resize(vertices);
        for (std::size_t i = 0; i < vertices; ++i) order[i] = static_cast<std::uint32_t>(i);
    }
    return order;
}

Expected<std::vector<std::uint32_t>> GltfReader::triangles(const tinygltf::Primitive& primitive, std::size_t vertices) {
    Expected<std::vector<std::uint32_t>> read = vertexOrder(primitive, vertices);
    if (!read) return read;
    std::vector<std::uint32_t>& order = *read;
    const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
    if (mode == TINYGLTF_MODE_TRIANGLES) {
        order.resize(order.size() / 3 * 3);
        return read;
    }
    std::vector<std::uint32_t> list;
    list.reserve(order.size() * 3);
    for (std::size_t i = 0; i + 2 < order.size(); ++i) {
        if (mode == TINYGLTF_MODE_TRIANGLE_FAN)
            list.insert(list.end(), {order[0], order[i + 1], order[i + 2]});
        else  // a strip: every second triangle turns the other way
            list.insert(list.end(), {order[i], order[i + 1 + i % 2], order[i + 2 - i % 2]});
    }
    return list;
}

Expected<MeshData> GltfReader::primitive(const tinygltf::Node& node, const tinygltf::Mesh& mesh,
                                         const tinygltf::Primitive& primitive, bool atRest) {
    if (primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN)
        return fail(ErrorCode::kBadInput, fmt::format("its mode is {}: 0 to 6 are known", primitive.mode));
    MeshData data;
    Expected<std::vector<float>> positions = accessors_.floats(attribute(primitive, "POSITION"), 3);
    if (!positions) return tl::unexpected(positions.error());
    data.positions = std::move(*positions);
    const std::size_t vertices = data.positions.size() / 3;
    const auto optional = [&](const char* name, int components, float fill) -> Expected<std::vector<float>> {
        const int accessor = attribute(primitive, name);
        if (accessor < 0) return std::vector<float>();
        if (accessors_.count(accessor) != vertices)
            return fail(ErrorCode::kBadInput, fmt::format("{} and POSITION have different numbers of vertices", name));
        return accessors_.floats(accessor, components, fill);
    };
    Expected<std::vector<float>> normals = optional("NORMAL", 3, 0.0f);
    if (!normals) return tl::unexpected(normals.error());
    data.normals = std::move(*normals);
    Expected<std::vector<float>> texcoords = optional("TEXCOORD_0", 2, 0.0f);
    if (!texcoords) return tl::unexpected(texcoords.error());
    data.texcoords = std::move(*texcoords);
    Expected<std::vector<float>> texcoords1 = optional("TEXCOORD_1", 2, 0.0f);
    if (!texcoords1) return tl::unexpected(texcoords1.error());
    data.texcoords1 = std::move(*texcoords1);
    // Of triangles that have normals: glTF says nothing of others.
    if (!data.normals.empty() && primitive.mode != TINYGLTF_MODE_POINTS && !isLines(primitive)) {
        Expected<std::vector<float>> tangents = optional("TANGENT", 4, 1.0f);
        if (!tangents) return tl::unexpected(tangents.error());
        data.tangents = std::move(*tangents);
    }
    const Expected<std::vector<float>> colors = optional("COLOR_0", 4, 1.0f);
    if (!colors) return tl::unexpected(colors.error());
    data.colors.resize(colors->size());
    for (std::size_t i = 0; i < colors->size(); ++i)
        data.colors[i] = i % 4 == 3
                             ? static_cast<std::uint8_t>(std::lround(std::clamp((*colors)[i], 0.0f, 1.0f) * 255.0f))
                             : toSrgbByte((*colors)[i]);

    noteAttributes(primitive);
    static const std::vector<double> kNone;
    const std::vector<double>& weights = atRest ? kNone : weightsOf(node, mesh);
    for (std::size_t i = 0; i < primitive.targets.size() && i < weights.size(); ++i) {
        if (weights[i] == 0.0) continue;
        const std::tuple<const char*, std::vector<float>*, std::size_t> moved[] = {
            {"POSITION", &data.positions, 3}, {"NORMAL", &data.normals, 3}, {"TANGENT", &data.tangents, 4}};
        for (const auto& [name, values, each] : moved)
            if (Expected<void> done = addTarget(accessors_, primitive.targets[i], name, weights[i], *values, each);
                !done)
                return tl::unexpected(done.error());
    }
    normalise(data.normals, 3, Vec3f::UnitY());
    normalise(data.tangents, 4, Vec3f::Zero());
    for (std::size_t i = 3; i < data.tangents.size(); i += 4) data.tangents[i] = data.tangents[i] < 0 ? -1.0f : 1.0f;

    const std::string name =
        fmt::format("mesh {}, primitive {}", &mesh - model_.meshes.data(), &primitive - mesh.primitives.data());
    const auto sound = [&] {
        if (const std::string leftOut = keepSoundParts(data, name); !leftOut.empty()) scene_.noteMissing(leftOut);
        return std::move(data);
    };
    if (primitive.mode == TINYGLTF_MODE_POINTS) {
        if (primitive.indices >= 0) {
            const Expected<std::vector<std::uint32_t>> order = vertexOrder(primitive, vertices);
            if (!order) return tl::unexpected(order.error());
            LeftOutParts missing(name, "points");
            std::vector<std::uint32_t> there;
            for (const std::uint32_t& index : *order)
                if (missing.keeps(std::span(&index, 1), vertices, [](std::uint32_t) { return true; }))
                    there.push_back(index);
            if (!missing.text().empty()) scene_.noteMissing(missing.text());
            data = pickedVertices(data, there);
        }
        data.primitive = Primitive::kPoints;
        for (const tinygltf::Value* extras : {&primitive.extras, &node.extras, &mesh.extras})
            if (data.pointRadius == 0) data.pointRadius = radiusIn(*extras);
        return sound();
    }
    if (isLines(primitive)) {
        const Expected<std::vector<std::uint32_t>> order = vertexOrder(primitive, vertices);
        if (!order) return tl::unexpected(order.error());
        data.primitive = Primitive::kLines;
        data.lines = linesOf(primitive, *order);
        data.normals.clear();
        return sound();
    }
    Expected<std::vector<std::uint32_t>> indices = triangles(primitive, vertices);
    if (!indices) return tl::unexpected(indices.error());
    data.indices = std::move(*indices);
    return sound();
}

Expected<std::vector<GltfReader::Part>> GltfReader::meshParts(const tinygltf::Node& node) {
    const int index = node.mesh;
    const MeshUse use{index, radiusIn(node.extras), node.weights};
    if (const auto known = parts_.find(use); known != parts_.end()) return known->second;
    if (static_cast<std::size_t>(index) >= model_.meshes.size())
        return fail(ErrorCode::kBadInput, fmt::format("mesh {} does not exist", index));
    const tinygltf::Mesh& mesh = model_.meshes[static_cast<std::size_t>(index)];
    const std::size_t number = parts_.size();
    std::vector<Part>& parts = parts_[use];
    for (std::size_t i = 0; i < mesh.primitives.size(); ++i) {
        const tinygltf::Primitive& source = mesh.primitives[i];
        if (isLeftOut(source)) continue;
        Expected<MeshData> data = primitive(node, mesh, source, false);
        if (!data) return failWith(fmt::format("mesh {}, primitive {}", index, i), data.error());
        if (data->empty()) continue;
        Expected<std::string> material = materialName(source);
        if (!material) return tl::unexpected(material.error());
        Part part{fmt::format("mesh {}.{}", number, i), std::move(*material), boundsOf(data->positions)};
        scene_.addModelMesh(part.mesh, std::move(*data), limits_);
        parts.push_back(std::move(part));
    }
    return parts;
}

}  // namespace tessera
