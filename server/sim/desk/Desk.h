/// What a deed has at hand.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "server/panel/Panel.h"
#include "server/sim/desk/BesideRequests.h"
#include "server/sim/desk/CopyRequests.h"
#include "server/sim/desk/DeskSurroundings.h"
#include "server/sim/desk/ImageRequests.h"
#include "server/sim/desk/LoadRequests.h"
#include "server/sim/desk/OpenEdits.h"
#include "server/sim/desk/PanelRights.h"
#include "server/sim/desk/PreviewRequests.h"
#include "server/sim/desk/ProposalRequests.h"
#include "server/sim/desk/ReloadRequests.h"

namespace tessera {

/// All that waits for something, with what the server lends the desk. Frame thread only.
struct Desk {
    /// An application, as its link has brought it.
    struct Known {
        std::string name = {};  ///< as it calls itself
        Entrant who = {.role = Role::kOperator};
        std::shared_ptr<const Panel> panel = {};  ///< whose fields alone it reaches; null: all that its role does
        TimePoint since = {};
    };

    Desk(const DeskSurroundings& lent, const DeskLimits& most)
        : around(lent),
          limits(most),
          edits(around, limits),
          proposals(around, limits, edits),
          reloads(around, edits),
          loads(around, edits, reloads),
          copies(around, limits, edits),
          images(around.wall, around.session, limits.imageDeadline),
          previews(around.wall, around.session),
          views(around.answers(), around.view, around.simulation, around.orderSurvey),
          news(around.session, limits.news),
          looks(around.answers()),
          works(around.answers()),
          listings(around.answers()) {}
    ~Desk() { *closing = true; }
    Desk(const Desk&) = delete;
    Desk& operator=(const Desk&) = delete;

    const DeskSurroundings around;
    const DeskLimits limits;
    std::map<ConnectionId, Known> applications;                  ///< that are there
    std::uint64_t comings = 0;                                   ///< and goings of these, so far
    std::map<std::string, std::shared_ptr<const Panel>> panels;  ///< by their names among the keys
    PanelRights panelRights;
    OpenEdits edits;
    ProposalRequests proposals;
    ReloadRequests reloads;
    LoadRequests loads;
    CopyRequests copies;
    ImageRequests images;
    PreviewRequests previews;
    ViewRequests views;
    FrameNews news;
    BesideRequests looks, works, listings;
    /// For what is under way on other threads: nobody waits for it any more.
    const std::shared_ptr<std::atomic<bool>> closing = std::make_shared<std::atomic<bool>>(false);

    /// For people: that of the person, else of the program; empty: it has gone.
    [[nodiscard]] std::string nameOf(ConnectionId connection) const;
    [[nodiscard]] ServerActions answer(const Asker& asker, const Expected<ApplicationAnswer>& answer) const {
        return around.answers().to(asker, answer);
    }
    [[nodiscard]] ServerActions done(const Asker& asker) const { return answer(asker, answer::Done{}); }
    [[nodiscard]] ServerActions refuse(const Asker& asker, Error why) const {
        return answer(asker, tl::unexpected(std::move(why)));
    }
    /// `look` is called beside the frames with the scene as it is then, and what it returns on the frame thread after
    /// that, unless the application has gone.
    using Look = std::function<WorkedOut(const Aspect& scene, Sequence sequence)>;
    [[nodiscard]] ServerActions afterLooking(const Asker& asker, std::size_t bytes, Look look);
    /// An answer that is found in the scene as it is then, beside the frames. `make` is called on another thread.
    using Found = std::function<Expected<ApplicationAnswer>(const Aspect& scene, Sequence sequence)>;
    [[nodiscard]] ServerActions answerBeside(const Asker& asker, std::size_t bytes, Found make);
    /// Lets go of what is kept for picks no more, and of this, beside the frames: that takes as long as one.
    void letGo(std::shared_ptr<const void> with = {}) const;
    /// One that has gone may do nothing any more.
    [[nodiscard]] std::optional<Error> mayNot(ConnectionId connection, const RequestInfo& info) const;
    /// The same of what it says in it, where it reaches a panel alone.
    [[nodiscard]] std::optional<Error> mayNot(ConnectionId connection, const ApplicationRequest& request);
    /// Read once, however often somebody comes with it. Null: it is no panel any more.
    [[nodiscard]] std::shared_ptr<const Panel> panelIn(const std::string& name, const std::string& text);
    /// Each application for itself: one that asks without end keeps no other from asking.
    [[nodiscard]] std::optional<Error> tooManyOpen(ConnectionId connection) const;
};

}  // namespace tessera
