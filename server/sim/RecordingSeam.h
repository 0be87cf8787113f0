/// A simulation made and stepped as its present constructor and step want it.
#pragma once

#include "server/sim/Simulation.h"

namespace tessera {

struct SimulationOptions;

namespace detail {
template <typename Sim, typename Options>
Sim simulationOf(const SceneLimits& limits, unsigned threads) {
    if constexpr (requires { Sim(Options{limits, threads}); })
        return Sim(Options{limits, threads});
    else
        return Sim(limits);
}
template <typename Sim>
FrameResult stepOf(Sim& simulation, bool first, std::vector<Edit> edits, std::vector<Reply> replies) {
    if constexpr (requires { simulation.step(first, std::move(edits), std::move(replies)); })
        return simulation.step(first, std::move(edits), std::move(replies));
    else
        return simulation.step(first, std::move(edits));
}
}  // namespace detail

inline Simulation simulationOf(const SceneLimits& limits, unsigned threads) {
    return detail::simulationOf<Simulation, SimulationOptions>(limits, threads);
}
inline FrameResult stepOf(Simulation& simulation, bool first, std::vector<Edit> edits, std::vector<Reply> replies) {
    return detail::stepOf(simulation, first, std::move(edits), std::move(replies));
}

}  // namespace tessera
