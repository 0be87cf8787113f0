#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/confine/Confinement.h"
#include "server/import/reader/GltfReader.h"

namespace tessera {
namespace {

/// What Tessera calls a property that glTF animates; empty: it has none such.
std::string fieldOfPath(const std::string& path) {
    if (path == "translation" || path == "rotation" || path == "scale" || path == "weights") return path;
    return {};
}

/// Of all channels, which may share them: who plays them looks at each. A key has bytes of its own in most files.
constexpr std::uint64_t kFreeKeys = 20'000'000, kKeysPerByte = 1;

}  // namespace

std::uint32_t GltfReader::keyOf(int node) {
    return static_cast<std::uint32_t>(node) + 1;
}

bool GltfReader::hasRoomForKeys(const tinygltf::Animation& animation, int number, std::size_t channels) {
    if (number < 0 || static_cast<std::size_t>(number) >= animation.samplers.size()) return true;  // refused
    const tinygltf::AnimationSampler& source = animation.samplers[static_cast<std::size_t>(number)];
    const std::uint64_t keys =
        channels * std::uint64_t{std::max(accessors_.count(source.input), accessors_.count(source.output))};
    const std::uint64_t most = kFreeKeys + kKeysPerByte * bytesGranted();
    if (keys > most - std::min(most, keys_)) {
        ++channelsBeyond_;
        return false;
    }
    keys_ += keys;
    return true;
}

Expected<GltfReader::Sampled> GltfReader::sampler(const tinygltf::Animation& animation, int number,
                                                  const std::string& path, std::size_t components) {
    if (number < 0 || static_cast<std::size_t>(number) >= animation.samplers.size())
        return fail(ErrorCode::kBadInput, fmt::format("animation sampler {} does not exist", number));
    const tinygltf::AnimationSampler& source = animation.samplers[static_cast<std::size_t>(number)];
    const auto senseless = [&] {
        return fail(ErrorCode::kBadInput, fmt::format("animation sampler {} has keys that make no sense", number));
    };
    Sampled sampled;
    sampled.interpolation = source.interpolation == "STEP"          ? proto::scene::Channel::STEP
                            : source.interpolation == "CUBICSPLINE" ? proto::scene::Channel::SPLINE
                                                                    : proto::scene::Channel::LINEAR;
    const std::size_t parts = sampled.interpolation == proto::scene::Channel::SPLINE ? 3 : 1;
    const Expected<std::vector<float>> times = accessors_.floats(source.input, 1);
    if (!times) return tl::unexpected(times.error());
    const bool scalars = path == "weights";  // an element per target
    Expected<std::vector<float>> values = accessors_.floats(source.output, scalars ? 1 : static_cast<int>(components));
    if (!values) return tl::unexpected(values.error());
    const bool ascending =
        std::adjacent_find(times->begin(), times->end(), [](float a, float b) { return !(a < b); }) == times->end();
    const bool finite = std::all_of(values->begin(), values->end(), [](float v) { return std::isfinite(v); });
    if (times->empty() || times->size() > kMaxKeysPerChannel || times->size() * parts * components != values->size() ||
        !ascending || !finite || !(times->front() >= 0.0f) || !(times->back() <= 1e9f))
        return senseless();
    std::vector<double> numbers(values->begin(), values->end());
    if (path == "rotation") {
        for (std::size_t i = 0; i < numbers.size(); i += 4) {
            std::rotate(numbers.begin() + static_cast<std::ptrdiff_t>(i),
                        numbers.begin() + static_cast<std::ptrdiff_t>(i) + 3,
                        numbers.begin() + static_cast<std::ptrdiff_t>(i) + 4);
            const bool tangent = parts == 3 && i / 4 % 3 != 1;
            if (!tangent) mendRotationKey(scene_, std::span<double, 4>(&numbers[i], 4));
        }
    }
    std::uint32_t& timesBlob = keyTimes_[source.input];
    if (timesBlob == 0) timesBlob = scene_.addBlob(bytesOfNumbers(std::vector<double>(times->begin(), times->end())));
    sampled.times = timesBlob;
    std::uint32_t& valuesBlob = keyValues_[{source.output, path}];
    if (valuesBlob == 0) valuesBlob = scene_.addBlob(bytesOfNumbers(numbers));
    sampled.values = valuesBlob;
    return sampled;
}

void GltfReader::findAnimated() {
    for (const tinygltf::Animation& animation : model_.animations)
        for (const tinygltf::AnimationChannel& channel : animation.channels)
            if (channel.target_node >= 0 && channel.target_path != "weights" &&
                static_cast<std::size_t>(channel.target_node) < model_.nodes.size() &&
                model_.nodes[static_cast<std::size_t>(channel.target_node)].matrix.empty())
                animated_.insert(channel.target_node);
}

Expected<void> GltfReader::addAnimation(const tinygltf::Animation& source, std::size_t number) {
    proto::scene::Animation animation;
    std::set<std::pair<std::uint32_t, std::string>> driven;
    for (const tinygltf::AnimationChannel& channel : source.channels) {
        if (channel.target_node >= 0 && world_.count(channel.target_node) == 0) {
            scene_.note("animations of nodes that are not in the scene are left out");
            continue;
        }
        const std::string field = fieldOfPath(channel.target_path);
        if (channel.target_node < 0 || field.empty()) {
            scene_.note(fmt::format("animated {} are left out", channel.target_path));
            continue;
        }
        const bool weights = field == "weights";
        if (!weights && animated_.count(channel.target_node) == 0) {
            scene_.note(fmt::format("the animation of {} is left out: its transform is a matrix",
                                    nodeName(channel.target_node)));
            continue;
        }
        std::vector<std::uint32_t> targets = {keyOf(channel.target_node)};
        std::size_t components = field == "rotation" ? 4 : 3;
        if (weights) {
            const auto parts = morphed_.find(channel.target_node);
            if (parts == morphed_.end()) {
                scene_.note("animated weights of meshes without morph targets are left out");
                continue;
            }
            targets = parts->second.keys;
            components = parts->second.targets;
        }
        if (!hasRoomForKeys(source, channel.sampler, targets.size())) continue;
        const Expected<Sampled> sampled = sampler(source, channel.sampler, field, components);
        if (!sampled) return tl::unexpected(sampled.error());
        for (const std::uint32_t target : targets) {
            if (!driven.insert({target, field}).second) {
                scene_.note(fmt::format("an animation drives the {} of {} twice: the first is played",
                                        channel.target_path, nodeName(channel.target_node)));
                continue;
            }
            proto::scene::Channel& message = *animation.add_channel();
            message.set_target_key(target);
            message.set_field(field);
            message.set_times_blob(sampled->times);
            message.set_values_blob(sampled->values);
            message.set_interpolation(sampled->interpolation);
        }
    }
    animations_.add(source.name.empty() ? fmt::format("animation {}", number) : source.name, std::move(animation));
    return {};
}

Expected<void> GltfReader::addAnimations() {
    for (std::size_t i = 0; i < model_.animations.size(); ++i)
        if (Expected<void> added = addAnimation(model_.animations[i], i); !added) return added;
    if (channelsBeyond_ > 0)
        scene_.note(
            fmt::format("its animations have more than {} keys where each counts as often as it is shared, too "
                        "many for {} bytes: {} channels left out (fewer of them, or with fewer keys)",
                        kFreeKeys + kKeysPerByte * bytesGranted(), bytesGranted(), channelsBeyond_));
    animations_.finish();
    return {};
}

}  // namespace tessera
