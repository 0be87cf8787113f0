/// A cube of n × n quadrilaterals a side, as a SubdivisionSurface, and the hall with one in it.
#pragma once

#include <map>

#include "common/cores/SubdivisionSurface.h"
#include "common/drawable/SubdivisionArrays.h"
#include "tests/unit/scene/SceneEdits.h"

namespace tessera::test {

inline SubdivisionSurface controlGrid(std::uint32_t n) {
    std::map<std::array<std::uint32_t, 3>, std::uint32_t> numbers;
    std::vector<float> points;
    std::vector<std::uint32_t> sizes, vertices;
    const auto vertex = [&](std::array<std::uint32_t, 3> at) {
        const auto [found, isNew] = numbers.try_emplace(at, static_cast<std::uint32_t>(numbers.size()));
        if (isNew)
            for (const std::uint32_t x : at) points.push_back(2 * static_cast<float>(x) / static_cast<float>(n) - 1);
        vertices.push_back(found->second);
    };
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (const std::uint32_t side : {0U, n})
            for (std::uint32_t j = 0; j < n; ++j)
                for (std::uint32_t i = 0; i < n; ++i) {
                    const std::size_t u = (axis + (side ? 1 : 2)) % 3, v = (axis + (side ? 2 : 1)) % 3;
                    sizes.push_back(4);
                    for (const auto& [x, y] : {std::pair{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}}) {
                        std::array<std::uint32_t, 3> at{};
                        at[axis] = side;
                        at[u] = x;
                        at[v] = y;
                        vertex(at);
                    }
                }
    SubdivisionSurface surface;
    surface.points = Blob::of(std::span<const float>(points));
    surface.faceSizes = Blob::of(std::span<const std::uint32_t>(sizes));
    surface.faceVertices = Blob::of(std::span<const std::uint32_t>(vertices));
    return surface;
}

/// The hall (SceneEdits.h) with the surface as object 9.
inline Aspect sceneWithSurface(const SubdivisionSurface& surface) {
    Aspect aspect = hall();
    Edits edits;
    const ObjectId id(9);
    const TypeInfo& type = *findType(SubdivisionSurface::kType);
    edits.create(id, type.type);
    const SubdivisionSurface given = [&] {
        SubdivisionSurface s = surface;
        s.material = ObjectId(7);
        return s;
    }();
    for (const FieldEntry& field : type.fields) edits.set(id, type.type, field.id, field.read(&given));
    mustApply(aspect, edits.take());
    return aspect;
}

}  // namespace tessera::test
