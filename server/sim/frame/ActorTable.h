/// Whoever acts on the scene beside people, in the order of their rows.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "server/sim/frame/Actor.h"
#include "server/sim/frame/Frame.h"

namespace tessera {

/// Passes on what happens in a frame, row by row, and knows none of the actors. Frame thread only.
class ActorTable {
public:
    explicit ActorTable(std::vector<Actor> rows) : rows_(std::move(rows)) {}
    [[nodiscard]] std::span<const Actor> rows() const { return rows_; }

    // Outside the step.
    /// Puts what is said before what people have said.
    void say(const Occasion& occasion, std::vector<Edit>& edits) const;
    /// Of edits with this ticket: see Actor::followsWhatIsSeen.
    [[nodiscard]] bool followsWhatIsSeen(std::uint64_t ticket) const;
    void look(View& view) const;
    [[nodiscard]] std::vector<std::string> takeRemarks() const;
    /// One for each row that waits for something.
    [[nodiscard]] std::vector<Actor::Awaited> awaited(const Aspect& scene, TimePoint now) const;

    /// To those who are told of each list, or of each frame's.
    void follow(Actor::Each each, const Aspect& scene, const ChangeList* list) const;

    // In the step.
    void want(ActorStage& stage) const;
    void hear(const Aspect& scene, const WishOutcome& outcome, ChangeListBuilder& list) const;
    void settle(ActorStage& stage, const StepResult& collisions) const;
    /// The first refusal.
    [[nodiscard]] Expected<void> receive(const Aspect& scene, ChangeList& list, const Actor::Incoming& incoming) const;
    [[nodiscard]] std::vector<Actor::Afterwards> before(ServersHand& hand, const ChangeList& list,
                                                        Actor::ListOf of) const;
    [[nodiscard]] std::vector<Actor::Driver> drivers(const ChangeList& list) const;

private:
    std::vector<Actor> rows_;
};

}  // namespace tessera
