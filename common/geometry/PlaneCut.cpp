#include "common/geometry/PlaneCut.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <unordered_map>
#include <vector>

namespace tessera {
namespace {

/// A bit per plane.
using PlaneBits = std::uint64_t;

class SurfaceCutter {
public:
    SurfaceCutter(const MeshArrays& mesh, std::span<const Vec4d> planes, std::size_t mostTriangles)
        : positions_(mesh.positions.as<float>()),
          normals_(mesh.normals.as<float>()),
          indices_(mesh.indices.as<std::uint32_t>()),
          most_(mostTriangles) {
        for (const Vec4d& plane : planes) planes_.push_back(plane / plane.head<3>().norm());
        given_ = positions_.size() / 3;
    }

    Expected<MeshData> make() {
        beyond_.resize(given_);
        for (std::size_t v = 0; v < given_; ++v)
            beyond_[v] = beyondAt(placeOf(static_cast<std::uint32_t>(v)), ~PlaneBits{0});
        for (std::size_t t = 0; t + 2 < indices_.size(); t += 3) {
            const std::array<std::uint32_t, 3> corners{indices_[t], indices_[t + 1], indices_[t + 2]};
            const std::array<PlaneBits, 3> beyond{beyond_[corners[0]], beyond_[corners[1]], beyond_[corners[2]]};
            if ((beyond[0] & beyond[1] & beyond[2]) != 0) continue;
            if (const PlaneBits cutting = beyond[0] | beyond[1] | beyond[2]; cutting == 0)
                kept_.insert(kept_.end(), corners.begin(), corners.end());
            else
                cut(corners, cutting);
            if (kept_.size() / 3 > most_)
                return fail(ErrorCode::kLimit,
                            fmt::format("a surface that planes cut has more than {} triangles", most_));
        }
        return mesh();
    }

private:
    /// What is made where an edge is cut.
    struct Made {
        Vec3d place, normal;
    };

    [[nodiscard]] static Vec3d three(std::span<const float> numbers, std::uint32_t at) {
        const float* p = &numbers[3 * std::size_t{at}];
        return {p[0], p[1], p[2]};
    }
    [[nodiscard]] Vec3d placeOf(std::uint32_t v) const {
        return v < given_ ? three(positions_, v) : made_[v - given_].place;
    }
    [[nodiscard]] Vec3d normalOf(std::uint32_t v) const {
        if (v >= given_) return made_[v - given_].normal;
        return normals_.empty() ? Vec3d(Vec3d::Zero()) : three(normals_, v);
    }
    [[nodiscard]] double off(std::size_t plane, const Vec3d& place) const {
        return planes_[plane].head<3>().dot(place) - planes_[plane].w();
    }
    [[nodiscard]] PlaneBits beyondAt(const Vec3d& place, PlaneBits of) const {
        PlaneBits bits = 0;
        for (std::size_t k = 0; k < planes_.size(); ++k)
            if ((of >> k & 1) != 0 && off(k, place) > 0) bits |= PlaneBits{1} << k;
        return bits;
    }

    /// Of an edge with one end on each side. Both triangles at an edge cut it at the same planes in the same order: at
    /// those that an end is beyond.
    [[nodiscard]] std::uint32_t cornerBetween(std::uint32_t in, std::uint32_t out, std::size_t plane) {
        const Vec3d from = placeOf(in), to = placeOf(out);
        const double before = off(plane, from), after = off(plane, to);
        if (!(before < 0)) return in;
        const std::uint64_t edge = std::uint64_t{std::min(in, out)} << 32 | std::max(in, out);
        const auto [known, isNew] = cuts_.try_emplace(edge, static_cast<std::uint32_t>(given_ + made_.size()));
        if (!isNew) return known->second;
        const double share = before / (before - after);
        Made corner{from + share * (to - from), (1 - share) * normalOf(in) + share * normalOf(out)};
        if (const double length = corner.normal.norm(); length > 0) corner.normal /= length;
        // Between two that are not beyond a plane nothing is, whatever rounding says: the triangle beside this one may
        // not ask.
        beyond_.push_back(beyondAt(corner.place, (beyond_[in] | beyond_[out]) & ~(PlaneBits{1} << plane)));
        made_.push_back(corner);
        return known->second;
    }

    // As Sutherland and Hodgman cut a convex polygon ("Reentrant polygon clipping", 1974).
    void cut(const std::array<std::uint32_t, 3>& corners, PlaneBits cutting) {
        polygon_.assign(corners.begin(), corners.end());
        for (; cutting != 0 && polygon_.size() > 2; cutting &= cutting - 1) {
            const auto plane = static_cast<std::size_t>(std::countr_zero(cutting));
            left_.clear();
            const auto add = [this](std::uint32_t corner) {
                if (left_.empty() || (left_.back() != corner && left_.front() != corner)) left_.push_back(corner);
            };
            for (std::size_t i = 0; i < polygon_.size(); ++i) {
                const std::uint32_t a = polygon_[i], b = polygon_[(i + 1) % polygon_.size()];
                const bool aOut = (beyond_[a] >> plane & 1) != 0, bOut = (beyond_[b] >> plane & 1) != 0;
                if (!aOut) add(a);
                if (aOut != bOut) add(aOut ? cornerBetween(b, a, plane) : cornerBetween(a, b, plane));
            }
            std::swap(polygon_, left_);
        }
        for (std::size_t i = 2; i < polygon_.size(); ++i)
            kept_.insert(kept_.end(), {polygon_[0], polygon_[i - 1], polygon_[i]});
    }

    /// Corners that are left, in their order.
    [[nodiscard]] MeshData mesh() {
        constexpr std::uint32_t kGone = 0xffffffffu;
        std::vector<std::uint32_t> numbers(beyond_.size(), kGone);
        for (const std::uint32_t corner : kept_) numbers[corner] = 0;
        MeshData out;
        std::uint32_t count = 0;
        for (std::uint32_t v = 0; v < numbers.size(); ++v) {
            if (numbers[v] == kGone) continue;
            numbers[v] = count++;
            const Vec3f place = placeOf(v).cast<float>();
            out.positions.insert(out.positions.end(), place.data(), place.data() + 3);
            if (normals_.empty()) continue;
            const Vec3f normal = normalOf(v).cast<float>();
            out.normals.insert(out.normals.end(), normal.data(), normal.data() + 3);
        }
        for (std::uint32_t& corner : kept_) corner = numbers[corner];
        out.indices = std::move(kept_);
        return out;
    }

    std::span<const float> positions_, normals_;
    std::span<const std::uint32_t> indices_;
    std::size_t most_, given_ = 0;
    std::vector<Vec4d> planes_;
    std::vector<PlaneBits> beyond_;  ///< by corner, made ones behind those that are given
    std::vector<Made> made_;
    std::unordered_map<std::uint64_t, std::uint32_t> cuts_;  ///< by edge, both ends
    std::vector<std::uint32_t> kept_, polygon_, left_;
};

}  // namespace

Expected<MeshData> cutAtPlanes(const MeshArrays& mesh, std::span<const Vec4d> planes, std::size_t mostTriangles) {
    if (planes.size() > kMostCutPlanes)
        return fail(ErrorCode::kLimit,
                    fmt::format("{} planes at once, at most {} can cut", planes.size(), kMostCutPlanes));
    return SurfaceCutter(mesh, planes, mostTriangles).make();
}

}  // namespace tessera
