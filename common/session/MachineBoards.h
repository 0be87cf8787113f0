/// Hosts of one machine are told of each other's boards.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/session/Messages.h"

namespace tessera {

/// Each host is told, once it is there and whenever that has changed, which other hosts of its machine are there and
/// have a board. What they do with that is no business of the session.
///
/// Invariants: nobody is told the same twice in a row on one connection; what is said of one machine is bounded, in
/// lines and their lengths. Pure; one owner.
class MachineBoards {
public:
    /// In the order in which hosts are told, and told of.
    explicit MachineBoards(const std::vector<std::string>& hosts) {
        for (const std::string& name : hosts) places_.push_back({.host = name});
    }

    using News = std::vector<std::pair<std::string, message::Neighbours>>;  ///< by host
    /// On a new connection, with what its Hello says; an empty machine or board: it shares nothing.
    [[nodiscard]] News arrives(const std::string& host, const std::string& machine, const std::string& board);
    [[nodiscard]] News leaves(const std::string& host);
    /// All go, and say it again when they come: nobody is told of it.
    void startOver();

private:
    struct Place {
        std::string host;
        bool there = false;
        std::string machine, board;
        std::string told;  ///< the last, on this connection
    };
    [[nodiscard]] Place& placeOf(const std::string& host);
    [[nodiscard]] News newsOf(const std::string& machine);

    std::vector<Place> places_;
};

}  // namespace tessera
