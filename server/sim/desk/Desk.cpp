#include "server/sim/desk/Desk.h"

#include <fmt/format.h>

#include "common/request/Check.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {

std::string Desk::nameOf(ConnectionId connection) const {
    const auto known = applications.find(connection);
    if (known == applications.end()) return {};
    return known->second.who.name.empty() ? known->second.name : known->second.who.name;
}

std::optional<Error> Desk::mayNot(ConnectionId connection, const RequestInfo& info) const {
    const auto known = applications.find(connection);
    const Role role = known == applications.end() ? Role::kViewer : known->second.who.role;
    if (role < info.role) return roleRefusal(info, role);
    if (known == applications.end() || !known->second.panel || info.forPanels) return std::nullopt;
    return Error{ErrorCode::kRefused,
                 fmt::format("{} is not for the token of a panel: it reaches the fields of \"{}\" alone", info.name,
                             known->second.panel->title)};
}

std::optional<Error> Desk::mayNot(ConnectionId connection, const ApplicationRequest& request) {
    const auto known = applications.find(connection);
    if (known == applications.end() || !known->second.panel) return std::nullopt;
    return panelRights.whyNot(known->second.panel, around.simulation.scene(), around.simulation.sequence(), request);
}

std::shared_ptr<const Panel> Desk::panelIn(const std::string& name, const std::string& text) {
    constexpr std::size_t kMost = 64;
    if (const auto known = panels.find(name); known != panels.end()) return known->second;
    Expected<Panel> panel = parsePanel(text, name);
    if (panels.size() >= kMost) panels.erase(panels.begin());
    return panels[name] = panel ? std::make_shared<const Panel>(std::move(*panel)) : nullptr;
}

ServerActions Desk::afterLooking(const Asker& asker, std::size_t bytes, Look look) {
    return looks.ask(asker, bytes, [this, asker, look = std::move(look)] {
        around.lookBeside([this, asker, look](const Aspect& scene, Sequence at) -> WorkedOut {
            return [this, connection = asker.connection, then = look(scene, at)](TimePoint now) {
                looks.done();
                return applications.contains(connection) ? then(now) : ServerActions();
            };
        });
    });
}

ServerActions Desk::answerBeside(const Asker& asker, std::size_t bytes, Found make) {
    const auto look = [this, asker, make = std::move(make)](const Aspect& scene, Sequence at) -> WorkedOut {
        // Encoded there, too: that takes as long.
        return [this, to = asker.connection, reply = replyTo(asker, make(scene, at))](TimePoint) {
            return around.session.reply(to, reply);
        };
    };
    return afterLooking(asker, bytes, look);
}

void Desk::letGo(std::shared_ptr<const void> with) const {
    std::vector<std::shared_ptr<const CollisionShape>> gone = around.simulation.takeReleased();
    if (!around.workBeside || (gone.empty() && !with)) return;
    around.workBeside([gone = std::move(gone), with = std::move(with)]() mutable {
        gone.clear();
        with.reset();
        return withoutWord([] {});
    });
}

std::optional<Error> Desk::tooManyOpen(ConnectionId connection) const {
    const OpenEdits::Count open = edits.countOf(connection);
    const std::size_t count =
        open.edits + images.openCount(connection) + previews.openCount(connection) + views.openCount(connection);
    if (count >= limits.maxOpenRequests)
        return Error{ErrorCode::kLimit,
                     fmt::format("{} requests of this application are open already; try again later", count)};
    if (open.bytes >= limits.maxOpenBytes)
        return Error{ErrorCode::kLimit, fmt::format("proposals of {} MiB of this application wait already; "
                                                    "try again later",
                                                    open.bytes >> 20)};
    return std::nullopt;
}

}  // namespace tessera
