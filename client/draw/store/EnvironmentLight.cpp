#include "client/draw/store/EnvironmentLight.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "common/cores/Image.h"
#include "common/drawable/ImageLayout.h"

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

/// On which face a direction falls, and where on it, from 0 to 1 (OpenGL 4.5, table 8.19).
struct FacePlace {
    std::size_t face;
    double s, t;
};
FacePlace faceOf(const Vec3d& d) {
    const Vec3d size = d.cwiseAbs();
    const auto place = [](std::size_t face, double sc, double tc, double major) {
        return FacePlace{face, 0.5 * (sc / major + 1), 0.5 * (tc / major + 1)};
    };
    if (size.x() >= size.y() && size.x() >= size.z())
        return d.x() > 0 ? place(0, -d.z(), -d.y(), size.x()) : place(1, d.z(), -d.y(), size.x());
    if (size.y() >= size.z()) return d.y() > 0 ? place(2, d.x(), d.z(), size.y()) : place(3, d.x(), -d.z(), size.y());
    return d.z() > 0 ? place(4, d.x(), -d.y(), size.z()) : place(5, -d.x(), -d.y(), size.z());
}
/// And back; s and t may lie beyond the face.
Vec3d directionOnFace(std::size_t face, double s, double t) {
    const double x = 2 * s - 1, y = 2 * t - 1;
    switch (face) {
        case 0:
            return {1, -y, -x};
        case 1:
            return {-1, -y, x};
        case 2:
            return {x, 1, y};
        case 3:
            return {x, -1, -y};
        case 4:
            return {x, -y, 1};
        default:
            return {-x, -y, -1};
    }
}

/// What is finer than the sharp map is averaged.
SurroundingsPicture pictureOf(const Image& image) {
    std::array<double, 256> linear{}, exponents{};
    for (int i = 0; i < 256; ++i) {
        linear[static_cast<std::size_t>(i)] = image.encoding == Image::kRgbe ? i : linearOfSrgb(i / 255.0);
        exponents[static_cast<std::size_t>(i)] = image.encoding != Image::kRgbe ? 1
                                                 : i == 0                       ? 0
                                                                                : std::ldexp(1.0, i - 136);
    }
    const bool cube = image.shape == Image::kCube;
    const auto width = static_cast<std::size_t>(image.widthPx), height = static_cast<std::size_t>(image.heightPx);
    const std::size_t shrink = std::max<std::size_t>(1, width / (cube ? 512 : 1024)), faces = cube ? 6 : 1;
    SurroundingsPicture out{
        .cube = cube, .width = width / shrink, .height = std::max<std::size_t>(1, height / shrink), .pixels = {}};
    out.pixels.resize(faces * out.width * out.height);
    for (std::size_t row = 0; row < faces * out.height; ++row) {
        const std::size_t face = row / out.height, y = row % out.height;
        const std::byte* bytes = image.pixels.bytes().data() + 4 * face * width * height;
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
            out.pixels[row * out.width + x] = (sum / count).cwiseMin(kLargestHalf).cast<float>();
        }
    }
    return out;
}

/// Of the triangle that three directions span (Van Oosterom and Strackee 1983).
double solidAngleOf(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    return 2 * std::abs(std::atan2(a.dot(b.cross(c)), 1 + a.dot(b) + b.dot(c) + c.dot(a)));
}

}  // namespace

Vec3d SurroundingsPicture::at(const Vec3d& d) const {
    const auto w = static_cast<double>(width), h = static_cast<double>(height);
    const FacePlace place =
        cube ? faceOf(d)
             : FacePlace{0, 0.5 + std::atan2(d.x(), -d.z()) / (2 * kPi), std::acos(std::clamp(d.y(), -1.0, 1.0)) / kPi};
    const double x = place.s * w - 0.5, y = place.t * h - 0.5;
    const double left = std::floor(x), above = std::floor(y);
    const auto texel = [&](std::size_t face, double px, double py) -> Vec3d {
        const auto column = static_cast<std::size_t>(std::clamp(px, 0.0, w - 1)),
                   row = static_cast<std::size_t>(std::clamp(py, 0.0, h - 1));
        return pixels[(face * height + row) * width + column].cast<double>();
    };
    const auto pixel = [&](double px, double py) -> Vec3d {
        // Around in the one direction, to the poles in the other.
        if (!cube) return texel(0, px - w * std::floor(px / w), py);
        if (px >= 0 && px < w && py >= 0 && py < h) return texel(place.face, px, py);
        const FacePlace beside = faceOf(directionOnFace(place.face, (px + 0.5) / w, (py + 0.5) / h));
        return texel(beside.face, std::floor(beside.s * w), std::floor(beside.t * h));
    };
    const double fx = x - left, fy = y - above;
    return (1 - fy) * ((1 - fx) * pixel(left, above) + fx * pixel(left + 1, above)) +
           fy * ((1 - fx) * pixel(left, above + 1) + fx * pixel(left + 1, above + 1));
}

void SurroundingsPicture::halve() {
    const std::size_t w = width / 2, h = height / 2, faces = cube ? 6 : 1;
    std::vector<Vec3f> small(faces * w * h);
    for (std::size_t face = 0; face < faces; ++face)
        for (std::size_t y = 0; y < h; ++y)
            for (std::size_t x = 0; x < w; ++x) {
                const Vec3f* first = &pixels[(face * height + 2 * y) * width + 2 * x];
                small[(face * h + y) * w + x] = 0.25f * (first[0] + first[1] + first[width] + first[width + 1]);
            }
    pixels = std::move(small);
    width = w;
    height = h;
}

int EnvironmentLight::firstRow(int level) {
    int row = 0;
    for (int i = 0; i < level; ++i) row += kSides[static_cast<std::size_t>(i)] + 2;
    return row;
}

Vec3d EnvironmentLight::directionOf(int level, int x, int y) {
    const double side = kSides[static_cast<std::size_t>(level)];
    return octahedral((x + 0.5) / side, (y + 0.5) / side);
}

Expected<void> EnvironmentLight::check(const Image& image) {
    const auto bad = [](std::string why) {
        return fail(ErrorCode::kBadInput, "the surroundings' image " + std::move(why));
    };
    if (!image.pixels.resident()) return bad("is not here");
    const Expected<void> sound = checkImage(image);
    if (!sound) return bad(fmt::format("of {} × {} pixels: {}", image.widthPx, image.heightPx, sound.error().message));
    if (image.pixels.sizeBytes() == 0)
        return bad(fmt::format("of {} × {} pixels has 0 bytes", image.widthPx, image.heightPx));
    constexpr std::int64_t kMostWithoutMipmaps = 8192;
    if (isCompressed(image.encoding) && levelsOf(image).back().widthPx > kMostWithoutMipmaps)
        return bad(fmt::format("of {} × {} pixels is compressed and has no mipmap of {} pixels or less", image.widthPx,
                               image.heightPx, kMostWithoutMipmaps));
    if (image.shape == Image::kCube) return {};
    if (image.shape != Image::kFlat) return bad("is neither flat nor a cube");
    if (image.widthPx < 2) return bad(fmt::format("of {} × {} pixels is too small", image.widthPx, image.heightPx));
    if (std::abs(image.widthPx - 2 * image.heightPx) > image.heightPx / 8)
        return bad(fmt::format("of {} × {} pixels is not about twice as wide as high", image.widthPx, image.heightPx));
    return {};
}

Expected<EnvironmentLight> EnvironmentLight::of(const Image& image) {
    if (Expected<void> sound = check(image); !sound) return tl::unexpected(sound.error());
    if (isCompressed(image.encoding)) return fail(ErrorCode::kBadInput, "the surroundings' image is compressed");
    return of(pictureOf(image));
}

EnvironmentLight EnvironmentLight::of(const SurroundingsPicture& picture) {
    EnvironmentLight light;
    light.atlas_.assign(static_cast<std::size_t>(kAtlasWidth) * kAtlasHeight * 4, 0.0f);
    light.buildTree(picture);
    light.project();
    for (int level = 0; level < kLevels; ++level) light.filter(level);
    return light;
}

void EnvironmentLight::buildTree(const SurroundingsPicture& picture) {
    constexpr int kSide = kSides[0];
    const auto index = [](int side, int x, int y) {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(side) + static_cast<std::size_t>(x);
    };
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
                for (const double dy : {0.25, 0.75}) mean += 0.25 * picture.at(at(dx, dy));
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
    // Basis functions without their constants; those, squared, and the cosine's (1, 2/3, 1/4) are multiplied in at the
    // end.
    std::array<Vec3d, 9> sums;
    sums.fill(Vec3d::Zero());
    const auto basis = [](const Vec3d& d) {
        return std::array<double, 9>{1,
                                     d.y(),
                                     d.z(),
                                     d.x(),
                                     d.x() * d.y(),
                                     d.y() * d.z(),
                                     3 * d.z() * d.z() - 1,
                                     d.x() * d.z(),
                                     d.x() * d.x() - d.y() * d.y()};
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
                const Node& node = tree_.back()[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) +
                                                static_cast<std::size_t>(x)];
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
        if (level + 1 < levels &&
            (level < 4 || size > kFineness * (2 * alpha + away) || (nl < size && nl > -size && size > 0.05))) {
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
    float* texel = &atlas_[4 * (static_cast<std::size_t>(firstRow(level) + 1 + y) * kAtlasWidth +
                                static_cast<std::size_t>(1 + x))];
    for (int c = 0; c < 3; ++c) texel[c] = static_cast<float>(value[c]);
    texel[3] = 1;
}

Vec3d EnvironmentLight::reflected(int level, int x, int y) const {
    const float* texel = &atlas_[4 * (static_cast<std::size_t>(firstRow(level) + 1 + y) * kAtlasWidth +
                                      static_cast<std::size_t>(1 + x))];
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

}  // namespace tessera
