/// The part of the object handler that keeps bodies, and finds those that are free.
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/cores/CollisionObject.h"
#include "server/collision/objects/ObjectHandler.h"
#include "server/collision/objects/SortOnce.h"

namespace tessera {

namespace {

/// Whether a map keeps shapes but for one scale, and does not mirror them. Products of a hundred rotations do.
bool rigidButForScale(const Affine3d& m) {
    constexpr double kTolerance = 1e-9;
    const Mat3d gram = m.linear().transpose() * m.linear();
    const double scale = gram.trace() / 3;
    if (!std::isfinite(scale) || !(scale > 0)) return false;
    return (gram - scale * Mat3d::Identity()).cwiseAbs().maxCoeff() <= kTolerance * scale &&
           m.linear().determinant() > 0;
}

}  // namespace

std::uint32_t ObjectHandler::makeBody(std::uint32_t place) {
    std::uint32_t number = 0;
    if (freeBodyNumbers_.empty()) {
        number = static_cast<std::uint32_t>(bodies_.size());
        bodies_.emplace_back();
        bodyTerms_.emplace_back();
    } else {
        number = freeBodyNumbers_.back();
        freeBodyNumbers_.pop_back();
    }
    bodies_[number].place = place;
    bodies_[number].node = tree_.at(place).node;
    return number;
}

void ObjectHandler::touchBody(std::uint32_t body) {
    if (std::exchange(bodyTerms_[body].touched, true)) return;
    touchedBodies_.push_back(body);
}

void ObjectHandler::settleBodies(const Aspect& aspect) {
    std::sort(touchedBodies_.begin(), touchedBodies_.end());
    for (const std::uint32_t body : touchedBodies_) {
        bodyTerms_[body].touched = false;
        if (bodies_[body].parts.empty())
            removeBody(body);
        else
            settleBody(aspect, body);
    }
    touchedBodies_.clear();
}

void ObjectHandler::settleBody(const Aspect& aspect, std::uint32_t number) {
    Body& body = bodies_[number];
    BodyTerms& terms = bodyTerms_[number];
    const Place& place = tree_.at(body.place);
    setObject(number, standings_[body.place].object);
    if (body.free()) noteFree(number);
    BodyShape shape;
    bool candidate = false;
    if (terms.object == kNobody) {
        const Body plain;
        body.core = {};
        body.kind = plain.kind;
        body.layers = plain.layers;
        body.restitution = plain.restitution;
        body.friction = plain.friction;
        body.tolerance = plain.tolerance;
        body.velocity = plain.velocity;
        body.spin = plain.spin;
        terms.mass = 0;
    } else {
        const CollisionObjectTable::Entry& entry = objects_.at(terms.object);
        body.core = entry.core;
        body.kind = entry.kind;
        body.layers = entry.layers;
        shape.choice = entry.choice;
        shape.deforms = entry.kind == CollisionWords::kDeforming;
        candidate = entry.kind == CollisionWords::kRigid && entry.division == CollisionWords::kWhole &&
                    place.transform && place.movable && tree_.bearers()[tree_.bearersOf(place.transform)].count == 1;
    }
    if (shape != terms.shape) touchedParts_.insert(touchedParts_.end(), body.parts.begin(), body.parts.end());
    terms.shape = shape;
    terms.candidate = candidate;
    candidates_.push_back(number);
    if (terms.object != kNobody) copyTerms(*aspect.get<CollisionObject>(body.core), number);
    if (!candidate) return;
    const auto inOrder = [&](std::uint32_t a, std::uint32_t b) { return before(a, b); };
    if (std::is_sorted(body.parts.begin(), body.parts.end(), inOrder)) return;
    std::sort(body.parts.begin(), body.parts.end(), inOrder);
    for (std::uint32_t i = 0; i < body.parts.size(); ++i) partTerms_[body.parts[i]].inBody = i;
}

void ObjectHandler::removeBody(std::uint32_t number) {
    Body& body = bodies_[number];
    if (body.free()) {
        noteFree(number);
        listFree(number, false);
        if (tree_.find(body.node) == body.place) askBelow(body.place);
    }
    setObject(number, kNobody);
    standings_[body.place].body = kNobody;
    body = {};
    bodyTerms_[number] = {};
    freeBodyNumbers_.push_back(number);
}

void ObjectHandler::setObject(std::uint32_t number, std::uint32_t object) {
    BodyTerms& terms = bodyTerms_[number];
    if (terms.object == object) return;
    if (terms.object != kNobody) {
        std::vector<std::uint32_t>& others = objects_.at(terms.object).bodies;
        others[terms.inObject] = others.back();
        bodyTerms_[others.back()].inObject = terms.inObject;
        others.pop_back();
    }
    terms.object = object;
    if (object == kNobody) return;
    std::vector<std::uint32_t>& others = objects_.at(object).bodies;
    terms.inObject = static_cast<std::uint32_t>(others.size());
    others.push_back(number);
}

/// What can change without anybody belonging elsewhere.
void ObjectHandler::copyTerms(const CollisionObject& core, std::uint32_t body) {
    Body& mine = bodies_[body];
    mine.restitution = core.restitution;
    mine.friction = core.friction;
    mine.tolerance = core.tolerance;
    mine.velocity = core.velocity;
    mine.spin = core.spin;
    const double mass = bodyTerms_[body].candidate ? core.mass : 0;
    if (mine.free()) noteFree(body);
    if (mass != bodyTerms_[body].mass) candidates_.push_back(body);
    bodyTerms_[body].mass = mass;
}

double ObjectHandler::toleranceOf(std::uint32_t a, std::uint32_t b, double size, double relative) const {
    double said = 0;
    for (const std::uint32_t part : {a, b}) {
        if (parts_[part].body == kNobody) continue;
        const double own = bodies_[parts_[part].body].tolerance;
        if (own > 0 && (said == 0 || own < said)) said = own;
    }
    // Less would be lost among rounding errors.
    constexpr double kLeast = 1e-9;
    return said > 0 ? std::max(said, kLeast * size) : relative * size;
}

/// All conditions of CollisionObject::mass that poses and shapes decide; the others have chosen the candidates.
bool ObjectHandler::mayBeFree(const Body& body, const BodyTerms& terms) const {
    if (!terms.candidate || !(terms.mass > 0) || terms.solids == 0) return false;
    const std::uint32_t parent = tree_.at(body.place).parent;
    if (parent != Place::kNone && !rigidButForScale(tree_.at(parent).world)) return false;
    for (std::uint32_t at = parent; at != Place::kNone; at = tree_.at(at).parent)
        if (standings_[at].body != kNobody && bodies_[standings_[at].body].free()) return false;
    return true;
}

/// What is below a place may be free now, or no longer.
void ObjectHandler::askBelow(std::uint32_t place) {
    if (tree_.at(place).objects == (standings_[place].isTop ? 1u : 0u)) return;
    tree_.walk(place, [&](std::uint32_t at) {
        ++work_.places;
        const std::uint32_t below = standings_[at].body;
        if (at != place && below != kNobody && bodyTerms_[below].candidate) candidates_.push_back(below);
        return tree_.at(at).objects > 0;
    });
}

void ObjectHandler::findFreeBodies() {
    if (candidates_.empty()) return;
    while (!candidates_.empty()) {
        std::vector<std::uint32_t> asked = std::exchange(candidates_, {});
        sortOnce(asked);
        std::erase_if(asked, [&](std::uint32_t body) { return !bodies_[body].node; });
        // Those above first: what is at or below a free body is not free.
        if (asked.size() > 1)
            std::sort(asked.begin(), asked.end(), [&](std::uint32_t a, std::uint32_t b) {
                return tree_.order().before(bodies_[a].place, bodies_[b].place);
            });
        for (const std::uint32_t number : asked) {
            Body& body = bodies_[number];
            const bool was = body.free(), free = mayBeFree(body, bodyTerms_[number]);
            const double mass = free ? bodyTerms_[number].mass : 0;
            if (mass != body.mass) noteFree(number);
            body.mass = mass;
            body.transform = free ? tree_.at(body.place).transform : ObjectId{};
            if (free == was) continue;
            listFree(number, free);
            askBelow(body.place);
        }
    }
}

void ObjectHandler::listFree(std::uint32_t body, bool free) {
    std::uint32_t& at = bodyTerms_[body].inFree;
    if (free) {
        at = static_cast<std::uint32_t>(freeBodies_.size());
        freeBodies_.push_back(body);
        return;
    }
    bodyTerms_[freeBodies_.back()].inFree = at;
    freeBodies_[at] = freeBodies_.back();
    freeBodies_.pop_back();
    at = kNobody;
}

}  // namespace tessera
