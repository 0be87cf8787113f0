#include "common/export/GltfShapes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/geometry/MeshCopies.h"
#include "common/math/Srgb.h"

namespace tessera {
namespace {

constexpr int kPointsMode = 0, kLinesMode = 1;

bool isUnit(const Vec3f& vector) {
    return std::abs(vector.norm() - 1.0f) < 1e-5f;
}

/// As many corners as whole triangles or lines have.
Blob wholeOf(const Blob& indices, std::size_t each) {
    const std::size_t over = indices.as<std::uint32_t>().size() % each;
    if (over == 0) return indices;
    const std::span<const std::uint32_t> all = indices.as<std::uint32_t>();
    return Blob::of(all.first(all.size() - over));
}

std::string normalizedMember() {
    return R"(,"normalized":true)";
}

/// Streaks and discs of no size are not shown.
Blob shownParticles(const MeshArrays& arrays) {
    const std::span<const float> sizes = arrays.texcoords.as<float>();
    std::vector<std::uint32_t> shown;
    const std::size_t step = arrays.kind == MeshKind::kStreaks ? 2 : 1;
    for (std::size_t i = 0; i + step <= sizes.size() / 2; i += step)
        for (std::size_t k = 0; k < step && sizes[2 * i] > 0; ++k) shown.push_back(static_cast<std::uint32_t>(i + k));
    return Blob::of(std::span<const std::uint32_t>(shown));
}

}  // namespace

int GltfShapes::unitVectors(const Blob& blob, std::size_t each) {
    const auto [known, isNew] = vectors_.try_emplace({blob.id(), each}, 0);
    if (!isNew) return known->second;
    const std::string_view kind = each == 3 ? "VEC3" : "VEC4";
    const std::span<const float> values = blob.as<float>();
    bool sound = true;
    for (std::size_t i = 0; sound && i + each <= values.size(); i += each)
        sound = isUnit(Vec3f(values[i], values[i + 1], values[i + 2])) && (each == 3 || std::abs(values[i + 3]) == 1);
    if (sound) return known->second = parts_.floats(blob, kind, each);
    std::vector<float> unit(values.begin(), values.end());
    for (std::size_t i = 0; i + each <= unit.size(); i += each) {
        Vec3f vector(unit[i], unit[i + 1], unit[i + 2]);
        const float length = vector.norm();
        const bool tells = length > 1e-20f && std::isfinite(length);
        vector = tells ? Vec3f((vector.cast<double>() / static_cast<double>(length)).normalized().cast<float>())
                       : Vec3f(each == 3 ? Vec3f::UnitY() : Vec3f::UnitX());
        std::copy(vector.begin(), vector.end(), unit.begin() + static_cast<std::ptrdiff_t>(i));
        if (each == 4) unit[i + 3] = unit[i + 3] < 0 ? -1.0f : 1.0f;
    }
    return known->second = parts_.floats(std::move(unit), kind, each, false, kGltfVertices);
}

/// Ours are sRGB, glTF's are linear: in 16 bits each of our bytes has a number of its own.
int GltfShapes::colors(const Blob& blob) {
    const auto [known, isNew] = colors_.try_emplace(blob.id(), 0);
    if (!isNew) return known->second;
    static const std::array<std::uint16_t, 256> kLinear = [] {
        std::array<std::uint16_t, 256> table{};
        for (std::size_t i = 0; i < table.size(); ++i)
            table[i] = static_cast<std::uint16_t>(std::lround(linearOfSrgb(static_cast<double>(i) / 255) * 65535));
        return table;
    }();
    const std::span<const std::uint8_t> bytes = blob.as<std::uint8_t>();
    std::vector<std::uint16_t> linear(bytes.size());
    for (std::size_t i = 0; i < bytes.size(); ++i)
        linear[i] = i % 4 == 3 ? static_cast<std::uint16_t>(bytes[i] * 257) : kLinear[bytes[i]];
    const std::size_t count = linear.size() / 4;
    return known->second = parts_.addAccessor(parts_.addView(sliceOf(std::move(linear)), kGltfVertices), kGltfShort,
                                              "VEC4", count, normalizedMember());
}

Expected<std::optional<int>> GltfShapes::mesh(std::span<const SelectedNode* const> nodes, bool skinned,
                                              std::size_t times) {
    std::vector<Worn> key;
    std::string list;
    std::size_t triangles = 0;
    for (const SelectedNode* node : nodes) {
        const Expected<Primitive> made = primitive(*node, skinned);
        if (!made) return tl::unexpected(made.error());
        if (made->json.empty()) continue;
        key.emplace_back(node->node->core, node->materialFor(drawableOf(node->core).material()), skinned);
        (list += list.empty() ? "" : ",") += made->json;
        triangles += made->triangles;
    }
    if (key.empty()) return std::nullopt;
    triangles_ += times * triangles;
    const auto [known, isNew] = known_.try_emplace(std::move(key), std::nullopt);
    if (isNew) {
        JsonObject mesh;
        mesh.json("primitives", '[' + list + ']');
        const auto* skin = nodes.front()->core.as<Skin>();
        if (skinned && skin && !skin->morphPositions.empty()) {
            const std::size_t vertices = skin->positions.sizeBytes() / (3 * sizeof(float));
            const std::size_t targets = skin->morphPositions.sizeBytes() / (3 * sizeof(float)) / vertices;
            const std::span<const float> said = skin->weights.as<float>();
            std::vector<float> weights(targets);
            std::copy_n(said.begin(), std::min(said.size(), targets), weights.begin());
            mesh.numbers("weights", weights);
        }
        known->second = parts_.meshes.add(mesh.done());
    }
    return known->second;
}

Expected<GltfShapes::Primitive> GltfShapes::primitive(const SelectedNode& node, bool skinned) {
    const Drawable drawable = drawableOf(node.core);
    const ObjectId material = node.materialFor(drawable.material());
    const Worn key{node.node->core, material, skinned};
    if (const auto known = primitives_.find(key); known != primitives_.end()) return known->second;
    Expected<MeshArrays> arrays = meshes_.of(node);
    if (!arrays) return tl::unexpected(arrays.error());
    const auto* skin = skinned ? node.core.as<Skin>() : nullptr;
    // At rest: `arrays` are as they stand, and were looked at.
    if (skin && !arrays->positions.empty())
        *arrays = {.positions = skin->positions,
                   .normals = skin->normals,
                   .colors = skin->colors,
                   .texcoords = skin->texcoords,
                   .indices = skin->indices.empty() ? arrays->indices : skin->indices,
                   .texcoords1 = skin->texcoords1,
                   .tangents = skin->tangents};
    Primitive made = arrays->positions.empty() ? Primitive() : describe(*arrays, node, material, skin);
    return primitives_.emplace(key, std::move(made)).first->second;
}

GltfShapes::Primitive GltfShapes::describe(const MeshArrays& arrays, const SelectedNode& node, ObjectId material,
                                           const Skin* skin) {
    const std::size_t vertices = arrays.positions.sizeBytes() / (3 * sizeof(float));
    const bool lines = arrays.kind == MeshKind::kLines || arrays.kind == MeshKind::kStreaks;
    const bool points =
        arrays.kind == MeshKind::kPoints || arrays.kind == MeshKind::kDiscs || arrays.kind == MeshKind::kSprites;
    const bool particles =
        arrays.kind == MeshKind::kDiscs || arrays.kind == MeshKind::kSprites || arrays.kind == MeshKind::kStreaks;
    const Blob order = particles && !lines ? shownParticles(arrays)
                       : points            ? Blob()
                       : lines             ? wholeOf(particles ? shownParticles(arrays) : arrays.lines, 2)
                                           : wholeOf(arrays.indices, 3);
    if (order.sizeBytes() == 0 && !(points && !particles)) return {};
    if (particles) notes_.add("particles are written as points or lines, without their sizes", node.id);

    JsonObject attributes, primitive;
    attributes.number("POSITION", parts_.floats(arrays.positions, "VEC3", 3, true));
    if (!arrays.normals.empty() && !lines) attributes.number("NORMAL", unitVectors(arrays.normals, 3));
    if (!arrays.tangents.empty() && !arrays.normals.empty() && !lines && !points)
        attributes.number("TANGENT", unitVectors(arrays.tangents, 4));
    GltfCoordinates coordinates;
    if (!particles) {
        coordinates = {.first = !arrays.texcoords.empty(), .second = !arrays.texcoords1.empty()};
        // Sets are numbered without gaps: the second alone has a first of the same.
        if (coordinates.first || coordinates.second)
            attributes.number("TEXCOORD_0",
                              parts_.floats(coordinates.first ? arrays.texcoords : arrays.texcoords1, "VEC2", 2));
        if (coordinates.second) attributes.number("TEXCOORD_1", parts_.floats(arrays.texcoords1, "VEC2", 2));
        coordinates.first = coordinates.first || coordinates.second;
    }
    if (!arrays.colors.empty() && arrays.kind != MeshKind::kGlyphs) attributes.number("COLOR_0", colors(arrays.colors));
    if (skin && !skin->jointIndices.empty() && !skin->jointWeights.empty()) addInfluences(*skin, attributes);
    primitive.json("attributes", attributes.done());
    if (!order.empty()) primitive.number("indices", parts_.indices(order, vertices));
    if (points || lines) primitive.number("mode", points ? kPointsMode : kLinesMode);
    if (material || !(points || lines)) primitive.number("material", looks_.material(material, coordinates, node.id));
    if (skin && !skin->morphPositions.empty()) primitive.json("targets", morphTargets(*skin, vertices));
    if (arrays.kind == MeshKind::kPoints && arrays.pointRadius > 0) {
        JsonObject extras;
        primitive.json("extras", extras.number("pointRadius", arrays.pointRadius).done());
    }
    const bool surface = !points && !lines;
    return {.json = primitive.done(), .triangles = surface ? order.as<std::uint32_t>().size() / 3 : 0};
}

/// Each joint of a vertex once, weights that sum up to 1, no joint where the weight is 0: as glTF wants them.
void GltfShapes::addInfluences(const Skin& skin, JsonObject& attributes) {
    const std::span<const std::uint16_t> saidJoints = skin.jointIndices.as<std::uint16_t>();
    const std::span<const float> saidWeights = skin.jointWeights.as<float>();
    std::vector<std::uint16_t> joints(saidJoints.begin(), saidJoints.end());
    std::vector<float> weights(saidWeights.begin(), saidWeights.end());
    for (std::size_t v = 0; v + 4 <= weights.size(); v += 4) {
        for (std::size_t i = v; i < v + 4; ++i)
            for (std::size_t k = v; k < i; ++k)
                if (weights[i] > 0 && joints[i] == joints[k]) weights[k] += std::exchange(weights[i], 0.0f);
        double sum = 0;
        for (std::size_t i = v; i < v + 4; ++i) sum += weights[i];
        for (std::size_t i = v; i < v + 4; ++i) {
            if (!(weights[i] > 0)) joints[i] = 0, weights[i] = 0;
            if (std::abs(sum - 1) > 1e-7) weights[i] = static_cast<float>(weights[i] / sum);
        }
    }
    const std::size_t vertices = joints.size() / 4;
    const int view = parts_.addView(sliceOf(std::move(joints)), kGltfVertices);
    attributes.number("JOINTS_0", parts_.addAccessor(view, kGltfShort, "VEC4", vertices));
    attributes.number("WEIGHTS_0", parts_.floats(std::move(weights), "VEC4", 4, false, kGltfVertices));
}

std::string GltfShapes::morphTargets(const Skin& skin, std::size_t vertices) {
    const std::size_t each = 3 * vertices;
    const std::size_t count = each == 0 ? 0 : skin.morphPositions.as<float>().size() / each;
    JsonArray targets;
    for (std::size_t t = 0; t < count; ++t) {
        const auto part = [&](const Blob& all, bool bounds) {
            const std::span<const float> values = all.as<float>().subspan(t * each, each);
            return parts_.floats(std::vector<float>(values.begin(), values.end()), "VEC3", 3, bounds, kGltfVertices);
        };
        JsonObject target;
        target.number("POSITION", part(skin.morphPositions, true));
        if (!skin.morphNormals.empty() && !skin.normals.empty())
            target.number("NORMAL", part(skin.morphNormals, false));
        if (!skin.morphTangents.empty() && !skin.tangents.empty() && !skin.normals.empty())
            target.number("TANGENT", part(skin.morphTangents, false));
        targets.add(target.done());
    }
    return targets.done();
}

int GltfShapes::inverseBinds(const Skin& skin) {
    const auto [known, isNew] = binds_.try_emplace({skin.inverseBinds.id(), skin.joints.size()}, 0);
    if (!isNew) return known->second;
    std::vector<float> matrices;
    const std::span<const float> rows = skin.inverseBinds.as<float>();
    for (std::size_t joint = 0; joint < skin.joints.size(); ++joint)
        for (std::size_t column = 0; column < 4; ++column)
            for (std::size_t row = 0; row < 4; ++row)
                matrices.push_back(row == 3       ? (column == 3 ? 1.0f : 0.0f)
                                   : rows.empty() ? (column == row ? 1.0f : 0.0f)
                                                  : rows[12 * joint + 4 * row + column]);
    return known->second = parts_.floats(std::move(matrices), "MAT4", 16, false, kGltfNoTarget);
}

Expected<GltfShapes::Instances> GltfShapes::instances(const SelectedNode& node) {
    const Expected<MeshArrays> arrays = meshes_.of(node);
    if (!arrays) return tl::unexpected(arrays.error());
    if (arrays->kind != MeshKind::kGlyphs) return Instances();
    const std::span<const MeshCopy> copies = arrays->copies.as<MeshCopy>();
    const std::span<const std::uint8_t> colored = arrays->colors.as<std::uint8_t>();
    std::vector<float> places, turns, scales;
    std::vector<std::uint8_t> kept;
    for (std::size_t i = 0; i < copies.size(); ++i) {
        const MeshCopy& copy = copies[i];
        if (!(copy.width > 0) || !(copy.length > 0)) continue;
        places.insert(places.end(), copy.place.begin(), copy.place.end());
        turns.insert(turns.end(), copy.turn.begin(), copy.turn.end());
        scales.insert(scales.end(), {copy.width, copy.length, copy.width});
        if (!colored.empty()) kept.insert(kept.end(), &colored[4 * i], &colored[4 * i] + 4);
    }
    if (places.empty()) return Instances();
    const std::size_t count = places.size() / 3;
    parts_.extensions.insert("EXT_mesh_gpu_instancing");
    JsonObject attributes, extension;
    attributes.number("TRANSLATION", parts_.floats(std::move(places), "VEC3", 3, false, kGltfNoTarget))
        .number("ROTATION", parts_.floats(std::move(turns), "VEC4", 4, false, kGltfNoTarget))
        .number("SCALE", parts_.floats(std::move(scales), "VEC3", 3, false, kGltfNoTarget));
    if (!kept.empty()) {
        const Blob blob = Blob::of(std::span<const std::uint8_t>(kept));
        attributes.number("_COLOR_0", colors(blob));
    }
    return Instances{extension.json("attributes", attributes.done()).done(), count};
}

}  // namespace tessera
