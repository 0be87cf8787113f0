// KHR_draco_mesh_compression (Khronos, glTF 2.0 extensions), decoded by libdraco.
#include <draco/compression/decode.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "server/import/reader/GltfCompression.h"
#include "server/import/reader/GltfReader.h"

namespace tessera {
namespace {

constexpr const char* kDraco = "KHR_draco_mesh_compression";

/// One value an accessor has, of all its points.
template <typename Number>
bool convert(const draco::PointAttribute& attribute, std::size_t points, int components, unsigned char* to) {
    for (std::size_t p = 0; p < points; ++p, to += sizeof(Number) * static_cast<std::size_t>(components)) {
        std::array<Number, 16> value{};
        const draco::AttributeValueIndex at = attribute.mapped_index(draco::PointIndex(static_cast<std::uint32_t>(p)));
        if (at.value() >= attribute.size() ||
            !attribute.ConvertValue(at, static_cast<std::int8_t>(components), value.data()))
            return false;
        std::memcpy(to, value.data(), sizeof(Number) * static_cast<std::size_t>(components));
    }
    return true;
}

bool convert(int componentType, const draco::PointAttribute& attribute, std::size_t points, int components,
             unsigned char* to) {
    switch (componentType) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            return convert<std::int8_t>(attribute, points, components, to);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return convert<std::uint8_t>(attribute, points, components, to);
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            return convert<std::int16_t>(attribute, points, components, to);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return convert<std::uint16_t>(attribute, points, components, to);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
            return convert<std::uint32_t>(attribute, points, components, to);
        case TINYGLTF_COMPONENT_TYPE_FLOAT:
            return convert<float>(attribute, points, components, to);
        default:
            return false;
    }
}

class DracoPrimitives {
public:
    DracoPrimitives(tinygltf::Model& model, std::size_t mostBytes)
        : model_(model), mostBytes_(mostBytes), left_(mostBytes) {}

    /// All of it or, with an error, nothing: what it has filled by then is as the file says again.
    Expected<void> expand(tinygltf::Primitive& primitive, const tinygltf::Value& said) {
        changed_.clear();
        const int indices = primitive.indices, mode = primitive.mode;
        Expected<void> done = fillAll(primitive, said);
        if (done) return done;
        for (const auto& [filled, before] : changed_) {
            model_.accessors[static_cast<std::size_t>(filled.first)] = before;
            filled_.erase(filled);
        }
        primitive.indices = indices;
        primitive.mode = mode;
        return done;
    }

private:
    Expected<void> fillAll(tinygltf::Primitive& primitive, const tinygltf::Value& said) {
        const int view = static_cast<int>(std::clamp(gltfNumber(said, "bufferView", -1), -1.0, 1e9));
        const Expected<std::shared_ptr<const draco::Mesh>> mesh = meshIn(view);
        if (!mesh) return tl::unexpected(mesh.error());
        if (!said.Has("attributes") || !said.Get("attributes").IsObject())
            return fail(ErrorCode::kBadInput, "it names no attributes");
        const tinygltf::Value& attributes = said.Get("attributes");
        for (const std::string& name : attributes.Keys()) {
            const auto accessor = primitive.attributes.find(name);
            if (accessor == primitive.attributes.end()) continue;  // nobody asks for it
            const auto id = static_cast<std::uint32_t>(
                std::clamp(gltfNumber(attributes, name.c_str(), 4294967295.0), 0.0, 4294967295.0));
            const draco::PointAttribute* attribute = (*mesh)->GetAttributeByUniqueId(id);
            if (!attribute) return fail(ErrorCode::kBadInput, fmt::format("it has no attribute {} ({})", id, name));
            if (Expected<void> done = fill(accessor->second, name, **mesh, *attribute); !done) return done;
        }
        return fillIndices(primitive, **mesh);
    }

    /// Decoded once, whoever names it.
    Expected<std::shared_ptr<const draco::Mesh>> meshIn(int view) {
        if (const auto known = meshes_.find(view); known != meshes_.end()) return known->second;
        if (view < 0 || static_cast<std::size_t>(view) >= model_.bufferViews.size())
            return fail(ErrorCode::kBadInput, fmt::format("there is no buffer view {}", view));
        const tinygltf::BufferView& found = model_.bufferViews[static_cast<std::size_t>(view)];
        if (found.buffer < 0 || static_cast<std::size_t>(found.buffer) >= model_.buffers.size())
            return fail(ErrorCode::kBadInput, fmt::format("buffer view {} names no buffer", view));
        const std::vector<unsigned char>& data = model_.buffers[static_cast<std::size_t>(found.buffer)].data;
        if (found.byteOffset > data.size() || found.byteLength > data.size() - found.byteOffset)
            return fail(ErrorCode::kBadInput, fmt::format("buffer view {} reaches past the end of its buffer", view));
        draco::DecoderBuffer bytes;
        bytes.Init(reinterpret_cast<const char*>(data.data() + found.byteOffset), found.byteLength);
        const auto type = draco::Decoder::GetEncodedGeometryType(&bytes);
        if (!type.ok() || type.value() != draco::TRIANGULAR_MESH)
            return fail(ErrorCode::kBadInput, fmt::format("buffer view {} holds no mesh of Draco's", view));
        draco::Decoder decoder;
        auto mesh = decoder.DecodeMeshFromBuffer(&bytes);
        if (!mesh.ok())
            return fail(ErrorCode::kBadInput,
                        fmt::format("buffer view {} cannot be decoded: {}", view, mesh.status().error_msg_string()));
        return meshes_[view] = std::shared_ptr<const draco::Mesh>(std::move(mesh).value().release());
    }

    /// A view of its own for so many bytes.
    Expected<unsigned char*> place(tinygltf::Accessor& accessor, std::size_t bytes) {
        if (bytes > left_)
            return fail(ErrorCode::kLimit, fmt::format("its compressed parts hold more than {} bytes", mostBytes_));
        left_ -= bytes;
        tinygltf::Buffer& buffer = model_.buffers.emplace_back();
        buffer.data.resize(bytes);
        tinygltf::BufferView& view = model_.bufferViews.emplace_back();
        view.buffer = static_cast<int>(model_.buffers.size()) - 1;
        view.byteLength = bytes;
        accessor.bufferView = static_cast<int>(model_.bufferViews.size()) - 1;
        accessor.byteOffset = 0;
        accessor.sparse.isSparse = false;
        return buffer.data.data();
    }

    Expected<void> fill(int index, const std::string& name, const draco::Mesh& mesh,
                        const draco::PointAttribute& attribute) {
        if (index < 0 || static_cast<std::size_t>(index) >= model_.accessors.size())
            return fail(ErrorCode::kBadInput, fmt::format("accessor {} does not exist", index));
        if (!filled_.emplace(index, &mesh).second) return {};  // of another primitive with the same mesh
        tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(index)];
        changed_.push_back({{index, &mesh}, accessor});
        const int components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)),
                  bytes = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
        if (components <= 0 || components > 4 || bytes <= 0 || bytes > 4)
            return fail(ErrorCode::kBadInput, fmt::format("accessor {} has an unknown type", index));
        const std::size_t points = mesh.num_points();
        if (accessor.count != points)
            return fail(ErrorCode::kBadInput,
                        fmt::format("{} has {} elements, accessor {} says {}", name, points, index, accessor.count));
        const Expected<unsigned char*> to =
            place(accessor, points * static_cast<std::size_t>(components) * static_cast<std::size_t>(bytes));
        if (!to) return tl::unexpected(to.error());
        if (!convert(accessor.componentType, attribute, points, components, *to))
            return fail(ErrorCode::kBadInput, fmt::format("{} cannot be put into accessor {}", name, index));
        return {};
    }

    Expected<void> fillIndices(tinygltf::Primitive& primitive, const draco::Mesh& mesh) {
        const std::size_t corners = std::size_t{3} * mesh.num_faces();
        if (primitive.indices < 0 || static_cast<std::size_t>(primitive.indices) >= model_.accessors.size()) {
            primitive.indices = static_cast<int>(model_.accessors.size());
            model_.accessors.emplace_back();
        }
        primitive.mode = TINYGLTF_MODE_TRIANGLES;  // also of what was a strip: faces are what is decoded
        if (!filled_.emplace(primitive.indices, &mesh).second) return {};
        tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(primitive.indices)];
        changed_.push_back({{primitive.indices, &mesh}, accessor});
        const Expected<unsigned char*> to = place(accessor, corners * sizeof(std::uint32_t));
        if (!to) return tl::unexpected(to.error());
        accessor.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
        accessor.type = TINYGLTF_TYPE_SCALAR;
        accessor.count = corners;
        for (std::uint32_t f = 0; f < mesh.num_faces(); ++f) {
            const draco::Mesh::Face& face = mesh.face(draco::FaceIndex(f));
            const std::array<std::uint32_t, 3> own = {face[0].value(), face[1].value(), face[2].value()};
            std::memcpy(*to + f * sizeof own, own.data(), sizeof own);
        }
        return {};
    }

    tinygltf::Model& model_;
    std::size_t mostBytes_, left_;
    std::map<int, std::shared_ptr<const draco::Mesh>> meshes_;  ///< by view
    using Filled = std::pair<int, const draco::Mesh*>;
    std::vector<std::pair<Filled, tinygltf::Accessor>> changed_;  ///< by this primitive: as it was before
    std::set<Filled> filled_;                                     ///< accessors
};

/// The file has the primitive uncompressed, too.
bool hasTwin(const tinygltf::Model& model, const tinygltf::Primitive& primitive) {
    const auto lies = [&](int accessor) {
        if (accessor < 0 || static_cast<std::size_t>(accessor) >= model.accessors.size()) return false;
        const int view = model.accessors[static_cast<std::size_t>(accessor)].bufferView;
        return view >= 0 && static_cast<std::size_t>(view) < model.bufferViews.size() &&
               model.bufferViews[static_cast<std::size_t>(view)].name != kStandIn;
    };
    return (primitive.indices < 0 || lies(primitive.indices)) && !primitive.attributes.empty() &&
           std::ranges::all_of(primitive.attributes, [&](const auto& named) { return lies(named.second); });
}

}  // namespace

Expected<void> expandDraco(tinygltf::Model& model, std::size_t mostBytes, std::vector<std::string>& notes) {
    DracoPrimitives primitives(model, mostBytes);
    for (std::size_t m = 0; m < model.meshes.size(); ++m) {
        for (std::size_t p = 0; p < model.meshes[m].primitives.size(); ++p) {
            tinygltf::Primitive& primitive = model.meshes[m].primitives[p];
            const auto said = primitive.extensions.find(kDraco);
            if (said == primitive.extensions.end()) continue;
            const bool twin = hasTwin(model, primitive);
            const Expected<void> done = primitives.expand(primitive, said->second);
            if (done) continue;
            const std::string where =
                fmt::format("mesh {}, primitive {}, compressed by Draco: {}", m, p, done.error().message);
            if (!twin) return fail(done.error().code, where);
            notes.push_back(where + "; its uncompressed twin is shown");
        }
    }
    return {};
}

}  // namespace tessera
