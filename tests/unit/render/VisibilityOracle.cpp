#include "tests/unit/render/VisibilityOracle.h"

#include <cmath>

namespace tessera {

namespace {

struct Sample {
    double depth = 0;  ///< greatest inverse depth so far
    std::vector<std::pair<double, ObjectId>> seen;
};

constexpr int kSamples = 20;

Vec2d sampleAt(int i) {
    constexpr double kMsaa[4][2] = {{0.375, 0.125}, {0.875, 0.375}, {0.125, 0.625}, {0.625, 0.875}};
    if (i < 4) return {kMsaa[i][0], kMsaa[i][1]};
    return {((i - 4) % 4 + 0.5) / 4, ((i - 4) / 4 + 0.5) / 4};
}

struct Corner {
    double x, y, depth;
};

}  // namespace

std::set<ObjectId> visibleNodes(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                                const PixelRect& tile) {
    std::vector<Sample> samples(static_cast<std::size_t>(tile.width) * static_cast<std::size_t>(tile.height) *
                                kSamples);
    const double nearW = camera.clip_T_eye(2, 3) / (camera.clip_T_eye(2, 2) - 1);
    const auto addItem = [&](const DrawItem& item, bool writesDepth) {
        const auto& geometry = *aspect.get<Geometry>(item.geometry);
        const auto* material = aspect.get<Material>(item.material);
        const bool doubleSided = material && material->doubleSided != 0;
        const auto positions = geometry.positions.as<float>();
        const auto indices = geometry.indices.as<std::uint32_t>();
        const Mat4d clip = camera.clip_T_eye * camera.eye_T_world.matrix() * item.world_T_item.matrix();
        for (std::size_t t = 0; t + 2 < indices.size(); t += 3) {
            Vec4d c[3];
            for (std::size_t i = 0; i < 3; ++i) {
                const float* p = &positions[3 * indices[t + i]];
                c[i] = clip * Vec4d(p[0], p[1], p[2], 1);
            }
            std::vector<Corner> polygon;
            const auto push = [&](const Vec4d& v) {
                polygon.push_back({(v.x() / v.w() + 1) / 2 * camera.pixels.width - tile.x,
                                   (v.y() / v.w() + 1) / 2 * camera.pixels.height - tile.y, 1 / v.w()});
            };
            for (int i = 0; i < 3; ++i) {
                const Vec4d& a = c[i];
                const Vec4d& b = c[(i + 1) % 3];
                if (a.w() >= nearW) push(a);
                if ((a.w() >= nearW) != (b.w() >= nearW)) push(a + (b - a) * ((nearW - a.w()) / (b.w() - a.w())));
            }
            if (polygon.size() < 3) continue;
            double area = 0;
            double best = 0;
            double gx = 0;
            double gy = 0;
            const Corner& o = polygon[0];
            for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
                const Corner& p = polygon[i];
                const Corner& q = polygon[i + 1];
                const double part = (p.x - o.x) * (q.y - o.y) - (p.y - o.y) * (q.x - o.x);
                area += part;
                if (std::abs(part) <= best) continue;
                best = std::abs(part);
                gx = ((p.depth - o.depth) * (q.y - o.y) - (q.depth - o.depth) * (p.y - o.y)) / part;
                gy = ((q.depth - o.depth) * (p.x - o.x) - (p.depth - o.depth) * (q.x - o.x)) / part;
            }
            const double facing = item.mirrored ? -area : area;
            if (area == 0 || (facing < 0 && !doubleSided)) continue;
            double box[4] = {1e9, 1e9, -1e9, -1e9};
            for (const Corner& p : polygon) {
                box[0] = std::min(box[0], p.x);
                box[1] = std::min(box[1], p.y);
                box[2] = std::max(box[2], p.x);
                box[3] = std::max(box[3], p.y);
            }
            const int x0 = static_cast<int>(std::clamp(std::floor(box[0]), 0.0, tile.width - 1.0));
            const int x1 = static_cast<int>(std::clamp(std::floor(box[2]), 0.0, tile.width - 1.0));
            const int y0 = static_cast<int>(std::clamp(std::floor(box[1]), 0.0, tile.height - 1.0));
            const int y1 = static_cast<int>(std::clamp(std::floor(box[3]), 0.0, tile.height - 1.0));
            for (int y = y0; y <= y1; ++y) {
                for (int x = x0; x <= x1; ++x) {
                    for (int s = 0; s < kSamples; ++s) {
                        const Vec2d at = Vec2d(x, y) + sampleAt(s);
                        bool inside = true;
                        for (std::size_t i = 0; i < polygon.size() && inside; ++i) {
                            const Corner& p = polygon[i];
                            const Corner& q = polygon[(i + 1) % polygon.size()];
                            const double side = (q.x - p.x) * (at.y() - p.y) - (q.y - p.y) * (at.x() - p.x);
                            inside = area > 0 ? side >= 0 : side <= 0;
                        }
                        if (!inside) continue;
                        const double depth = o.depth + gx * (at.x() - o.x) + gy * (at.y() - o.y);
                        Sample& sample = samples[(static_cast<std::size_t>(y) * static_cast<std::size_t>(tile.width) +
                                                  static_cast<std::size_t>(x)) *
                                                     kSamples +
                                                 static_cast<std::size_t>(s)];
                        if (depth < sample.depth * (1 - 1e-6)) continue;
                        if (writesDepth && depth > sample.depth) {
                            sample.depth = depth;
                            std::erase_if(sample.seen, [&](const auto& e) { return e.first < depth * (1 - 1e-6); });
                        }
                        if (sample.seen.empty() || sample.seen.back().second != item.node ||
                            sample.seen.back().first < depth)
                            sample.seen.emplace_back(depth, item.node);
                    }
                }
            }
        }
    };
    for (const DrawItem& item : list.opaque) addItem(item, true);
    for (const DrawItem& item : list.transparent) addItem(item, false);
    std::set<ObjectId> result;
    for (const Sample& sample : samples)
        for (const auto& [depth, node] : sample.seen) result.insert(node);
    return result;
}

}  // namespace tessera
