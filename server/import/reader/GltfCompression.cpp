// The meshopt formats are those of EXT_meshopt_compression (Khronos, glTF 2.0 vendor extensions); libmeshoptimizer
// decodes them.
#include "server/import/reader/GltfCompression.h"

#include <fmt/format.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>

#include "server/import/reader/GltfReader.h"

namespace tessera {
namespace {

using Json = nlohmann::json;

constexpr std::array<const char*, 2> kNames = {"EXT_meshopt_compression", "KHR_meshopt_compression"};

/// A GLB's chunks. tinygltf checks what they say; here they are only found.
struct GlbChunks {
    std::string_view json, rest;
};
std::uint32_t wordAt(ByteSpan bytes, std::size_t at) {
    std::uint32_t word = 0;
    if (at + sizeof word <= bytes.size()) std::memcpy(&word, bytes.data() + at, sizeof word);
    return word;
}
std::optional<GlbChunks> chunksOf(ByteSpan file) {
    constexpr std::size_t kHead = 20;
    const std::size_t length = wordAt(file, 12);
    if (file.size() < kHead || length > file.size() - kHead) return std::nullopt;
    return GlbChunks{asText(file.subspan(kHead, length)), asText(file.subspan(kHead + length))};
}

Bytes glbOf(std::string json, std::string_view rest) {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    Bytes made(20 + json.size() + rest.size());
    const std::array<std::uint32_t, 5> head = {0x46546C67u, 2, static_cast<std::uint32_t>(made.size()),
                                               static_cast<std::uint32_t>(json.size()), 0x4E4F534Au};
    std::memcpy(made.data(), head.data(), sizeof head);
    std::memcpy(made.data() + sizeof head, json.data(), json.size());
    if (!rest.empty()) std::memcpy(made.data() + sizeof head + json.size(), rest.data(), rest.size());
    return made;
}

/// What a view says of itself.
struct CompressedView {
    int buffer = -1;
    std::size_t offset = 0, bytes = 0, stride = 0, count = 0;
    std::string mode, filter;
};
CompressedView viewOf(const tinygltf::Value& said) {
    const auto number = [&](const char* key) {
        return static_cast<std::size_t>(std::clamp(gltfNumber(said, key, 0), 0.0, 1e15));
    };
    const auto word = [&](const char* key, const char* otherwise) -> std::string {
        return said.Has(key) && said.Get(key).IsString() ? said.Get(key).Get<std::string>() : otherwise;
    };
    return {.buffer = static_cast<int>(std::clamp(gltfNumber(said, "buffer", -1), -1.0, 1e9)),
            .offset = number("byteOffset"),
            .bytes = number("byteLength"),
            .stride = number("byteStride"),
            .count = number("count"),
            .mode = word("mode", ""),
            .filter = word("filter", "NONE")};
}

bool isFilter(std::string_view filter) {
    return filter == "OCTAHEDRAL" || filter == "QUATERNION" || filter == "EXPONENTIAL";
}

/// What the format does not allow, or nothing.
std::string faultOf(const CompressedView& view) {
    const std::size_t s = view.stride;
    if (view.mode == "ATTRIBUTES") {
        if (s < 4 || s > 256 || s % 4 != 0) return fmt::format("its stride is {}: 4 to 256 in fours", s);
        if (view.filter == "NONE") return {};
        if (view.filter == "OCTAHEDRAL" && s != 4 && s != 8) return fmt::format("octahedral with a stride of {}", s);
        if (view.filter == "QUATERNION" && s != 8) return fmt::format("quaternions with a stride of {}", s);
        return isFilter(view.filter) ? "" : fmt::format("the filter {} is not read", view.filter);
    }
    if (view.mode != "TRIANGLES" && view.mode != "INDICES") return fmt::format("the mode \"{}\" is unknown", view.mode);
    if (s != 2 && s != 4) return fmt::format("indices of {} bytes", s);
    if (view.filter != "NONE") return "indices with a filter";
    if (view.mode == "TRIANGLES" && view.count % 3 != 0) return fmt::format("{} indices are no triangles", view.count);
    return {};
}

/// No encoder makes fewer bytes of so many elements: an attribute's byte takes two bits for 16 elements, a triangle
/// one byte, an index one.
bool canHold(const CompressedView& view) {
    constexpr std::size_t kOfAByte = 64, kSlack = 4096;
    return view.stride == 0 || view.count <= (view.bytes * kOfAByte + kSlack) / std::max<std::size_t>(1, view.stride);
}

Expected<std::vector<unsigned char>> decode(const CompressedView& view, const unsigned char* from) {
    std::vector<unsigned char> to(view.count * view.stride);
    int status = 0;
    if (view.mode == "ATTRIBUTES")
        status = meshopt_decodeVertexBuffer(to.data(), view.count, view.stride, from, view.bytes);
    else if (view.mode == "TRIANGLES")
        status = meshopt_decodeIndexBuffer(to.data(), view.count, view.stride, from, view.bytes);
    else
        status = meshopt_decodeIndexSequence(to.data(), view.count, view.stride, from, view.bytes);
    if (status != 0) {
        const bool later = view.mode == "ATTRIBUTES" && view.bytes > 0 && from[0] == 0xa1;
        return fail(ErrorCode::kBadInput, later ? "its codec is of version 1, and 0 is read here: write it as "
                                                  "EXT_meshopt_compression"
                                                : "its bytes are damaged");
    }
    if (view.filter == "OCTAHEDRAL") meshopt_decodeFilterOct(to.data(), view.count, view.stride);
    if (view.filter == "QUATERNION") meshopt_decodeFilterQuat(to.data(), view.count, view.stride);
    if (view.filter == "EXPONENTIAL") meshopt_decodeFilterExp(to.data(), view.count, view.stride);
    return to;
}

}  // namespace

namespace {

constexpr const char* kOneByte = "data:application/octet-stream;base64,AA==";

bool isArray(const Json& of, const char* key) {
    return of.is_object() && of.contains(key) && of[key].is_array();
}
bool extends(const Json& of, std::span<const char* const> names) {
    return of.is_object() && of.contains("extensions") && of["extensions"].is_object() &&
           std::ranges::any_of(names, [&](const char* name) { return of["extensions"].contains(name); });
}

/// Buffers whose views are all compressed.
bool fillBuffers(Json& json) {
    bool some = false;
    if (!isArray(json, "buffers")) return false;
    for (Json& buffer : json["buffers"]) {
        if (!extends(buffer, kNames)) continue;
        buffer["uri"] = kOneByte;
        buffer["byteLength"] = 1;
        some = true;
    }
    return some;
}

/// Accessors that Draco alone fills.
bool fillAccessors(Json& json) {
    constexpr std::array<const char*, 1> kDraco = {"KHR_draco_mesh_compression"};
    if (!isArray(json, "meshes") || !isArray(json, "accessors") || !isArray(json, "buffers") ||
        !isArray(json, "bufferViews"))
        return false;
    bool some = false;
    const auto fill = [&](const Json& accessor) {
        if (!accessor.is_number_unsigned() || accessor.get<std::size_t>() >= json["accessors"].size()) return;
        Json& filled = json["accessors"][accessor.get<std::size_t>()];
        if (!filled.is_object() || filled.contains("bufferView")) return;
        filled["bufferView"] = json["bufferViews"].size();
        some = true;
    };
    for (const Json& mesh : json["meshes"]) {
        if (!isArray(mesh, "primitives")) continue;
        for (const Json& primitive : mesh["primitives"]) {
            if (!extends(primitive, kDraco)) continue;
            if (primitive.contains("indices")) fill(primitive["indices"]);
            if (primitive.contains("attributes") && primitive["attributes"].is_object())
                for (const Json& accessor : primitive["attributes"]) fill(accessor);
        }
    }
    if (!some) return false;
    json["bufferViews"].push_back({{"buffer", json["buffers"].size()}, {"byteLength", 1}, {"name", kStandIn}});
    json["buffers"].push_back({{"uri", kOneByte}, {"byteLength", 1}});
    return true;
}

}  // namespace

std::optional<Bytes> withStandIns(ByteSpan file) {
    const bool binary = asText(file).starts_with("glTF");
    const std::optional<GlbChunks> chunks = binary ? chunksOf(file) : GlbChunks{asText(file), {}};
    if (!chunks || chunks->json.find("_compression\"") == std::string_view::npos) return std::nullopt;
    Json json = Json::parse(chunks->json, nullptr, false);
    const bool buffers = fillBuffers(json), accessors = fillAccessors(json);
    if (!buffers && !accessors) return std::nullopt;
    const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (binary) return glbOf(text, chunks->rest);
    const ByteSpan bytes = asBytes(text);
    return Bytes(bytes.begin(), bytes.end());
}

Expected<void> expandMeshopt(tinygltf::Model& model, std::size_t mostBytes) {
    std::size_t left = mostBytes;
    for (std::size_t i = 0; i < model.bufferViews.size(); ++i) {
        const tinygltf::Value* said = nullptr;
        for (const char* name : kNames)
            if (const auto found = model.bufferViews[i].extensions.find(name);
                !said && found != model.bufferViews[i].extensions.end())
                said = &found->second;
        if (!said) continue;
        const auto wrong = [&](const std::string& what) {
            return fail(ErrorCode::kBadInput, fmt::format("buffer view {}, compressed by meshopt: {}", i, what));
        };
        const CompressedView view = viewOf(*said);
        if (const std::string fault = faultOf(view); !fault.empty()) return wrong(fault);
        if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= model.buffers.size())
            return wrong(fmt::format("there is no buffer {}", view.buffer));
        const std::vector<unsigned char>& data = model.buffers[static_cast<std::size_t>(view.buffer)].data;
        if (view.offset > data.size() || view.bytes > data.size() - view.offset)
            return wrong(fmt::format("it reaches past the end of buffer {}", view.buffer));
        if (!canHold(view))
            return wrong(
                fmt::format("{} elements of {} bytes are not in {} bytes", view.count, view.stride, view.bytes));
        if (view.count * view.stride > left)
            return fail(ErrorCode::kLimit, fmt::format("its compressed parts hold more than {} bytes", mostBytes));
        left -= view.count * view.stride;
        Expected<std::vector<unsigned char>> decoded = decode(view, data.data() + view.offset);
        if (!decoded) return wrong(decoded.error().message);
        tinygltf::BufferView& now = model.bufferViews[i];
        now.buffer = static_cast<int>(model.buffers.size());
        now.byteOffset = 0;
        now.byteLength = decoded->size();
        // Of indices no view says a stride.
        now.byteStride = view.mode == "ATTRIBUTES" ? view.stride : 0;
        model.buffers.emplace_back().data = std::move(*decoded);
    }
    return {};
}

}  // namespace tessera
