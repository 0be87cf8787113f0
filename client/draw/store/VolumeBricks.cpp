#include "client/draw/store/VolumeBricks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "common/cores/Volume.h"

namespace tessera {
namespace {

/// Ranges of a row's bricks.
template <typename Number>
void rangesOfRow(std::span<const Number> row, std::vector<float>& least, std::vector<float>& most) {
    for (std::size_t brick = 0; brick < least.size(); ++brick) {
        const std::size_t from = brick * VolumeBricks::kSide,
                          end = std::min<std::size_t>(row.size(), from + VolumeBricks::kSide + 1);
        Number low = row[from], high = row[from];
        for (std::size_t i = from + 1; i < end; ++i) {
            low = std::min(low, row[i]);
            high = std::max(high, row[i]);
        }
        least[brick] = static_cast<float>(low);
        most[brick] = static_cast<float>(high);
    }
}

/// `row` counts rows of voxels, y first.
void rangesOfRow(const Volume& v, std::int64_t row, std::vector<float>& least, std::vector<float>& most) {
    const auto of = [&]<typename Number>(Number) {
        const auto size = static_cast<std::size_t>(v.sizeX);
        rangesOfRow(v.voxels.as<Number>().subspan(static_cast<std::size_t>(row) * size, size), least, most);
    };
    switch (v.format) {
        case Volume::kUint8:
            return of(std::uint8_t{});
        case Volume::kUint16:
            return of(std::uint16_t{});
        case Volume::kInt16:
            return of(std::int16_t{});
        default:
            return of(float{});
    }
}

/// The bricks along an axis that a voxel is a corner of.
std::pair<std::int64_t, std::int64_t> bricksAt(std::int64_t voxel, std::int64_t count) {
    const std::int64_t own = voxel / VolumeBricks::kSide;
    return {voxel % VolumeBricks::kSide == 0 && own > 0 ? own - 1 : own, std::min(own, count - 1)};
}

}  // namespace

VolumeBricks::VolumeBricks(const Volume& v) {
    const std::array<std::int64_t, 3> sizes{v.sizeX, v.sizeY, v.sizeZ};
    // The last voxel is a place too: rays end there.
    for (std::size_t axis = 0; axis < 3; ++axis) counts_[axis] = (sizes[axis] - 1) / kSide + 1;
    const auto all = static_cast<std::size_t>(counts_[0] * counts_[1] * counts_[2]);
    least_.resize(all);
    most_.resize(all);
    update(v, 0, v.sizeZ);
}

void VolumeBricks::update(const Volume& v, std::int64_t first, std::int64_t end) {
    if (first >= end) return;
    const std::int64_t from = bricksAt(first, counts_[2]).first, to = bricksAt(end - 1, counts_[2]).second + 1,
                       layer = counts_[0] * counts_[1];
    std::fill(least_.begin() + from * layer, least_.begin() + to * layer, std::numeric_limits<float>::infinity());
    std::fill(most_.begin() + from * layer, most_.begin() + to * layer, -std::numeric_limits<float>::infinity());
    std::vector<float> least(static_cast<std::size_t>(counts_[0])), most(least.size());
    for (std::int64_t z = from * kSide; z < std::min(v.sizeZ, to * kSide + 1); ++z) {
        const auto [belowZ, aboveZ] = bricksAt(z, counts_[2]);
        for (std::int64_t y = 0; y < v.sizeY; ++y) {
            rangesOfRow(v, z * v.sizeY + y, least, most);
            const auto [belowY, aboveY] = bricksAt(y, counts_[1]);
            for (std::int64_t bz = std::max(from, belowZ); bz <= std::min(to - 1, aboveZ); ++bz)
                for (std::int64_t by = belowY; by <= aboveY; ++by) {
                    const auto at = static_cast<std::size_t>((bz * counts_[1] + by) * counts_[0]);
                    for (std::size_t bx = 0; bx < least.size(); ++bx) {
                        least_[at + bx] = std::min(least_[at + bx], least[bx]);
                        most_[at + bx] = std::max(most_[at + bx], most[bx]);
                    }
                }
        }
    }
}

std::vector<std::uint8_t> VolumeBricks::emptySteps(const Volume& v) const {
    // How many stops before each have any opacity.
    const std::span<const std::uint8_t> given = v.transfer.as<std::uint8_t>();
    std::vector<std::uint32_t> visible{0};
    if (given.size() < 4)
        visible = {0, 0, 1};
    else
        for (std::size_t i = 3; i < given.size(); i += 4) visible.push_back(visible.back() + (given[i] != 0));
    if (visible.size() == 2) visible.push_back(2 * visible.back());
    const double last = static_cast<double>(visible.size() - 2), perValue = last / (v.high - v.low);
    const double shift = v.format == Volume::kInt16 ? 65536 : 0;  // what has signs is read as if it had none
    const auto stopAt = [&](double place) { return static_cast<std::size_t>(std::clamp(place, 0.0, last)); };
    std::vector<std::uint8_t> steps(least_.size(), 255);
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const double low = static_cast<double>(least_[i]), high = static_cast<double>(most_[i]);
        // A shader's value · x + y, in floats: each of them may be off by so much.
        const double off = 1e-3 + 1e-6 * perValue * (std::abs(low) + std::abs(high) + std::abs(v.low) + shift);
        const std::size_t from = stopAt(std::floor((low - v.low) * perValue - off)),
                          to = stopAt(std::floor((high - v.low) * perValue + off) + 1);
        if (visible[to + 1] != visible[from]) steps[i] = 0;
    }
    // A step there and one back over the nearest 26 say how far it is (Rosenfeld and Pfaltz, "Distance functions on
    // digital pictures", 1968).
    const std::int64_t nx = counts_[0], ny = counts_[1], nz = counts_[2];
    const auto sweep = [&](bool back) {
        const std::int64_t d = back ? 1 : -1;
        for (std::int64_t i = 0; i < nx * ny * nz; ++i) {
            const std::int64_t at = back ? nx * ny * nz - 1 - i : i, x = at % nx, y = at / nx % ny, z = at / (nx * ny);
            unsigned least = steps[static_cast<std::size_t>(at)];
            const auto look = [&](std::int64_t ox, std::int64_t oy, std::int64_t oz) {
                const std::int64_t px = x + ox, py = y + oy, pz = z + oz;
                if (px < 0 || py < 0 || pz < 0 || px >= nx || py >= ny || pz >= nz) return;
                least = std::min(least, steps[static_cast<std::size_t>((pz * ny + py) * nx + px)] + 1u);
            };
            if (least == 0) continue;
            look(d, 0, 0);
            for (const std::int64_t ox : {-1, 0, 1}) look(ox, d, 0);
            for (const std::int64_t oy : {-1, 0, 1})
                for (const std::int64_t ox : {-1, 0, 1}) look(ox, oy, d);
            steps[static_cast<std::size_t>(at)] = static_cast<std::uint8_t>(least);
        }
    };
    sweep(false);
    sweep(true);
    return steps;
}

}  // namespace tessera
