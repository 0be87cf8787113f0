#include "client/draw/EnvironmentLight.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace tessera {
namespace {

constexpr double kPi = std::numbers::pi;
/// What half floats of a texture can hold.
constexpr double kLargestHalf = 60000;
/// Nodes that look larger than this part of their distance from the lobe's axis, plus the lobe's own width, are opened.
constexpr double kFineness = 0.3;

/// The unit square's point to a direction; the square's middle is +Y.
Vec3d octahedral(double u, double v) {
    double x = 2 * u - 1, z = 2 * v - 1;
    const double y = 1 - std::abs(x) - std::abs(z);
    if (y < 0) {
        const double folded = (1 - std::abs(z)) * (x < 0 ? -1 : 1);
        z = (1 - std::abs(x)) * (z < 0 ? -1 : 1);
        x = folded;
    }
    return Vec3d(x, y, z).normalized();
}

/// And back.
Eigen::Vector2d onSquare(const Vec3d& d) {
    const double size = d.cwiseAbs().sum();
    double x = d.x() / size, z = d.z() / size;
    if (d.y() < 0) {
        const double folded = (1 - std::abs(z)) * (x < 0 ? -1 : 1);
        z = (1 - std::abs(x)) * (z < 0 ? -1 : 1);
        x = folded;
    }
    return {0.5 * x + 0.5, 0.5 * z + 0.5};
}

/// The picture's pixels as linear numbers.
struct Panorama {
    std::size_t width = 0, height = 0;
    std::vector<Vec3f> pixels;

    /// Linear between pixels; around in the one direction, to the poles in the other.
    [[nodiscard]] Vec3d at(const Vec3d& d) const {
        const double x = (0.5 + std::atan2(d.x(), -d.z()) / (2 * kPi)) * static_cast<double>(width) - 0.5;
        const double y = std::acos(std::clamp(d.y(), -1.0, 1.0)) / kPi * static_cast<double>(height) - 0.5;
        const double left = std::floor(x), above = std::floor(y);
        const auto pixel = [&](double px, double py) -> Vec3d {
            const auto w = static_cast<double>(width);
            const auto column = static_cast<std::size_t>(px - w * std::floor(px / w));
            const auto row = static_cast<std::size_t>(std::clamp(py, 0.0, static_cast<double>(height - 1)));
            return pixels[row * width + std::min(column, width - 1)].cast<double>();
        };
        const double fx = x - left, fy = y - above;
        return (1 - fy) * ((1 - fx) * pixel(left, above) + fx * pixel(left + 1, above)) +
               fy * ((1 - fx) * pixel(left, above + 1) + fx * pixel(left + 1, above + 1));
    }
};

double linearOfSrgb(double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

Panorama panoramaOf(const Image& image) {
    std::array<double, 256> linear{}, exponents{};
    for (int i = 0; i < 256; ++i) {
        linear[static_cast<std::size_t>(i)] = image.encoding == Image::kRgbe ? i : linearOfSrgb(i / 255.0);
        exponents[static_cast<std::size_t>(i)] = image.encoding != Image::kRgbe ? 1 : i == 0 ? 0 : std::ldexp(1.0, i - 136);
    }
    const auto width = static_cast<std::size_t>(image.widthPx), height = static_cast<std::size_t>(image.heightPx);
    // What is finer than the sharp map is averaged.
    const std::size_t shrink = std::max<std::size_t>(1, width / 1024);
    Panorama out{.width = width / shrink, .height = std::max<std::size_t>(1, height / shrink), .pixels = {}};
    out.pixels.resize(out.width * out.height);
    const std::byte* bytes = image.pixels.bytes().data();
    for (std::size_t y = 0; y < out.height; ++y) {
        for (std::size_t x = 0; x < out.width; ++x) {
            Vec3d sum = Vec3d::Zero();
            double count = 0;
            for (std::size_t dy = 0; dy < shrink && y * shrink + dy < height; ++dy) {
                for (std::size_t dx = 0; dx < shrink; ++dx, ++count) {
                    const std::byte* p = bytes + 4 * ((y * shrink + dy) * width + x * shrink + dx);
                    const double factor = exponents[std::to_integer<std::size_t>(p[3])];
                    for (int c = 0; c < 3; ++c) sum[c] += factor * linear[std::to_integer<std::size_t>(p[c])];
                }
            }
            out.pixels[y * out.width + x] = (sum / count).cwiseMin(kLargestHalf).cast<float>();
        }
    }
    return out;
}

/// Of the triangle that three directions span (Van Oosterom and Strackee 1983).
double solidAngleOf(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    return 2 * std::abs(std::atan2(a.dot(b.cross(c)), 1 + a.dot(b) + b.dot(c) + c.dot(a)));
}

}  // namespace

int EnvironmentLight::firstRow(int level) {
    int row = 0;
    for (int i = 0; i < level; ++i) row += kSides[static_cast<std::size_t>(i)] + 2;
    return row;
}

Vec3d EnvironmentLight::directionOf(int level, int x, int y) {
    const double side = kSides[static_cast<std::size_t>(level)];
    return octahedral((x + 0.5) / side, (y + 0.5) / side);
}

Expected<EnvironmentLight> EnvironmentLight::of(const Image& image) {
    const auto bad = [](std::string why) { return fail(ErrorCode::kBadInput, "the surroundings' image " + std::move(why)); };
    if (!image.pixels.resident()) return bad("is not here");
    if (image.widthPx < 2 || image.heightPx < 1 || image.widthPx > Image::kMaxSidePx || image.heightPx > Image::kMaxSidePx ||
        image.pixels.sizeBytes() != static_cast<std::uint64_t>(image.widthPx * image.heightPx) * 4)
        return bad(fmt::format("of {} × {} pixels has {} bytes", image.widthPx, image.heightPx, image.pixels.sizeBytes()));
    if (std::abs(image.widthPx - 2 * image.heightPx) > image.heightPx / 8)
        return bad(fmt::format("of {} × {} pixels is not about twice as wide as high", image.widthPx, image.heightPx));
    EnvironmentLight light;
    light.atlas_.assign(static_cast<std::size_t>(kAtlasWidth) * kAtlasHeight * 4, 0.0f);
    light.buildTree(image);
    light.project();
    for (int level = 0; level < kLevels; ++level) light.filter(level);
    return light;
}

void EnvironmentLight::buildTree(const Image& image) {
    const Panorama panorama = panoramaOf(image);
    constexpr int kSide = kSides[0];
    const auto index = [](int side, int x, int y) { return static_cast<std::size_t>(y) * static_cast<std::size_t>(side) + static_cast<std::size_t>(x); };
    std::vector<Node> leaves(static_cast<std::size_t>(kSide) * kSide);
    for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
            const auto at = [&](double dx, double dy) { return octahedral((x + dx) / kSide, (y + dy) / kSide); };
            Node& node = leaves[index(kSide, x, y)];
            node.direction = at(0.5, 0.5);
            node.solidAngle = solidAngleOf(at(0, 0), at(1, 0), at(1, 1)) + solidAngleOf(at(0, 0), at(1, 1), at(0, 1));
            // Of four places, so that small bright things do not fall between texels.
            Vec3d mean = Vec3d::Zero();
            for (const double dx : {0.25, 0.75})
                for (const double dy : {0.25, 0.75}) mean += 0.25 * panorama.at(at(dx, dy));
            node.sum = mean * node.solidAngle;
        }
    }
    tree_.assign(1, std::move(leaves));
    for (int side = kSide / 2; side >= 1; side /= 2) {
        const std::vector<Node>& below = tree_.back();
        std::vector<Node> nodes(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
        for (int y = 0; y < side; ++y) {
            for (int x = 0; x < side; ++x) {
                Node& node = nodes[index(side, x, y)];
                Vec3d direction = Vec3d::Zero();
                for (int k = 0; k < 4; ++k) {
                    const Node& child = below[index(2 * side, 2 * x + k % 2, 2 * y + k / 2)];
                    node.sum += child.sum;
                    node.solidAngle += child.solidAngle;
                    direction += child.solidAngle * child.direction;
                }
                node.direction = direction.norm() > 1e-9 ? Vec3d(direction.normalized()) : Vec3d::UnitY();
            }
        }
        tree_.push_back(std::move(nodes));
    }
    std::reverse(tree_.begin(), tree_.end());
}

void EnvironmentLight::project() {
    // Basis functions without their constants; those, squared, and the cosine's (1, 2/3, 1/4) are multiplied in at the end.
    std::array<Vec3d, 9> sums;
    sums.fill(Vec3d::Zero());
    const auto basis = [](const Vec3d& d) {
        return std::array<double, 9>{1, d.y(), d.z(), d.x(), d.x() * d.y(), d.y() * d.z(), 3 * d.z() * d.z() - 1,
                                     d.x() * d.z(), d.x() * d.x() - d.y() * d.y()};
    };
    for (const Node& node : tree_.back()) {
        const auto values = basis(node.direction);
        for (std::size_t i = 0; i < 9; ++i) sums[i] += values[i] * node.sum;
    }
    const double l0 = 1 / (4 * kPi), l1 = 3 / (4 * kPi) * (2.0 / 3), l2 = 15 / (4 * kPi) / 4;
    const std::array<double, 9> factors = {l0, l1, l1, l1, l2, l2, l2 / 12, l2, l2 / 4};
    for (std::size_t i = 0; i < 9; ++i) harmonics_[i] = (factors[i] * sums[i]).cast<float>();
}

void EnvironmentLight::filter(int level) {
    const int side = kSides[static_cast<std::size_t>(level)];
    for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
            if (level == 0) {
                const Node& node = tree_.back()[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) + static_cast<std::size_t>(x)];
                store(0, x, y, node.sum / node.solidAngle);
            } else {
                store(level, x, y, lobeMean(directionOf(level, x, y), roughnessOf(level)));
            }
        }
    }
    closeBorders(level);
}

/// Σ radiance · D(n·h) · (n·l) / Σ D(n·h) · (n·l), with the eye along the normal: (n·h)² = (1 + n·l) / 2.
Vec3d EnvironmentLight::lobeMean(const Vec3d& axis, double roughness) const {
    const double alpha = roughness * roughness, alpha2 = alpha * alpha;
    Vec3d sum = Vec3d::Zero();
    double weights = 0;
    struct Open {
        std::uint32_t level, x, y;
    };
    std::vector<Open> open{{0, 0, 0}};
    const auto levels = static_cast<std::uint32_t>(tree_.size());
    while (!open.empty()) {
        const auto [level, x, y] = open.back();
        open.pop_back();
        const Node& node = tree_[level][(std::size_t{y} << level) + x];
        const double nl = std::clamp(node.direction.dot(axis), -1.0, 1.0);
        const double size = std::sqrt(node.solidAngle);
        // Half the angle between axis and node is that of the half vector: the lobe is twice as wide as alpha.
        const double away = std::sqrt(2 * (1 - nl));
        if (level + 1 < levels && (level < 4 || size > kFineness * (2 * alpha + away) || (nl < size && nl > -size && size > 0.05))) {
            for (std::uint32_t k = 0; k < 4; ++k) open.push_back({level + 1, 2 * x + k % 2, 2 * y + k / 2});
            continue;
        }
        if (nl <= 0) continue;
        const double q = 0.5 * (1 + nl) * (alpha2 - 1) + 1;
        const double weight = nl / (q * q);
        sum += weight * node.sum;
        weights += weight * node.solidAngle;
    }
    return weights > 0 ? Vec3d(sum / weights) : Vec3d::Zero();
}

void EnvironmentLight::store(int level, int x, int y, const Vec3d& value) {
    float* texel = &atlas_[4 * (static_cast<std::size_t>(firstRow(level) + 1 + y) * kAtlasWidth + static_cast<std::size_t>(1 + x))];
    for (int c = 0; c < 3; ++c) texel[c] = static_cast<float>(value[c]);
    texel[3] = 1;
}

Vec3d EnvironmentLight::reflected(int level, int x, int y) const {
    const float* texel = &atlas_[4 * (static_cast<std::size_t>(firstRow(level) + 1 + y) * kAtlasWidth + static_cast<std::size_t>(1 + x))];
    return {texel[0], texel[1], texel[2]};
}

/// Beyond an edge of the square its other half follows, mirrored.
void EnvironmentLight::closeBorders(int level) {
    const int side = kSides[static_cast<std::size_t>(level)];
    for (int i = -1; i <= side; ++i) {
        const auto inside = [&](int k) { return std::clamp(k, 0, side - 1); };
        const int mirrored = side - 1 - inside(i);
        store(level, i, -1, reflected(level, mirrored, 0));
        store(level, i, side, reflected(level, mirrored, side - 1));
        store(level, -1, i, reflected(level, 0, mirrored));
        store(level, side, i, reflected(level, side - 1, mirrored));
    }
}

Vec3d EnvironmentLight::radiance(const Vec3d& direction) const {
    const Eigen::Vector2d at = onSquare(direction) * kSides[0];
    const auto texel = [](double v) { return std::clamp(static_cast<int>(std::floor(v)), 0, kSides[0] - 1); };
    return reflected(0, texel(at.x()), texel(at.y()));
}

Vec3d EnvironmentLight::diffuse(const Vec3d& n) const {
    const std::array<double, 9> basis = {1, n.y(), n.z(), n.x(), n.x() * n.y(), n.y() * n.z(), 3 * n.z() * n.z() - 1,
                                         n.x() * n.z(), n.x() * n.x() - n.y() * n.y()};
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 0; i < 9; ++i) sum += basis[i] * harmonics_[i].cast<double>();
    return sum.cwiseMax(0.0);
}

}  // namespace tessera
