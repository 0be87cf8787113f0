/// A wall's navigation as protobuf's message. Not for other modules: it names a generated class.
#pragma once

#include "common/base/Error.h"
#include "common/wall/Navigation.h"
#include "proto/wall.pb.h"

namespace tessera {

void putNavigation(const Navigation& from, proto::Wall::Navigation& to);
/// Form only: bounds are findNavigationFault's. The error says what is wrong.
[[nodiscard]] Expected<Navigation> readNavigation(const proto::Wall::Navigation& from);

}  // namespace tessera
