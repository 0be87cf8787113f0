#include "server/import/reader/GltfAccessors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "common/confine/Confinement.h"

namespace tessera {
namespace {

/// Without this, an accessor without data could ask for any amount of zeros.
constexpr std::size_t kMaxElements = 64'000'000;
/// Of all accessors: few sparse values may stand for very many zeros.
constexpr std::uint64_t kFreeZeros = 32'000'000, kZerosPerByte = 16;

/// One number of a component type, as a double.
double readNumber(const unsigned char* at, int componentType) {
    const auto as = [at](auto value) {
        std::memcpy(&value, at, sizeof(value));
        return static_cast<double>(value);
    };
    switch (componentType) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            return as(std::int8_t{});
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return as(std::uint8_t{});
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            return as(std::int16_t{});
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return as(std::uint16_t{});
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
            return as(std::uint32_t{});
        default:
            return as(float{});
    }
}

/// What an integer is divided by where it is normalised (glTF 2.0, "Accessor Data Types").
double normaliser(int componentType) {
    switch (componentType) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            return 127.0;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return 255.0;
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            return 32767.0;
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return 65535.0;
        default:
            return 1.0;
    }
}

}  // namespace

struct GltfAccessors::Layout {
    const tinygltf::Accessor* accessor;
    int components;
    std::size_t componentBytes;
};

std::size_t GltfAccessors::count(int accessor) const {
    if (accessor < 0 || static_cast<std::size_t>(accessor) >= model_.accessors.size()) return 0;
    return model_.accessors[static_cast<std::size_t>(accessor)].count;
}

Expected<GltfAccessors::Layout> GltfAccessors::layout(int accessor) const {
    if (accessor < 0 || static_cast<std::size_t>(accessor) >= model_.accessors.size())
        return fail(ErrorCode::kBadInput, fmt::format("accessor {} does not exist", accessor));
    const tinygltf::Accessor& found = model_.accessors[static_cast<std::size_t>(accessor)];
    const int components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(found.type));
    const int bytes = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(found.componentType));
    if (components <= 0 || bytes <= 0 || bytes > 4)
        return fail(ErrorCode::kBadInput, fmt::format("accessor {} has an unknown type", accessor));
    if (found.count > kMaxElements)
        return fail(ErrorCode::kLimit, fmt::format("accessor {} has more than {} elements", accessor, kMaxElements));
    if (found.bufferView < 0) {
        zeros_ += std::uint64_t{found.count} * static_cast<std::uint64_t>(components);
        const std::uint64_t most = kFreeZeros + kZerosPerByte * bytesGranted();
        if (zeros_ > most)
            return fail(ErrorCode::kLimit,
                        fmt::format("more than {} numbers of its accessors stand in no buffer, too many for a file of "
                                    "{} bytes: write accessor {} with all its numbers",
                                    most, bytesGranted(), accessor));
    }
    return Layout{&found, components, static_cast<std::size_t>(bytes)};
}

Expected<const unsigned char*> GltfAccessors::viewBytes(int view, std::size_t offset, std::size_t count,
                                                        std::size_t elementBytes, std::size_t stride) const {
    const auto outside = [&] {
        return fail(ErrorCode::kBadInput, fmt::format("an accessor reaches past the end of buffer view {}", view));
    };
    if (view < 0 || static_cast<std::size_t>(view) >= model_.bufferViews.size())
        return fail(ErrorCode::kBadInput, fmt::format("buffer view {} does not exist", view));
    const tinygltf::BufferView& found = model_.bufferViews[static_cast<std::size_t>(view)];
    if (found.buffer < 0 || static_cast<std::size_t>(found.buffer) >= model_.buffers.size())
        return fail(ErrorCode::kBadInput, fmt::format("buffer view {} names no buffer", view));
    const std::vector<unsigned char>& data = model_.buffers[static_cast<std::size_t>(found.buffer)].data;
    if (found.byteOffset > data.size() || found.byteLength > data.size() - found.byteOffset) return outside();
    if (count == 0) return data.data();
    if (offset > found.byteLength || elementBytes > found.byteLength - offset) return outside();
    if (stride > 0 && (count - 1) > (found.byteLength - offset - elementBytes) / stride) return outside();
    return data.data() + found.byteOffset + offset;
}

template <typename Value, typename Store>
Expected<void> GltfAccessors::visit(const Layout& layout, int components, Store store) const {
    const tinygltf::Accessor& accessor = *layout.accessor;
    const std::size_t elementBytes = layout.componentBytes * static_cast<std::size_t>(layout.components);
    const int used = std::min(components, layout.components);
    const double divisor = accessor.normalized ? normaliser(accessor.componentType) : 1.0;
    const auto element = [&](std::size_t index, const unsigned char* at) {
        for (int c = 0; c < used; ++c) {
            double value = readNumber(at + static_cast<std::size_t>(c) * layout.componentBytes, accessor.componentType);
            if (divisor != 1.0) value = std::max(value / divisor, -1.0);
            store(index, c, static_cast<Value>(value));
        }
    };
    if (accessor.bufferView >= 0) {
        const bool exists = static_cast<std::size_t>(accessor.bufferView) < model_.bufferViews.size();
        const std::size_t declared =
            exists ? model_.bufferViews[static_cast<std::size_t>(accessor.bufferView)].byteStride : 0;
        const std::size_t stride = declared != 0 ? declared : elementBytes;
        const Expected<const unsigned char*> data =
            viewBytes(accessor.bufferView, accessor.byteOffset, accessor.count, elementBytes, stride);
        if (!data) return tl::unexpected(data.error());
        for (std::size_t i = 0; i < accessor.count; ++i) element(i, *data + i * stride);
    }
    if (accessor.sparse.isSparse) {
        const auto& sparse = accessor.sparse;
        if (sparse.count < 0 || static_cast<std::size_t>(sparse.count) > accessor.count ||
            sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0)
            return fail(ErrorCode::kBadInput, "a sparse accessor replaces more elements than there are");
        const auto count = static_cast<std::size_t>(sparse.count);
        const int indexSize =
            tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(sparse.indices.componentType));
        if (indexSize <= 0 || indexSize > 4 || sparse.indices.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT)
            return fail(ErrorCode::kBadInput, "a sparse accessor's indices have an unknown type");
        const auto indexBytes = static_cast<std::size_t>(indexSize);
        const Expected<const unsigned char*> indices =
            viewBytes(sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset), count, indexBytes,
                      indexBytes);
        if (!indices) return tl::unexpected(indices.error());
        const Expected<const unsigned char*> values =
            viewBytes(sparse.values.bufferView, static_cast<std::size_t>(sparse.values.byteOffset), count, elementBytes,
                      elementBytes);
        if (!values) return tl::unexpected(values.error());
        for (std::size_t i = 0; i < count; ++i) {
            const double index = readNumber(*indices + i * indexBytes, sparse.indices.componentType);
            if (!(index >= 0.0 && index < static_cast<double>(accessor.count)))
                return fail(ErrorCode::kBadInput, "a sparse accessor's index is out of range");
            element(static_cast<std::size_t>(index), *values + i * elementBytes);
        }
    }
    return {};
}

Expected<std::vector<float>> GltfAccessors::floats(int accessor, int components, float fill) const {
    const Expected<Layout> found = layout(accessor);
    if (!found) return tl::unexpected(found.error());
    const auto width = static_cast<std::size_t>(components);
    std::vector<float> values(found->accessor->count * width, 0.0f);
    if (fill != 0.0f)
        for (std::size_t c = static_cast<std::size_t>(found->components); c < width; ++c)
            for (std::size_t i = c; i < values.size(); i += width) values[i] = fill;
    const Expected<void> done = visit<float>(*found, components, [&](std::size_t index, int component, float value) {
        values[index * width + static_cast<std::size_t>(component)] = value;
    });
    if (!done) return tl::unexpected(done.error());
    return values;
}

Expected<std::vector<std::uint32_t>> GltfAccessors::integers(int accessor, int components) const {
    const Expected<Layout> found = layout(accessor);
    if (!found) return tl::unexpected(found.error());
    const int type = found->accessor->componentType;
    if (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
        type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
        return fail(ErrorCode::kBadInput, fmt::format("accessor {} should hold unsigned integers", accessor));
    const auto width = static_cast<std::size_t>(components);
    std::vector<std::uint32_t> values(found->accessor->count * width, 0);
    const Expected<void> done =
        visit<std::uint32_t>(*found, components, [&](std::size_t index, int component, std::uint32_t value) {
            values[index * width + static_cast<std::size_t>(component)] = value;
        });
    if (!done) return tl::unexpected(done.error());
    return values;
}

}  // namespace tessera
