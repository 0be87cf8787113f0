/// What programs say to --version.
#pragma once

#include <string>

namespace tessera {

inline constexpr const char* kVersion = "0.1.0";
/// Version of everything on the wire. A peer with another one is refused with both numbers in the message.
inline constexpr unsigned kProtocolVersion = 19;
/// Applications that hold no replica come in from this one on: what they say and are told keeps its numbers.
inline constexpr unsigned kOldestAskersProtocol = 17;

/// e.g. "tessera-server 0.1.0 (protocol 1)".
[[nodiscard]] inline std::string versionText(const std::string& program) {
    return program + " " + kVersion + " (protocol " + std::to_string(kProtocolVersion) + ")";
}

}  // namespace tessera
