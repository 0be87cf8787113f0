#include "server/collision/pipeline/CollisionPipeline.h"

#include <algorithm>
#include <utility>

#include "server/collision/objects/SceneEffects.h"
#include "server/collision/pipeline/PipelineState.h"

namespace tessera {

StepResult CollisionPipeline::Impl::run(const Aspect& committed, std::span<const TentativeTransform> wanted,
                                        std::span<const Reply> replies, double seconds) {
    const bool asked = !wanted.empty() || !replies.empty();
    if (!asked && !sceneIsNew && still && stillSeconds == seconds) {
        StepResult same = *still;
        giveLists(same);
        return same;
    }
    lists.close();
    still.reset();
    Step step;
    step.work.limit = limits.maxTests;
    handler.dropOverlay(committed);
    admitWishes(committed, wanted, replies, step);

    const bool changed = neighbourhood.find(handler, step.movers, bodies, seconds, memory);
    step.result.counters.neighbours = memory.size();
    if (!handler.deformations().empty()) {
        // Ways are those that are wished for: how far they are free is found against the new shapes.
        lookOnTheWay(true, step);
        handler.settleDeformations();
    }
    rollBack(step);
    move(step);
    for (Touching& touching : step.rolledBack) {
        touching.worldA = part(touching.partA).world;
        touching.worldB = part(touching.partB).world;
        stopped.add(std::move(touching));
    }
    moveFreeBodies(committed, seconds, step);
    std::ranges::sort(step.moved, {}, [](const Mover& mover) { return mover.wish.transform; });
    lookOnTheWay(false, step);
    const bool looked = touchAtRest(step);
    tellStops(step);
    tell(step);
    for (const ObjectId transform : holdBack(step.result.accepted, committed)) {
        step.result.stopped.push_back(transform);
        notLookedAt(transform, {}, NotLookedAt::Reason::kNotFinite, step);
    }
    finish(step);
    const bool rests = !asked && !sceneIsNew && !changed && !looked && sameAsBefore(step);
    sceneIsNew = false;
    if (rests) {
        still = step.result;
        stillSeconds = seconds;
    }
    giveLists(step.result);
    return std::move(step.result);
}

void CollisionPipeline::Impl::giveLists(StepResult& result) {
    std::uint64_t none = 0;
    lists.give(
        contactPage, eventPage,
        {[this, none]() mutable { return contacts.list(handler, describe(), limits.maxContacts, none); },
         [this] { return events.events(limits.maxEvents); }, [this] { return events.distances(limits.maxEvents); }},
        result);
}

/// Whether another step like this one would say the same.
bool CollisionPipeline::Impl::sameAsBefore(const Step& step) const {
    const StepResult& result = step.result;
    return result.accepted.empty() && result.velocities.empty() && result.stopped.empty() && result.questions.empty() &&
           questions.empty() && incomplete.empty() && result.contactsBegun == 0 &&
           (!bodies.any() || bodies.resting()) && eventPage.eventChanges.empty() && eventPage.distanceChanges.empty() &&
           result.counters.eventsLeftOut == 0;
}

void CollisionPipeline::Impl::finish(Step& step) {
    StepResult& result = step.result;
    if (!std::ranges::is_sorted(result.accepted, {}, &TentativeTransform::transform))
        std::ranges::sort(result.accepted, {}, &TentativeTransform::transform);
    std::ranges::sort(result.stopped);
    result.stopped.erase(std::unique(result.stopped.begin(), result.stopped.end()), result.stopped.end());

    contactPage = contacts.turnPage(handler, describe(), limits.maxContacts);
    result.contactsBegun = contactPage.begun;
    result.counters.contactsLeftOut = contactPage.leftOut;

    const auto inTouch = [&](const QuestionBook::Matter& matter) {
        return std::ranges::any_of(memory.told(), [&](std::uint32_t k) {
            const PairState& pair = memory.states()[k];
            return pair.touch.touching && bodyOf(pair.a).node == matter.objectA &&
                   bodyOf(pair.b).node == matter.objectB;
        });
    };
    StepCounters& counters = result.counters;
    counters.unanswered = questions.endFrame(inTouch);
    counters.objects = handler.partCount();
    counters.skipped = handler.partsSkipped();
    counters.boxTests = step.work.boxTests;
    counters.triangleTests = step.work.triangleTests;
    counters.notLookedAt += handler.interestsLeftOut();
    counters.standIns = handler.standIns().size();
    for (const std::uint32_t number : handler.standIns()) {
        if (result.standIns.size() == limits.maxNotLookedAt) break;
        result.standIns.push_back(
            {part(number).node, handler.askedShape(number), nameOf(part(number).shape->representation())});
    }
}

CollisionPipeline::CollisionPipeline(CollisionLimits limits, Workers* workers)
    : impl_(std::make_unique<Impl>(limits, workers)) {}
CollisionPipeline::~CollisionPipeline() = default;
CollisionPipeline::CollisionPipeline(CollisionPipeline&&) noexcept = default;
CollisionPipeline& CollisionPipeline::operator=(CollisionPipeline&&) noexcept = default;

void CollisionPipeline::sceneChanged(const Aspect& aspect, const ChangeList* list) {
    impl_->sceneIsNew = impl_->sceneIsNew || list == nullptr || !list->empty();
    // Contacts are made of where things stand, and of what is asked of them.
    if (impl_->lists.contactsHeld() && (!list || impl_->handler.wouldChange(aspect, *list)))
        impl_->lists.makeContacts();
    impl_->handler.update(aspect, list);
    if (list == nullptr || changesRules(*list)) impl_->bodies.rulesChanged();
}

StepResult CollisionPipeline::step(const Aspect& committed, std::span<const TentativeTransform> wanted,
                                   std::span<const Reply> replies, double seconds) {
    return impl_->run(committed, wanted, replies, seconds);
}

std::vector<std::pair<ObjectId, ObjectId>> CollisionPipeline::overlaps(const Aspect& committed,
                                                                       std::span<const ObjectId> transforms,
                                                                       Deforming deforming) {
    impl_->handler.dropOverlay(committed);
    return impl_->overlapsNow(transforms, deforming);
}

std::vector<std::vector<std::pair<ObjectId, ObjectId>>> CollisionPipeline::overlapsAfter(
    const Aspect& committed, std::span<const PosedTransforms> moves, Against against) {
    impl_->handler.dropOverlay(committed);
    return impl_->overlapsAfter(committed, moves, against);
}

std::uint64_t CollisionPipeline::boxesLookedAt() const {
    return impl_->boxesLookedAt;
}

void CollisionPipeline::forgetLists() {
    impl_->lists.forget();
}

std::vector<std::uint64_t> CollisionPipeline::openQuestions() const {
    return impl_->questions.open();
}

std::span<const InterestTerms> CollisionPipeline::interests() const {
    return impl_->handler.interests();
}

ObjectId CollisionPipeline::bearerOf(ObjectId core) const {
    return impl_->handler.bearerOf(core);
}

const CollisionLimits& CollisionPipeline::limits() const {
    return impl_->limits;
}

std::optional<PickHit> CollisionPipeline::pickNode(const Aspect& aspect, const Ray& ray, PickPatience* patience) {
    return impl_->picker.pick(aspect, impl_->handler, ray, patience);
}

std::optional<AsidePick> CollisionPipeline::pickAside(const Aspect& aspect, const Ray& ray) {
    return impl_->picker.pickAside(aspect, impl_->handler, ray);
}

std::optional<AsideNearest> CollisionPipeline::nearestAside(const Aspect& aspect, const Vec3d& place, ObjectId below) {
    return impl_->picker.nearestAside(aspect, impl_->handler, place, below);
}

void CollisionPipeline::putShapes(std::vector<MadeShape> made) {
    impl_->picker.put(std::move(made));
}

std::vector<std::shared_ptr<const CollisionShape>> CollisionPipeline::takeReleased() {
    return impl_->picker.takeReleased();
}

bool CollisionPipeline::facesIn(const Aspect& aspect, const Box& box, QueryWork& work, std::vector<Triangle>& faces,
                                PickPatience* patience) {
    return impl_->picker.facesIn(aspect, impl_->handler, box, work, faces, patience);
}

std::optional<NearestSurface> CollisionPipeline::nearestSurface(const Aspect& aspect, const Vec3d& place,
                                                                ObjectId below, PickPatience* patience) {
    return impl_->picker.nearest(aspect, impl_->handler, place, below, patience);
}

}  // namespace tessera
