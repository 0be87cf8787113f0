#include "server/collision/pipeline/FreeBodies.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tessera {
namespace {

ContactLaw lawOf(std::int64_t response) {
    if (response == Interest::kBounce) return ContactLaw::kBounce;
    return response == Interest::kSlide ? ContactLaw::kSlide : ContactLaw::kStick;
}

Pose poseOf(const Transform& t) {
    return {t.translation, t.rotation, t.scale};
}

/// What moves a part from one pose to another in some seconds, as the velocity of its origin and a spin about it.
void setVelocity(RigidBody& body, const Affine3d& start, const Affine3d& end, double seconds) {
    body.anchor = start.translation();
    const Affine3d move = end * start.inverse();
    if (!move.matrix().allFinite()) return;
    body.velocity = (end.translation() - start.translation()) / seconds;
    const Eigen::AngleAxisd turn(Mat3d(move.rotation()));
    body.spin = turn.axis() * (turn.angle() / seconds);
    if (!body.spin.allFinite()) body.spin = Vec3d::Zero();
}

}  // namespace

std::uint64_t FreeBodies::versionOf(const ObjectHandler& handler, const Body& body) {
    std::uint64_t sum = 0;
    for (const std::uint32_t part : body.parts) sum += handler.parts()[part].poseVersion;
    return sum;
}

const FreeBodies::Left* FreeBodies::leftOf(std::uint32_t body, ObjectId core) const {
    const auto left = std::ranges::lower_bound(left_, body, {}, &Left::body);
    if (left != left_.end() && left->body == body && left->core == core) return &*left;
    if (!std::exchange(leftIndexed_, true)) {
        leftOfCore_.reset(left_.size());
        for (std::uint32_t i = 0; i < left_.size(); ++i) leftOfCore_.insert(left_[i].core, i);
    }
    const std::uint32_t number = leftOfCore_.find(core);
    return number == IdTable::kNone ? nullptr : &left_[number];
}

bool FreeBodies::supports(const ObjectHandler& handler, std::uint32_t part) const {
    const std::uint64_t id = handler.parts()[part].node.value;
    const auto at = std::ranges::lower_bound(supports_, id, {}, &std::pair<std::uint64_t, std::uint64_t>::first);
    return at != supports_.end() && at->first == id;
}

void FreeBodies::noteMoved(const ObjectHandler& handler, std::span<const std::uint32_t> parts, bool others) {
    supportsStand_ = supportsStand_ && !others &&
                     std::ranges::none_of(parts, [&](std::uint32_t part) { return supports(handler, part); });
}

void FreeBodies::begin(const ObjectHandler& handler, std::span<const ObjectId> held) {
    const std::span<const Body> bodies = handler.bodies();
    bool othersMatter = std::exchange(rulesChanged_, false);
    if (interestsVersion_ != handler.interestsVersion()) {
        interestsVersion_ = handler.interestsVersion();
        std::vector<std::pair<ObjectId, std::int64_t>> responses;
        for (const InterestTerms& interest : handler.interests())
            responses.emplace_back(interest.core, 16 * interest.mode + interest.response);
        othersMatter = othersMatter || responses != responses_;
        responses_ = std::move(responses);
    }
    changed_.clear();
    const bool sameBodies = generation_ == handler.generation();
    unchanged_ = allAsleep_ && !othersMatter && held.empty() && !anyHeld_ && sameBodies &&
                 version_ == handler.freeBodiesVersion();
    if (unchanged_) return;
    anyHeld_ = !held.empty();
    generation_ = handler.generation();
    if (!sameBodies) roles_.clear();
    for (const std::uint32_t body : free_)
        if (body < roles_.size()) roles_[body] = Role::kOther;
    roles_.resize(std::max(roles_.size(), bodies.size()), Role::kOther);
    disturbed_.resize(roles_.size(), false);
    const std::vector<std::uint32_t> before = std::exchange(free_, {});
    told_ = false;
    allAsleep_ = true;
    for (const std::uint32_t i : handler.freeBodies()) {
        const Body& body = bodies[i];
        if (std::ranges::binary_search(held, body.transform)) continue;
        // What cannot be met has nothing that says where its mass is either: such a body is not free for the handler.
        const Left* left = leftOf(i, body.core);
        disturbed_[i] = left == nullptr || othersMatter || left->poseVersion != versionOf(handler, body) ||
                        left->velocity != body.velocity || left->spin != body.spin || left->mass != body.mass ||
                        left->restitution != body.restitution || left->friction != body.friction;
        roles_[i] = !disturbed_[i] && stage_.asleep(body.core.value) ? Role::kAsleep : Role::kAwake;
        allAsleep_ = allAsleep_ && roles_[i] == Role::kAsleep;
        free_.push_back(i);
    }
    std::ranges::set_symmetric_difference(before, free_, std::back_inserter(changed_));
}

Box FreeBodies::reach(const ObjectHandler& handler, std::uint32_t part, double seconds) const {
    const Body& body = handler.bodies()[handler.parts()[part].body];
    Box box = handler.parts()[part].worldBox;
    RigidBody rigid;
    rigid.mass = body.mass;
    rigid.velocity = body.velocity;
    rigid.spin = body.spin;
    Box whole;
    for (const std::uint32_t other : body.parts) whole.extend(handler.parts()[other].worldBox);
    const double margin = RigidBodyStage::reach(rigid, whole.size().norm(), handler.gravity(), seconds);
    box.lower -= Vec3d::Constant(margin);
    box.upper += Vec3d::Constant(margin);
    return box;
}

/// The number of a part in what is handed to the stage. What is not free goes part by part: parts of one body may move
/// in different ways.
std::uint32_t FreeBodies::rigidPart(const ObjectHandler& handler, std::uint32_t index, const StartWorlds& startWorlds,
                                    double seconds) {
    if (rigidPartOf_[index] != kNobody) return rigidPartOf_[index];
    const Part& part = handler.parts()[index];
    const Body& of = handler.bodies()[part.body];
    RigidBody body;
    body.id = part.node.value;
    body.restitution = of.restitution;
    body.friction = of.friction;
    RigidPart rigid;
    rigid.id = part.node.value;
    rigid.tree = &part.shape->tree;
    rigid.hull = part.shape->hull ? &*part.shape->hull : nullptr;
    rigid.world = part.world;
    if (const auto start = startWorlds.find(index); start != startWorlds.end()) {
        rigid.world = start->second;
        setVelocity(body, start->second, part.world, seconds);
    }
    rigid.body = static_cast<std::uint32_t>(bodies_.size());
    rigidPartOf_[index] = static_cast<std::uint32_t>(parts_.size());
    given_.push_back(index);
    body.parts.push_back(rigidPartOf_[index]);
    parts_.push_back(rigid);
    bodies_.push_back(std::move(body));
    return rigidPartOf_[index];
}

void FreeBodies::gather(const ObjectHandler& handler, PairMemory& memory, const StartWorlds& startWorlds, double seconds) {
    const std::span<const Part> parts = handler.parts();
    for (const std::uint32_t part : given_) rigidPartOf_[part] = kNobody;
    given_.clear();
    rigidPartOf_.resize(std::max(rigidPartOf_.size(), parts.size()), kNobody);
    bodies_.resize(free_.size());
    parts_.clear();
    encounters_.clear();
    for (std::uint32_t i = 0; i < free_.size(); ++i) {
        const Body& from = handler.bodies()[free_[i]];
        RigidBody& body = bodies_[i];
        body.id = from.core.value;
        body.mass = from.mass;
        body.restitution = from.restitution;
        body.friction = from.friction;
        body.velocity = from.velocity;
        body.spin = from.spin;
        body.disturbed = disturbed_[free_[i]];
        body.parts.clear();
        for (const std::uint32_t index : from.parts) {
            const Part& part = parts[index];
            if (!part.solid()) continue;
            rigidPartOf_[index] = static_cast<std::uint32_t>(parts_.size());
            given_.push_back(index);
            body.parts.push_back(rigidPartOf_[index]);
            parts_.push_back(
                {part.node.value, i, &part.shape->tree, part.shape->hull ? &*part.shape->hull : nullptr, part.world});
        }
    }
    const auto meet = [&](const PairState& pair) {
        const std::uint32_t bodyA = parts[pair.a].body, bodyB = parts[pair.b].body;
        const auto still = [&](std::uint32_t body, std::uint32_t part) {
            return isFree(body) ? asleep(body) : !startWorlds.contains(part);
        };
        if (still(bodyA, pair.a) && still(bodyB, pair.b)) return;
        const Relation relation = handler.relation(pair.a, pair.b);
        if (relation.response == Interest::kReport) return;
        const std::uint32_t a = rigidPart(handler, pair.a, startWorlds, seconds);
        const std::uint32_t b = rigidPart(handler, pair.b, startWorlds, seconds);
        encounters_.push_back({a, b, lawOf(relation.response)});
    };
    for (const std::uint32_t body : free_)
        for (const std::uint32_t part : handler.bodies()[body].parts)
            for (const std::uint32_t number : memory.pairsOf(part)) {
                const PairState& pair = memory.states()[number];
                // Of two free ones once.
                if (part == pair.a || !isFree(parts[pair.a].body)) meet(pair);
            }
    for (const std::uint64_t id : stage_.supports())
        if (const std::uint32_t part = handler.partOf(ObjectId{id}); part != kNobody && parts[part].solid())
            rigidPart(handler, part, startWorlds, seconds);
}

/// Whether the stage has to be told of any pair.
bool FreeBodies::mayMeet(const ObjectHandler& handler, PairMemory& memory, const StartWorlds& startWorlds) const {
    return std::ranges::any_of(startWorlds, [&](const auto& start) {
        return std::ranges::any_of(memory.pairsOf(start.first), [&](std::uint32_t number) {
            const PairState& pair = memory.states()[number];
            const std::uint32_t other = pair.a == start.first ? pair.b : pair.a;
            return isFree(handler.parts()[other].body) &&
                   handler.relation(pair.a, pair.b).response != Interest::kReport;
        });
    });
}

bool FreeBodies::sameSupports(const ObjectHandler& handler, const StartWorlds& startWorlds) {
    noteMoved(handler, {}, std::ranges::any_of(startWorlds, [&](const auto& start) { return supports(handler, start.first); }));
    supportsStand_ =
        supportsStand_ || std::ranges::all_of(supports_, [&](const std::pair<std::uint64_t, std::uint64_t>& support) {
            const std::uint32_t part = handler.partOf(ObjectId{support.first});
            return part != kNobody && handler.parts()[part].poseVersion == support.second;
        });
    return supportsStand_;
}

void FreeBodies::noteSupports(const ObjectHandler& handler, const StartWorlds& startWorlds) {
    supports_.clear();
    supportsStand_ = false;
    for (const std::uint64_t id : stage_.supports()) {
        const std::uint32_t part = handler.partOf(ObjectId{id});
        const bool stands = part != kNobody && !startWorlds.contains(part);
        supports_.emplace_back(id, stands ? handler.parts()[part].poseVersion : 0);
    }
}

FreeBodies::Outcome FreeBodies::advance(const Aspect& committed, const ObjectHandler& handler,
                                        PairMemory& memory, const StartWorlds& startWorlds, double seconds,
                                        QueryWork& work) {
    Outcome outcome;
    if (free_.empty()) return outcome;
    // Sleepers whom nothing comes near sleep on: nobody need be asked.
    if (unchanged_ && told_ && gravity_ == handler.gravity() && sameSupports(handler, startWorlds) &&
        !mayMeet(handler, memory, startWorlds)) {
        outcome.asleep = free_.size();
        return outcome;
    }
    gather(handler, memory, startWorlds, seconds);
    const RigidFrame frame = stage_.advance(bodies_, parts_, encounters_, handler.gravity(), seconds, work);
    outcome.asleep = frame.asleep;
    told_ = true;
    allAsleep_ = allAsleep_ && frame.asleep == free_.size();
    gravity_ = handler.gravity();
    noteSupports(handler, startWorlds);
    for (const RigidEncounter& encounter : frame.notLookedAt)
        outcome.notLookedAt.push_back(
            {ObjectId{parts_[encounter.partA].id}, ObjectId{parts_[encounter.partB].id}, NotLookedAt::Reason::kWork});
    for (std::uint32_t i = 0; i < free_.size(); ++i) {
        const Body& body = handler.bodies()[free_[i]];
        const RigidMotion& motion = frame.motions[i];
        if (motion.velocity != body.velocity || motion.spin != body.spin)
            outcome.velocities.push_back({body.core, motion.velocity, motion.spin});
        if (motion.world_T_before.matrix() == Isometry3d::Identity().matrix()) continue;
        const Transform* transform = committed.get<Transform>(body.transform);
        if (transform == nullptr) continue;
        Moved moved{.body = free_[i], .way = {.start = poseOf(*transform), .end = poseOf(*transform)}};
        const std::uint32_t parent = handler.places()[body.place].parent;
        const Affine3d above = parent == Place::kNone ? Affine3d(Affine3d::Identity()) : handler.places()[parent].world;
        // Above is rigid but for one scale: what it does to a rotation is a change of axes.
        const Quatd axes = Quatd(Mat3d(above.linear() / std::cbrt(above.linear().determinant()))).normalized();
        const Vec3d origin = motion.world_T_before * (above * transform->translation);
        moved.way.end.translation = above.inverse() * origin;
        moved.way.end.rotation =
            (axes.conjugate() * Quatd(motion.world_T_before.rotation()) * axes * transform->rotation.normalized())
                .normalized();
        if (possible(moved.way.end)) outcome.moved.push_back(std::move(moved));
    }
    std::ranges::sort(outcome.moved, {}, [&](const Moved& m) { return handler.bodies()[m.body].transform; });
    std::ranges::sort(outcome.velocities, {}, &BodyVelocity::core);
    return outcome;
}

std::vector<BodyVelocity> FreeBodies::letGo(const ObjectHandler& handler,
                                            std::initializer_list<std::span<const Mover>> movers, double seconds) {
    std::vector<BodyVelocity> out;
    for (const std::span<const Mover> some : movers)
        for (const Mover& mover : some) {
            const std::uint32_t index = handler.freeBodyOf(mover.number);
            if (index == kNobody) continue;
            const Body& body = handler.bodies()[index];
            BodyVelocity now{body.core, Vec3d::Zero(), Vec3d::Zero()};
            if (mover.wish.source == 0 && seconds > 0) {
                const std::uint32_t parent = handler.places()[body.place].parent;
                const Affine3d above =
                    parent == Place::kNone ? Affine3d(Affine3d::Identity()) : handler.places()[parent].world;
                now.velocity = above.linear() * (mover.way.end.translation - mover.way.start.translation) / seconds;
                const Eigen::AngleAxisd turn(mover.way.end.rotation.normalized() *
                                             mover.way.start.rotation.normalized().conjugate());
                now.spin = (above.linear() * turn.axis()).stableNormalized() * (turn.angle() / seconds);
            }
            if (now.velocity != body.velocity || now.spin != body.spin) out.push_back(now);
        }
    std::ranges::sort(out, {}, &BodyVelocity::core);
    return out;
}

void FreeBodies::end(const ObjectHandler& handler, std::span<const BodyVelocity> velocities) {
    version_ = handler.freeBodiesVersion();
    if (unchanged_ && allAsleep_) return;
    left_.clear();
    leftIndexed_ = false;
    for (const std::uint32_t index : free_) {
        const Body& body = handler.bodies()[index];
        Left& now = left_.emplace_back(Left{body.core, index, versionOf(handler, body), body.velocity, body.spin,
                                            body.mass, body.restitution, body.friction});
        const auto velocity = std::ranges::lower_bound(velocities, body.core, {}, &BodyVelocity::core);
        if (velocity == velocities.end() || velocity->core != body.core) continue;
        now.velocity = velocity->velocity;
        now.spin = velocity->spin;
    }
}

}  // namespace tessera
