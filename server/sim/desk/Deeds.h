/// What is done for each request.
#pragma once

#include "server/sim/desk/Desk.h"

namespace tessera {

/// Does what the request asks: its row is in the table of its topic (EditDeeds.h, SceneDeeds.h, ViewDeeds.h,
/// AimDeeds.h, CollisionDeeds.h, StatusDeeds.h). One that has no row does not compile. One that would stay open is
/// refused where its application has too many open.
[[nodiscard]] ServerActions carryOut(Desk& desk, const Asker& asker, const ApplicationRequest& request, TimePoint now);

}  // namespace tessera
