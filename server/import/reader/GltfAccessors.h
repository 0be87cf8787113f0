/// Typed, bounds-checked views of a glTF model's accessors: strides, sparse ones, normalised integers.
#pragma once

#include <tiny_gltf.h>

#include <cstdint>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

/// Refuses what a file of its bytes (`bytesGranted`) has too much of: numbers that stand in no buffer, as of sparse
/// accessors. Not thread-safe.
class GltfAccessors {
public:
    explicit GltfAccessors(const tinygltf::Model& model) : model_(model) {}

    /// `components` floats per element, whatever the file stores; further components are left off, missing ones are
    /// `fill`. Integers become numbers from -1 or 0 to 1 where the accessor says normalised.
    [[nodiscard]] Expected<std::vector<float>> floats(int accessor, int components, float fill = 0.0f) const;
    /// One unsigned integer per component of each element.
    [[nodiscard]] Expected<std::vector<std::uint32_t>> integers(int accessor, int components) const;
    /// How many elements the accessor has, or 0 where there is no such accessor.
    [[nodiscard]] std::size_t count(int accessor) const;

private:
    struct Layout;
    [[nodiscard]] Expected<Layout> layout(int accessor) const;
    /// The bytes of `count` elements of `elementBytes` at `offset` in a view; checked.
    [[nodiscard]] Expected<const unsigned char*> viewBytes(int view, std::size_t offset, std::size_t count,
                                                           std::size_t elementBytes, std::size_t stride) const;
    /// Calls `store(element, component, value)` for every stored number, sparse replacements last.
    template <typename Value, typename Store>
    [[nodiscard]] Expected<void> visit(const Layout& layout, int components, Store store) const;

    const tinygltf::Model& model_;
    /// Numbers that stand in no buffer, as often as they were read: meshes may share an accessor, and each has a copy.
    mutable std::uint64_t zeros_ = 0;
};

}  // namespace tessera
