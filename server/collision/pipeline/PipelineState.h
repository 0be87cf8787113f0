/// What the collision pipeline holds, and the stages of its step. Private to the pipeline.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <unordered_set>
#include <vector>

#include "server/collision/pipeline/CollisionPipeline.h"
#include "server/collision/pipeline/ContactList.h"
#include "server/collision/pipeline/EventBook.h"
#include "server/collision/pipeline/EventNotes.h"
#include "server/collision/pipeline/MotionTask.h"
#include "server/collision/pipeline/Neighbourhood.h"
#include "server/collision/pipeline/PairTasks.h"
#include "server/collision/pipeline/QuestionBook.h"
#include "server/collision/pipeline/ScenePicker.h"
#include "server/collision/pipeline/SelfContacts.h"
#include "server/collision/pipeline/StepLists.h"
#include "server/collision/pipeline/StoppedContacts.h"

namespace tessera {

struct CollisionPipeline::Impl {
    Impl(CollisionLimits l, Workers* w)
        : limits(l),
          workers(w),
          shapes(std::make_shared<ShapeCache>()),
          handler(shapes, {.maxInterests = l.maxInterests}),
          neighbourhood(w),
          bodies(w),
          picker(shapes) {}

    CollisionLimits limits;
    Workers* workers;
    std::shared_ptr<ShapeCache> shapes;
    ObjectHandler handler;
    Neighbourhood neighbourhood;
    PairMemory memory;
    FreeBodies bodies;
    QuestionBook questions;
    EventBook events;
    StoppedContacts stopped;
    SelfContacts selfContacts;
    ScenePicker picker;
    std::unique_ptr<Response> stop = makeStopResponse(), slide = makeSlideResponse();
    ContactList contacts;
    std::vector<Mover> admitted;            // kept for its memory
    std::vector<std::uint32_t> incomplete;  // pairs whose touch a limit left open
    bool sceneIsNew = true;                 // since the last step
    std::optional<StepResult> still;        // what a step says as long as nothing changes, but for lists
    double stillSeconds = 0;
    EventBook::Page eventPage;  // of the last step
    ContactList::Page contactPage;

    StepLists lists;  // last: they are made of all the others

    std::uint64_t boxesLookedAt = 0;  // by overlapsNow and overlapsAfter

    // State of one step.
    struct Step {
        StepResult result;
        QueryWork work;
        std::vector<Mover> movers;            // that something may be in the way of, ascending by transform
        std::vector<Mover> plain;             // free bodies that are moved and that nothing is in the way of
        std::vector<Mover> moved;             // all that moved, on the ways that they went, ascending by transform
        FreeBodies::StartWorlds startWorlds;  // of the parts that they carry, but for free bodies
        std::unordered_set<std::uint32_t> metDeforming;  // pairs whose first contact the deformation has told
        std::vector<Touching> rolledBack;                // what made everybody go back; their poses are still to come
        std::vector<EventBook::Touching> touchedOnTheWay, stopped;
    };

    StepResult run(const Aspect& committed, std::span<const TentativeTransform> wanted, std::span<const Reply> replies,
                   double seconds);
    void admitWishes(const Aspect& committed, std::span<const TentativeTransform> wanted,
                     std::span<const Reply> replies, Step& step);
    void noteStart(const Mover& mover, Step& step) const;
    [[nodiscard]] std::vector<std::uint32_t> pairsCarried(std::span<const Mover> movers) const;
    [[nodiscard]] bool sameAsBefore(const Step& step) const;
    /// Of parts in the order of the deciding interest's sides.
    [[nodiscard]] bool obstacle(std::uint32_t a, std::uint32_t b, const Relation& relation, ObjectId transform) const;
    // PipelineOverlaps.cpp
    struct Carriers;
    [[nodiscard]] Carriers carriersOf(std::span<const ObjectId> transforms);
    template <typename Visit>
    void forNeighbours(const Carriers& carriers, std::optional<std::span<const std::uint32_t>> others,
                       const Visit& visit);
    /// `pair`: the number of the two in the memory, or kNobody.
    [[nodiscard]] bool touchesNow(std::uint32_t i, std::uint32_t other, ObjectId transform, std::uint32_t pair,
                                  QueryWork& work) const;
    [[nodiscard]] std::vector<std::pair<ObjectId, ObjectId>> overlapsNow(
        std::span<const ObjectId> transforms, Deforming deforming,
        std::optional<std::span<const std::uint32_t>> others = std::nullopt);
    [[nodiscard]] std::vector<std::vector<std::pair<ObjectId, ObjectId>>> overlapsAfter(
        const Aspect& committed, std::span<const PosedTransforms> moves, Against against);
    void rollBack(Step& step);
    [[nodiscard]] MotionTask taskOf(const Mover& mover) const;
    void move(Step& step);
    void settle(const MotionTask& task, Step& step);
    void ask(const MotionTrial& trial, const Resolution& resolution, const Mover& mover, Step& step);
    void moveFreeBodies(const Aspect& committed, double seconds, Step& step);
    void lookOnTheWay(bool deforming, Step& step);
    void askAllFaces(std::uint32_t pair, QueryWork& work);
    [[nodiscard]] bool touchAtRest(Step& step);
    void giveLists(StepResult& result);
    [[nodiscard]] auto describe() {
        return [this](std::uint32_t k) { return restingContact(handler, memory.states()[k]); };
    }
    void tellStops(Step& step);
    void tell(Step& step);
    void finish(Step& step);

    void notLookedAt(ObjectId a, ObjectId b, NotLookedAt::Reason reason, Step& step) const {
        ++step.result.counters.notLookedAt;
        if (step.result.notLookedAt.size() < limits.maxNotLookedAt) step.result.notLookedAt.push_back({a, b, reason});
    }
    [[nodiscard]] const Part& part(std::uint32_t index) const { return handler.parts()[index]; }
    [[nodiscard]] const Body& bodyOf(std::uint32_t index) const { return handler.bodies()[part(index).body]; }
    [[nodiscard]] Relation relationOf(const PairState& pair) const {
        return handler.relation(std::min(pair.a, pair.b), std::max(pair.a, pair.b));
    }
    [[nodiscard]] ObjectId interestOf(const Relation& relation) const {
        return relation.interests.empty() ? ObjectId{} : handler.interests()[relation.interests.front()].core;
    }
    template <typename Query>
    void forPairs(std::span<const std::uint32_t> pairs, QueryWork& work, const Query& query) {
        tessera::forPairs(handler, memory.states(), pairs, workers, work, query);
    }
};

}  // namespace tessera
