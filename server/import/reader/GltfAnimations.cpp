#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server/import/reader/GltfReader.h"

namespace tessera {
namespace {

constexpr std::size_t kMaxKeysPerNode = 100'000;
/// Cubic splines become straight pieces of this length.
constexpr double kCurveStepSeconds = 1.0 / 30.0;

/// One animated property of one node.
struct Track {
    std::vector<float> times;
    std::vector<float> values;
    int width = 3;  ///< 3, or 4 for rotations
    enum class Kind { kLinear, kStep, kCubic } kind = Kind::kLinear;

    [[nodiscard]] Vec4d key(std::size_t index, std::size_t part) const {
        const std::size_t parts = kind == Kind::kCubic ? 3 : 1;
        Vec4d value = Vec4d::Zero();
        for (int c = 0; c < width; ++c)
            value[c] = static_cast<double>(
                values[(index * parts + part) * static_cast<std::size_t>(width) + static_cast<std::size_t>(c)]);
        return value;
    }

    /// glTF 2.0, appendix C, "Interpolation Algorithms".
    [[nodiscard]] Vec4d at(double time) const {
        const std::size_t middle = kind == Kind::kCubic ? 1 : 0;
        const auto after = std::upper_bound(times.begin(), times.end(), static_cast<float>(time));
        if (after == times.begin()) return key(0, middle);
        const auto i = static_cast<std::size_t>(after - times.begin()) - 1;
        if (after == times.end() || kind == Kind::kStep) return key(i, middle);
        const double span = static_cast<double>(times[i + 1]) - static_cast<double>(times[i]);
        const double t = (time - static_cast<double>(times[i])) / span;
        if (kind == Kind::kCubic) {
            const double t2 = t * t, t3 = t2 * t;
            return (2 * t3 - 3 * t2 + 1) * key(i, 1) + span * (t3 - 2 * t2 + t) * key(i, 2) +
                   (-2 * t3 + 3 * t2) * key(i + 1, 1) + span * (t3 - t2) * key(i + 1, 0);
        }
        if (width == 3) return (1 - t) * key(i, 0) + t * key(i + 1, 0);
        const Vec4d a = key(i, 0), b = key(i + 1, 0);
        const Quatd from = Quatd(a[3], a[0], a[1], a[2]).normalized(), to = Quatd(b[3], b[0], b[1], b[2]).normalized();
        return from.slerp(t, to).coeffs();
    }
};

struct NodeTracks {
    const Track* translation = nullptr;
    const Track* rotation = nullptr;
    const Track* scale = nullptr;
};

/// The instants at which a motion of straight pieces must have keys.
std::vector<double> keyTimes(const NodeTracks& tracks) {
    std::vector<double> times;
    for (const Track* track : {tracks.translation, tracks.rotation, tracks.scale}) {
        if (track == nullptr) continue;
        for (std::size_t i = 0; i < track->times.size(); ++i) {
            const auto time = static_cast<double>(track->times[i]);
            if (i > 0) {
                const auto before = static_cast<double>(track->times[i - 1]);
                // A step is a very short straight piece.
                if (track->kind == Track::Kind::kStep) times.push_back(std::max(before, time - 1e-4));
                if (track->kind == Track::Kind::kCubic)
                    for (double t = before + kCurveStepSeconds; t < time && times.size() < kMaxKeysPerNode;
                         t += kCurveStepSeconds)
                        times.push_back(t);
            }
            times.push_back(time);
        }
    }
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end(), [](double a, double b) { return b - a < 1e-6; }), times.end());
    return times;
}

}  // namespace

Expected<void> GltfReader::readAnimation() {
    if (model_.animations.empty()) return {};
    if (model_.animations.size() > 1) scene_.note("of several animations, the first is played");
    const tinygltf::Animation& animation = model_.animations.front();
    std::vector<Track> tracks(animation.channels.size());
    std::map<int, NodeTracks> byNode;
    for (std::size_t i = 0; i < animation.channels.size(); ++i) {
        const tinygltf::AnimationChannel& channel = animation.channels[i];
        if (channel.sampler < 0 || static_cast<std::size_t>(channel.sampler) >= animation.samplers.size())
            return fail(ErrorCode::kBadInput, fmt::format("animation sampler {} does not exist", channel.sampler));
        if (world_.count(channel.target_node) == 0) continue;
        NodeTracks& node = byNode[channel.target_node];
        const Track** slot = channel.target_path == "translation" ? &node.translation
                             : channel.target_path == "rotation"  ? &node.rotation
                             : channel.target_path == "scale"     ? &node.scale
                                                                  : nullptr;
        if (slot == nullptr) {
            scene_.note(fmt::format("animated {} are left out", channel.target_path));
            continue;
        }
        const tinygltf::AnimationSampler& sampler = animation.samplers[static_cast<std::size_t>(channel.sampler)];
        Track& track = tracks[i];
        track.width = channel.target_path == "rotation" ? 4 : 3;
        track.kind = sampler.interpolation == "STEP"          ? Track::Kind::kStep
                     : sampler.interpolation == "CUBICSPLINE" ? Track::Kind::kCubic
                                                              : Track::Kind::kLinear;
        Expected<std::vector<float>> times = accessors_.floats(sampler.input, 1);
        if (!times) return tl::unexpected(times.error());
        Expected<std::vector<float>> values = accessors_.floats(sampler.output, track.width);
        if (!values) return tl::unexpected(values.error());
        const std::size_t perKey = static_cast<std::size_t>(track.width) * (track.kind == Track::Kind::kCubic ? 3 : 1);
        const bool ascending =
            std::adjacent_find(times->begin(), times->end(), [](float a, float b) { return !(a < b); }) == times->end();
        const bool finite = std::all_of(values->begin(), values->end(), [](float v) { return std::isfinite(v); });
        if (times->empty() || times->size() > kMaxKeysPerNode || times->size() * perKey != values->size() ||
            !ascending || !finite || !(times->front() >= 0.0f) || !std::isfinite(times->back()))
            return fail(ErrorCode::kBadInput,
                        fmt::format("animation sampler {} has keys that make no sense", channel.sampler));
        track.times = std::move(*times);
        track.values = std::move(*values);
        *slot = &track;
    }
    for (const auto& [index, node] : byNode) {
        const tinygltf::Node& target = model_.nodes[static_cast<std::size_t>(index)];
        const std::vector<double> times = keyTimes(node);
        if (times.empty()) continue;
        if (times.size() > 3 * kMaxKeysPerNode || !target.matrix.empty()) {
            scene_.note(fmt::format("the animation of {} is left out", nodeName(index)));
            continue;
        }
        const Affine3d rest = localTransform(target);
        const Vec3d restScale =
            target.scale.size() == 3 ? Vec3d(target.scale[0], target.scale[1], target.scale[2]) : Vec3d(Vec3d::Ones());
        Quatd restRotation = target.rotation.size() == 4
                                 ? Quatd(target.rotation[3], target.rotation[0], target.rotation[1], target.rotation[2])
                                 : Quatd::Identity();
        if (!(restRotation.norm() > 1e-12)) restRotation = Quatd::Identity();
        proto::scene::Motion& motion = motions_[index];
        motion.set_mode(proto::scene::Motion::LOOP);
        for (const double time : times) {
            proto::scene::Key* key = motion.add_key();
            key->set_time(time);
            Quatd rotation = restRotation.normalized();
            if (node.rotation != nullptr) {
                const Vec4d q = node.rotation->at(time);
                const Quatd sampled(q[3], q[0], q[1], q[2]);
                if (sampled.norm() > 1e-12) rotation = sampled.normalized();
            }
            const Vec3d translation =
                node.translation != nullptr ? Vec3d(node.translation->at(time).head<3>()) : Vec3d(rest.translation());
            const Vec3d scale = node.scale != nullptr ? Vec3d(node.scale->at(time).head<3>()) : restScale;
            setTransform(*key->mutable_transform(), translation, rotation, scale);
        }
    }
    return {};
}

}  // namespace tessera
