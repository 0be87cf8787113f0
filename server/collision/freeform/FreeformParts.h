/// What queries go down: groups of faces, faces, and parts of faces, each with a hull of points that holds it. Made
/// when first asked for.
///
/// A part is halved at most once, whatever it is compared with. All is in the shape's own frame: whoever compares two
/// parts maps directions, not points. For the queries of this library; not thread-safe.
#pragma once

#include <immintrin.h>

#include <array>
#include <cstdint>
#include <vector>

#include "server/collision/freeform/FreeformShape.h"
#include "server/collision/freeform/PartBlock.h"

namespace tessera {

struct FreeformPart {
    enum class Kind : std::uint8_t { kGroup, kPatch, kTriangle, kNeighbourhood };

    Kind kind = Kind::kGroup;
    std::uint8_t degreeU = 0, degreeV = 0;  ///< of a triangle the first
    std::uint8_t corner = 0;                ///< of a neighbourhood: the one that its sample is the limit at
    bool rational = false;
    bool crossed = false;    ///< by a trimming curve: some of it may not be there
    bool hasSample = false;  ///< `center` is a point of the surface, at `middle`; else only the middle of the hull
    std::uint8_t children = 0;
    bool divided = false;
    std::uint32_t firstChild = 0;
    std::uint32_t block = kNoIndex;  ///< its own parts, many at once
    std::uint32_t lane = 0;          ///< where its box is: 8 · block + lane
    std::uint32_t face = 0;          ///< as answers name it; of a group the node
    std::uint32_t points = 0;        ///< of the hull; of groups and neighbourhoods the corners of a box
    std::uint32_t controls = 0;      ///< of a neighbourhood: its own points
    std::size_t at = 0;  ///< where the hull's x, y and z begin; then, of rational patches, w·x, w·y, w·z, w; of
                         ///< neighbourhoods the points' x, y, z
    const NeighbourhoodGraph::Node* node = nullptr;
    Vec2d origin = Vec2d::Zero(), alongU = Vec2d::UnitX(),
          alongV = Vec2d::UnitY();  ///< (s, t) is origin + s · alongU + t · alongV
    Vec2d middle = Vec2d::Zero();   ///< (s, t) of the sample
    Vec3d center = Vec3d::Zero();
    double radius = 0;              ///< the hull is within it of `center`
    Vec3d normal = Vec3d::UnitZ();  ///< of length 1; where the part is thin, or any
    double low = 0, high = 0;       ///< the hull along it, from `center`
};

/// A point of a part with derivatives by the part's own s and t.
struct PartPoint {
    Vec3d point = Vec3d::Zero(), ds = Vec3d::Zero(), dt = Vec3d::Zero();
};

class FreeformParts {
public:
    explicit FreeformParts(const FreeformShape& shape) : shape_(shape) {}

    /// The whole shape. Forgets all parts where the shape has moved, or where there are very many.
    std::uint32_t root();
    [[nodiscard]] const FreeformPart& operator[](std::uint32_t part) const { return parts_[part]; }
    /// Its parts, from firstChild on; there are none of what trimming takes away. References to parts do not outlive
    /// this.
    void divide(std::uint32_t part);
    /// Its parts, some halvings down, with their boxes: the larger are halved first, while there is room. The block's
    /// number.
    std::uint32_t blockOf(std::uint32_t part);
    /// References to blocks do not outlive `blockOf`.
    [[nodiscard]] const PartBlock& block(std::uint32_t block) const { return blocks_[block]; }
    /// A part of a block.
    std::uint32_t partOf(std::uint32_t block, std::uint32_t lane) {
        const std::uint32_t known = blocks_[block].parts[lane];
        return known != PartBlock::kNone ? known : makePart(block, lane);
    }
    /// Of parts of blocks, and the root.
    [[nodiscard]] PartBox boxOf(std::uint32_t part) const {
        return blocks_[parts_[part].lane / kernel::kBoxLanes].box(parts_[part].lane % kernel::kBoxLanes);
    }
    /// Patches and triangles alone; s and t in [0, 1], s + t of a triangle at most 1.
    [[nodiscard]] PartPoint evaluate(const FreeformPart& part, double s, double t) const;
    /// Of a neighbourhood: the surface's normal at its sample, of length 1; zero where it has none. In the shape's
    /// frame.
    [[nodiscard]] Vec3d normalAtSample(const FreeformPart& part) const;
    /// The least and the largest of the hull along a direction.
    struct Extent {
        double least, most;
    };
    [[nodiscard]] Extent extentAlong(const FreeformPart& part, const Vec3d& direction) const {
        const double *x = coordinates_.data() + part.at, *y = x + part.points, *z = y + part.points;
        const __m128d dx = _mm_set1_pd(direction.x()), dy = _mm_set1_pd(direction.y()), dz = _mm_set1_pd(direction.z());
        const auto along = [&](__m128d px, __m128d py, __m128d pz) {
            return _mm_add_pd(_mm_add_pd(_mm_mul_pd(dx, px), _mm_mul_pd(dy, py)), _mm_mul_pd(dz, pz));
        };
        // Two at a time, which SSE2 has and so every x86-64; what is left over last.
        __m128d least = along(_mm_set1_pd(x[0]), _mm_set1_pd(y[0]), _mm_set1_pd(z[0])), most = least;
        std::uint32_t i = 0;
        for (; i + 2 <= part.points; i += 2) {
            const __m128d d = along(_mm_loadu_pd(x + i), _mm_loadu_pd(y + i), _mm_loadu_pd(z + i));
            least = _mm_min_pd(least, d);
            most = _mm_max_pd(most, d);
        }
        if (i < part.points) {
            const __m128d d = along(_mm_set1_pd(x[i]), _mm_set1_pd(y[i]), _mm_set1_pd(z[i]));
            least = _mm_min_pd(least, d);
            most = _mm_max_pd(most, d);
        }
        return {_mm_cvtsd_f64(_mm_min_sd(least, _mm_unpackhi_pd(least, least))),
                _mm_cvtsd_f64(_mm_max_sd(most, _mm_unpackhi_pd(most, most)))};
    }
    /// Of a group: half the sides of its box, which is around its center.
    [[nodiscard]] Vec3d boxHalf(const FreeformPart& part) const {
        const double* x = coordinates_.data() + part.at;
        return 0.5 * Vec3d(x[7] - x[0], x[15] - x[8], x[23] - x[16]);
    }
    /// The hull's points.
    [[nodiscard]] std::vector<Vec3d> hullOf(const FreeformPart& part) const { return pointsAt(part.at, part.points); }
    /// Whether trimming leaves the place; of whatever is not trimmed: yes.
    [[nodiscard]] bool isThere(const FreeformPart& part, double s, double t) const;
    /// Too small to be halved: parameters come to an end.
    [[nodiscard]] bool isSmallest(const FreeformPart& part) const;
    [[nodiscard]] std::size_t count() const { return parts_.size(); }
    [[nodiscard]] std::size_t memoryBytes() const {
        return parts_.capacity() * sizeof(FreeformPart) + coordinates_.capacity() * sizeof(double) +
               blocks_.capacity() * sizeof(PartBlock);
    }

private:
    std::uint32_t makePart(std::uint32_t block, std::uint32_t lane);
    [[nodiscard]] std::size_t coordinatesOf(const FreeformPart& part) const;
    [[nodiscard]] PartBox boxAround(const FreeformPart& part) const;
    // Not `whole`: without hull, sample and normal, for what is halved at once.
    FreeformPart makeGroup(std::uint32_t node, bool whole);
    void makeFace(FreeformPart& part, std::uint32_t face, bool whole);
    void addNeighbourhood(FreeformPart& part, const NeighbourhoodGraph::Node& node, std::span<const Vec3d> points,
                          bool whole);
    FreeformPart quarterOf(const FreeformPart& part, std::span<const Vec3d> points, std::uint32_t c, bool whole);
    FreeformPart childOf(const FreeformPart& part, std::uint32_t c, bool whole);
    [[nodiscard]] static std::size_t controlsAt(const FreeformPart& part) {
        return part.at + 3 * std::size_t{part.points};
    }
    std::size_t takePoints(std::span<const Vec3d> points);
    [[nodiscard]] std::vector<Vec3d> pointsAt(std::size_t at, std::size_t count) const;
    void finish(FreeformPart& part);
    bool settleTrim(FreeformPart& part) const;
    std::array<FreeformPart, 2> halve(const FreeformPart& part);
    std::array<FreeformPart, 2> halveTriangle(const FreeformPart& part);
    void project(FreeformPart& part);

    const FreeformShape& shape_;
    std::vector<FreeformPart> parts_;
    std::vector<double> coordinates_;
    std::vector<PartBlock> blocks_;
    std::vector<Vec3d> points_, finer_, hull_;
    std::uint64_t moves_ = 0;
};

}  // namespace tessera
