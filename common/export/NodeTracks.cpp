#include "common/export/NodeTracks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
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
            const Channel channel{.keys = keys, .track = *track, .component = target.as<ComponentTransform>()};
            if (keys->interpolation != KeyFrames::kSpline) {
                addTo(bearers->second, made(channel, timesOf(*keys)), node);
                continue;
            }
            const std::size_t first = made_.tracks.size();
            addTo(bearers->second, {.field = keys->field, .times = {}, .values = {}}, node);
            const std::size_t count = made_.tracks.size() - first;
            if (count > 0)
                splines_.push_back({.channel = channel, .playing = playing_, .first = first, .count = count});
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

    NodeTracks take() {
        fillSplines();
        return std::move(made_);
    }

private:
    struct Channel {
        const KeyFrames* keys;
        KeyTrack track;
        const ComponentTransform* component;  ///< its target, if it is one
    };
    /// What has no values before all splines are known.
    struct Spline {
        Channel channel;
        Playing playing;
        std::size_t first, count;  ///< in NodeTracks::tracks

        [[nodiscard]] double length() const {
            const std::span<const double> times = channel.keys->times.as<double>();
            return std::max(times.back(), 0.0) - std::max(times.front(), 0.0);
        }
        /// Values beside those at its keys, at most.
        [[nodiscard]] double wanted() const { return std::min(length() / kSecondsPerFrame, kMostValuesOfASpline); }
        /// How often they are in the file.
        [[nodiscard]] double often() const {
            return static_cast<double>(count) * (playing.mode == Animation::kPingPong ? 2 : 1);
        }
    };

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
        std::vector<double> times;
        const std::span<const double> said = keys.times.as<double>();
        if (beginsBefore(said)) times.push_back(0);
        for (std::size_t i = 0; i < said.size(); ++i) {
            if (said[i] < 0) continue;
            if (i > 0 && keys.interpolation == KeyFrames::kStep && said[i] - kBeforeStep > std::max(said[i - 1], 0.0))
                times.push_back(said[i] - kBeforeStep);
            times.push_back(said[i]);
        }
        return times;
    }
    /// `step`: the longest time between two, s.
    static std::vector<double> timesOfSpline(std::span<const double> said, double step) {
        std::vector<double> times;
        if (beginsBefore(said)) times.push_back(0);
        for (std::size_t i = 0; i < said.size(); ++i) {
            if (said[i] < 0) continue;
            const double from = i > 0 ? std::max(said[i - 1], 0.0) : said[i];
            const double parts = std::ceil((said[i] - from) / step - 1e-6);
            for (double part = 1; part < parts; ++part) times.push_back(from + (said[i] - from) * (part / parts));
            times.push_back(said[i]);
        }
        return times;
    }
    /// And has no key at 0 s.
    static bool beginsBefore(std::span<const double> times) {
        return times.front() < 0 && !std::ranges::binary_search(times, 0.0);
    }

    static NodeTrack made(const Channel& channel, std::vector<double> times) {
        NodeTrack made{.field = channel.keys->field, .times = std::move(times), .values = {}};
        for (const double time : made.times) {
            const std::vector<double> numbers = channel.track.at(time);
            std::array<double, 4> value{};
            std::copy_n(numbers.begin(), std::min<std::size_t>(4, numbers.size()), value.begin());
            if (channel.component) place(*channel.component, channel.keys->field, value);
            made.values.push_back(value);
        }
        return made;
    }

    /// How many values a spline may have beside its keys, so that all together have kMostSplineValues.
    [[nodiscard]] double mostOfEach() const {
        std::vector<std::pair<double, double>> wanted;
        double often = 0, left = kMostSplineValues;
        for (const Spline& spline : splines_) {
            wanted.emplace_back(spline.wanted(), spline.often());
            often += spline.often();
        }
        std::ranges::sort(wanted);
        for (const auto& [values, times] : wanted) {  // what the short ones do not need is for the others
            if (values * often > left) return left / often;
            left -= values * times;
            often -= times;
        }
        return kMostValuesOfASpline;
    }

    void fillSplines() {
        const double most = mostOfEach();
        double coarsest = 0;  // s, of the file
        std::vector<ObjectId> coarse;
        for (const Spline& spline : splines_) {
            const double values = std::min(spline.wanted(), most);
            const double step = std::max(kSecondsPerFrame, spline.length() / values);
            NodeTrack filled =
                made(spline.channel, timesOfSpline(spline.channel.keys->times.as<double>(),
                                                   values >= 1 ? step : std::numeric_limits<double>::infinity()));
            fold(spline.playing, filled);
            for (std::size_t i = 0; i < spline.count; ++i) {
                made_.tracks[spline.first + i].times = filled.times;
                made_.tracks[spline.first + i].values = filled.values;
            }
            if (!(spline.length() / kSecondsPerFrame > values * (1 + 1e-9))) continue;
            coarse.push_back(made_.clocks[made_.tracks[spline.first].clock].node);
            for (std::size_t i = 1; i < filled.times.size(); ++i)
                coarsest = std::max(coarsest, filled.times[i] - filled.times[i - 1]);
        }
        for (const ObjectId node : coarse)
            notes_.add(fmt::format("long splines are straight lines of up to {:.3g} s", coarsest), node);
    }

    /// `track`: without values that are known later.
    void addTo(const std::vector<int>& nodes, NodeTrack track, const SelectedNode& node) {
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
    std::vector<Spline> splines_;
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
