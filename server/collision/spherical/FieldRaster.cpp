#include "server/collision/spherical/FieldRaster.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "common/base/Workers.h"

namespace tessera::spherical {
namespace {

/// Places s, t are rounded; texels are taken a little wider.
constexpr float kPlaceSlack = 2e-6F;
constexpr std::size_t kChunk = 4096;  ///< triangles of a task
constexpr std::size_t kMostEntriesPerTriangle = 12, kEntriesBeside = 4096;

/// A polygon in a face's coordinates (s z, t z, z).
struct FacePolygon {
    std::array<Vec3d, 12> corner;
    unsigned count = 0;

    /// What of it is where n · x >= -slack.
    void clip(const Vec3d& n, double slack) {
        std::array<Vec3d, 12> out;
        unsigned kept = 0;
        for (unsigned i = 0; i < count; ++i) {
            const Vec3d &p = corner[i], &q = corner[(i + 1) % count];
            const double a = p.dot(n) + slack, b = q.dot(n) + slack;
            if (a >= 0 && kept < out.size()) out[kept++] = p;
            if ((a >= 0) != (b >= 0) && kept < out.size()) out[kept++] = p + (q - p) * (a / (a - b));
        }
        std::copy_n(out.begin(), kept, corner.begin());
        count = kept;
    }
};

struct Chunk {
    std::vector<RasterEntry> entries;
    std::vector<Vec3f> clipped;
    bool full = false;
};

class ChunkRaster {
public:
    ChunkRaster(std::span<const Corners> triangles, unsigned level, std::size_t most, Chunk& out)
        : triangles_(triangles), level_(level), size_(1 << level), most_(most), out_(out) {}

    void add(std::uint32_t triangle) {
        const Corners& p = triangles_[triangle];
        if (const unsigned only = onlyFace(p); only < 6) {
            addOn(only, triangle, p);
            return;
        }
        for (unsigned face = 0; face < 6 && !out_.full; ++face) addOn(face, triangle, p);
    }

private:
    /// The face that all of the triangle is well inside of; 6: there is none.
    [[nodiscard]] static unsigned onlyFace(const Corners& p) {
        const Vec3f size = p[0].cwiseAbs();
        const unsigned c = size[0] > size[1] ? (size[0] > size[2] ? 0 : 2) : (size[1] > size[2] ? 1 : 2);
        const float sign = p[0][c] < 0 ? -1.0F : 1.0F;
        for (const Vec3f& x : p) {
            const float z = 0.9999F * sign * x[c];
            if (!(std::abs(x[(c + 1) % 3]) < z && std::abs(x[(c + 2) % 3]) < z)) return 6;
        }
        return 2 * c + (sign < 0 ? 1U : 0U);
    }
    [[nodiscard]] int texelOf(float place) const {
        return std::clamp(
            static_cast<int>(std::floor((std::clamp(place, -1.0F, 1.0F) + 1) * 0.5F * static_cast<float>(size_))), 0,
            size_ - 1);
    }
    [[nodiscard]] std::uint32_t texel(unsigned face, int s, int t) const {
        return (face << (2 * level_)) + (static_cast<std::uint32_t>(t) << level_) + static_cast<std::uint32_t>(s);
    }
    void emit(const RasterEntry& entry) {
        if (out_.entries.size() >= most_)
            out_.full = true;
        else
            out_.entries.push_back(entry);
    }

    void addOn(unsigned face, std::uint32_t triangle, const Corners& p) {
        const CubeFace f = cubeFace(face);
        float x[3], y[3], z[3];
        float zLeast = 3e38F, zMost = -3e38F, size = 0;
        for (unsigned k = 0; k < 3; ++k) {
            x[k] = p[k][f.a];
            y[k] = p[k][f.b];
            z[k] = f.sign * p[k][f.c];
            zLeast = std::min(zLeast, z[k]);
            zMost = std::max(zMost, z[k]);
            size = std::max({size, std::abs(x[k]), std::abs(y[k]), std::abs(z[k])});
        }
        const float wide = 1 + 4 * kPlaceSlack;
        if (zMost < 0) return;
        if (x[0] > wide * z[0] && x[1] > wide * z[1] && x[2] > wide * z[2]) return;
        if (-x[0] > wide * z[0] && -x[1] > wide * z[1] && -x[2] > wide * z[2]) return;
        if (y[0] > wide * z[0] && y[1] > wide * z[1] && y[2] > wide * z[2]) return;
        if (-y[0] > wide * z[0] && -y[1] > wide * z[1] && -y[2] > wide * z[2]) return;
        if (zLeast > 1e-3F * size) {
            float s0 = 3e38F, s1 = -3e38F, t0 = 3e38F, t1 = -3e38F;
            for (unsigned k = 0; k < 3; ++k) {
                const float s = x[k] / z[k], t = y[k] / z[k];
                const float slackS = kPlaceSlack * (1 + std::abs(s)), slackT = kPlaceSlack * (1 + std::abs(t));
                s0 = std::min(s0, s - slackS);
                s1 = std::max(s1, s + slackS);
                t0 = std::min(t0, t - slackT);
                t1 = std::max(t1, t + slackT);
            }
            if (s0 > 1 || s1 < -1 || t0 > 1 || t1 < -1) return;
            const int i0 = texelOf(s0), i1 = texelOf(s1), j0 = texelOf(t0), j1 = texelOf(t1);
            if (i1 - i0 <= 1 && j1 - j0 <= 1) {
                for (int j = j0; j <= j1; ++j)
                    for (int i = i0; i <= i1; ++i) emit({texel(face, i, j), triangle});
                return;
            }
        }
        FacePolygon whole;
        whole.count = 3;
        for (unsigned k = 0; k < 3; ++k) whole.corner[k] = Vec3d(x[k], y[k], z[k]);
        addClipped(face, f, triangle, whole, static_cast<double>(size));
    }

    /// Row by row, texel by texel. Planes go through the centre, so a slack in lengths is what rounding did to lengths.
    void addClipped(unsigned face, const CubeFace& f, std::uint32_t triangle, const FacePolygon& whole, double size) {
        const double slack = 2e-6 * size;
        FacePolygon seen = whole;
        for (const Vec3d& n : {Vec3d(-1, 0, 1), Vec3d(1, 0, 1), Vec3d(0, -1, 1), Vec3d(0, 1, 1)}) seen.clip(n, slack);
        if (seen.count == 0) return;
        const double step = 2.0 / size_;
        const auto [j0, j1] = range(seen, 1, size);
        for (int j = j0; j <= j1; ++j) {
            FacePolygon row = seen;
            row.clip(Vec3d(0, 1, 1 - j * step), slack);
            row.clip(Vec3d(0, -1, -1 + (j + 1) * step), slack);
            if (row.count == 0) continue;
            const auto [i0, i1] = range(row, 0, size);
            for (int i = i0; i <= i1 && !out_.full; ++i) {
                FacePolygon bit = row;
                bit.clip(Vec3d(1, 0, 1 - i * step), slack);
                bit.clip(Vec3d(-1, 0, -1 + (i + 1) * step), slack);
                if (bit.count == 0) continue;
                emit({texel(face, i, j), triangle, static_cast<std::uint32_t>(out_.clipped.size()), bit.count});
                for (unsigned k = 0; k < bit.count; ++k) {
                    Vec3f p;
                    p[f.a] = static_cast<float>(bit.corner[k][0]);
                    p[f.b] = static_cast<float>(bit.corner[k][1]);
                    p[f.c] = f.sign * static_cast<float>(bit.corner[k][2]);
                    out_.clipped.push_back(p);
                }
            }
        }
    }

    /// Texels along an axis; all of them where a corner is so near the centre's plane that it is seen anywhere.
    [[nodiscard]] std::pair<int, int> range(const FacePolygon& polygon, int axis, double size) const {
        float low = 3e38F, high = -3e38F;
        for (unsigned k = 0; k < polygon.count; ++k) {
            const Vec3d& p = polygon.corner[k];
            if (p[2] <= 1e-4 * size) return {0, size_ - 1};
            // The polygon is wrong by 2e-6 of the size, and z at least 1e-4 of it.
            const double place = p[axis] / p[2], doubt = 4e-6 * size * (1 + std::abs(place)) / p[2];
            low = std::min(low, static_cast<float>(place - doubt));
            high = std::max(high, static_cast<float>(place + doubt));
        }
        return {texelOf(low), texelOf(high)};
    }

    std::span<const Corners> triangles_;
    unsigned level_;
    int size_;
    std::size_t most_;
    Chunk& out_;
};

}  // namespace

Raster rasterise(std::span<const Corners> triangles, unsigned level, Workers* workers) {
    const std::size_t chunks = (triangles.size() + kChunk - 1) / kChunk;
    std::vector<Chunk> done(chunks);
    for (;; --level) {
        const std::size_t most =
            level == 0 ? ~std::size_t{0} : kMostEntriesPerTriangle * triangles.size() + kEntriesBeside;
        const auto task = [&](std::size_t i) {
            done[i] = {};
            const std::size_t first = i * kChunk, end = std::min(triangles.size(), first + kChunk);
            done[i].entries.reserve(4 * (end - first));
            ChunkRaster raster(triangles, level, most, done[i]);
            for (std::size_t k = first; k < end && !done[i].full; ++k) raster.add(static_cast<std::uint32_t>(k));
        };
        if (workers != nullptr && chunks > 1)
            workers->run(chunks, task);
        else
            for (std::size_t i = 0; i < chunks; ++i) task(i);
        std::size_t sum = 0;
        bool full = false;
        for (const Chunk& chunk : done) {
            sum += chunk.entries.size();
            full = full || chunk.full;
        }
        if (level == 0 || (!full && sum <= most)) break;
    }

    Raster out;
    out.level = level;
    const std::size_t texels = std::size_t{6} << (2 * level);
    out.start.assign(texels + 1, 0);
    std::size_t corners = 0;
    for (const Chunk& chunk : done) {
        for (const RasterEntry& e : chunk.entries) ++out.start[e.texel + 1];
        corners += chunk.clipped.size();
    }
    for (std::size_t i = 0; i < texels; ++i) out.start[i + 1] += out.start[i];
    out.entries.resize(out.start[texels]);
    out.clipped.reserve(corners);
    std::vector<std::uint32_t> next(out.start.begin(), out.start.end() - 1);
    for (const Chunk& chunk : done) {
        const auto shift = static_cast<std::uint32_t>(out.clipped.size());
        for (RasterEntry e : chunk.entries) {
            if (e.first != RasterEntry::kWhole) e.first += shift;
            out.entries[next[e.texel]++] = e;
        }
        out.clipped.insert(out.clipped.end(), chunk.clipped.begin(), chunk.clipped.end());
    }
    return out;
}

}  // namespace tessera::spherical
