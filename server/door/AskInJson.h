/// A request that came as JSON, asked of the server.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/json/Json.h"
#include "server/door/DoorLink.h"

namespace tessera {

/// An answer of more than that many bytes, as it comes, is taken apart and written beside the door's thread.
inline constexpr std::size_t kMostAtOnce = std::size_t{64} << 10;

/// Reads `fields` as that request and asks it of the server; paths in it are looked up there first. Exactly one call of
/// `answered`, with the answer as it came (codec ApplicationCodec), unless the link is closed.
void askInJson(DoorLink& link, const std::string& request, std::shared_ptr<const Json> fields,
               std::vector<ByteSlice> binaries, std::function<void(const ApiExpected<ByteSlice>&)> answered);

}  // namespace tessera
