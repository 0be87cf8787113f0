#include "tests/support/MadeModels.h"

#include <cmath>
#include <numbers>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

namespace {

constexpr double kTurn = 2 * std::numbers::pi;

class Builder {
public:
    std::uint32_t vertex(const Vec3d& p) {
        positions_.insert(positions_.end(), {p.x(), p.y(), p.z()});
        return static_cast<std::uint32_t>(positions_.size() / 3 - 1);
    }
    void face(std::uint32_t a, std::uint32_t b, std::uint32_t c) { indices_.insert(indices_.end(), {a, b, c}); }
    void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
        face(a, b, c);
        face(a, c, d);
    }
    [[nodiscard]] TriangleMesh take() {
        Expected<TriangleMesh> mesh = TriangleMesh::make(std::span<const double>(positions_), indices_);
        TESSERA_CHECK(mesh.has_value(), "a made model is one");
        return *std::move(mesh);
    }

private:
    std::vector<double> positions_;
    std::vector<std::uint32_t> indices_;
};

TriangleMesh knot() {
    constexpr std::uint32_t kAlong = 240, kAround = 12;
    const auto centre = [](double t) {
        return Vec3d(std::sin(t) + 2 * std::sin(2 * t), std::cos(t) - 2 * std::cos(2 * t), -std::sin(3 * t));
    };
    Builder out;
    for (std::uint32_t i = 0; i < kAlong; ++i) {
        const double t = kTurn * i / kAlong, h = 1e-4;
        const Vec3d along = (centre(t + h) - centre(t - h)).normalized();
        const Vec3d side = along.cross(Vec3d::UnitZ()).normalized(), up = side.cross(along);
        for (std::uint32_t k = 0; k < kAround; ++k) {
            const double a = kTurn * k / kAround;
            out.vertex(centre(t) + 0.35 * (std::cos(a) * side + std::sin(a) * up));
        }
    }
    for (std::uint32_t i = 0; i < kAlong; ++i)
        for (std::uint32_t k = 0; k < kAround; ++k) {
            const std::uint32_t next = (i + 1) % kAlong, beside = (k + 1) % kAround;
            out.quad(kAround * i + k, kAround * i + beside, kAround * next + beside, kAround * next + k);
        }
    return out.take();
}

TriangleMesh gear() {
    constexpr std::uint32_t kTeeth = 24, kRim = 4 * kTeeth;
    constexpr double kHub = 0.3, kRoot = 0.85, kTip = 1, kThickness = 0.25;
    Builder out;
    for (const double z : {0.0, kThickness}) {
        for (std::uint32_t i = 0; i < kRim; ++i) {
            const double a = kTurn * i / kRim, r = i % 4 < 2 ? kRoot : kTip;
            out.vertex(r * Vec3d(std::cos(a), std::sin(a), 0) + z * Vec3d::UnitZ());
        }
        for (std::uint32_t i = 0; i < kRim; ++i) {
            const double a = kTurn * i / kRim;
            out.vertex(kHub * Vec3d(std::cos(a), std::sin(a), 0) + z * Vec3d::UnitZ());
        }
    }
    for (std::uint32_t i = 0; i < kRim; ++i) {
        const std::uint32_t next = (i + 1) % kRim, hub = kRim, top = 2 * kRim;
        out.quad(i, hub + i, hub + next, next);                          // below
        out.quad(top + i, top + next, top + hub + next, top + hub + i);  // above
        out.quad(i, next, top + next, top + i);                          // outside
        out.quad(hub + i, top + hub + i, top + hub + next, hub + next);  // of the hole
    }
    return out.take();
}

TriangleMesh plate() {
    constexpr std::uint32_t kX = 24, kY = 16;
    constexpr double kWidth = 1.5, kDepth = 1, kThickness = 0.0015;
    Builder out;
    for (const double z : {0.0, kThickness})
        for (std::uint32_t y = 0; y <= kY; ++y)
            for (std::uint32_t x = 0; x <= kX; ++x) out.vertex(Vec3d(kWidth * x / kX, kDepth * y / kY, z));
    const auto at = [](std::uint32_t x, std::uint32_t y, std::uint32_t level) {
        return (level * (kY + 1) + y) * (kX + 1) + x;
    };
    for (std::uint32_t y = 0; y < kY; ++y)
        for (std::uint32_t x = 0; x < kX; ++x) {
            out.quad(at(x, y, 0), at(x, y + 1, 0), at(x + 1, y + 1, 0), at(x + 1, y, 0));
            out.quad(at(x, y, 1), at(x + 1, y, 1), at(x + 1, y + 1, 1), at(x, y + 1, 1));
        }
    for (std::uint32_t x = 0; x < kX; ++x) {
        out.quad(at(x, 0, 0), at(x + 1, 0, 0), at(x + 1, 0, 1), at(x, 0, 1));
        out.quad(at(x + 1, kY, 0), at(x, kY, 0), at(x, kY, 1), at(x + 1, kY, 1));
    }
    for (std::uint32_t y = 0; y < kY; ++y) {
        out.quad(at(0, y + 1, 0), at(0, y, 0), at(0, y, 1), at(0, y + 1, 1));
        out.quad(at(kX, y, 0), at(kX, y + 1, 0), at(kX, y + 1, 1), at(kX, y, 1));
    }
    return out.take();
}

TriangleMesh terrain() {
    constexpr std::uint32_t kSide = 48;
    Builder out;
    for (std::uint32_t y = 0; y <= kSide; ++y)
        for (std::uint32_t x = 0; x <= kSide; ++x) {
            const double u = 2.0 * x / kSide - 1, v = 2.0 * y / kSide - 1;
            const double height =
                0.25 * std::sin(5 * u) * std::cos(4 * v) + 0.06 * std::sin(17 * u + 9 * v) + 0.02 * std::cos(41 * v);
            out.vertex(Vec3d(u, v, height));
        }
    for (std::uint32_t y = 0; y < kSide; ++y)
        for (std::uint32_t x = 0; x < kSide; ++x) {
            const std::uint32_t at = y * (kSide + 1) + x;
            out.quad(at, at + 1, at + kSide + 2, at + kSide + 1);
        }
    return out.take();
}

}  // namespace

std::optional<TriangleMesh> madeModel(std::string_view name) {
    if (name == "made/knot") return knot();
    if (name == "made/gear") return gear();
    if (name == "made/plate") return plate();
    if (name == "made/terrain") return terrain();
    return std::nullopt;
}

}  // namespace tessera
