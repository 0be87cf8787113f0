#include "server/sim/view/AnimatedBounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <new>
#include <numbers>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "common/animation/KeyTrack.h"
#include "common/animation/MotionKeys.h"
#include "common/cores/Motion.h"
#include "common/cores/Skin.h"
#include "common/cores/Transform.h"
#include "common/drawable/Drawable.h"
#include "common/drawable/SceneBounds.h"
#include "common/scene/Action.h"

namespace tessera {
namespace {

constexpr double kSecondsApart = 1.0 / 60;
/// Between two looks, in radians and in parts of all that is seen: beyond, there is one in between, unless they are so
/// near (s) that it is a leap.
constexpr double kMostTurn = 0.1, kMostStep = 0.01, kLeap = kSecondsApart / 1000;
constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);

/// An animation or a motion.
struct Player {
    double time = 0, speed = 1, last = 0;
    std::int64_t mode = Animation::kLoop;
    std::size_t group = 0;            ///< of those that are looked at together: 0, all that play
    std::vector<double> keys;         ///< s, ascending
    std::vector<double> motion = {};  ///< Motion::keys

    [[nodiscard]] double period() const {
        return speed == 0 ? 0 : (mode == Animation::kPingPong ? 2 : 1) * last / std::abs(speed);
    }
    /// The time of the keys that are shown when the group has played for so long.
    [[nodiscard]] double shownAfter(double seconds) const {
        const std::int64_t around =
            mode == Animation::kPingPong ? Animation::kPingPong : Animation::kLoop;  // once: people play it again
        const double shown = shownTime(foldedTime(time + speed * seconds, last, around), last, around);
        return shown > last - 0.5 * moment() ? last : shown;
    }
    /// s; next to nothing, and more than rounding.
    [[nodiscard]] double moment() const { return 1e-9 * last; }
    /// Appends when the group comes to a key first: just behind it, where what steps has stepped; at the end, and just
    /// before it, as what loops leaps there.
    void appendLooks(std::vector<double>& looks) const {
        looks.push_back(0);
        if (!(period() > 0)) return;
        const auto append = [&](double shown) {
            for (const double phase : {shown, mode == Animation::kPingPong ? 2 * last - shown : shown}) {
                const double after = std::fmod((phase - time) / speed, period());
                looks.push_back(after < 0 ? after + period() : after);
            }
        };
        for (const double key : keys) append(std::clamp(key + moment(), moment(), last - moment()));
        append(last - 0.25 * moment());
    }
};

struct Driver {
    std::size_t player;
    std::optional<KeyTrack> track;  ///< none: a motion
};

/// A node that moves, or that stands below one.
struct MovingNode {
    std::size_t parent = kNowhere;                   ///< among the moving ones
    Affine3d world_T_parent = Affine3d::Identity();  ///< where the parent does not move
    Object core;
    const std::vector<Driver>* drivers = nullptr;
    Box box = {};  ///< of what goes with it, in its coordinates
    Affine3d world_T_node = Affine3d::Identity(), before = Affine3d::Identity();
    Vec3d step = Vec3d::Zero();  ///< of the box's middle, from the look before last to the last one
};

/// By how much the axes of one place lie across those of the other (radians): of a turn, 0.8 of it at least.
double turnBetween(const Affine3d& from, const Affine3d& to) {
    double turn = 0;
    for (int c = 0; c < 3; ++c) {
        const Vec3d a = from.linear().col(c), b = to.linear().col(c);
        const double lengths = a.norm() * b.norm();
        if (lengths > 0) turn = std::max(turn, std::acos(std::clamp(a.dot(b) / lengths, -1.0, 1.0)));
    }
    return turn;
}

/// How far what passes from one place to the other gets beyond both: as if it turned about an axis, the height of an
/// arc is half its chord times the tangent of a quarter of the turn.
double arcHeight(const Affine3d& from, const Affine3d& to, const Box& box) {
    const double turn = std::min(1.25 * turnBetween(from, to), std::numbers::pi);
    if (turn < 1e-9) return 0;
    double chord = 0;
    for (unsigned corner = 0; corner < 8; ++corner) {
        const Vec3d at((corner & 1 ? box.upper : box.lower).x(), (corner & 2 ? box.upper : box.lower).y(),
                       (corner & 4 ? box.upper : box.lower).z());
        chord = std::max(chord, (to * at - from * at).norm());
    }
    return 0.5 * chord * std::tan(0.25 * turn);
}

/// The lowest and the highest of a mesh along its own axes and diagonals: those of a box are all its corners.
std::vector<Vec3d> extremesOf(std::span<const float> positions) {
    static const std::array<Vec3f, 7> kWays = {Vec3f(1, 0, 0),  Vec3f(0, 1, 0),  Vec3f(0, 0, 1), Vec3f(1, 1, 1),
                                               Vec3f(1, 1, -1), Vec3f(1, -1, 1), Vec3f(-1, 1, 1)};
    struct Found {
        std::size_t at = 0;
        float along = 0;
    };
    if (positions.size() < 3) return {};
    std::array<Found, 14> found;
    for (std::size_t i = 0; i + 3 <= positions.size(); i += 3)
        for (std::size_t way = 0; way < kWays.size(); ++way) {
            const float along = kWays[way].dot(Vec3f(positions[i], positions[i + 1], positions[i + 2]));
            Found &low = found[2 * way], &high = found[2 * way + 1];
            if (i == 0 || along < low.along) low = {i, along};
            if (i == 0 || along > high.along) high = {i, along};
        }
    std::vector<Vec3d> extremes;
    for (const auto& [i, along] : found) extremes.emplace_back(positions[i], positions[i + 1], positions[i + 2]);
    return extremes;
}

/// The farthest places along 26 directions: a room of eight corners shows around a chair of a million.
class Outermost {
public:
    void add(std::span<const Vec3d> extremes, const Affine3d& world_T_node) {
        for (const Vec3d& extreme : extremes) {
            const Vec3d place = world_T_node * extreme;
            if (!place.allFinite()) continue;
            for (int x = -1, n = 0; x <= 1; ++x)
                for (int y = -1; y <= 1; ++y)
                    for (int z = -1; z <= 1; ++z, ++n) {
                        std::optional<Vec3d>& farthest = farthest_[static_cast<std::size_t>(n)];
                        const Vec3d direction(x, y, z);
                        if (!farthest || direction.dot(place) > direction.dot(*farthest)) farthest = place;
                    }
        }
    }
    void appendTo(std::vector<Vec3d>& places) const {
        for (const std::optional<Vec3d>& place : farthest_)
            if (place) places.push_back(*place);
    }

private:
    std::array<std::optional<Vec3d>, 27> farthest_;
};

class Survey {
public:
    explicit Survey(const Aspect& scene) : scene_(scene) {}

    AnimatedBounds run() {
        result_.box = result_.now = sceneBounds(scene_);
        findPlayers();
        if (players_.empty() && weightTracks_.empty()) {
            takeSamples();
            return result_;
        }
        findMoving();
        findDrawn();
        if (moving_.empty()) {
            takeSamples();
            return result_;
        }
        for (std::size_t group = 0; group <= lastGroup_; ++group) lookAt(group);
        return result_;
    }

private:
    void takeSamples() {
        // Each mesh is looked at once, however often it stands.
        struct Mesh {
            std::size_t count = 0;
            std::vector<Vec3d> extremes;
        };
        std::unordered_map<MeshKey, Mesh, MeshKeyHash> meshes;
        std::vector<const Mesh*> placed;  // one for each that is drawn, in their order
        const auto visitEach = [&](auto&& take) {
            Action action;
            action.onNode([&](const Visit& visit) {
                if (visit.node.ofServer) return Descend::kPast;
                if (const Drawable drawable = drawableOf(scene_, visit.node); drawable && drawable.resident())
                    take(drawable, visit.world_T_node);
                return Descend::kInto;
            });
            action.run(scene_);
        };
        std::size_t all = 0;
        visitEach([&](const Drawable& drawable, const Affine3d&) {
            const auto [mesh, isNew] = meshes.try_emplace(drawable.key());
            if (isNew) {
                const MeshArrays arrays = drawable.arrays();
                const auto positions = arrays.positions.as<float>();
                mesh->second = {positions.size() / 3, extremesOf(positions)};
                result_.measured += mesh->second.count;
            }
            all += mesh->second.count;
            placed.push_back(&mesh->second);
        });
        const std::size_t step = all / kMostSamples + 1;
        std::size_t next = 0;  // among those that are still to come
        Outermost outermost;
        visitEach([&, mesh = placed.begin()](const Drawable& drawable, const Affine3d& world_T_node) mutable {
            outermost.add((*mesh)->extremes, world_T_node);
            const std::size_t count = (*mesh++)->count;
            const MeshArrays arrays = next < count ? drawable.arrays() : MeshArrays();
            const auto positions = arrays.positions.as<float>();
            for (; next < count; next += step) {
                const Vec3d at =
                    world_T_node * Vec3d(positions[3 * next], positions[3 * next + 1], positions[3 * next + 2]);
                if (at.allFinite()) result_.samples.push_back(at);
            }
            next -= count;
        });
        outermost.appendTo(result_.samples);
    }

    void findPlayers() {
        for (const ObjectId id : scene_.ids()) {
            const Object object = scene_.find(id);
            if (const Animation* animation = object.as<Animation>()) addAnimation(*animation);
            if (const Motion* motion = object.as<Motion>()) addMotion(*motion);
        }
    }
    std::size_t groupOf(bool playing) {
        if (playing) return 0;
        return lastGroup_ < kMostAlone ? ++lastGroup_ : kNowhere;
    }

    void addAnimation(const Animation& animation) {
        Player player{.time = animation.playing ? animation.time : 0,
                      .speed = animation.playing ? animation.speed : 1,
                      .mode = animation.mode};
        bool any = false;
        for (const ObjectId channel : animation.channels) {
            const KeyFrames* frames = scene_.get<KeyFrames>(channel);
            const Object target = frames ? scene_.find(frames->target) : Object();
            if (!target) continue;
            const Expected<KeyTrack> track = KeyTrack::of(*frames, &target.info());
            if (!track) continue;
            player.last = std::max(player.last, track->lastTime());
            const bool weights = target.is<Skin>() && track->field().id == fieldId<&Skin::weights>;
            if (weights) weightTracks_[frames->target].push_back(frames);
            if (!(track->field().effects & Effect::kPose) || !target.info().place) continue;
            const auto times = frames->times.as<double>();
            player.keys.insert(player.keys.end(), times.begin(), times.end());
            drivers_[frames->target].push_back({players_.size(), *track});
            any = true;
        }
        if (!any) return;
        player.group = groupOf(animation.playing);
        std::ranges::sort(player.keys);
        player.keys.erase(std::unique(player.keys.begin(), player.keys.end()), player.keys.end());
        players_.push_back(std::move(player));
    }

    void addMotion(const Motion& motion) {
        const auto numbers = motion.keys.as<double>();
        if (!scene_.get<Transform>(motion.target) || !checkKeys(numbers)) return;
        Player player{.time = motion.playing ? motion.time : 0,
                      .mode = motion.mode,
                      .group = groupOf(motion.playing),
                      .keys = {}};
        for (std::size_t i = 0; i < numbers.size(); i += kScalarsPerKey) player.keys.push_back(numbers[i]);
        player.last = player.keys.back();
        player.motion.assign(numbers.begin(), numbers.end());
        drivers_[motion.target].push_back({players_.size(), std::nullopt});
        players_.push_back(std::move(player));
    }

    void findMoving() {
        if (drivers_.empty()) return;
        std::vector<std::pair<std::size_t, Affine3d>> above;  // of each level: among the moving ones, where it stands
        Action action;
        action.visitHidden(true);  // joints may be
        action.onNode([&](const Visit& visit) {
            above.resize(visit.depth + 1);
            const std::size_t parent = visit.depth > 0 ? above[visit.depth - 1].first : kNowhere;
            const auto drivers = visit.node.core ? drivers_.find(visit.node.core) : drivers_.end();
            above[visit.depth] = {kNowhere, visit.world_T_node};
            if (parent == kNowhere && drivers == drivers_.end()) return Descend::kInto;
            above[visit.depth].first = moving_.size();
            indices_[visit.nodeId] = moving_.size();
            MovingNode node{.parent = parent,
                            .core = visit.core,
                            .drivers = drivers == drivers_.end() ? nullptr : &drivers->second};
            if (parent == kNowhere && visit.depth > 0) node.world_T_parent = above[visit.depth - 1].second;
            moving_.push_back(node);
            return Descend::kInto;
        });
        action.run(scene_);
    }

    /// What goes with which node.
    void findDrawn() {
        std::unordered_map<MeshKey, Box, MeshKeyHash> boxes;
        Action action;
        action.onNode([&](const Visit& visit) {
            if (const Skin* skin = visit.core.as<Skin>()) {
                addSkin(visit, *skin);
                return Descend::kInto;
            }
            const auto index = indices_.find(visit.nodeId);
            if (index == indices_.end()) return Descend::kInto;
            if (const Drawable drawable = drawableOf(scene_, visit.node)) {
                const auto [it, isNew] = boxes.try_emplace(drawable.key());
                if (isNew) it->second = drawable.bounds();
                moving_[index->second].box.extend(it->second);
            }
            return Descend::kInto;
        });
        action.run(scene_);
    }

    void extendAt(ObjectId node, const Affine3d& world_T_node, const Box& box) {
        if (box.empty()) return;
        const auto index = indices_.find(node);
        if (index != indices_.end())
            moving_[index->second].box.extend(box);
        else
            result_.box.extend(box.transformed(world_T_node));
    }

    void addSkin(const Visit& visit, const Skin& skin) {
        const Drawable drawable = drawableOf(scene_, visit.node);
        if (!drawable || !drawable.resident() || !drawable.check()) return;
        const bool weighted = weightTracks_.contains(visit.node.core);
        const auto joints = skin.jointIndices.as<std::uint16_t>();
        const auto weights = skin.jointWeights.as<float>();
        const bool follows = !skin.joints.empty() && !joints.empty() && !weights.empty();
        const bool moves = std::ranges::any_of(skin.joints, [&](ObjectId joint) { return indices_.contains(joint); });
        if (!(follows && moves) && !weighted) {
            // As it is now, wherever its node goes; the joints of one that follows take nothing along.
            if (!follows) extendAt(visit.nodeId, visit.world_T_node, drawable.bounds());
            return;
        }
        const std::vector<Box> vertices = vertexBoxes(skin, visit.node.core);
        if (!follows) {
            Box all;
            for (const Box& vertex : vertices) all.extend(vertex);
            return extendAt(visit.nodeId, visit.world_T_node, all);
        }
        const auto rows = skin.inverseBinds.as<float>();
        std::vector<Affine3d> binds(skin.joints.size(), Affine3d::Identity());
        for (std::size_t j = 0; j < binds.size() && 12 * (j + 1) <= rows.size(); ++j)
            for (Eigen::Index i = 0; i < 12; ++i)
                binds[j](i / 4, i % 4) = static_cast<double>(rows[12 * j + static_cast<std::size_t>(i)]);
        std::vector<Box> boxes(binds.size());
        for (std::size_t k = 0; k < joints.size() && k / 4 < vertices.size(); ++k)
            if (weights[k] > 0 && joints[k] < boxes.size())
                boxes[joints[k]].extend(vertices[k / 4].transformed(binds[joints[k]]));
        for (std::size_t j = 0; j < boxes.size(); ++j)
            extendAt(skin.joints[j], worldTransform(scene_, skin.joints[j]), boxes[j]);
    }

    /// Of each vertex where its targets take it, before joints do.
    std::vector<Box> vertexBoxes(const Skin& skin, ObjectId id) const {
        const auto positions = skin.positions.as<float>();
        const auto deltas = skin.morphPositions.as<float>();
        std::vector<Box> boxes(positions.size() / 3);
        for (std::size_t v = 0; v < boxes.size(); ++v)
            boxes[v].extend(Vec3d(static_cast<double>(positions[3 * v]), static_cast<double>(positions[3 * v + 1]),
                                  static_cast<double>(positions[3 * v + 2])));
        const auto now = skin.weights.as<float>();
        std::vector<std::pair<double, double>> ranges;
        for (const float weight : now) ranges.emplace_back(static_cast<double>(weight), static_cast<double>(weight));
        if (const auto tracks = weightTracks_.find(id); tracks != weightTracks_.end())
            for (const KeyFrames* frames : tracks->second) extendRanges(*frames, ranges);
        for (std::size_t t = 0; t < ranges.size() && (t + 1) * positions.size() <= deltas.size(); ++t)
            for (std::size_t i = 0; i < positions.size(); ++i) {
                const auto delta = static_cast<double>(deltas[t * positions.size() + i]);
                const auto axis = static_cast<Eigen::Index>(i % 3);
                boxes[i / 3].lower[axis] += std::min(ranges[t].first * delta, ranges[t].second * delta);
                boxes[i / 3].upper[axis] += std::max(ranges[t].first * delta, ranges[t].second * delta);
            }
        return boxes;
    }

    /// By the weights at keys; of splines by the control points between them too, which hold the curve.
    static void extendRanges(const KeyFrames& frames, std::vector<std::pair<double, double>>& ranges) {
        const auto times = frames.times.as<double>();
        const auto values = frames.values.as<double>();
        const bool spline = frames.interpolation == KeyFrames::kSpline;
        const std::size_t parts = spline ? 3 : 1, count = values.size() / times.size() / parts;
        for (std::size_t k = 0; k < times.size(); ++k)
            for (std::size_t t = 0; t < std::min(count, ranges.size()); ++t) {
                const auto at = [&](std::size_t part) { return values[(k * parts + part) * count + t]; };
                const auto extend = [&](double weight) {
                    ranges[t].first = std::min(ranges[t].first, weight);
                    ranges[t].second = std::max(ranges[t].second, weight);
                };
                extend(at(spline ? 1 : 0));
                if (spline && k > 0) extend(at(1) - at(0) * (times[k] - times[k - 1]) / 3);
                if (spline && k + 1 < times.size()) extend(at(1) + at(2) * (times[k + 1] - times[k]) / 3);
            }
    }

    [[nodiscard]] std::uint64_t mostLooks(std::size_t group) const {
        return std::max(group == 0 ? kFewestLooks : kFewestLooksAlone,
                        kMostPlaced / (moving_.size() * (lastGroup_ + 1)));
    }

    [[nodiscard]] std::vector<double> looksOf(std::size_t group) const {
        std::vector<double> keys;
        double length = 0;
        for (const Player& player : players_)
            if (player.group == group) {
                player.appendLooks(keys);
                length = std::max(length, player.period());
            }
        if (keys.empty()) return keys;
        keys.push_back(length);
        std::ranges::sort(keys);
        keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
        const std::uint64_t most = mostLooks(group);
        std::vector<double> looks;
        if (static_cast<double>(keys.size()) + length / kSecondsApart <= static_cast<double>(most)) {
            for (std::size_t k = 0; k < keys.size(); ++k) {
                looks.push_back(keys[k]);
                if (k + 1 == keys.size()) break;
                const double gap = keys[k + 1] - keys[k];
                const double steps = std::ceil(gap / kSecondsApart);
                for (double s = 1; s < steps; ++s) looks.push_back(keys[k] + gap * s / steps);
            }
        } else if (keys.size() <= most / 2) {  // all keys, and the rest evenly
            looks = keys;
            const auto rest = static_cast<double>(most - keys.size());
            for (double s = 0; s < rest; ++s) looks.push_back(length * s / rest);
            std::ranges::sort(looks);
        } else {
            for (std::uint64_t s = 0; s < most; ++s)
                looks.push_back(length * static_cast<double>(s) / static_cast<double>(most - 1));
        }
        return looks;
    }

    void lookAt(std::size_t group) {
        std::vector<double> ahead = looksOf(group);
        std::ranges::reverse(ahead);
        const std::uint64_t most = result_.looks + mostLooks(group);
        std::optional<double> last;
        double gapBefore = 0;  // 0: there was a leap, or nothing, before the last look
        while (!ahead.empty()) {
            const double seconds = ahead.back(), gap = last ? seconds - *last : 0;
            const double farthest = kMostStep * result_.box.size().norm();
            ++result_.looks;
            bool far = false;
            for (MovingNode& node : moving_) {
                place(node, group, seconds);
                ++result_.placed;
                if (far || !last || node.box.empty()) continue;
                far = turnBetween(node.before, node.world_T_node) > kMostTurn || stepOf(node).norm() > farthest;
            }
            const bool leap = far && gap <= kLeap;
            if (far && !leap && result_.looks + ahead.size() < most) {
                ahead.push_back(*last + 0.5 * gap);
                continue;
            }
            for (MovingNode& node : moving_) {
                extendBy(node, gap > kLeap ? gap : 0, gapBefore);
                node.before = node.world_T_node;
            }
            gapBefore = leap ? 0 : gap > kLeap ? gap : gapBefore;
            last = seconds;
            ahead.pop_back();
        }
    }

    static Vec3d stepOf(const MovingNode& node) {
        return node.world_T_node * node.box.center() - node.before * node.box.center();
    }

    /// `gap`: s since the look before; 0: next to none, there was no way between them.
    void extendBy(MovingNode& node, double gap, double gapBefore) {
        if (node.box.empty()) return;
        Box box = node.box.transformed(node.world_T_node);
        if (!box.lower.allFinite() || !box.upper.allFinite()) return;
        double beyond = 0;
        if (gap > 0) {
            const Vec3d step = stepOf(node);
            beyond = arcHeight(node.before, node.world_T_node, node.box);
            // What turns back between two looks: an eighth of the acceleration times the square of the time, but no
            // more than it goes.
            if (gapBefore > 0)
                beyond += std::min((step / gap - node.step / gapBefore).norm() * std::max(gap, gapBefore) / 8,
                                   (step.norm() + node.step.norm()) / 4);
            node.step = step;
        }
        box.lower.array() -= beyond;
        box.upper.array() += beyond;
        result_.box.extend(box);
    }

    void place(MovingNode& node, std::size_t group, double seconds) {
        const Affine3d& parent = node.parent == kNowhere ? node.world_T_parent : moving_[node.parent].world_T_node;
        const TypeInfo* type = node.core ? &node.core.info() : nullptr;
        if (!type || !type->place) {
            node.world_T_node = parent;
            return;
        }
        if (!node.drivers) return type->place(node.core.data(), parent, node.world_T_node);
        // A copy that the animations write.
        if (scratch_.size() < type->size + type->alignment) scratch_.resize(type->size + type->alignment);
        void* at = scratch_.data();
        std::size_t room = scratch_.size();
        at = std::align(type->alignment, type->size, at, room);
        type->copy(at, node.core.data());
        for (const Driver& driver : *node.drivers) {
            const Player& player = players_[driver.player];
            if (player.group != group) continue;
            if (driver.track) {
                driver.track->field().store(at, driver.track->valueAt(player.shownAfter(seconds)));
            } else {
                const Pose pose = poseAt(player.motion, Motion::kOnce, player.shownAfter(seconds));
                Transform& transform = *static_cast<Transform*>(at);
                transform.translation = pose.translation;
                transform.rotation = pose.rotation;
                transform.scale = pose.scale;
            }
        }
        type->place(at, parent, node.world_T_node);
        type->destroy(at);
    }

    const Aspect& scene_;
    AnimatedBounds result_;
    std::vector<Player> players_;
    std::size_t lastGroup_ = 0;
    std::unordered_map<ObjectId, std::vector<Driver>> drivers_;                 ///< by core
    std::unordered_map<ObjectId, std::vector<const KeyFrames*>> weightTracks_;  ///< by Skin
    std::vector<MovingNode> moving_;                                            ///< parents before children
    std::unordered_map<ObjectId, std::size_t> indices_;
    std::vector<std::byte> scratch_;
};

}  // namespace

AnimatedBounds animatedBounds(const Aspect& scene) {
    return Survey(scene).run();
}

}  // namespace tessera
