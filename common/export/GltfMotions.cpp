#include "common/export/GltfMotions.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "common/animation/KeyTrack.h"
#include "common/animation/MotionKeys.h"
#include "common/cores/ComponentTransform.h"
#include "common/cores/Skin.h"
#include "common/cores/Transform.h"
#include "common/export/LeavingMotions.h"

namespace tessera {

/// One animation as it grows: glTF wants each property of a node once.
class GltfMotions::Channels {
public:
    JsonArray samplers;

    bool add(int node, std::string_view path, int sampler) {
        if (!driven_.emplace(node, path).second) return false;
        JsonObject target, channel;
        target.number("node", node).text("path", path);
        list_.add(channel.number("sampler", sampler).json("target", target.done()).done());
        return true;
    }
    [[nodiscard]] bool has(int node, std::string_view path) const {
        return driven_.contains({node, std::string(path)});
    }
    [[nodiscard]] std::string done(std::string_view name) const {
        JsonObject animation;
        if (!name.empty()) animation.text("name", name);
        return animation.json("samplers", samplers.done()).json("channels", list_.done()).done();
    }
    [[nodiscard]] bool empty() const { return list_.size() == 0; }

private:
    JsonArray list_;
    std::set<std::pair<int, std::string>> driven_;
};

GltfMotions::GltfMotions(const Aspect& scene, const Selection& selection, const PlannedTree& tree, GltfParts& parts,
                         ExportNotes& notes)
    : scene_(scene), selection_(selection), tree_(tree), parts_(parts), notes_(notes) {
    for (std::size_t i = 0; i < selection.nodes.size(); ++i)
        if (selection.nodes[i].core && tree.moved[i] >= 0) bearers_[selection.nodes[i].node->core].push_back(i);
}

void GltfMotions::addAll() {
    for (const SelectedNode& node : selection_.nodes) {
        if (const auto* animation = node.core.as<Animation>()) add(node, *animation);
        if (const auto* motion = node.core.as<Motion>()) add(node, *motion);
    }
}

void GltfMotions::add(const SelectedNode& node, const Animation& animation) {
    Channels channels;
    for (const ObjectId id : animation.channels)
        if (const auto* keys = scene_.get<KeyFrames>(id)) addKeys(node, *keys, channels);
    if (channels.empty()) return;
    noteLostPlaying(Playing::of(scene_, animation), notes_, node.id);
    parts_.animations.add(channels.done(node.node->name));
}

void GltfMotions::addKeys(const SelectedNode& node, const KeyFrames& keys, Channels& channels) {
    const Object target = keys.target ? scene_.find(keys.target) : Object();
    const Expected<KeyTrack> sound = KeyTrack::of(keys, target ? &target.info() : nullptr);
    if (!sound) return noteUnsound(keys.values, node.id, notes_);
    const auto bearers = bearers_.find(keys.target);
    const bool weights = target.is<Skin>() && keys.field == "weights";
    const bool places = (target.is<Transform>() || target.is<ComponentTransform>()) &&
                        (keys.field == "translation" || keys.field == "rotation" || keys.field == "scale");
    if (!weights && !places)
        return notes_.add("animations of other fields than places and weights are left out", node.id);
    if (bearers == bearers_.end()) return notes_.add("animations of what is not in the file are left out", node.id);
    const std::span<const double> times = keys.times.as<double>(), values = keys.values.as<double>();
    if (places && !canLead(values, keys.field, node.id, notes_)) return;
    Track track{.times = {times.begin(), times.end()},
                .values = {values.begin(), values.end()},
                .interpolation = keys.interpolation};
    const std::size_t components = sound->numbers();
    // glTF begins at 0, and has no splines of one key.
    const bool isSpline = track.interpolation == KeyFrames::kSpline;
    if (times.back() < 0 || (times.size() == 1 && isSpline)) {
        track = Track{.times = {std::max(times.back(), 0.0)}, .values = sound->at(times.back())};
    } else if (times.front() < 0) {
        // What is before is left out, and 0 has a key.
        if (isSpline) return notes_.add("animations that begin before 0 s are left out", node.id);
        const auto first = std::ranges::lower_bound(times, 0.0) - times.begin();
        const std::vector<double> now = sound->at(0);
        track.times.erase(track.times.begin(), track.times.begin() + first);
        track.values.erase(track.values.begin(),
                           track.values.begin() + first * static_cast<std::ptrdiff_t>(components));
        if (track.times.front() > 0) {
            track.times.insert(track.times.begin(), 0.0);
            track.values.insert(track.values.begin(), now.begin(), now.end());
        }
    }
    if (const auto* component = target.as<ComponentTransform>()) {
        // See PlannedTree: translation + centre, rotation · scaleOrientation.
        const std::size_t parts = track.interpolation == KeyFrames::kSpline ? 3 : 1;
        const Quatd turn = component->scaleOrientation.normalized();
        for (std::size_t i = 0; i + components <= track.values.size(); i += components) {
            const bool tangent = parts == 3 && i / components % 3 != 1;
            double* value = &track.values[i];
            if (keys.field == "translation" && !tangent)
                for (int axis = 0; axis < 3; ++axis) value[axis] += component->center[axis];
            if (keys.field == "rotation") {
                const Quatd turned = Quatd(value[0], value[1], value[2], value[3]) * turn;
                value[0] = turned.w(), value[1] = turned.x(), value[2] = turned.y(), value[3] = turned.z();
            }
        }
    }
    std::optional<int> made;
    for (const std::size_t bearer : bearers->second) {
        const int at = tree_.moved[bearer];
        if (weights && !hasItsJoints(selection_.nodes[bearer], tree_, selection_)) continue;
        if (channels.has(at, keys.field)) continue;
        if (!made) made = sampler(track, keys.field, components, channels);
        channels.add(at, keys.field, *made);
    }
}

void GltfMotions::add(const SelectedNode& node, const Motion& motion) {
    const std::span<const double> keys = motion.keys.as<double>();
    const auto bearers = bearers_.find(motion.target);
    if (keys.empty() && !motion.target) return;
    if (!checkKeys(keys)) return noteUnsound(motion.keys, node.id, notes_);
    if (bearers == bearers_.end()) return notes_.add("animations of what is not in the file are left out", node.id);
    if (!canLead(motion, node.id, notes_)) return;
    const Playing playing = Playing::of(motion);
    if (playing.length > kLatestKeySeconds)  // our own reader refuses the file
        return notes_.add("animations that take more than 1e9 s are left out", node.id);
    noteLostPlaying(playing, notes_, node.id);
    Track places, turns, scales;
    for (std::size_t i = 0; i < keys.size(); i += kScalarsPerKey) {
        for (Track* track : {&places, &turns, &scales}) track->times.push_back(keys[i] - keyTime(keys, 0));
        places.values.insert(places.values.end(), &keys[i + 1], &keys[i + 4]);
        turns.values.insert(turns.values.end(), &keys[i + 4], &keys[i + 8]);
        scales.values.insert(scales.values.end(), &keys[i + 8], &keys[i] + kScalarsPerKey);
    }
    Channels channels;
    const auto drive = [&](Track track, std::string_view path, std::size_t components) {
        const int made = sampler(std::move(track), path, components, channels);
        for (const std::size_t bearer : bearers->second) channels.add(tree_.moved[bearer], path, made);
    };
    drive(std::move(places), "translation", 3);
    drive(std::move(turns), "rotation", 4);
    drive(std::move(scales), "scale", 3);
    parts_.animations.add(channels.done(node.node->name));
}

int GltfMotions::sampler(Track track, std::string_view path, std::size_t components, Channels& channels) {
    const std::size_t perKey = (track.interpolation == KeyFrames::kSpline ? 3 : 1) * components;
    std::vector<float> times, values;
    for (std::size_t key = 0; key < track.times.size(); ++key) {
        const auto time = static_cast<float>(std::max(track.times[key], 0.0));
        // Of keys that single precision cannot tell apart the last holds.
        if (!times.empty() && time <= times.back())
            values.resize(values.size() - perKey);
        else
            times.push_back(time);
        for (std::size_t i = 0; i < perKey; i += components) {
            double* value = &track.values[key * perKey + i];
            const bool tangent = perKey != components && i != components;
            if (path != "rotation") {
                for (std::size_t k = 0; k < components; ++k) values.push_back(static_cast<float>(value[k]));
                continue;
            }
            Quatd turn(value[0], value[1], value[2], value[3]);
            if (!tangent && std::abs(turn.norm() - 1) > 1e-7) turn.normalize();
            for (const double part : {turn.x(), turn.y(), turn.z(), turn.w()})
                values.push_back(static_cast<float>(part));
        }
    }
    for (float& value : values)
        if (!std::isfinite(value)) value = 0;
    const auto [known, isNew] = times_.try_emplace(times, 0);
    if (isNew) known->second = parts_.floats(times, "SCALAR", 1, true, kGltfNoTarget);
    const bool scalars = path == "weights";
    const int output = parts_.floats(std::move(values),
                                     scalars           ? "SCALAR"
                                     : components == 4 ? "VEC4"
                                                       : "VEC3",
                                     scalars ? 1 : components, false, kGltfNoTarget);
    JsonObject sampler;
    sampler.number("input", known->second).number("output", output);
    sampler.text("interpolation", track.interpolation == KeyFrames::kStep     ? "STEP"
                                  : track.interpolation == KeyFrames::kSpline ? "CUBICSPLINE"
                                                                              : "LINEAR");
    return channels.samplers.add(sampler.done());
}

}  // namespace tessera
