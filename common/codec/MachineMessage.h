/// Wall.Host.Machine of proto/wall.proto as a Machine. Inside of the codec only.
#pragma once

#include "common/wall/Machine.h"
#include "proto/wall.pb.h"

namespace tessera {

void put(proto::Wall::Machine& to, const Machine& from);
/// As it is written; findMachineFault judges.
[[nodiscard]] Machine machineOf(const proto::Wall::Machine& from);

}  // namespace tessera
