#include "server/sim/desk/RequestDesk.h"

#include <algorithm>

#include "server/sim/desk/Deeds.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {

namespace {
constexpr std::uint64_t kHeldTicket = ~std::uint64_t{5};  ///< of what is said of held handles; nobody waits for it
}  // namespace

ServerActions RequestDesk::received(const server_action::RequestReceived& received, TimePoint now) {
    const Asker asker{.connection = received.connection, .request = received.id};
    // The one place where roles are looked at.
    const Expected<ApplicationRequest> decoded = decodeRequest(received.body, {}, [&](const RequestInfo& info) {
        std::optional<Error> why = desk_.mayNot(received.connection, info);
        if (why && info.bringsArrays) desk_.proposals.dropArrays(received.connection);
        return why;
    });
    if (!decoded) return desk_.refuse(asker, decoded.error());
    return carryOut(desk_, asker, *decoded, now);
}

ServerActions RequestDesk::blobsEverywhere(std::uint64_t token) {
    desk_.edits.blobsEverywhere(token);
    return {};
}

void RequestDesk::applicationLeft(ConnectionId connection) {
    desk_.applications.erase(connection);
    desk_.news.applicationLeft(connection);
    if (desk_.around.steering) desk_.around.steering->applicationLeft(connection.value);
    desk_.images.applicationLeft(connection);
    desk_.views.applicationLeft(connection);
    desk_.looks.applicationLeft(connection);
    desk_.works.applicationLeft(connection);
    desk_.proposals.dropArrays(connection);
    desk_.around.drags.release(connection.value);
    desk_.edits.forgetLeftBehind([this](ConnectionId one) { return desk_.applications.contains(one); });
    desk_.copies.goOn();
}

std::vector<Edit> RequestDesk::takeEdits() {
    std::vector<Edit> edits = desk_.edits.takeEdits();
    const DeskSurroundings& around = desk_.around;
    if (around.steering && around.whyNoEdit()) around.steering->letGoOfHandles();
    // Beside steps of undo there is nothing else in a frame.
    if (std::ranges::none_of(edits, isStep, &Edit::kind)) {
        if (around.steering) std::ranges::move(around.steering->takeEdits(), std::back_inserter(edits));
        Simulation& simulation = around.simulation;
        ChangeList held = around.drags.corrections(simulation.scene(), simulation.manipulators());
        if (!held.empty()) edits.push_back({.ticket = kHeldTicket, .list = std::move(held), .undoable = false});
    }
    desk_.edits.takePart(edits);
    return edits;
}

ServerActions RequestDesk::committed(FrameResult frame, FrameNumber number,
                                     std::span<const std::uint64_t> openQuestions) {
    ServerActions actions = desk_.edits.committed(std::move(frame.outcomes));
    desk_.copies.goOn();
    if (desk_.around.uploads) desk_.around.uploads->letGo(std::move(frame.unneeded));
    append(actions, desk_.news.committed(std::move(frame.collision), number, openQuestions));
    return actions;
}

}  // namespace tessera
