/// The law of relative moves: a node that is moved by ones alone. Each move that is granted is in its list, once.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/support/wall/SimulatedWall.h"

namespace tessera::simulation {

class MoveTally {
public:
    /// `/tally` in the scene of this application, whose lists it looks at from now on.
    explicit MoveTally(SimulatedApplication& application);
    /// The application is there anew, with the whole scene.
    void look(const SimulatedApplication& application, bool whole);

    [[nodiscard]] ObjectId node() const { return node_; }
    [[nodiscard]] ObjectId core() const { return core_; }

    /// Such a request was sent: a move, or a step of undo or redo, which may be one of moves.
    enum class Asked : std::uint8_t { kMove, kStep };
    void asked(const std::string& application, std::uint64_t request, Asked what) {
        asked_[{application, request}] = what;
    }
    [[nodiscard]] bool waits() const { return !asked_.empty(); }
    void answered(const std::string& application, std::uint64_t request, const Expected<ApplicationAnswer>& answer);
    /// Nobody will answer its questions. Empty: those of all.
    void forgetQuestionsOf(const std::string& application);

    /// Compares granted moves with the lists since the last call. No answer is awaited then. Empty: all is
    /// there.
    [[nodiscard]] std::string fault();

private:
    struct TallyReading {
        Sequence sequence;
        double at = 0;
        bool whole = false;
    };
    ObjectId node_, core_;
    std::vector<TallyReading> readings_;  ///< after each list
    std::map<std::pair<std::string, std::uint64_t>, Asked> asked_;
    std::map<Sequence, int> granted_;  ///< moves, by the list that has them
    std::set<Sequence> steps_;
    int unknown_ = 0;  ///< moves that nobody will be told of
    bool stepUnknown_ = false;
};

}  // namespace tessera::simulation
