/// The descriptions as a protobuf schema: proto/application.proto is what this prints.
#pragma once

#include <string>

namespace tessera {

/// With the members' help, units and bounds, and where the bytes of records stand, as comments.
[[nodiscard]] std::string applicationSchema();

}  // namespace tessera
