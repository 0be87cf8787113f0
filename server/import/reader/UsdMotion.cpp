// What moves in a stage: transforms over time, and what is seen when.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/math/Decompositions.h"
#include "server/import/reader/MovingParts.h"
#include "server/import/reader/UsdReader.h"

namespace tessera {
namespace {

constexpr std::int64_t kShowAll = -1, kShowNone = -2;  // common/cores/Switch.h

struct MovedParts {
    Vec3d translation, scale;
    Quatd rotation;
    bool sheared = false;
};

/// Translation, rotation and scale of a map; of one that shears those that are nearest.
MovedParts movedPartsOf(const Affine3d& map) {
    MovedParts parts{map.translation(), Vec3d::Ones(), Quatd::Identity()};
    const Mat3d linear = map.linear();
    parts.scale = linear.colwise().norm();
    const Mat3d gram = linear.transpose() * linear;
    const double most = parts.scale.maxCoeff() * parts.scale.maxCoeff();
    parts.sheared = std::max({std::abs(gram(0, 1)), std::abs(gram(0, 2)), std::abs(gram(1, 2))}) > 1e-6 * most;
    if (!(parts.scale.minCoeff() > 1e-12)) return parts;  // nothing is left that could be turned
    Mat3d rotation = linear * parts.scale.cwiseInverse().asDiagonal();
    if (rotation.determinant() < 0) {
        parts.scale.x() = -parts.scale.x();
        rotation.col(0) = -rotation.col(0);
    }
    if (parts.sheared) {
        const SingularValues values = singularValuesOf(rotation);
        rotation = values.u * values.v.transpose();
    }
    parts.rotation = Quatd(rotation).normalized();
    return parts;
}

}  // namespace

void UsdReader::addKeys(const UsdComposedPrim& prim, const UsdTransform& transform, const Affine3d& parent_T_above,
                        Node& node) {
    const UsdTransform::KeyTimes keys = transform.keyTimes(kMaxKeysPerChannel, keysBetween_);
    const std::vector<double>& times = keys.times;
    if (keys.cut) remarks_.add(fmt::format("motions of more than {} keys end there", kMaxKeysPerChannel), prim.path());
    if (keys.turnsLost)
        remarks_.add("turns that are too far between two samples for a file's keys go the shorter way", prim.path());
    std::vector<double> moves, turns, scales;
    bool sheared = false;
    Quatd before = Quatd::Identity();
    for (const double time : times) {
        MovedParts parts = movedPartsOf(parent_T_above * transform.at(time));
        sheared = sheared || parts.sheared;
        if (before.dot(parts.rotation) < 0) parts.rotation.coeffs() = -parts.rotation.coeffs();
        before = parts.rotation;
        moves.insert(moves.end(), parts.translation.begin(), parts.translation.end());
        turns.insert(turns.end(), {before.w(), before.x(), before.y(), before.z()});
        scales.insert(scales.end(), parts.scale.begin(), parts.scale.end());
    }
    if (sheared) remarks_.add("transforms that shear while they move are shown without that", prim.path());
    setTransform(*node.mutable_transform(), Vec3d(moves[0], moves[1], moves[2]),
                 Quatd(turns[0], turns[1], turns[2], turns[3]), Vec3d(scales[0], scales[1], scales[2]));
    node.set_key(++keys_);
    const auto varies = [&](const std::vector<double>& values, std::size_t each) {
        for (std::size_t i = each; i < values.size(); ++i)
            // What rounding does to it is no motion.
            if (std::abs(values[i] - values[i - each]) > 1e-9 * (1 + std::abs(values[i]))) return true;
        return false;
    };
    if (varies(moves, 3)) channels_.push_back({keys_, "translation", times, std::move(moves)});
    if (varies(turns, 4)) channels_.push_back({keys_, "rotation", times, std::move(turns)});
    if (varies(scales, 3)) channels_.push_back({keys_, "scale", times, std::move(scales)});
}

void UsdReader::addVisibility(const UsdComposedPrim& prim, const UsdAttribute& visibility, Node& node) {
    const auto shown = [](const UsdValuePtr& value) {
        return value->word() != nullptr && *value->word() == "invisible" ? kShowNone : kShowAll;
    };
    std::vector<double> times, values;
    for (const auto& [time, value] : visibility.samples) {
        times.push_back(time);
        values.push_back(static_cast<double>(shown(value)));
    }
    const bool changes = std::ranges::adjacent_find(values, std::not_equal_to()) != values.end();
    if (!changes && shown(visibility.value) == kShowAll) return;
    node.mutable_switch_()->set_choice(shown(visibility.value));
    if (!changes) return remarks_.add("invisible ones are there, behind a Switch that shows none", prim.path());
    if (inPrototype_) return remarks_.add("prototypes that come and go stay as they are first", prim.path());
    if (node.key() == 0) node.set_key(++keys_);
    channels_.push_back({node.key(), "choice", std::move(times), std::move(values), true});
}

void UsdReader::addAnimation() {
    if (channels_.empty()) return;
    const double rate = stage_.rootLayer().timeCodesPerSecond();
    double begin = channels_.front().times.front();
    for (const Channel& channel : channels_) begin = std::min(begin, channel.times.front());
    // It begins where the file says, unless something moves before.
    if (const UsdValue* said = stage_.metadata("startTimeCode"))
        if (const double start = said->number().value_or(begin); std::isfinite(start)) begin = std::min(begin, start);
    proto::scene::Animation animation;
    for (Channel& channel : channels_) {
        std::vector<double> times;
        bool sound = true;
        for (const double time : channel.times) {
            const double seconds = (time - begin) / rate;
            sound = sound && seconds <= 1e9 && (times.empty() || seconds > times.back());
            times.push_back(seconds);
        }
        if (!sound) {
            scene_.note("an animation whose times do not ascend, or beyond 1e9 s, is left out");
            continue;
        }
        proto::scene::Channel& message = *animation.add_channel();
        message.set_target_key(channel.key);
        message.set_field(channel.field);
        message.set_times_blob(scene_.addBlob(bytesOfNumbers(times)));
        message.set_values_blob(scene_.addBlob(bytesOfNumbers(channel.values)));
        message.set_interpolation(channel.steps ? proto::scene::Channel::STEP : proto::scene::Channel::LINEAR);
    }
    AnimationNodes nodes(scene_);
    nodes.add("animation", std::move(animation));
    nodes.finish();
}

}  // namespace tessera
