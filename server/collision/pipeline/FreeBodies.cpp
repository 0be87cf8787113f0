#include "server/collision/pipeline/FreeBodies.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/cores/Transform.h"
#include "common/math/Decompositions.h"

namespace tessera {
namespace {

ContactLaw lawOf(std::int64_t response) {
    if (response == InterestWords::kBounce) return ContactLaw::kBounce;
    return response == InterestWords::kSlide ? ContactLaw::kSlide : ContactLaw::kStick;
}

/// All of one kind of volume, whatever their objects ask for: what is divided anew for each question would cost more
/// than any kind saves. All trees of what deforms follow it.
const TriangleTree& treeOf(const CollisionShape& shape) {
    return shape.tree(kAutomaticVolume);
}

Pose poseOf(const Transform& t) {
    return {t.translation, t.rotation, t.scale};
}

void sortOnce(std::vector<std::uint32_t>& numbers) {
    if (!std::ranges::is_sorted(numbers)) std::ranges::sort(numbers);
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
}

/// What moves a part from one pose to another in some seconds, as the velocity of its origin and a spin about it.
void setVelocity(RigidBody& body, const Affine3d& start, const Affine3d& end, double seconds) {
    body.anchor = start.translation();
    const Affine3d move = end * start.inverse();
    if (!move.matrix().allFinite()) return;
    body.velocity = (end.translation() - start.translation()) / seconds;
    const Eigen::AngleAxisd turn(rotationOf(move));
    body.spin = turn.axis() * (turn.angle() / seconds);
    if (!body.spin.allFinite()) body.spin = Vec3d::Zero();
}

}  // namespace

std::uint64_t FreeBodies::versionOf(const ObjectHandler& handler, const Body& body) {
    std::uint64_t sum = 0;
    for (const std::uint32_t part : body.parts) sum += handler.parts()[part].poseVersion;
    return sum;
}

void FreeBodies::noteMoved(std::span<const std::uint32_t> parts) {
    for (const std::uint32_t part : parts)
        if (part < supportOf_.size() && supportOf_[part]) suspects_.push_back(std::exchange(supportOf_[part], {}));
}

void FreeBodies::forget(std::uint32_t slot) {
    stage_.gone(known_[slot].core.value);
    slotOfCore_.erase(known_[slot].core);
    known_[slot] = {};
    freeSlots_.push_back(slot);
}

/// A body that is free in this frame; what is known of it by its core.
void FreeBodies::attach(std::uint32_t number, const ObjectHandler& handler, bool disturbed) {
    const Body& body = handler.bodies()[number];
    std::uint32_t slot = slotOfCore_.find(body.core);
    if (slot == IdTable::kNone) {
        if (freeSlots_.empty()) {
            slot = static_cast<std::uint32_t>(known_.size());
            known_.emplace_back();
        } else {
            slot = freeSlots_.back();
            freeSlots_.pop_back();
        }
        slotOfCore_.insert(body.core, slot);
        known_[slot].core = body.core;
        disturbed = true;
    }
    Known& known = known_[slot];
    if (known.body != kNobody && known.body != number) slotOfBody_[known.body] = kNobody;
    known.body = number;
    slotOfBody_[number] = slot;
    // What cannot be met has nothing that says where its mass is either: such a body is not free for the handler.
    known.disturbed = known.disturbed || disturbed || known.poseVersion != versionOf(handler, body) ||
                      known.velocity != body.velocity || known.spin != body.spin || known.mass != body.mass ||
                      known.restitution != body.restitution || known.friction != body.friction;
    known.asleep = !known.disturbed && stage_.asleep(body.core.value);
    if (!known.asleep) awake_.push_back(number);
}

void FreeBodies::begin(ObjectHandler& handler, std::vector<std::uint32_t> held) {
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
    now_.clear();
    const bool sameBodies = generation_ == handler.generation();
    std::vector<std::uint32_t> look = handler.takeFreeChanged();
    unchanged_ = allAsleep_ && !othersMatter && held.empty() && held_.empty() && sameBodies && look.empty();
    if (unchanged_) return;
    told_ = false;
    std::ranges::sort(held);
    std::vector<std::uint32_t> orphans;  // slots
    if (!sameBodies) {
        generation_ = handler.generation();
        slotOfBody_.clear();
        for (std::uint32_t slot = 0; slot < known_.size(); ++slot) {
            known_[slot].body = kNobody;
            if (known_[slot].core) orphans.push_back(slot);
        }
        supportOf_.clear();
        for (const std::uint64_t id : stage_.supports()) suspects_.emplace_back(id);
        look.assign(handler.freeBodies().begin(), handler.freeBodies().end());
    } else {
        for (const std::vector<std::uint32_t>* more : {&again_, &held, &held_})
            look.insert(look.end(), more->begin(), more->end());
        if (othersMatter)
            for (const Known& known : known_)
                if (known.core) look.push_back(known.body);
    }
    sortOnce(look);
    slotOfBody_.resize(std::max(slotOfBody_.size(), bodies.size()), kNobody);
    const auto free = [&](std::uint32_t body) {
        return bodies[body].free() && !std::ranges::binary_search(held, body);
    };
    if (sameBodies)
        for (const std::uint32_t body : look)
            if (isFree(body) != free(body)) changed_.push_back(body);
    for (const std::uint32_t body : look) {
        const std::uint32_t slot = slotOfBody_[body];
        if (slot == kNobody || (free(body) && known_[slot].core == bodies[body].core)) continue;
        known_[slot].body = slotOfBody_[body] = kNobody;
        orphans.push_back(slot);
    }
    awake_.clear();
    for (const std::uint32_t body : look)
        if (free(body)) attach(body, handler, othersMatter);
    for (const std::uint32_t slot : orphans)
        if (known_[slot].body == kNobody) forget(slot);
    held_ = std::move(held);
    allAsleep_ = awake_.empty();
    again_ = awake_;
    now_ = std::move(look);
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

/// What is not free goes part by part: parts of one body may move in different ways.
void FreeBodies::describePart(const ObjectHandler& handler, std::uint32_t index, const StartWorlds& startWorlds,
                              double seconds, RigidBody& body, RigidPart& rigid) {
    const Part& part = handler.parts()[index];
    const Body& of = handler.bodies()[part.body];
    body.id = part.node.value;
    body.restitution = of.restitution;
    body.friction = of.friction;
    rigid.id = part.node.value;
    rigid.tree = &treeOf(*part.shape);
    rigid.hull = part.shape->hull();
    rigid.world = part.world;
    if (const auto start = startWorlds.find(index); start != startWorlds.end()) {
        rigid.world = start->second;
        setVelocity(body, start->second, part.world, seconds);
    }
}

/// A free body, with all its parts.
void FreeBodies::describe(const ObjectHandler& handler, std::uint32_t number, RigidBody& rigid,
                          std::vector<RigidPart>& parts) const {
    const Body& body = handler.bodies()[number];
    rigid.id = body.core.value;
    rigid.mass = body.mass;
    rigid.restitution = body.restitution;
    rigid.friction = body.friction;
    rigid.velocity = body.velocity;
    rigid.spin = body.spin;
    rigid.disturbed = known_[slotOfBody_[number]].disturbed;
    for (const std::uint32_t index : body.parts) {
        const Part& part = handler.parts()[index];
        if (part.solid()) parts.push_back({part.node.value, 0, &treeOf(*part.shape), part.shape->hull(), part.world});
    }
}

RigidBody& FreeBodies::nextBody(std::uint32_t number) {
    if (bodies_.size() == bodyOf_.size()) bodies_.emplace_back();
    RigidBody& body = bodies_[bodyOf_.size()];
    bodyOf_.push_back(number);
    std::vector<std::uint32_t> parts = std::move(body.parts);
    parts.clear();
    body = {};
    body.parts = std::move(parts);
    return body;
}

void FreeBodies::give(const ObjectHandler& handler, std::uint32_t number) {
    const auto place = static_cast<std::uint32_t>(bodyOf_.size());
    RigidBody& rigid = nextBody(number);
    auto next = static_cast<std::uint32_t>(parts_.size());
    describe(handler, number, rigid, parts_);
    for (const std::uint32_t index : handler.bodies()[number].parts) {
        if (!handler.parts()[index].solid()) continue;
        rigidPartOf_[index] = next;
        given_.push_back(index);
        rigid.parts.push_back(next);
        parts_[next++].body = place;
    }
}

/// The number of a part in what is handed to the stage.
std::uint32_t FreeBodies::rigidPart(const ObjectHandler& handler, std::uint32_t index, const StartWorlds& startWorlds,
                                    double seconds) {
    if (rigidPartOf_[index] != kNobody) return rigidPartOf_[index];
    const std::uint32_t body = handler.parts()[index].body;
    if (isFree(body)) {
        give(handler, body);
        return rigidPartOf_[index];
    }
    const auto place = static_cast<std::uint32_t>(bodyOf_.size());
    RigidBody& rigid = nextBody(kNobody);
    rigidPartOf_[index] = static_cast<std::uint32_t>(parts_.size());
    given_.push_back(index);
    RigidPart& part = parts_.emplace_back();
    part.body = place;
    rigid.parts.push_back(rigidPartOf_[index]);
    describePart(handler, index, startWorlds, seconds, rigid, part);
    return rigidPartOf_[index];
}

void FreeBodies::gather(const ObjectHandler& handler, PairMemory& memory, const StartWorlds& startWorlds,
                        double seconds) {
    const std::span<const Part> parts = handler.parts();
    for (const std::uint32_t part : given_) rigidPartOf_[part] = kNobody;
    given_.clear();
    rigidPartOf_.resize(std::max(rigidPartOf_.size(), parts.size()), kNobody);
    bodyOf_.clear();
    parts_.clear();
    encounters_.clear();
    for (const std::uint32_t body : awake_) give(handler, body);
    const auto meet = [&](const PairState& pair) {
        const Relation relation = handler.relation(pair.a, pair.b);
        if (relation.response == InterestWords::kReport) return;
        const std::uint32_t a = rigidPart(handler, pair.a, startWorlds, seconds);
        const std::uint32_t b = rigidPart(handler, pair.b, startWorlds, seconds);
        encounters_.push_back({a, b, lawOf(relation.response)});
    };
    const auto isAwake = [&](std::uint32_t part) { return isFree(parts[part].body) && !asleep(parts[part].body); };
    for (const std::uint32_t body : awake_)
        for (const std::uint32_t part : handler.bodies()[body].parts)
            for (const std::uint32_t number : memory.pairsOf(part)) {
                const PairState& pair = memory.states()[number];
                // Of two that are awake once.
                if (part == pair.a || !isAwake(pair.a)) meet(pair);
            }
    for (const auto& [part, start] : startWorlds) {
        if (isFree(parts[part].body)) continue;
        for (const std::uint32_t number : memory.pairsOf(part)) {
            const PairState& pair = memory.states()[number];
            if (asleep(parts[pair.a == part ? pair.b : pair.a].body)) meet(pair);
        }
        if (parts[part].solid() && stage_.supports(parts[part].node.value))
            rigidPart(handler, part, startWorlds, seconds);
    }
    for (const ObjectId id : suspects_) {
        const std::uint32_t part = handler.partOf(id);
        if (part == kNobody || !parts[part].solid()) {
            stage_.gone(id.value);
            continue;
        }
        rigidPart(handler, part, startWorlds, seconds);
        supportOf_.resize(std::max(supportOf_.size(), parts.size()));
        if (stage_.supports(id.value)) supportOf_[part] = id;
    }
    suspects_.clear();
}

/// Those that sleep are not handed over: the stage asks for them where something wakes them.
struct FreeBodies::Sleepers final : RigidSource {
    Sleepers(const FreeBodies& b, const ObjectHandler& h, const StartWorlds& s, double t)
        : bodies(b), handler(h), startWorlds(s), seconds(t) {}

    bool body(std::uint64_t id, RigidBody& body, std::vector<RigidPart>& parts) override {
        const std::uint32_t slot = bodies.slotOfCore_.find(ObjectId{id});
        if (slot == IdTable::kNone) return false;
        bodies.describe(handler, bodies.known_[slot].body, body, parts);
        return true;
    }
    bool support(std::uint64_t id, RigidBody& body, std::vector<RigidPart>& parts) override {
        const std::uint32_t part = handler.partOf(ObjectId{id});
        if (part == kNobody || !handler.parts()[part].solid()) return false;
        if (const std::uint32_t of = handler.parts()[part].body; bodies.isFree(of))
            bodies.describe(handler, of, body, parts);
        else
            describePart(handler, part, startWorlds, seconds, body, parts.emplace_back());
        return true;
    }

    const FreeBodies& bodies;
    const ObjectHandler& handler;
    const StartWorlds& startWorlds;
    double seconds;
};

/// Whether the stage has to be told of any pair.
bool FreeBodies::mayMeet(const ObjectHandler& handler, PairMemory& memory, const StartWorlds& startWorlds) const {
    return std::ranges::any_of(startWorlds, [&](const auto& start) {
        return std::ranges::any_of(memory.pairsOf(start.first), [&](std::uint32_t number) {
            const PairState& pair = memory.states()[number];
            const std::uint32_t other = pair.a == start.first ? pair.b : pair.a;
            return isFree(handler.parts()[other].body) &&
                   handler.relation(pair.a, pair.b).response != InterestWords::kReport;
        });
    });
}

FreeBodies::Outcome FreeBodies::advance(const Aspect& committed, const ObjectHandler& handler, PairMemory& memory,
                                        const StartWorlds& startWorlds, double seconds, QueryWork& work) {
    Outcome outcome;
    if (!any()) return outcome;
    const bool supportMoves = std::ranges::any_of(
        startWorlds, [&](const auto& start) { return stage_.supports(handler.parts()[start.first].node.value); });
    // Sleepers whom nothing comes near sleep on: nobody need be asked.
    if (unchanged_ && told_ && gravity_ == handler.gravity() && suspects_.empty() && !supportMoves &&
        !mayMeet(handler, memory, startWorlds)) {
        outcome.asleep = count();
        return outcome;
    }
    gather(handler, memory, startWorlds, seconds);
    Sleepers sleepers(*this, handler, startWorlds, seconds);
    const RigidFrame frame = stage_.advance(std::span(bodies_).first(bodyOf_.size()), parts_, encounters_,
                                            handler.gravity(), seconds, work, &sleepers);
    outcome.asleep = frame.asleep;
    told_ = true;
    allAsleep_ = allAsleep_ && frame.asleep == count();
    gravity_ = handler.gravity();
    for (const std::uint64_t id : frame.supports) {
        const std::uint32_t part = handler.partOf(ObjectId{id});
        supportOf_.resize(std::max(supportOf_.size(), handler.parts().size()));
        supportOf_[part] = ObjectId{id};
    }
    for (const RigidFrame::Left& pair : frame.notLookedAt)
        outcome.notLookedAt.push_back({ObjectId{pair.partA}, ObjectId{pair.partB}, NotLookedAt::Reason::kWork});
    for (const std::uint64_t id : frame.fetched) {
        const std::uint32_t slot = slotOfCore_.find(ObjectId{id});
        bodyOf_.push_back(slot == IdTable::kNone ? kNobody : known_[slot].body);
    }
    outcome.handedOver = bodyOf_.size();
    for (std::size_t i = 0; i < bodyOf_.size(); ++i) {
        if (bodyOf_[i] == kNobody) continue;
        Known& known = known_[slotOfBody_[bodyOf_[i]]];
        known.disturbed = false;
        if (known.asleep) again_.push_back(bodyOf_[i]);
        const Body& body = handler.bodies()[bodyOf_[i]];
        const RigidMotion& motion = frame.motions[i];
        if (motion.velocity != body.velocity || motion.spin != body.spin)
            outcome.velocities.push_back({body.core, motion.velocity, motion.spin});
        if (motion.world_T_before.matrix() == Isometry3d::Identity().matrix()) continue;
        const Transform* transform = committed.get<Transform>(body.transform);
        if (transform == nullptr) continue;
        Moved moved{.body = bodyOf_[i], .way = {.start = poseOf(*transform), .end = poseOf(*transform)}};
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
    sortOnce(again_);
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

void FreeBodies::end(ObjectHandler& handler, std::span<const BodyVelocity> velocities) {
    const std::vector<std::uint32_t> moved = handler.takeFreeChanged();
    for (const std::span<const std::uint32_t> some : {std::span(std::as_const(now_)), std::span(moved)})
        for (const std::uint32_t index : some) {
            if (!isFree(index)) continue;
            const Body& body = handler.bodies()[index];
            Known& now = known_[slotOfBody_[index]];
            now.poseVersion = versionOf(handler, body);
            now.velocity = body.velocity;
            now.spin = body.spin;
            now.mass = body.mass;
            now.restitution = body.restitution;
            now.friction = body.friction;
        }
    // What still sleeps and is elsewhere was carried there, perhaps away from what it lay on.
    for (const std::uint32_t index : moved) {
        if (!asleep(index) || !stage_.asleep(known_[slotOfBody_[index]].core.value)) continue;
        known_[slotOfBody_[index]].disturbed = true;
        again_.push_back(index);
        allAsleep_ = false;
    }
    for (const BodyVelocity& velocity : velocities) {
        const std::uint32_t slot = slotOfCore_.find(velocity.core);
        if (slot == IdTable::kNone) continue;
        known_[slot].velocity = velocity.velocity;
        known_[slot].spin = velocity.spin;
    }
}

}  // namespace tessera
