#include "tests/unit/render/DepthFake.h"

#include <algorithm>
#include <cmath>

#include "common/cores/Geometry.h"

namespace tessera {

namespace {

Vec2d placeOfSample(int i) {
    constexpr double kMsaa[4][2] = {{0.375, 0.125}, {0.875, 0.375}, {0.125, 0.625}, {0.625, 0.875}};
    if (i < 4) return {kMsaa[i][0], kMsaa[i][1]};
    return {((i - 4) % 4 + 0.5) / 4, ((i - 4) / 4 + 0.5) / 4};
}

}  // namespace

std::vector<VisibilityDevice::Part> DepthFake::partsOf(const ScreenCamera& screen, const PixelRect& rect) const {
    std::vector<Part> parts;
    for (int x = rect.x; x < rect.x + rect.width; x += partPx_)
        parts.push_back({screen, {x, rect.y, std::min(partPx_, rect.x + rect.width - x), rect.height}});
    return parts;
}

Expected<void> DepthFake::call() {
    if (callsLeft && (*callsLeft)-- == 0) return fail(ErrorCode::kFailed, "the fake has given up");
    return {};
}

Expected<void> DepthFake::begin(const Part& part) {
    part_ = part;
    answers_.clear();
    depths_.assign(
        static_cast<std::size_t>(part.pixels.width) * static_cast<std::size_t>(part.pixels.height) * kSamples, 0);
    return call();
}

void DepthFake::draw(const DrawItem& item) {
    const auto* geometry = aspect_.get<Geometry>(item.geometry);
    const auto* material = aspect_.get<Material>(item.material);
    const bool doubleSided = material && material->doubleSided;
    const auto positions = geometry->positions.as<float>();
    const auto indices = geometry->indices.as<std::uint32_t>();
    const ScreenCamera& camera = part_.camera;
    const Mat4d clip = camera.clip_T_eye * camera.eye_T_world.matrix() * item.world_T_item.matrix();
    const double nearW = camera.clip_T_eye(2, 3) / (camera.clip_T_eye(2, 2) - 1);
    for (std::size_t t = 0; t + 2 < indices.size(); t += 3) {
        std::vector<Vec4d> corners;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto at = [&](std::size_t k) {
                const float* p = &positions[3 * indices[t + k % 3]];
                return Vec4d(clip * Vec4d(p[0], p[1], p[2], 1));
            };
            const Vec4d a = at(i), b = at(i + 1);
            if (a.w() >= nearW) corners.push_back(a);
            if ((a.w() >= nearW) != (b.w() >= nearW))
                corners.push_back(a + (b - a) * ((nearW - a.w()) / (b.w() - a.w())));
        }
        // Each triangle of the fan by itself: x, y in pixels of the part, and depth from 1 to 0.
        const auto onScreen = [&](const Vec4d& c) {
            return Vec3d((c.x() / c.w() + 1) / 2 * camera.pixels.width - part_.pixels.x,
                         (c.y() / c.w() + 1) / 2 * camera.pixels.height - part_.pixels.y, (1 - c.z() / c.w()) / 2);
        };
        for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
            const Vec3d o = onScreen(corners[0]), p = onScreen(corners[i]), q = onScreen(corners[i + 1]);
            const auto area = [](const Vec3d& a, const Vec3d& b, double x, double y) {
                return (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
            };
            const double whole = area(o, p, q.x(), q.y());
            if (whole == 0 || ((item.mirrored ? -whole : whole) < 0 && !doubleSided)) continue;
            const auto pixel = [](double value, int size) {
                return static_cast<int>(std::clamp(value, 0.0, size - 1.0));
            };
            const int width = part_.pixels.width, height = part_.pixels.height;
            for (int y = pixel(std::min({o.y(), p.y(), q.y()}), height);
                 y <= pixel(std::max({o.y(), p.y(), q.y()}), height); ++y) {
                for (int x = pixel(std::min({o.x(), p.x(), q.x()}), width);
                     x <= pixel(std::max({o.x(), p.x(), q.x()}), width); ++x) {
                    for (int s = 0; s < kSamples; ++s) {
                        const Vec2d at = Vec2d(x, y) + placeOfSample(s);
                        const double a = area(p, q, at.x(), at.y()) / whole, b = area(q, o, at.x(), at.y()) / whole;
                        const double c = 1 - a - b;
                        if (a < 0 || b < 0 || c < 0) continue;
                        float& depth = depths_[(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                                static_cast<std::size_t>(x)) *
                                                   kSamples +
                                               static_cast<std::size_t>(s)];
                        depth = std::max(depth, static_cast<float>(a * o.z() + b * p.z() + c * q.z()));
                    }
                }
            }
        }
    }
}

Expected<void> DepthFake::drawDepth(std::span<const DrawItem> items) {
    for (const DrawItem& item : items) draw(item);
    return call();
}

Expected<VisibilityDevice::Ticket> DepthFake::ask(std::span<const Plate> plates, std::span<const std::uint32_t> sizes) {
    const auto first = static_cast<Ticket>(answers_.size());
    std::size_t next = 0;
    for (const std::uint32_t size : sizes) {
        bool shows = false;
        for (const Plate& plate : plates.subspan(next, size)) {
            for (int y = plate.bottom; y < plate.top && !shows; ++y)
                for (int x = plate.left; x < plate.right && !shows; ++x)
                    for (std::size_t s = 0; s < kSamples && !shows; ++s)
                        shows = depths_[(static_cast<std::size_t>(y) * static_cast<std::size_t>(part_.pixels.width) +
                                         static_cast<std::size_t>(x)) *
                                            kSamples +
                                        s] <= plate.depth;
        }
        next += size;
        answers_.push_back(shows);
    }
    if (auto good = call(); !good) return tl::unexpected(good.error());
    return first;
}

Expected<bool> DepthFake::answer(Ticket ticket) {
    if (auto good = call(); !good) return tl::unexpected(good.error());
    return answers_.at(ticket);
}

Expected<std::span<const float>> DepthFake::farthest() {
    if (auto good = call(); !good) return tl::unexpected(good.error());
    farthest_.clear();
    for (std::size_t i = 0; i < depths_.size(); i += kSamples)
        farthest_.push_back(*std::min_element(depths_.begin() + static_cast<std::ptrdiff_t>(i),
                                              depths_.begin() + static_cast<std::ptrdiff_t>(i + kSamples)));
    return std::span<const float>(farthest_);
}

}  // namespace tessera
