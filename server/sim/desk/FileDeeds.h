/// What lies in the folders from which may be loaded, and what is on its way. For Deeds.cpp alone.
#pragma once

#include "server/sim/desk/DeedTable.h"
#include "server/sim/desk/FolderListing.h"

namespace tessera::file_deeds {

/// Folders may be slow: read on a thread of their own, beside which everything else goes on.
inline ServerActions getFiles(Desk& desk, const Asker& asker, const request::GetFiles& wish, TimePoint) {
    if (!desk.around.listBeside || !desk.around.files)
        return desk.refuse(asker, {ErrorCode::kUnsupported, "this server tells nobody what lies in its folders"});
    return desk.listings.ask(asker, wish.wish.folder.size(), [&desk, asker, wish = wish.wish] {
        desk.around.listBeside([&desk, asker, wish]() -> WorkedOut {
            return [&desk, asker, page = desk.around.files->list(wish)](TimePoint) {
                desk.listings.done();
                if (!desk.applications.contains(asker.connection)) return ServerActions();
                return desk.answer(asker, page ? Expected<ApplicationAnswer>(*page) : tl::unexpected(page.error()));
            };
        });
    });
}

inline ServerActions getLoads(Desk& desk, const Asker& asker, const request::GetLoads&, TimePoint now) {
    const auto nameOf = [&desk](ConnectionId connection) { return desk.nameOf(connection); };
    return desk.answer(asker, ApplicationAnswer(desk.loads.underWay(asker, nameOf, now)));
}

inline ServerActions cancelLoad(Desk& desk, const Asker& asker, const request::CancelLoad& wish, TimePoint) {
    Expected<ServerActions> told = desk.loads.cancel(wish.load, desk.nameOf(asker.connection));
    if (!told) return desk.refuse(asker, told.error());
    append(*told, desk.done(asker));
    return *std::move(told);
}

inline constexpr DeedTable kRows{&getFiles, &getLoads, &cancelLoad};

}  // namespace tessera::file_deeds
