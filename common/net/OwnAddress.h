/// Which addresses are this machine's own.
#pragma once

#include <string>

namespace tessera {

/// A number, of IPv4 or IPv6, in one way of writing: without a scope, and IPv4 in IPv6 ("::ffff:127.0.0.1") as IPv4.
/// Other texts stay what they are.
[[nodiscard]] std::string plainAddress(const std::string& address);
/// Such a number: is it loopback's, or one of this machine's interfaces'? Asks the kernel, some microseconds.
[[nodiscard]] bool isOwnAddress(const std::string& address);

}  // namespace tessera
