/// Files that are read on the server, until they are edits.
#pragma once

#include <string>

#include "server/sim/desk/OpenEdits.h"

namespace tessera {

/// Loads that applications ask for, and what Inlines hold. Read by `Loader`, beside the frames. Frame thread only.
class LoadRequests {
public:
    LoadRequests(const DeskSurroundings& around, OpenEdits& edits) : around_(around), edits_(edits) {}

    /// `parent`: none means the root. kNotFound: there is no such node. kLimit: too many files wait.
    [[nodiscard]] ServerActions ask(const Asker& asker, const std::string& path, ObjectId parent,
                                    const Placing& placing);
    /// What an Inline holds comes like any other load, but nobody is answered and it is no step of undo.
    void loadContent(Preparation order);
    [[nodiscard]] ServerActions loaded(Preparation made, TimePoint now);

private:
    const DeskSurroundings& around_;
    OpenEdits& edits_;
};

}  // namespace tessera
