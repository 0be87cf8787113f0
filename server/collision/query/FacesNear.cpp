#include "server/collision/query/FacesNear.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/collision/tree/TreeStorage.h"

namespace tessera {

namespace {

using Lanes = std::array<float, kernel::kWidth>;

/// A box in a tree's own coordinates, a little larger than it is: rounding must not lose a triangle.
struct OwnBox {
    float centre[3], half[3], lower[3], upper[3];
};

OwnBox ownBox(const TreeStorage& tree, const Box& box) {
    // Everything in the tree is within 1 of the origin; far beyond that it does not matter where a box ends.
    constexpr double kFar = 4, kSlack = 4e-6;
    OwnBox out;
    for (int i = 0; i < 3; ++i) {
        const double lower = std::clamp((box.lower[i] - tree.centre[i]) * tree.unit, -kFar, kFar) - kSlack;
        const double upper = std::clamp((box.upper[i] - tree.centre[i]) * tree.unit, -kFar, kFar) + kSlack;
        out.lower[i] = static_cast<float>(lower);
        out.upper[i] = static_cast<float>(upper);
        out.centre[i] = static_cast<float>(0.5 * (lower + upper));
        out.half[i] = static_cast<float>(0.5 * (upper - lower)) + 1e-6f;
    }
    return out;
}

/// Above 0 where a child's volume may overlap the box: sixteen at once, in plain loops that compilers make vectors of.
void overlapSpheres(const float* row, const OwnBox& box, Lanes& out) {
    constexpr unsigned w = kernel::kWidth;
    for (unsigned l = 0; l < w; ++l) {
        float square = 0;
        for (unsigned i = 0; i < 3; ++i) {
            const float d = std::max(std::abs(row[i * w + l] - box.centre[i]) - box.half[i], 0.0f);
            square += d * d;
        }
        const float r = row[3 * w + l] + 1e-6f;
        out[l] = r * r - square + 1e-12f;
    }
}

void overlapBoxes(const float* row, const OwnBox& box, Lanes& out) {
    constexpr unsigned w = kernel::kWidth;
    for (unsigned l = 0; l < w; ++l) {
        const float c[3] = {row[l] - box.centre[0], row[w + l] - box.centre[1], row[2 * w + l] - box.centre[2]};
        float least = 1, reach[3] = {box.half[0], box.half[1], box.half[2]};
        for (unsigned i = 0; i < 3; ++i) {
            const float half = row[(12 + i) * w + l];
            const float x = row[(3 + 3 * i) * w + l], y = row[(4 + 3 * i) * w + l], z = row[(5 + 3 * i) * w + l];
            const float own = half + std::abs(x) * box.half[0] + std::abs(y) * box.half[1] + std::abs(z) * box.half[2];
            least = std::min(least, own - std::abs(c[0] * x + c[1] * y + c[2] * z));
            reach[0] += half * std::abs(x);
            reach[1] += half * std::abs(y);
            reach[2] += half * std::abs(z);
        }
        for (unsigned k = 0; k < 3; ++k) least = std::min(least, reach[k] - std::abs(c[k]));
        out[l] = least + 2e-6f;
    }
}

/// Of a k-DOP the planes along the axes are enough.
void overlapSlabs(const float* row, unsigned half, const OwnBox& box, Lanes& out) {
    constexpr unsigned w = kernel::kWidth;
    for (unsigned l = 0; l < w; ++l) {
        float least = 1;
        for (unsigned i = 0; i < 3; ++i)
            least = std::min(least, std::min(row[i * w + l] - box.lower[i], row[(half + i) * w + l] + box.upper[i]));
        out[l] = least + 1e-6f;
    }
}

bool mayBeNear(const float* corners, unsigned lane, const OwnBox& box) {
    constexpr unsigned w = kernel::kLeafFaces;
    for (unsigned k = 0; k < 3; ++k) {
        const float a = corners[k * w + lane], b = corners[(3 + k) * w + lane], c = corners[(6 + k) * w + lane];
        if (std::min({a, b, c}) > box.upper[k] || std::max({a, b, c}) < box.lower[k]) return false;
    }
    return true;
}

bool isNear(const Triangle& t, const Box& box) {
    const Vec3d lower = t[0].cwiseMin(t[1]).cwiseMin(t[2]), upper = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
    return (lower.array() <= box.upper.array()).all() && (upper.array() >= box.lower.array()).all();
}

}  // namespace

bool facesNear(const TriangleTree& tree, const Box& box, QueryWork& work, std::vector<std::uint32_t>& faces) {
    const TreeStorage& storage = tree.storage();
    if (storage.empty() || box.empty()) return true;
    const OwnBox own = ownBox(storage, box);
    const kernel::TreeView view = storage.view();
    const kernel::Shape shape = shapeOf(storage.options.volume);
    const unsigned rows = rowsOf(storage.options.volume);
    const std::size_t first = faces.size();
    // A node leaves at most fifteen siblings behind per level; trees are far less deep than this has room for.
    std::array<std::uint32_t, 2048> open;
    std::size_t count = 0;
    open[count++] = 0;
    Lanes overlap;
    while (count > 0) {
        const std::uint32_t node = open[--count];
        const float* const row = view.volumes + std::size_t{node} * rows * kernel::kWidth;
        ++work.boxTests;
        switch (shape) {
            case kernel::Shape::kSphere:
                overlapSpheres(row, own, overlap);
                break;
            case kernel::Shape::kObb:
                overlapBoxes(row, own, overlap);
                break;
            default:
                overlapSlabs(row, rows / 2, own, overlap);
                break;
        }
        for (unsigned lane = 0; lane < kernel::kWidth; ++lane) {
            const kernel::ChildRef child = view.children[std::size_t{node} * kernel::kWidth + lane];
            if (child == kernel::kNoChild || !(overlap[lane] >= 0)) continue;
            if ((child & kernel::kLeafBit) == 0) {
                if (count == open.size()) {
                    faces.resize(first);
                    return false;
                }
                open[count++] = child;
                continue;
            }
            const std::uint32_t leaf = (child & ~kernel::kLeafBit) >> 2, triangles = (child & 3) + 1;
            const float* const corners = view.corners + std::size_t{leaf} * kernel::kLeafRows * kernel::kLeafFaces;
            work.triangleTests += triangles;
            for (std::uint32_t i = 0; i < triangles; ++i) {
                if (!mayBeNear(corners, i, own)) continue;
                const std::uint32_t face = view.faces[leaf * kernel::kLeafFaces + i];
                if (isNear(storage.mesh->triangle(face), box)) faces.push_back(face);
            }
        }
        if (work.exhausted()) {
            faces.resize(first);
            return false;
        }
    }
    std::sort(faces.begin() + static_cast<std::ptrdiff_t>(first), faces.end());
    return true;
}

}  // namespace tessera
