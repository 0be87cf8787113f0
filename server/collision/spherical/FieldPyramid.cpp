// The planes and radii of every texel: at the finest level around what is in its pyramid, above around the four below.
#include <algorithm>
#include <cmath>

#include "common/base/Workers.h"
#include "server/collision/spherical/FieldStorage.h"

namespace tessera {

std::size_t FieldPartStorage::memoryBytes() const {
    std::size_t bytes =
        start.size() * sizeof(std::uint32_t) + faces.size() * (sizeof(std::uint32_t) + 4 * sizeof(std::int16_t));
    for (const auto& level : texels) bytes += level.size() * sizeof(kernel::FieldTexel);
    return bytes;
}

namespace spherical {
namespace {

using kernel::FieldTexel;

constexpr float kSteps = 32700, kRadiusSteps = 65500;
constexpr FieldTexel kEmptyTexel = {{0, 0, 0}, 32767, -32768, 65535, 0, 0};
/// Sums and products of a dozen floats of a part's size: 2^-24 each. Less than what a query allows for
/// (FieldTouch.cpp).
constexpr float kBoundSlack = 1e-6F;

/// The sum of what is seen through a texel of areas times normals, all turned away from the centre.
using NormalSum = Vec3f;

[[nodiscard]] Vec3f texelDirection(unsigned face, float s, float t) {
    const CubeFace f = cubeFace(face);
    Vec3f d;
    d[f.c] = f.sign;
    d[f.a] = s;
    d[f.b] = t;
    return d;
}

/// The largest and the least of w · x over what is seen through a texel between two radii. That is inside the hull of
/// its corners at two depths z, and w · x = z g(s, t) with g linear.
struct Bounds {
    float least, most;
};
Bounds overPiece(const Vec3f& w, unsigned face, float s0, float s1, float t0, float t1, float inner, float outer) {
    const CubeFace f = cubeFace(face);
    const float gs = w[f.a], gt = w[f.b], g = f.sign * w[f.c];
    const float least = g + std::min(gs * s0, gs * s1) + std::min(gt * t0, gt * t1);
    const float most = g + std::max(gs * s0, gs * s1) + std::max(gt * t0, gt * t1);
    const auto nearest = [](float a, float b) { return a <= 0 && b >= 0 ? 0.0F : std::min(std::abs(a), std::abs(b)); };
    const auto farthest = [](float a, float b) { return std::max(std::abs(a), std::abs(b)); };
    const float ns = nearest(s0, s1), nt = nearest(t0, t1), fs = farthest(s0, s1), ft = farthest(t0, t1);
    const float zFar = outer / std::sqrt(1 + ns * ns + nt * nt), zNear = inner / std::sqrt(1 + fs * fs + ft * ft);
    return {std::min(least * zFar, least * zNear), std::max(most * zFar, most * zNear)};
}

/// A triangle or a clipped bit of one.
struct Piece {
    Vec3f area = Vec3f::Zero();  ///< normal times twice the area
    float inner = 0, outer = 0;  ///< radii: no point of it is nearer to the centre than the ball around it
};
Piece pieceOf(std::span<const Vec3f> p) {
    Piece out;
    Vec3f mean = Vec3f::Zero();
    for (std::size_t k = 1; k + 1 < p.size(); ++k) out.area += (p[k] - p[0]).cross(p[k + 1] - p[0]);
    for (const Vec3f& x : p) mean += x;
    mean /= static_cast<float>(p.size());
    float reach = 0;
    for (const Vec3f& x : p) {
        reach = std::max(reach, (x - mean).squaredNorm());
        out.outer = std::max(out.outer, x.squaredNorm());
    }
    out.inner = mean.norm() - std::sqrt(reach);
    out.outer = std::sqrt(out.outer);
    return out;
}

class Pyramid {
public:
    Pyramid(FieldPartStorage& part, std::span<const Corners> triangles, const Raster& raster, Workers* workers)
        : part_(part), triangles_(triangles), raster_(raster), workers_(workers) {}

    void fill() {
        kernel::FieldPart& v = part_.view;
        pieces_.reserve(triangles_.size());
        for (const Corners& p : triangles_) pieces_.push_back(pieceOf(p));
        std::vector<NormalSum> sums(std::size_t{6} << (2 * raster_.level)), above;
        part_.texels[raster_.level].assign(sums.size(), kEmptyTexel);
        overRows(raster_.level, [&](std::size_t first, std::size_t end) {
            for (std::size_t i = first; i < end; ++i) fitFinest(i, sums[i]);
        });
        for (unsigned level = raster_.level; level-- > 0;) {
            const std::size_t count = std::size_t{6} << (2 * level);
            part_.texels[level].assign(count, kEmptyTexel);
            above.assign(count, NormalSum::Zero());
            overRows(level, [&](std::size_t first, std::size_t end) {
                for (std::size_t i = first; i < end; ++i) fitAbove(level, i, sums, above[i]);
            });
            sums.swap(above);
        }
        for (unsigned level = 0; level <= raster_.level; ++level) v.texels[level] = part_.texels[level].data();
        measureLooseness();
    }

private:
    template <typename Range>
    void overRows(unsigned level, const Range& range) {
        const std::size_t count = std::size_t{6} << (2 * level);
        constexpr std::size_t kTask = 1024;
        const std::size_t tasks = (count + kTask - 1) / kTask;
        const auto task = [&](std::size_t i) { range(i * kTask, std::min(count, (i + 1) * kTask)); };
        if (workers_ != nullptr && tasks > 1)
            workers_->run(tasks, task);
        else
            for (std::size_t i = 0; i < tasks; ++i) task(i);
    }

    [[nodiscard]] std::span<const Vec3f> corners(const RasterEntry& e) const {
        if (e.first != RasterEntry::kWhole) return {raster_.clipped.data() + e.first, e.count};
        return triangles_[e.triangle];
    }

    void fitFinest(std::size_t texel, NormalSum& sum) {
        const std::uint32_t first = raster_.start[texel], end = raster_.start[texel + 1];
        sum = NormalSum::Zero();
        if (first == end) return;
        const unsigned level = raster_.level;
        const unsigned face = static_cast<unsigned>(texel >> (2 * level));
        const float step = 2.0F / static_cast<float>(1 << level);
        const auto s = static_cast<float>(texel & ((std::size_t{1} << level) - 1));
        const auto t = static_cast<float>((texel >> level) & ((std::size_t{1} << level) - 1));
        const Vec3f middle = texelDirection(face, (s + 0.5F) * step - 1, (t + 0.5F) * step - 1);
        float inner = 3e38F, outer = 0;
        for (std::uint32_t i = first; i < end; ++i) {
            const RasterEntry& e = raster_.entries[i];
            const Piece piece = e.first == RasterEntry::kWhole ? pieces_[e.triangle] : pieceOf(corners(e));
            sum += piece.area.dot(middle) < 0 ? Vec3f(-piece.area) : piece.area;
            inner = std::min(inner, piece.inner);
            outer = std::max(outer, piece.outer);
        }
        FieldTexel out = withNormal(sum, middle);
        const Vec3f n = normalOf(out);
        float least = 3e38F, most = -3e38F;
        for (std::uint32_t i = first; i < end; ++i)
            for (const Vec3f& x : corners(raster_.entries[i])) {
                const float d = n.dot(x);
                least = std::min(least, d);
                most = std::max(most, d);
            }
        setBounds(out, least, most, inner, outer);
        part_.texels[level][texel] = out;
    }

    /// With n the texel's normal and m a lower one's: n · x = α m · x + (n - α m) · x. The first is between planes, the
    /// second small.
    void fitAbove(unsigned level, std::size_t texel, const std::vector<NormalSum>& below, NormalSum& sum) {
        const std::size_t mask = (std::size_t{1} << level) - 1;
        const std::size_t face = texel >> (2 * level), s = texel & mask, t = (texel >> level) & mask;
        const std::vector<FieldTexel>& lower = part_.texels[level + 1];
        const auto child = [&](unsigned k) {
            return (face << (2 * level + 2)) + ((2 * t + (k >> 1)) << (level + 1)) + 2 * s + (k & 1);
        };
        const float step = 2.0F / static_cast<float>(1 << level), half = 0.5F * step;
        const float left = static_cast<float>(s) * step - 1, bottom = static_cast<float>(t) * step - 1;
        const Vec3f middle = texelDirection(static_cast<unsigned>(face), left + half, bottom + half);
        sum = NormalSum::Zero();
        bool any = false;
        for (unsigned k = 0; k < 4; ++k) {
            const std::size_t at = child(k);
            if (lower[at].lower > lower[at].upper) continue;
            any = true;
            sum += below[at].dot(middle) < 0 ? Vec3f(-below[at]) : below[at];
        }
        if (!any) return;
        FieldTexel out = withNormal(sum, middle);
        const Vec3f n = normalOf(out);
        const kernel::FieldPart& v = part_.view;
        float least = 3e38F, most = -3e38F, inner = 3e38F, outer = 0;
        for (unsigned k = 0; k < 4; ++k) {
            const FieldTexel& c = lower[child(k)];
            if (c.lower > c.upper) continue;
            const Vec3f m = normalOf(c);
            const float alpha = n.dot(m) / std::max(m.squaredNorm(), 1e-20F);
            const float a = alpha * static_cast<float>(c.lower) * v.planeUnit,
                        b = alpha * static_cast<float>(c.upper) * v.planeUnit;
            const float r0 = static_cast<float>(c.inner) * v.radiusUnit,
                        r1 = static_cast<float>(c.outer) * v.radiusUnit;
            const float s0 = left + static_cast<float>(k & 1) * half, t0 = bottom + static_cast<float>(k >> 1) * half;
            // Triangles that are not clipped stick out of their texel, by less than one of the finest.
            const float beyond = 2.0F / static_cast<float>(1 << raster_.level);
            const Bounds rest = overPiece(Vec3f(n - alpha * m), static_cast<unsigned>(face), s0 - beyond,
                                          s0 + half + beyond, t0 - beyond, t0 + half + beyond, r0, r1);
            least = std::min(least, std::min(a, b) + rest.least);
            most = std::max(most, std::max(a, b) + rest.most);
            inner = std::min(inner, r0);
            outer = std::max(outer, r1);
        }
        setBounds(out, least, most, inner, outer);
        part_.texels[level][texel] = out;
    }

    [[nodiscard]] FieldTexel withNormal(const NormalSum& sum, const Vec3f& middle) const {
        const float length = sum.norm();
        // Nothing has an area, or it cancels out.
        const Vec3f n = length > 1e-30F ? Vec3f(sum / length) : Vec3f(middle.normalized());
        FieldTexel out = kEmptyTexel;
        for (int k = 0; k < 3; ++k) out.normal[k] = static_cast<std::int16_t>(std::lround(n[k] * kSteps));
        return out;
    }
    [[nodiscard]] Vec3f normalOf(const FieldTexel& texel) const {
        return Vec3f(texel.normal[0], texel.normal[1], texel.normal[2]) * part_.view.normalUnit;
    }
    void setBounds(FieldTexel& out, float least, float most, float inner, float outer) const {
        const kernel::FieldPart& v = part_.view;
        const float slack = kBoundSlack * v.radius;
        const auto step = [](float x, float low, float high) { return std::clamp(x, low, high); };
        out.lower = static_cast<std::int16_t>(step(std::floor((least - slack) / v.planeUnit), -32768, 32767));
        out.upper = static_cast<std::int16_t>(step(std::ceil((most + slack) / v.planeUnit), -32768, 32767));
        out.inner = static_cast<std::uint16_t>(step(std::floor((inner - slack) / v.radiusUnit), 0, 65535));
        out.outer = static_cast<std::uint16_t>(step(std::ceil((outer + slack) / v.radiusUnit), 0, 65535));
    }

    void measureLooseness() {
        const unsigned level = raster_.level == 0 ? 0 : raster_.level - 1;
        const kernel::FieldPart& v = part_.view;
        double sum = 0;
        std::size_t count = 0;
        for (const FieldTexel& t : part_.texels[level]) {
            if (t.lower > t.upper) continue;
            const double thick = (static_cast<double>(t.upper) - t.lower) * static_cast<double>(v.planeUnit);
            const double width = static_cast<double>(t.outer) * static_cast<double>(v.radiusUnit) * 1.5 /
                                 static_cast<double>(1 << level);
            sum += width > 0 ? thick / width : 0;
            ++count;
        }
        part_.looseness = count == 0 ? 0 : sum / static_cast<double>(count);
        part_.occupied = count;
    }

    FieldPartStorage& part_;
    std::span<const Corners> triangles_;
    const Raster& raster_;
    Workers* workers_;
    std::vector<Piece> pieces_;  ///< of whole triangles
};

}  // namespace

void fillPart(FieldPartStorage& part, std::span<const Corners> triangles, std::span<const std::uint32_t> faces,
              unsigned level, Workers* workers) {
    kernel::FieldPart& v = part.view;
    float radius = 0;
    for (const Corners& t : triangles)
        for (const Vec3f& p : t) radius = std::max(radius, p.squaredNorm());
    v.radius = std::max(std::sqrt(radius) * 1.00001F, 1e-30F);
    v.normalUnit = 1 / kSteps;
    // |n| is at most 1 + 3e-5: every n · x fits.
    v.planeUnit = v.radius * 1.0001F / kSteps;
    v.radiusUnit = v.radius * 1.0001F / kRadiusSteps;
    // Coordinates reach the radius, a ball's radius at most twice that.
    v.ballUnit = v.radius * 1.0001F / 32000;

    const Raster raster = rasterise(triangles, level, workers);
    v.finest = raster.level;
    for (auto& texels : part.texels) texels.clear();
    Pyramid(part, triangles, raster, workers).fill();

    struct Ball {
        std::int16_t x, y, z;
        std::uint16_t r;
    };
    std::vector<Ball> balls(triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) {
        const Corners& p = triangles[i];
        const Vec3f middle = 0.5F * (p[0].cwiseMin(p[1]).cwiseMin(p[2]) + p[0].cwiseMax(p[1]).cwiseMax(p[2]));
        const Vec3f place = (middle / v.ballUnit).array().round();
        const Vec3f kept = place * v.ballUnit;
        float square = 0;
        for (const Vec3f& x : p) square = std::max(square, (x - kept).squaredNorm());
        const float r = std::ceil(std::sqrt(square) / v.ballUnit + 0.1F);
        balls[i] = {static_cast<std::int16_t>(place[0]), static_cast<std::int16_t>(place[1]),
                    static_cast<std::int16_t>(place[2]), static_cast<std::uint16_t>(std::min(r, 65535.0F))};
    }
    const std::size_t count = raster.entries.size(), padded = count + kernel::kWidth;
    part.faces.resize(count);
    part.ballX.assign(padded, 0);
    part.ballY.assign(padded, 0);
    part.ballZ.assign(padded, 0);
    part.ballR.assign(padded, 0);
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t t = raster.entries[i].triangle;
        part.faces[i] = faces[t];
        part.ballX[i] = balls[t].x;
        part.ballY[i] = balls[t].y;
        part.ballZ[i] = balls[t].z;
        part.ballR[i] = balls[t].r;
    }
    part.start = raster.start;
    v.start = part.start.data();
    v.faces = part.faces.data();
    v.ballX = part.ballX.data();
    v.ballY = part.ballY.data();
    v.ballZ = part.ballZ.data();
    v.ballR = part.ballR.data();
}

}  // namespace spherical
}  // namespace tessera
