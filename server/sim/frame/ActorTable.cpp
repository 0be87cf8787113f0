#include "server/sim/frame/ActorTable.h"

#include <algorithm>
#include <iterator>

namespace tessera {

Expected<void> ServersHand::apply(ChangeList list) {
    const Expected<Committer::Applied> applied = committer_.apply(std::move(list));
    if (!applied) return tl::unexpected(applied.error());
    applied_(applied->list.get());
    return {};
}

void ServersHand::commit(ChangeList list) {
    if (list.empty()) return;
    const Expected<void> done = apply(std::move(list));
    TESSERA_CHECK(done.has_value(), done ? std::string() : done.error().message);
}

void ActorTable::say(const Occasion& occasion, std::vector<Edit>& edits) const {
    std::vector<Edit> all;
    for (const Actor& actor : rows_) {
        if (!actor.say) continue;
        for (ChangeList& list : actor.say(occasion))
            if (!list.empty()) all.push_back({.ticket = actor.ticket, .list = std::move(list), .undoable = false});
    }
    if (all.empty()) return;
    std::ranges::move(edits, std::back_inserter(all));
    edits = std::move(all);
}

bool ActorTable::followsWhatIsSeen(std::uint64_t ticket) const {
    return std::ranges::any_of(rows_,
                               [&](const Actor& actor) { return actor.followsWhatIsSeen && actor.ticket == ticket; });
}

void ActorTable::look(View& view) const {
    for (const Actor& actor : rows_)
        if (actor.look) actor.look(view);
}

std::vector<std::string> ActorTable::takeRemarks() const {
    std::vector<std::string> all;
    for (const Actor& actor : rows_)
        if (actor.remarks) std::ranges::move(actor.remarks(), std::back_inserter(all));
    return all;
}

std::vector<Actor::Awaited> ActorTable::awaited(const Aspect& scene, TimePoint now) const {
    std::vector<Actor::Awaited> all;
    for (const Actor& actor : rows_)
        if (const Actor::Awaited some = actor.awaited ? actor.awaited(scene, now) : Actor::Awaited(); some.count > 0)
            all.push_back(some);
    return all;
}

void ActorTable::follow(Actor::Each each, const Aspect& scene, const ChangeList* list) const {
    for (const Actor& actor : rows_)
        if (actor.follow && actor.each == each) actor.follow(scene, list);
}

void ActorTable::want(ActorStage& stage) const {
    for (const Actor& actor : rows_)
        if (actor.want) actor.want(stage);
}

void ActorTable::hear(const Aspect& scene, const WishOutcome& outcome, ChangeListBuilder& list) const {
    for (const Actor& actor : rows_)
        if (actor.hear) actor.hear(scene, outcome, list);
}

void ActorTable::settle(ActorStage& stage, const StepResult& collisions) const {
    for (const Actor& actor : rows_)
        if (actor.settle) actor.settle(stage, collisions);
}

Expected<void> ActorTable::receive(const Aspect& scene, ChangeList& list, const Actor::Incoming& incoming) const {
    for (const Actor& actor : rows_)
        if (actor.receive)
            if (Expected<void> taken = actor.receive(scene, list, incoming); !taken) return taken;
    return {};
}

std::vector<Actor::Afterwards> ActorTable::before(ServersHand& hand, const ChangeList& list, Actor::ListOf of) const {
    std::vector<Actor::Afterwards> all;
    for (const Actor& actor : rows_)
        if (Actor::Afterwards next = actor.before ? actor.before(hand, list, of) : Actor::Afterwards())
            all.push_back(std::move(next));
    return all;
}

std::vector<Actor::Driver> ActorTable::drivers(const ChangeList& list) const {
    std::vector<Actor::Driver> all;
    for (const Actor& actor : rows_)
        if (actor.drivers) actor.drivers(list, all);
    return all;
}

}  // namespace tessera
