/// Files that are read on the server, until they are edits.
#pragma once

#include <functional>
#include <string>

#include "server/sim/desk/OpenEdits.h"
#include "server/sim/desk/ReloadRequests.h"

namespace tessera {

/// Loads that applications ask for, and what Inlines hold. Read by `Loader`, beside the frames. Frame thread only.
class LoadRequests {
public:
    LoadRequests(const DeskSurroundings& around, OpenEdits& edits, ReloadRequests& reloads)
        : around_(around), edits_(edits), reloads_(reloads) {}

    /// `reload`: if the file is in the scene already it is taken in again. `parent`: none means the root, or wherever
    /// it is. kNotFound: there is no such node. kLimit: too many files wait.
    [[nodiscard]] ServerActions ask(const Asker& asker, const std::string& path, ObjectId parent,
                                    const Placing& placing, bool reload = false);
    /// What an Inline holds comes like any other load, but nobody is answered and it is no step of undo.
    void loadContent(Preparation order);
    [[nodiscard]] ServerActions loaded(Preparation made, TimePoint now);

    /// All that are on their way, the oldest first. `nameOf`: that of an application; empty where it has gone.
    [[nodiscard]] answer::Loads underWay(const Asker& asker, const std::function<std::string(ConnectionId)>& nameOf,
                                         TimePoint now) const;
    /// Whoever waits for it is told `why`, and what is asked for here is done. kRefused: some of it appears already, or
    /// it is the scene that the server begins with. kNotFound: it is not on its way.
    [[nodiscard]] Expected<ServerActions> cancel(std::uint64_t load, const std::string& by);

private:
    const DeskSurroundings& around_;
    OpenEdits& edits_;
    ReloadRequests& reloads_;
};

}  // namespace tessera
