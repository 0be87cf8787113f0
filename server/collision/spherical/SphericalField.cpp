#include "server/collision/spherical/SphericalField.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "server/collision/spherical/FieldStorage.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {
namespace {

using spherical::Corners;

constexpr double kLengthPerCentre = 5;     ///< in widths (README.md)
constexpr double kTrianglesPerTexel = 11;  ///< of their own; with those that reach in it is about twice that
constexpr std::size_t kSample = 2048;

unsigned defaultLevel(std::size_t triangles) {
    const double texelsPerFace = static_cast<double>(triangles) / (6 * kTrianglesPerTexel);
    if (texelsPerFace <= 1) return 0;
    return static_cast<unsigned>(std::clamp(std::lround(0.5 * std::log2(texelsPerFace)), 0L, 8L));
}

/// How much of the surface faces a point: 1 where all of it does, 0 where it is all seen edge-on. Of a sample.
double facing(std::span<const Corners> triangles, const Vec3f& from) {
    double facingArea = 0, area = 0;
    const std::size_t stride = std::max<std::size_t>(1, triangles.size() / kSample);
    for (std::size_t i = 0; i < triangles.size(); i += stride) {
        const Corners& p = triangles[i];
        const Vec3f n = (p[1] - p[0]).cross(p[2] - p[0]), x = (p[0] + p[1] + p[2]) / 3 - from;
        const float length = x.norm();
        area += static_cast<double>(n.norm());
        if (length > 0) facingArea += static_cast<double>(std::abs(n.dot(x))) / static_cast<double>(length);
    }
    return area > 0 ? facingArea / area : 0;
}

/// The middle of the box, the middle of the surface, or between: what most of the surface faces.
Vec3f chooseCentre(std::span<const Corners> triangles) {
    Vec3f low = Vec3f::Constant(3e38F), high = Vec3f::Constant(-3e38F);
    Vec3d mean = Vec3d::Zero();
    double area = 0;
    for (const Corners& p : triangles) {
        for (const Vec3f& x : p) {
            low = low.cwiseMin(x);
            high = high.cwiseMax(x);
        }
        const double a = static_cast<double>((p[1] - p[0]).cross(p[2] - p[0]).norm());
        area += a;
        mean += a * ((p[0] + p[1] + p[2]) / 3).cast<double>();
    }
    const Vec3f box = 0.5F * (low + high);
    if (!(area > 0)) return box;
    const Vec3f surface = (mean / area).cast<float>();
    Vec3f best = box;
    double most = facing(triangles, box);
    for (const Vec3f& tried : {surface, Vec3f(0.5F * (box + surface))})
        if (const double f = facing(triangles, tried); f > 1.02 * most) {
            most = f;
            best = tried;
        }
    return best;
}

}  // namespace

SphericalField::SphericalField(const TriangleTree& tree, const SphericalFieldOptions& options)
    : tree_(&tree), options_(options) {
    rebuild();
}
SphericalField::~SphericalField() = default;
SphericalField::SphericalField(SphericalField&&) noexcept = default;
SphericalField& SphericalField::operator=(SphericalField&&) noexcept = default;

void SphericalField::rebuild() {
    parts_.clear();
    views_.clear();
    looseness_ = 0;
    const TreeStorage& storage = tree_->storage();
    if (storage.empty()) return;
    const TriangleMesh& mesh = *storage.mesh;
    const std::vector<OwnPosition> own = ownPositions(storage);
    std::vector<Corners> triangles(mesh.faceCount());
    const auto indices = mesh.indices();
    Vec3f low = Vec3f::Constant(3e38F), high = Vec3f::Constant(-3e38F);
    for (std::size_t i = 0; i < triangles.size(); ++i)
        for (unsigned k = 0; k < 3; ++k) {
            const float* const p = own[indices[3 * i + k]].xyz0;
            triangles[i][k] = Vec3f(p[0], p[1], p[2]);
            low = low.cwiseMin(triangles[i][k]);
            high = high.cwiseMax(triangles[i][k]);
        }

    Vec3f size = high - low;
    int longest = 0;
    const float length = size.maxCoeff(&longest);
    const float width = std::max({size[(longest + 1) % 3], size[(longest + 2) % 3], 0.05F * length});
    unsigned centres = options_.centres != 0
                           ? options_.centres
                           : static_cast<unsigned>(
                                 std::lround(length > 0 ? static_cast<double>(length / width) / kLengthPerCentre : 0));
    centres = std::clamp(centres, 1U, kernel::kMostFieldParts);

    std::vector<std::vector<std::uint32_t>> facesOf(centres);
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
        const float middle = (triangles[i][0][longest] + triangles[i][1][longest] + triangles[i][2][longest]) / 3;
        const float place = length > 0 ? (middle - low[longest]) / length * static_cast<float>(centres) : 0;
        facesOf[std::min(centres - 1, static_cast<unsigned>(std::max(place, 0.0F)))].push_back(i);
    }
    double loose = 0;
    std::size_t occupied = 0;
    for (const std::vector<std::uint32_t>& faces : facesOf) {
        if (faces.empty()) continue;
        std::vector<Corners> seen;
        seen.reserve(faces.size());
        for (const std::uint32_t f : faces) seen.push_back(triangles[f]);
        const Vec3f centre = chooseCentre(seen);
        for (Corners& p : seen)
            for (Vec3f& x : p) x -= centre;
        auto part = std::make_unique<FieldPartStorage>();
        part->offset = centre.cast<double>();
        const unsigned level =
            options_.level < 0 ? defaultLevel(faces.size()) : static_cast<unsigned>(std::min(options_.level, 8));
        spherical::fillPart(*part, seen, faces, level, options_.workers);
        views_.push_back(part->view);
        loose += part->looseness * static_cast<double>(part->occupied);
        occupied += part->occupied;
        parts_.push_back(std::move(part));
    }
    looseness_ = occupied == 0 ? 0 : loose / static_cast<double>(occupied);
}

Vec3d SphericalField::centre(std::size_t i) const {
    return tree_->storage().centre + parts_[i]->offset / tree_->storage().unit;
}
unsigned SphericalField::finestLevel(std::size_t i) const {
    return views_[i].finest;
}
const Vec3d& SphericalField::offset(std::size_t part) const {
    return parts_[part]->offset;
}

std::size_t SphericalField::memoryBytes() const {
    std::size_t bytes = 0;
    for (const auto& part : parts_) bytes += part->memoryBytes();
    return bytes;
}
std::size_t SphericalField::entryCount() const {
    std::size_t count = 0;
    for (const auto& part : parts_) count += part->faces.size();
    return count;
}

Expected<FieldShell> SphericalField::shell(std::size_t centre, const Vec3d& direction, unsigned level) const {
    if (centre >= parts_.size())
        return fail(ErrorCode::kBadInput,
                    "there is no centre " + std::to_string(centre) + " among " + std::to_string(parts_.size()));
    if (!direction.allFinite() || direction.isZero(0)) return fail(ErrorCode::kBadInput, "a direction that is none");
    const kernel::FieldPart& v = views_[centre];
    level = std::min(level, v.finest);
    const Vec3d d = direction / direction.cwiseAbs().maxCoeff();
    int axis = 0;
    d.cwiseAbs().maxCoeff(&axis);
    const unsigned face = 2 * static_cast<unsigned>(axis) + (d[axis] < 0 ? 1U : 0U);
    const double half = 0.5 * static_cast<double>(1 << level), last = static_cast<double>((1 << level) - 1);
    const auto texel = [&](double place) {
        return static_cast<std::size_t>(std::clamp(std::floor((place + 1) * half), 0.0, last));
    };
    const double z = std::abs(d[axis]);
    const std::size_t s = texel(d[(axis + 1) % 3] / z), t = texel(d[(axis + 2) % 3] / z);
    const kernel::FieldTexel& found = v.texels[level][(std::size_t{face} << (2 * level)) + (t << level) + s];
    FieldShell out;
    if (found.lower > found.upper) return out;
    const double unit = static_cast<double>(v.radiusUnit) / tree_->storage().unit;
    out.empty = false;
    out.inner = found.inner * unit * (1 - 1e-6);
    out.outer = found.outer * unit * (1 + 1e-6);
    out.error = 0.5 * (out.outer - out.inner);
    out.normal = Vec3d(found.normal[0], found.normal[1], found.normal[2]).normalized();
    return out;
}

}  // namespace tessera
