#include "client/render/scene/LineWidths.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "client/render/scene/SceneItems.h"

namespace tessera {
namespace {

/// Evenly spread, and in no step that a mesh may be made in.
std::uint64_t sampleAt(std::uint64_t sample, std::uint64_t samples, std::uint64_t all) {
    const std::uint64_t from = sample * all / samples, to = (sample + 1) * all / samples;
    std::uint64_t mixed = sample * 0x9e3779b97f4a7c15ull;
    mixed ^= mixed >> 29u;
    return from + mixed % std::max<std::uint64_t>(1, to - from);
}

struct Ends {
    Vec3d from, to;
};

class SampledLines {
public:
    SampledLines(const RenderMesh& mesh, LineSource source)
        : positions_(mesh.arrays().positions.as<float>()),
          numbers_((source == LineSource::kLines ? mesh.arrays().lines : mesh.arrays().indices).as<std::uint32_t>()),
          source_(source) {}
    /// Of what is sampled: lines, or corners of triangles.
    [[nodiscard]] std::uint64_t count() const {
        return source_ == LineSource::kStreaks ? positions_.size() / 6
               : source_ == LineSource::kLines ? numbers_.size() / 2
                                               : numbers_.size();
    }
    [[nodiscard]] Ends at(std::uint64_t i) const {
        switch (source_) {
            case LineSource::kStreaks:
                return {vertex(2 * i), vertex(2 * i + 1)};
            case LineSource::kLines:
                return {vertex(numbers_[2 * i]), vertex(numbers_[2 * i + 1])};
            case LineSource::kEdges:
                return {vertex(numbers_[i]), vertex(numbers_[i % 3 == 2 ? i - 2 : i + 1])};
            case LineSource::kCorners:
                break;
        }
        return {vertex(numbers_[i]), vertex(numbers_[i])};
    }

private:
    [[nodiscard]] Vec3d vertex(std::uint64_t v) const {
        return Eigen::Map<const Vec3f>(positions_.data() + 3 * v).cast<double>();
    }
    std::span<const float> positions_;
    std::span<const std::uint32_t> numbers_;
    LineSource source_;
};

/// The length of what is seen of it, within the screen and half a width around it; nothing: none of it.
std::optional<double> seenLength(const Mat4d& clip_T_item, double nearest, const ScreenCamera& camera, double widthPx,
                                 const Ends& ends) {
    Vec4d a = clip_T_item * ends.from.homogeneous(), b = clip_T_item * ends.to.homogeneous();
    // Up to the near plane, as it is drawn.
    const double beyondA = a.w() - nearest, beyondB = b.w() - nearest;
    if (!(beyondA >= 0) && !(beyondB >= 0)) return std::nullopt;
    if (beyondA < 0 || beyondB < 0)
        (beyondA < 0 ? a : b) = a * (beyondB / (beyondB - beyondA)) - b * (beyondA / (beyondB - beyondA));
    const std::array<double, 2> halfSize{0.5 * camera.pixels.width, 0.5 * camera.pixels.height};
    std::array<double, 2> from{}, along{};
    double begin = 0, end = 1;
    for (int i = 0; i < 2; ++i) {
        const auto k = static_cast<std::size_t>(i);
        from[k] = halfSize[k] * a[i] / a.w();
        along[k] = halfSize[k] * b[i] / b.w() - from[k];
        const double most = halfSize[k] + 0.5 * widthPx;
        if (along[k] == 0) {
            if (!(std::abs(from[k]) <= most)) return std::nullopt;
            continue;
        }
        const double low = (-most - from[k]) / along[k], high = (most - from[k]) / along[k];
        begin = std::max(begin, std::min(low, high));
        end = std::min(end, std::max(low, high));
    }
    if (!(begin <= end)) return std::nullopt;
    return (end - begin) * std::sqrt(along[0] * along[0] + along[1] * along[1]);
}

LineSource sourceOf(const SceneItem& item) {
    if (item.kind == MeshKind::kStreaks) return LineSource::kStreaks;
    if (item.mesh->kind() == MeshKind::kLines) return LineSource::kLines;
    return item.cornersAlone ? LineSource::kCorners : LineSource::kEdges;
}

/// As many times as one opaque line of its own it costs.
double layersOf(const SceneItem& item) {
    return item.lineLayers * (item.transparent || item.over ? kBlendedLine : 1.0);
}

}  // namespace

double LinesOnScreen::widthThatCovers(double pixels) const {
    // So that nothing is rounded away where one term is far greater.
    const double root = std::sqrt(length * length + 4 * count * pixels);
    return root + length > 0 ? 2 * pixels / (root + length) : pixels;
}

std::uint64_t linesOf(const RenderMesh& mesh, LineSource source) {
    switch (source) {
        case LineSource::kStreaks:
            return mesh.triangles / 2;
        case LineSource::kLines:
            return mesh.lines;
        case LineSource::kEdges:
            return mesh.triangles + mesh.triangles / 2;
        case LineSource::kCorners:
            break;
    }
    return std::min<std::uint64_t>(mesh.arrays().positions.sizeBytes() / (3 * sizeof(float)), mesh.triangles / 2 + 2);
}

LinesOnScreen linesOnScreen(const RenderMesh& mesh, LineSource source, const Affine3d& world_T_item,
                            const ScreenCamera& camera, double widthPx, std::uint64_t samples) {
    const SampledLines lines(mesh, source);
    const std::uint64_t all = lines.count();
    samples = std::min(samples, all);
    LinesOnScreen seen;
    if (samples == 0) return seen;
    const Mat4d clip_T_item = camera.clip_T_eye * (camera.eye_T_world * world_T_item).matrix();
    const double nearest = camera.clip_T_eye(2, 3) / (camera.clip_T_eye(2, 2) - 1);
    for (std::uint64_t i = 0; i < samples; ++i) {
        const std::optional<double> length =
            seenLength(clip_T_item, nearest, camera, widthPx, lines.at(sampleAt(i, samples, all)));
        if (!length) continue;
        seen.length += *length;
        ++seen.count;
    }
    const double each = static_cast<double>(linesOf(mesh, source)) / static_cast<double>(samples);
    seen.length *= each;
    seen.count *= each;
    return seen;
}

// Almost always the first look is all: even if each line went across the whole screen there would not be too much.
void RenderScene::Impl::narrowFor(const ScreenCamera& camera) {
    if (narrowedAt_ == version && drawAlike(camera, narrowedFrom_)) return;
    narrowedAt_ = version;
    narrowedFrom_ = camera;
    narrowed = {};
    const double across = std::sqrt(static_cast<double>(camera.pixels.width) * camera.pixels.width +
                                    static_cast<double>(camera.pixels.height) * camera.pixels.height);
    double atMost = 0, lines = 0;
    for (const std::uint32_t index : wideLines) {
        SceneItem& item = items[index];
        item.widestLinePx = DrawItem::kAnyWidth;
        const double width = static_cast<double>(item.lineWidth),
                     count = static_cast<double>(linesOf(*item.mesh, sourceOf(item))) * layersOf(item);
        atMost += count * width * (width + across);
        lines += count;
    }
    if (atMost <= kMostLinePixels) return;

    struct Covering {
        std::uint32_t item;
        LinesOnScreen seen;
        double pixels;
    };
    std::vector<Covering> covering;
    double together = 0;
    const PixelRect whole{.x = 0, .y = 0, .width = camera.pixels.width, .height = camera.pixels.height};
    const Frustum frustum = tileFrustum(camera, whole, kFrustumMarginPx + widestLineReachPx());
    for (const std::uint32_t index : wideLines) {
        const SceneItem& item = items[index];
        if (boxes[index].empty() || frustum.classify(boxes[index]).outside) continue;
        const LineSource source = sourceOf(item);
        const double width = static_cast<double>(item.lineWidth),
                     share = static_cast<double>(linesOf(*item.mesh, source)) / lines;
        const auto samples = static_cast<std::uint64_t>(
            std::clamp(share * static_cast<double>(kMostSampledLines), 4.0, static_cast<double>(kMostSampledOfMesh)));
        LinesOnScreen seen = linesOnScreen(*item.mesh, source, item.world_T_item, camera, width, samples);
        seen.length *= layersOf(item);
        seen.count *= layersOf(item);
        covering.push_back({index, seen, seen.covered(width)});
        together += covering.back().pixels;
    }
    if (!(together > kMostLinePixels)) return;

    // All have what the least of them cover, as long as there is so much for each.
    std::ranges::sort(covering, [&](const Covering& a, const Covering& b) {
        return a.pixels != b.pixels ? a.pixels < b.pixels : items[a.item].node < items[b.item].node;
    });
    double left = kMostLinePixels;
    std::size_t kept = 0;
    while (kept + 1 < covering.size() && covering[kept].pixels <= left / static_cast<double>(covering.size() - kept))
        left -= covering[kept++].pixels;
    const double each = left / static_cast<double>(covering.size() - kept);
    for (std::size_t i = kept; i < covering.size(); ++i) {
        SceneItem& item = items[covering[i].item];
        const double width = std::max(1.0, covering[i].seen.widthThatCovers(each));
        if (!(width < static_cast<double>(item.lineWidth))) continue;
        item.widestLinePx = static_cast<float>(width);
        ++narrowed.items;
        narrowed.node = item.node;
        narrowed.wantedPx = item.lineWidth;
        narrowed.drawnPx = item.widestLinePx;
    }
    narrowed.wantedPixels = together;
}

}  // namespace tessera
