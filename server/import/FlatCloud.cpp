#include "server/import/FlatCloud.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace tessera {
namespace {

constexpr std::size_t kLookedAt = 65'536, kFewest = 16;
constexpr double kFlat = 0.25;

/// Of what lies in the middle: without a twentieth at either end.
double reach(std::vector<float>& numbers) {
    const auto at = [&](std::size_t index) {
        const auto nth = numbers.begin() + static_cast<std::ptrdiff_t>(index);
        std::nth_element(numbers.begin(), nth, numbers.end());
        return double{*nth};
    };
    const std::size_t cut = numbers.size() / 20;
    return at(numbers.size() - 1 - cut) - at(cut);
}

bool areFlat(std::array<std::vector<float>, 3>& axes) {
    if (axes[0].size() < kFewest) return false;
    return reach(axes[2]) < kFlat * std::min(reach(axes[0]), reach(axes[1]));
}

/// Every so-manieth.
void addSample(std::span<const float> positions, std::size_t step, std::array<std::vector<float>, 3>& axes) {
    for (std::size_t i = 0; i + 2 < positions.size(); i += 3 * step) {
        const std::span<const float> point = positions.subspan(i, 3);
        if (!std::ranges::all_of(point, [](float x) { return std::isfinite(x); })) continue;
        for (std::size_t axis = 0; axis < 3; ++axis) axes[axis].push_back(point[axis]);
    }
}

}  // namespace

bool isFlatCloud(const LoadedFile& file) {
    std::vector<std::span<const float>> parts;
    std::size_t points = 0;
    for (const proto::scene::Mesh& mesh : file.content.mesh()) {
        if (mesh.primitive() != proto::scene::Mesh::POINTS) return false;
        const Expected<Blob> positions = file.blob(mesh.positions_blob());
        if (!positions || positions->sizeBytes() % (3 * sizeof(float)) != 0)
            return false;  // who makes the mesh says what is wrong
        parts.push_back(positions->as<float>());
        points += parts.back().size() / 3;
    }
    std::array<std::vector<float>, 3> axes;
    for (const std::span<const float> part : parts) addSample(part, points / kLookedAt + 1, axes);
    return areFlat(axes);
}

}  // namespace tessera
