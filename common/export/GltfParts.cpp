#include "common/export/GltfParts.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera {
namespace {

constexpr std::uint64_t kAlignment = 4;

bool allFinite(std::span<const float> values) {
    return std::ranges::all_of(values, [](float value) { return std::isfinite(value); });
}

/// "min" and "max" of each component, as members.
std::string boundsMembers(std::span<const float> values, std::size_t components) {
    std::vector<double> least(components, std::numeric_limits<double>::infinity());
    std::vector<double> greatest(components, -std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < values.size(); ++i) {
        const auto value = static_cast<double>(values[i]);
        least[i % components] = std::min(least[i % components], value);
        greatest[i % components] = std::max(greatest[i % components], value);
    }
    return fmt::format(",\"min\":{},\"max\":{}", jsonNumbers(least), jsonNumbers(greatest));
}

}  // namespace

int GltfParts::addView(ByteSlice bytes, int target) {
    if (const std::uint64_t over = bufferBytes_ % kAlignment; over != 0) {
        buffer_.push_back(sliceOf(std::vector<std::byte>(kAlignment - over)));
        bufferBytes_ += kAlignment - over;
    }
    JsonObject view;
    view.number("buffer", 0).number("byteOffset", bufferBytes_).number("byteLength", bytes.size());
    if (target != kGltfNoTarget) view.number("target", target);
    bufferBytes_ += bytes.size();
    buffer_.push_back(std::move(bytes));
    return views_.add(view.done());
}

int GltfParts::addAccessor(int view, int component, std::string_view kind, std::size_t count, std::string_view more,
                           std::size_t offset) {
    return accessors_.add(fmt::format(R"({{"bufferView":{}{},"componentType":{},"count":{},"type":"{}"{}}})", view,
                                      offset == 0 ? std::string() : fmt::format(",\"byteOffset\":{}", offset),
                                      component, count, kind, more));
}

int GltfParts::floats(const Blob& blob, std::string_view kind, std::size_t components, bool bounds) {
    const auto [found, isNew] = known_.try_emplace({blob.id(), std::string(kind), bounds}, 0);
    if (!isNew) return found->second;
    const std::span<const float> values = blob.as<float>();
    if (!allFinite(values)) {
        std::vector<float> finite(values.begin(), values.end());
        for (float& value : finite) value = std::isfinite(value) ? value : 0.0f;
        return found->second = floats(std::move(finite), kind, components, bounds, kGltfVertices);
    }
    const int view = addView(blob.slice(), kGltfVertices);
    return found->second = addAccessor(view, kGltfFloat, kind, values.size() / components,
                                       bounds ? boundsMembers(values, components) : std::string());
}

int GltfParts::floats(std::vector<float> values, std::string_view kind, std::size_t components, bool bounds,
                      int target) {
    const std::string more = bounds ? boundsMembers(values, components) : std::string();
    const std::size_t count = values.size() / components;
    return addAccessor(addView(sliceOf(std::move(values)), target), kGltfFloat, kind, count, more);
}

int GltfParts::indices(const Blob& blob, std::size_t vertices) {
    const auto [found, isNew] = known_.try_emplace({blob.id(), fmt::format("indices of {}", vertices), false}, 0);
    if (!isNew) return found->second;
    const std::span<const std::uint32_t> values = blob.as<std::uint32_t>();
    // The greatest number of 16 bits begins a new strip.
    if (vertices > std::numeric_limits<std::uint16_t>::max())
        return found->second = addAccessor(addView(blob.slice(), kGltfIndices), kGltfInt, "SCALAR", values.size());
    std::vector<std::uint16_t> narrow(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) narrow[i] = static_cast<std::uint16_t>(values[i]);
    return found->second =
               addAccessor(addView(sliceOf(std::move(narrow)), kGltfIndices), kGltfShort, "SCALAR", values.size());
}

}  // namespace tessera
