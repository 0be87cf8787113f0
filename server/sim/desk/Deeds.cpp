#include "server/sim/desk/Deeds.h"

#include <variant>

#include "server/sim/desk/AimDeeds.h"
#include "server/sim/desk/CollisionDeeds.h"
#include "server/sim/desk/EditDeeds.h"
#include "server/sim/desk/SceneDeeds.h"
#include "server/sim/desk/StatusDeeds.h"
#include "server/sim/desk/ViewDeeds.h"

namespace tessera {

namespace {

constexpr DeedTables kDeeds{edit_deeds::kRows, scene_deeds::kRows,     view_deeds::kRows,
                            aim_deeds::kRows,  collision_deeds::kRows, status_deeds::kRows};

template <typename Request, typename... Which>
constexpr bool kIsOneOf = (std::is_same_v<Request, Which> || ...);

/// Whether an answer comes later: with a frame, a file or from hosts.
template <typename Request>
constexpr bool kStaysOpen = kIsOneOf<Request, request::ProposeChanges, request::UndoStep, request::RedoStep,
                                     request::MoveNode, request::RemoveNode, request::CloneNode, request::Manipulate,
                                     request::LoadFile, request::GetImages, request::SetView>;

}  // namespace

ServerActions carryOut(Desk& desk, const Asker& asker, const ApplicationRequest& request, TimePoint now) {
    return std::visit(
        [&]<typename Request>(const Request& wish) {
            if constexpr (kStaysOpen<Request>)
                if (const std::optional<Error> why = desk.tooManyOpen(asker.connection)) {
                    forget(desk, asker, wish);
                    return desk.refuse(asker, *why);
                }
            return kDeeds(desk, asker, wish, now);
        },
        request);
}

}  // namespace tessera
