/// How the audit log names what somebody writes.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/request/Requests.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {

/// Before it is done: what is gone afterwards has its name then. "/hall/crane" of a node, and of a core that one node
/// has; "#17 Material" of other objects; "#17" of what stands among more siblings than are looked at, or very deep.
/// What a list makes is named by its place to be. `most` of them, each once, whatever else the list writes.
[[nodiscard]] std::vector<std::string> auditNames(const Simulation& simulation, const ChangeList& list,
                                                  std::size_t most);
/// The same of objects as they stand in the scene.
[[nodiscard]] std::vector<std::string> auditNames(const Simulation& simulation, std::span<const ObjectId> objects,
                                                  std::size_t most);
/// The name that a list gives to a node that it makes; empty: it gives none, or far behind.
[[nodiscard]] std::string nameIn(const ChangeList& list, ObjectId made);
/// The nodes and files that a request names itself.
[[nodiscard]] std::vector<std::string> auditNames(const Simulation& simulation, const ApplicationRequest& request);

}  // namespace tessera
