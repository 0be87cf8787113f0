#include "server/collision/spherical_bezier/DeformingSurface.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <string>

#include "server/collision/mesh/TriangleMesh.h"
#include "server/collision/spherical_bezier/DeformingStorage.h"

namespace tessera {

namespace {

using lanes::Box4;

/// Own coordinates are chosen so that the shape reaches 1; it may grow and shrink so much before they are chosen anew.
constexpr double kMostReach = 64;
constexpr double kLeastReach = 1.0 / 64;

/// Cuts at the median along the longest side of the centres' box, between whole groups.
class Division {
public:
    Division(const TriangleMesh& mesh, DeformingStorage& to) : to_(to), centres_(mesh.faceCount()) {
        to_.faces.resize(mesh.faceCount());
        std::iota(to_.faces.begin(), to_.faces.end(), 0U);
        for (std::uint32_t f = 0; f < mesh.faceCount(); ++f)
            centres_[f] = mesh.corner(f, 0) / 3 + mesh.corner(f, 1) / 3 + mesh.corner(f, 2) / 3;
        if (!to_.faces.empty()) divide(0, to_.faces.size());
        to_.groupStart.push_back(static_cast<std::uint32_t>(to_.faces.size()));
    }

private:
    void divide(std::size_t first, std::size_t end) {
        constexpr std::size_t kMost = DeformingStorage::kGroupFaces;
        if (end - first <= kMost) {
            to_.groupStart.push_back(static_cast<std::uint32_t>(first));
            return;
        }
        Box box;
        for (std::size_t i = first; i < end; ++i) box.extend(centres_[to_.faces[i]]);
        Eigen::Index axis = 0;
        box.size().maxCoeff(&axis);
        const std::size_t groups = (end - first + kMost - 1) / kMost, middle = first + groups / 2 * kMost;
        const auto at = [&](std::size_t i) { return to_.faces.begin() + static_cast<std::ptrdiff_t>(i); };
        // By number where places are equal: the division depends on the mesh alone.
        std::nth_element(at(first), at(middle), at(end), [&](std::uint32_t x, std::uint32_t y) {
            return centres_[x][axis] != centres_[y][axis] ? centres_[x][axis] < centres_[y][axis] : x < y;
        });
        divide(first, middle);
        divide(middle, end);
    }

    DeformingStorage& to_;
    std::vector<Vec3d> centres_;
};

void nameVertices(DeformingStorage& s) {
    std::vector<std::uint32_t> here;
    for (std::size_t g = 0; g < s.groupCount(); ++g) {
        s.vertexStart.push_back(static_cast<std::uint32_t>(s.vertices.size()));
        here.clear();
        for (std::size_t i = s.groupStart[g]; i < s.groupStart[g + 1]; ++i)
            for (unsigned k = 0; k < 3; ++k) here.push_back(s.indices[std::size_t{3} * s.faces[i] + k]);
        std::sort(here.begin(), here.end());
        here.erase(std::unique(here.begin(), here.end()), here.end());
        for (std::size_t i = s.groupStart[g]; i < s.groupStart[g + 1]; ++i)
            for (unsigned k = 0; k < 3; ++k) {
                const auto place =
                    std::lower_bound(here.begin(), here.end(), s.indices[std::size_t{3} * s.faces[i] + k]);
                s.corners.push_back(static_cast<std::uint8_t>(place - here.begin()));
            }
        s.vertices.insert(s.vertices.end(), here.begin(), here.end());
    }
    s.vertexStart.push_back(static_cast<std::uint32_t>(s.vertices.size()));

    s.groupsStart.assign(s.positions.size() / 3 + 1, 0);
    for (const std::uint32_t v : s.vertices) ++s.groupsStart[v + 1];
    std::partial_sum(s.groupsStart.begin(), s.groupsStart.end(), s.groupsStart.begin());
    s.groups.resize(s.vertices.size());
    std::vector<std::uint32_t> next(s.groupsStart.begin(), s.groupsStart.end() - 1);
    for (std::uint32_t g = 0; g < s.groupCount(); ++g)
        for (std::uint32_t i = s.vertexStart[g]; i < s.vertexStart[g + 1]; ++i) s.groups[next[s.vertices[i]]++] = g;
}

/// Vertices that no triangle uses do not count.
Box boxOfCorners(const DeformingStorage& s) {
    Box box;
    for (const std::uint32_t v : s.vertices)
        box.extend(Eigen::Map<const Vec3d>(s.positions.data() + std::size_t{3} * v));
    return box;
}

void chooseCoordinates(DeformingStorage& s) {
    const Box box = boxOfCorners(s);
    if (box.empty()) return;
    s.centre = box.center();
    const double reach = 0.5 * box.size().norm();
    s.unit = reach > 0 ? std::ldexp(1.0, std::clamp(-std::ilogb(reach) - 1, -200, 200)) : 1;
}

void findOwn(DeformingStorage& s, std::size_t first, std::size_t count) {
    const double x = s.centre.x(), y = s.centre.y(), z = s.centre.z(), unit = s.unit;
    const double* from = s.positions.data() + 3 * first;
    for (std::size_t i = first; i < first + count; ++i, from += 3) {
        float* const to = s.own[i].xyz0;
        to[0] = static_cast<float>((from[0] - x) * unit);
        to[1] = static_cast<float>((from[1] - y) * unit);
        to[2] = static_cast<float>((from[2] - z) * unit);
        to[3] = 0;
    }
}

Box4 boxOfGroup(const DeformingStorage& s, std::size_t group) {
    const std::uint32_t* v = s.vertices.data() + s.vertexStart[group];
    const std::uint32_t* const end = s.vertices.data() + s.vertexStart[group + 1];
    // Two at once: one waits for the other otherwise.
    Box4 even, odd;
    for (; v + 2 <= end; v += 2) {
        even.extend(s.own[v[0]].load());
        odd.extend(s.own[v[1]].load());
    }
    if (v != end) even.extend(s.own[*v].load());
    even.extend(odd);
    return even;
}

void fitBlock(DeformingStorage& s, std::size_t block) {
    Box4 all;
    const std::size_t end = std::min(16 * block + 16, s.groupCount());
    for (std::size_t g = 16 * block; g < end; ++g) all.extend(s.boxes.rows().box(g));
    s.blocks.set(block, all);
}

/// False where the shape has outgrown its coordinates.
bool fitWhole(DeformingStorage& s) {
    s.whole = {};
    for (std::size_t b = 0; b < s.blockCount(); ++b) s.whole.extend(s.blocks.rows().box(b));
    if (s.groupCount() == 0) return true;
    alignas(16) float lower[4], upper[4];
    _mm_store_ps(lower, s.whole.lower);
    _mm_store_ps(upper, s.whole.upper);
    double squares = 0, sizes = 0, middle = 0;
    for (int k = 0; k < 3; ++k) {
        const double low = lower[k], high = upper[k];
        squares += std::max(low * low, high * high);
        sizes += 0.25 * (high - low) * (high - low);
        middle += 0.25 * (high + low) * (high + low);
    }
    // Each coordinate was rounded.
    s.radius = std::sqrt(squares) * (1 + 1e-6);
    // A shape that has moved away from the centre, or that is far larger or smaller than it was, is bounded less well.
    return s.radius <= kMostReach && (s.radius >= kLeastReach || s.radius == 0) && middle <= 4 * sizes;
}

void fitAll(DeformingStorage& s) {
    for (int tries = 0; tries < 2; ++tries) {
        findOwn(s, 0, s.own.size());
        Box4 block;
        for (std::size_t g = 0; g < s.groupCount(); ++g) {
            const Box4 box = boxOfGroup(s, g);
            s.boxes.set(g, box);
            block.extend(box);
            if (g % 16 == 15 || g + 1 == s.groupCount()) {
                s.blocks.set(g / 16, block);
                block = {};
            }
        }
        if (fitWhole(s)) return;
        // What has been chosen for this very shape stays: a single point has no size that could be reached.
        if (tries == 0) chooseCoordinates(s);
    }
}

Expected<void> check(std::size_t first, std::span<const Vec3d> positions) {
    const double most = TriangleMeshLimits{}.maxCoordinate;
    const double* const numbers = positions.empty() ? nullptr : positions.data()->data();
    const std::size_t count = 3 * positions.size();
    // NaN fails every comparison, so what is counted is what passes.
    std::size_t good = 0;
    for (std::size_t i = 0; i < count; ++i) good += std::abs(numbers[i]) <= most ? 1 : 0;
    if (good == count) return {};
    for (std::size_t i = 0; i < count; ++i)
        if (!(std::abs(numbers[i]) <= most))
            return fail(ErrorCode::kBadInput, "vertex " + std::to_string(first + i / 3) +
                                                  " has a coordinate that is not finite or too large");
    return {};
}

}  // namespace

DeformingSurface::DeformingSurface(const TriangleMesh& mesh) : storage_(std::make_unique<DeformingStorage>()) {
    DeformingStorage& s = *storage_;
    s.positions.reserve(3 * mesh.vertexCount());
    for (const Vec3d& p : mesh.positions()) s.positions.insert(s.positions.end(), {p.x(), p.y(), p.z()});
    s.indices.assign(mesh.indices().begin(), mesh.indices().end());
    const Division division(mesh, s);
    nameVertices(s);
    s.own.resize(mesh.vertexCount());
    s.boxes = lanes::BoxArray(s.groupCount());
    s.blocks = lanes::BoxArray(s.blockCount());
    chooseCoordinates(s);
    fitAll(s);
}

DeformingSurface::~DeformingSurface() = default;
DeformingSurface::DeformingSurface(DeformingSurface&&) noexcept = default;
DeformingSurface& DeformingSurface::operator=(DeformingSurface&&) noexcept = default;

Expected<void> DeformingSurface::move(std::span<const Vec3d> positions) {
    DeformingStorage& s = *storage_;
    if (positions.size() != vertexCount())
        return fail(ErrorCode::kBadInput,
                    std::to_string(positions.size()) + " positions for " + std::to_string(vertexCount()) + " vertices");
    if (Expected<void> good = check(0, positions); !good) return good;
    if (positions.empty()) return {};
    std::memcpy(s.positions.data(), positions.data()->data(), s.positions.size() * sizeof(double));
    fitAll(s);
    return {};
}

Expected<void> DeformingSurface::move(std::size_t first, std::span<const Vec3d> positions) {
    DeformingStorage& s = *storage_;
    if (first > vertexCount() || positions.size() > vertexCount() - first)
        return fail(ErrorCode::kBadInput, std::to_string(positions.size()) + " positions from vertex " +
                                              std::to_string(first) + " on for " + std::to_string(vertexCount()) +
                                              " vertices");
    if (Expected<void> good = check(first, positions); !good) return good;
    if (positions.empty()) return {};
    std::memcpy(s.positions.data() + 3 * first, positions.data()->data(), 3 * positions.size() * sizeof(double));
    // One pass over all is cheaper than as many groups named one at a time.
    if (positions.size() >= vertexCount() / 2) {
        fitAll(s);
        return {};
    }
    findOwn(s, first, positions.size());
    std::vector<std::uint32_t> touched(s.groups.begin() + s.groupsStart[first],
                                       s.groups.begin() + s.groupsStart[first + positions.size()]);
    std::sort(touched.begin(), touched.end());
    touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    for (const std::uint32_t g : touched) s.boxes.set(g, boxOfGroup(s, g));
    for (std::size_t i = 0; i < touched.size(); ++i)
        if (i + 1 == touched.size() || touched[i + 1] / 16 != touched[i] / 16) fitBlock(s, touched[i] / 16);
    if (!fitWhole(s)) {
        chooseCoordinates(s);
        fitAll(s);
    }
    return {};
}

std::size_t DeformingSurface::faceCount() const {
    return storage_->faces.size();
}
std::size_t DeformingSurface::vertexCount() const {
    return storage_->positions.size() / 3;
}

Box DeformingSurface::bounds() const {
    const DeformingStorage& s = *storage_;
    Box box;
    if (s.groupCount() == 0) return box;
    alignas(16) float lower[4], upper[4];
    _mm_store_ps(lower, s.whole.lower);
    _mm_store_ps(upper, s.whole.upper);
    // Twice what the rounding of own coordinates can do, and that of the centre's double.
    const double grown = 0x1p-23 * s.radius;
    for (int k = 0; k < 3; ++k) {
        const double rounding = 0x1p-50 * std::abs(s.centre[k]);
        box.lower[k] = s.centre[k] + (lower[k] - grown) / s.unit - rounding;
        box.upper[k] = s.centre[k] + (upper[k] + grown) / s.unit + rounding;
    }
    return box;
}

std::size_t DeformingSurface::memoryBytes() const {
    const DeformingStorage& s = *storage_;
    const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return sizeof(s) + bytes(s.positions) + bytes(s.indices) + bytes(s.groupStart) + bytes(s.faces) + bytes(s.corners) +
           bytes(s.vertexStart) + bytes(s.vertices) + bytes(s.groupsStart) + bytes(s.groups) + bytes(s.own) +
           s.boxes.memoryBytes() + s.blocks.memoryBytes();
}

}  // namespace tessera
