/// Finds the first object in which a replica differs from the scene.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "common/scene/Aspect.h"
#include "common/session/ServerSession.h"

namespace tessera {

/// One walk down the hash tree per host, against the scene as it was when the mismatch was found (the scene goes on).
class StateComparison {
public:
    /// Remembers the present hashes; call when the mismatch is reported.
    void begin(const std::string& host, const Aspect& scene);

    struct Step {
        std::optional<std::uint64_t> queryLeaf;  ///< ask for this leaf's objects next
        std::string finding;                     ///< done: the first differing object, in words
    };
    /// `received` are the replica's hashes. With neither a query nor a finding there is nothing more to learn.
    [[nodiscard]] Step compare(const server_action::HashesReceived& received, const Aspect& scene);

private:
    struct Remembered {
        std::map<std::uint64_t, std::uint64_t> leaves;
        std::map<std::uint64_t, std::uint64_t> objects;
    };
    std::map<std::string, Remembered> byHost_;
};

}  // namespace tessera
