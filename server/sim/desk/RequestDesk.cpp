#include "server/sim/desk/RequestDesk.h"

#include <algorithm>

#include "server/sim/desk/AuditNames.h"
#include "server/sim/desk/Deeds.h"
#include "server/sim/desk/StatusAnswers.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {

namespace {
constexpr std::uint64_t kHeldTicket = ~std::uint64_t{5};  ///< of what is said of held handles; nobody waits for it

notice::States statesOf(const Desk& desk) {
    notice::States states{.hosts = hostsOf(desk.around.session),
                          .journalTrouble = {},
                          .applications = desk.applications.size(),
                          .comings = desk.comings};
    if (const std::optional<Error> why = desk.around.whyNoEdit()) states.journalTrouble = why->message;
    return states;
}
}  // namespace

ServerActions RequestDesk::received(const server_action::RequestReceived& received, TimePoint now) {
    Asker asker{.connection = received.connection, .request = received.id};
    AuditBook* const audit = desk_.around.audit;
    // The one place where roles are looked at.
    const Expected<ApplicationRequest> decoded = decodeRequest(received.body, {}, [&](const RequestInfo& info) {
        std::optional<Error> why = desk_.mayNot(received.connection, info);
        if (why && info.bringsArrays) desk_.proposals.dropArrays(received.connection);
        if (audit && why) audit->mayNot(asker.connection, info, why->message, received.from);
        if (audit && !why) asker.deed = audit->asked(asker.connection, info, received.from);
        return why;
    });
    if (!decoded) return desk_.refuse(asker, decoded.error());
    if (std::optional<Error> why = desk_.mayNot(received.connection, *decoded)) {
        if (audit) audit->mayNot(asker.connection, infoOf(*decoded), why->message, received.from);
        desk_.proposals.dropArrays(received.connection);
        return desk_.refuse(asker, *std::move(why));
    }
    if (audit && audit->wantsObjects(asker.connection, asker.deed))
        audit->names(asker.connection, asker.deed, auditNames(desk_.around.simulation, *decoded));
    return carryOut(desk_, asker, *decoded, now);
}

ServerActions RequestDesk::blobsEverywhere(std::uint64_t token) {
    desk_.edits.blobsEverywhere(token);
    return {};
}

void RequestDesk::applicationJoined(ConnectionId connection, Desk::Known known, const std::string& from,
                                    const std::string* panel) {
    // One that is none any more reaches nothing.
    static const auto kNothing = std::make_shared<const Panel>();
    if (panel && !known.panel) known.panel = desk_.panelIn(known.who.panel, *panel);
    if (panel && !known.panel) known.panel = kNothing;
    // Of whom a door asks for it says where that is.
    if (AuditBook* const audit = desk_.around.audit)
        audit->came(connection, {known.who, known.name, known.who.from.empty() ? from : known.who.from});
    desk_.applications.insert_or_assign(connection, std::move(known));
    ++desk_.comings;
}

void RequestDesk::uploading(const server_action::UploadReceived& received) {
    const auto known = desk_.applications.find(received.connection);
    if (known == desk_.applications.end() || !known->second.panel) desk_.proposals.uploading(received);
}

ServerActions RequestDesk::advance(TimePoint now) {
    if (AuditBook* const audit = desk_.around.audit) audit->advance(now);
    ServerActions actions = desk_.images.advance(now);
    append(actions, desk_.previews.advance(now));
    if (now >= desk_.news.nextDeadline()) append(actions, desk_.news.states(statesOf(desk_), now));
    return actions;
}

TimePoint RequestDesk::nextDeadline() const {
    const AuditBook* const audit = desk_.around.audit;
    return std::min({desk_.images.nextDeadline(), desk_.previews.nextDeadline(), desk_.news.nextDeadline(),
                     audit ? audit->nextDeadline() : TimePoint::max()});
}

void RequestDesk::applicationLeft(ConnectionId connection) {
    desk_.comings += desk_.applications.erase(connection);
    desk_.news.applicationLeft(connection);
    if (desk_.around.steering) desk_.around.steering->applicationLeft(connection.value);
    desk_.images.applicationLeft(connection);
    desk_.previews.applicationLeft(connection);
    desk_.views.applicationLeft(connection);
    desk_.looks.applicationLeft(connection);
    desk_.works.applicationLeft(connection);
    desk_.listings.applicationLeft(connection);
    desk_.proposals.dropArrays(connection);
    desk_.around.drags.release(connection.value);
    desk_.edits.forgetLeftBehind([this](ConnectionId one) { return desk_.applications.contains(one); });
    if (AuditBook* const audit = desk_.around.audit)
        audit->left(connection, [&](std::uint64_t deed) { return desk_.edits.has(connection, deed); });
    desk_.copies.goOn();
}

std::vector<Edit> RequestDesk::takeEdits() {
    std::vector<Edit> edits = desk_.edits.takeEdits();
    const DeskSurroundings& around = desk_.around;
    if (around.steering && around.whyNoEdit()) around.steering->letGoOfHandles();
    // Beside steps of undo there is nothing else in a frame.
    if (std::ranges::none_of(edits, isStep, &Edit::kind)) {
        Simulation& simulation = around.simulation;
        std::vector<Edit> byHand = around.steering ? around.steering->takeEdits() : std::vector<Edit>();
        if (around.audit)
            for (const Edit& edit : byHand)
                around.audit->byHand(auditNames(simulation, edit.list, AuditBook::kMostObjects),
                                     edit.list.changeCount());
        std::ranges::move(byHand, std::back_inserter(edits));
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
