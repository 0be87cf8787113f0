/// Requests that change the scene. For Deeds.cpp alone.
#pragma once

#include <fmt/format.h>

#include "common/scene/Edits.h"
#include "server/sim/desk/DeedTable.h"
#include "server/sim/desk/StepPlans.h"
#include "server/sim/frame/Simulation.h"

namespace tessera::edit_deeds {

inline ServerActions propose(Desk& desk, const Asker& asker, const Proposal& proposal, TimePoint now) {
    return desk.proposals.propose(asker, proposal, now);
}

inline ServerActions step(Desk& desk, const Asker& asker, Edit::Kind kind, TimePoint now) {
    return desk.edits.enter({.asker = asker, .edit = {.kind = kind}}, desk.around.simulation.arraysOf(kind), now);
}

inline ServerActions undo(Desk& desk, const Asker& asker, const request::UndoStep&, TimePoint now) {
    return step(desk, asker, Edit::Kind::kUndo, now);
}

inline ServerActions redo(Desk& desk, const Asker& asker, const request::RedoStep&, TimePoint now) {
    return step(desk, asker, Edit::Kind::kRedo, now);
}

inline ServerActions move(Desk& desk, const Asker& asker, const request::MoveNode& wish, TimePoint now) {
    const Gesture gesture{asker.connection.value, wish.gesture};
    return desk.edits.enter({.asker = asker, .edit = {.gesture = gesture, .move = wish.move, .node = wish.node}}, {},
                            now);
}

inline ServerActions remove(Desk& desk, const Asker& asker, const request::RemoveNode& wish, TimePoint now) {
    const std::size_t most = desk.limits.maxProposalChanges;
    // Each node is taken from its place and destroyed: two changes at least.
    Expected<ChangeList> list = removalList(desk.around.simulation.scene(), wish.node, most / 2);
    if (!list) return desk.refuse(asker, list.error());
    if (list->changeCount() > most)
        return desk.refuse(asker, {ErrorCode::kLimit, fmt::format("it would take {} changes at once, and {} may be "
                                                                  "made; remove it part by part",
                                                                  list->changeCount(), most)});
    const std::uint64_t removed = list->destructions.size();
    return desk.edits.enter({.asker = asker, .edit = {.list = std::move(*list)}, .removed = removed}, {}, now);
}

inline ServerActions clone(Desk& desk, const Asker& asker, const request::CloneNode& wish, TimePoint now) {
    return desk.copies.ask(asker, wish.wish, now);
}

inline ServerActions loadFile(Desk& desk, const Asker& asker, const request::LoadFile& wish, TimePoint) {
    Placing placing = wish.placing;
    placing.variants = wish.variants;
    return desk.loads.ask(asker, wish.path, wish.parent, placing, wish.reload);
}

inline ServerActions loadAsset(Desk& desk, const Asker& asker, const request::LoadAsset& wish, TimePoint) {
    Placing placing = wish.placing;
    placing.variants = wish.variants;
    return desk.loads.ask(asker, std::string(wish.kPrefix) + wish.name, wish.parent, placing, wish.reload);
}

inline ServerActions getSteps(Desk& desk, const Asker& asker, const request::GetSteps&, TimePoint) {
    const Simulation& simulation = desk.around.simulation;
    return desk.answer(
        asker, ApplicationAnswer(answer::Steps{
                   .sequence = simulation.sequence(), .undo = undoPlan(simulation), .redo = redoPlan(simulation)}));
}

inline constexpr DeedTable kRows{&propose, &undo, &redo, &move, &remove, &clone, &loadFile, &loadAsset, &getSteps};

}  // namespace tessera::edit_deeds
