#include "server/sim/desk/Deeds.h"

#include <variant>

#include "server/sim/desk/AimDeeds.h"
#include "server/sim/desk/CollisionDeeds.h"
#include "server/sim/desk/EditDeeds.h"
#include "server/sim/desk/FileDeeds.h"
#include "server/sim/desk/PanelDeeds.h"
#include "server/sim/desk/SceneDeeds.h"
#include "server/sim/desk/StatusDeeds.h"
#include "server/sim/desk/ViewDeeds.h"

namespace tessera {

namespace {

constexpr DeedTables kDeeds{edit_deeds::kRows,      scene_deeds::kRows,  view_deeds::kRows,  aim_deeds::kRows,
                            collision_deeds::kRows, status_deeds::kRows, panel_deeds::kRows, file_deeds::kRows};

}  // namespace

ServerActions carryOut(Desk& desk, const Asker& asker, const ApplicationRequest& request, TimePoint now) {
    return std::visit(
        [&]<typename Request>(const Request& wish) {
            constexpr const RequestInfo& info = Request::kInfo;
            if constexpr (info.answered == Answered::kLater)
                if (const std::optional<Error> why = desk.tooManyOpen(asker.connection)) {
                    if (info.bringsArrays) desk.proposals.dropArrays(asker.connection);
                    return desk.refuse(asker, *why);
                }
            return kDeeds(desk, asker, wish, now);
        },
        request);
}

}  // namespace tessera
