/// What whose token is of a panel asks of it. For Deeds.cpp alone.
#pragma once

#include <fmt/format.h>

#include "server/sim/desk/DeedTable.h"
#include "server/sim/desk/PanelStates.h"
#include "server/sim/frame/Simulation.h"

namespace tessera::panel_deeds {

/// Beside the frames: a panel names more nodes than a frame has time to look for, and many tablets ask.
inline ServerActions getPanel(Desk& desk, const Asker& asker, const request::GetPanel& wish, TimePoint) {
    const auto known = desk.applications.find(asker.connection);
    const std::shared_ptr<const Panel> panel = known == desk.applications.end() ? nullptr : known->second.panel;
    if (!panel) return desk.refuse(asker, {ErrorCode::kNotFound, "this link is of no panel: its token is of none"});
    const auto stampAt = [epoch = desk.around.session.epoch()](Sequence at) {
        return fmt::format("{:x}.{}", epoch.value, at.value);
    };
    const Simulation& simulation = desk.around.simulation;
    if (wish.since == stampAt(simulation.sequence()))
        return desk.answer(asker, answer::PanelState{.stamp = wish.since, .same = true, .title = {}});
    const auto state = [panel, stampAt](const Aspect& scene, Sequence at) -> Expected<ApplicationAnswer> {
        answer::PanelState found = stateOf(*panel, scene);
        found.stamp = stampAt(at);
        return ApplicationAnswer(std::move(found));
    };
    if (!desk.around.lookBeside) return desk.answer(asker, state(simulation.scene(), simulation.sequence()));
    return desk.answerBeside(asker, wish.since.size(), state);
}

inline constexpr DeedTable kRows{&getPanel};

}  // namespace tessera::panel_deeds
