/// A request that came as JSON, asked of the server.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/json/Json.h"
#include "server/door/DoorLink.h"

namespace tessera {

/// Reads `fields` as that request and asks it of the server; paths in it are looked up there first. Exactly one call of
/// `answered`, unless the link is closed.
void askInJson(DoorLink& link, const std::string& request, std::shared_ptr<const Json> fields,
               std::vector<ByteSlice> binaries, std::function<void(const ApiExpected<ApplicationAnswer>&)> answered);

}  // namespace tessera
