/// What no child may do, tried in earnest.
#pragma once

#include <sys/types.h>

#include <functional>
#include <string>
#include <vector>

namespace tessera::test {

/// What an attempt may do harm to: all of it is the test's own.
struct Victims {
    std::string file;    ///< that somebody else may read and write
    std::string folder;  ///< where it lies
    pid_t process = 0;   ///< of the same user
    int listener = 0;    ///< the port on loopback at which somebody listens
};

struct Attempt {
    std::string name;
    std::function<bool(const Victims&)> succeeds;
};

/// Of files, networks, processes, other processes, the machine.
[[nodiscard]] std::vector<Attempt> forbiddenAttempts();
/// Memory that can be executed: of those that compile nothing.
[[nodiscard]] Attempt makingCode();

}  // namespace tessera::test
