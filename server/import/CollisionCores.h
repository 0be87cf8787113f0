/// What a scene file says about collisions, as cores. References are not set: names are looked up later.
#pragma once

#include "common/base/Error.h"
#include "common/cores/CollisionObject.h"
#include "common/cores/Interest.h"
#include "proto/scene.pb.h"

namespace tessera {

// Errors name the field and its bounds: those of the field table, said here because the place in the file is known.
[[nodiscard]] Expected<Interest> readInterest(const proto::scene::Interest& message);
[[nodiscard]] Expected<CollisionObject> readCollisionObject(const proto::scene::CollisionObject& message);

}  // namespace tessera
