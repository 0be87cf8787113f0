#include "common/export/NodeTracks.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <unordered_map>

#include "common/animation/KeyTrack.h"
#include "common/animation/MotionKeys.h"
#include "common/cores/Animation.h"
#include "common/cores/ComponentTransform.h"
#include "common/cores/Motion.h"
#include "common/cores/Transform.h"

namespace tessera {
namespace {

/// The speed and the way back go into the times, so that it loops or plays once. Nothing: it takes so long that it
/// stands.
std::optional<Playing> folded(const Playing& playing) {
    Playing plain = playing;
    if (playing.mode == Animation::kPingPong) plain.length *= 2, plain.mode = Animation::kLoop;
    plain.length /= std::abs(playing.speed);
    plain.speed = 1;
    return plain.length <= kLongestCycle ? std::optional(plain) : std::nullopt;
}

void fold(const Playing& playing, NodeTrack& track) {
    if (!folded(playing)) return;
    std::vector<double>& times = track.times;
    if (playing.mode == Animation::kPingPong) {
        // The way back of what is symmetric is the way there.
        for (std::size_t i = times.size(); i-- > 0;) {
            if (times[i] >= playing.length) continue;
            const std::array<double, 4> value = track.values[i];
            times.push_back(2 * playing.length - times[i]);
            track.values.push_back(value);
        }
    } else if (playing.speed < 0) {
        std::ranges::reverse(times);
        std::ranges::reverse(track.values);
        for (double& time : times) time = playing.length - time;
    }
    for (double& time : times) time /= std::abs(playing.speed);
}

class TrackGatherer {
public:
    TrackGatherer(const Aspect& scene, const Selection& selection, const PlannedTree& tree, ExportNotes& notes)
        : scene_(scene), notes_(notes) {
        for (std::size_t i = 0; i < selection.nodes.size(); ++i)
            if (selection.nodes[i].core && tree.moved[i] >= 0)
                bearers_[selection.nodes[i].node->core].push_back(tree.moved[i]);
    }

    void add(const SelectedNode& node, const Animation& animation) {
        playing_ = Playing::of(scene_, animation);
        for (const ObjectId id : animation.channels) {
            const auto* keys = scene_.get<KeyFrames>(id);
            const Object target = keys && keys->target ? scene_.find(keys->target) : Object();
            if (!keys) continue;
            const Expected<KeyTrack> track = KeyTrack::of(*keys, target ? &target.info() : nullptr);
            const bool places = target.is<Transform>() || target.is<ComponentTransform>();
            if (!places || (keys->field != "translation" && keys->field != "rotation" && keys->field != "scale")) {
                notes_.add("animations of other fields than places are left out", node.id);
                continue;
            }
            if (!track) {
                noteUnsound(keys->values, node.id, notes_);
                continue;
            }
            const auto bearers = bearers_.find(keys->target);
            if (bearers == bearers_.end()) {
                notes_.add("animations of what is not in the file are left out", node.id);
                continue;
            }
            if (!canLead(keys->values.as<double>(), keys->field, node.id, notes_)) continue;
            NodeTrack made{.field = keys->field, .times = {}, .values = {}};
            const auto* component = target.as<ComponentTransform>();
            for (const double time : timesOf(*keys)) {
                const std::vector<double> numbers = track->at(time);
                std::array<double, 4> value{};
                std::copy_n(numbers.begin(), std::min<std::size_t>(4, numbers.size()), value.begin());
                if (component) place(*component, keys->field, value);
                made.times.push_back(time);
                made.values.push_back(value);
            }
            addTo(bearers->second, made, node);
        }
    }

    void add(const SelectedNode& node, const Motion& motion) {
        const std::span<const double> keys = motion.keys.as<double>();
        const auto bearers = bearers_.find(motion.target);
        if (keys.empty() && !motion.target) return;
        if (!checkKeys(keys)) return noteUnsound(motion.keys, node.id, notes_);
        if (bearers == bearers_.end()) return notes_.add("animations of what is not in the file are left out", node.id);
        if (!canLead(motion, node.id, notes_)) return;
        playing_ = Playing::of(motion);
        NodeTrack places{.field = "translation", .times = {}, .values = {}};
        NodeTrack turns{.field = "rotation", .times = {}, .values = {}};
        NodeTrack scales{.field = "scale", .times = {}, .values = {}};
        for (std::size_t i = 0; i < keys.size(); i += kScalarsPerKey) {
            for (NodeTrack* track : {&places, &turns, &scales}) track->times.push_back(keys[i] - keyTime(keys, 0));
            places.values.push_back({keys[i + 1], keys[i + 2], keys[i + 3], 0});
            const Quatd turn = Quatd(keys[i + 4], keys[i + 5], keys[i + 6], keys[i + 7]).normalized();
            turns.values.push_back({turn.w(), turn.x(), turn.y(), turn.z()});
            scales.values.push_back({keys[i + 8], keys[i + 9], keys[i + 10], 0});
        }
        for (const NodeTrack* track : {&places, &turns, &scales}) addTo(bearers->second, *track, node);
    }

    NodeTracks take() { return std::move(made_); }

private:
    /// As PlannedTree has its fields.
    static void place(const ComponentTransform& component, const std::string& field, std::array<double, 4>& value) {
        if (field == "translation")
            for (int axis = 0; axis < 3; ++axis) value[static_cast<std::size_t>(axis)] += component.center[axis];
        if (field != "rotation") return;
        const Quatd turn =
            Quatd(value[0], value[1], value[2], value[3]).normalized() * component.scaleOrientation.normalized();
        value = {turn.w(), turn.x(), turn.y(), turn.z()};
    }

    static std::vector<double> timesOf(const KeyFrames& keys) {
        constexpr double kBeforeStep = 0.01 * kSecondsPerFrame;
        constexpr std::size_t kMostSamples = 100'000;
        std::vector<double> times;
        const std::span<const double> said = keys.times.as<double>();
        if (said.front() < 0) times.push_back(0);
        for (std::size_t i = 0; i < said.size(); ++i) {
            if (said[i] < 0) continue;
            if (i > 0 && keys.interpolation == KeyFrames::kStep && said[i] - kBeforeStep > std::max(said[i - 1], 0.0))
                times.push_back(said[i] - kBeforeStep);
            const double from = i > 0 ? std::max(said[i - 1], 0.0) : said[i];
            if (keys.interpolation == KeyFrames::kSpline)
                for (double t = from + kSecondsPerFrame; t < said[i] && times.size() < kMostSamples;
                     t += kSecondsPerFrame)
                    times.push_back(t);
            times.push_back(said[i]);
        }
        return times;
    }

    void addTo(const std::vector<int>& nodes, NodeTrack track, const SelectedNode& node) {
        if (track.times.empty()) return;
        fold(playing_, track);
        for (const int at : nodes) {
            if (!driven_.emplace(at, track.field).second) {
                notes_.add("of several animations of one place the first is written", node.id);
                continue;
            }
            if (made_.clocks.empty() || made_.clocks.back().node != node.id)
                made_.clocks.push_back({.node = node.id,
                                        .name = node.node->name,
                                        .playing = folded(playing_).value_or(playing_),
                                        .stands = !folded(playing_)});
            track.node = at;
            track.clock = made_.clocks.size() - 1;
            made_.tracks.push_back(track);
        }
    }

    const Aspect& scene_;
    ExportNotes& notes_;
    std::unordered_map<ObjectId, std::vector<int>> bearers_;
    std::set<std::pair<int, std::string>> driven_;
    Playing playing_;  ///< of what is added
    NodeTracks made_;
};

}  // namespace

NodeTracks nodeTracks(const Aspect& scene, const Selection& selection, const PlannedTree& tree, ExportNotes& notes) {
    TrackGatherer gatherer(scene, selection, tree, notes);
    for (const SelectedNode& node : selection.nodes) {
        if (const auto* animation = node.core.as<Animation>()) gatherer.add(node, *animation);
        if (const auto* motion = node.core.as<Motion>()) gatherer.add(node, *motion);
    }
    return gatherer.take();
}

}  // namespace tessera
