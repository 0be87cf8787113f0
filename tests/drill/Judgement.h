/// What a row of the drill measures, what was promised, and whether it was kept.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tessera::drill {

/// What was promised of a quiet machine; nothing where nothing was.
struct Promise {
    std::optional<double> missed = {};     ///< frames that the others miss
    std::optional<double> noticedMs = {};  ///< until the wall goes on without it
    std::optional<double> backMs = {};     ///< until everybody shows frames again
};

struct Measurement {
    std::vector<double> missed = {}, noticedMs = {}, backMs = {};  ///< one value a repetition
    /// The longest gap between two frames of the same wall while nothing was done to it: the machine's own noise, in
    /// frames and ms.
    double usualMissed = 0, usualGapMs = 0;
    std::optional<std::uint64_t> bytes = {};  ///< at the server's network interface, both ways
    std::string stateHash = {};               ///< of everybody, afterwards; empty: not asked
    std::vector<std::string> broken = {};     ///< what else was to hold and did not
    std::string remark = {};
};

/// What was not kept, in words; empty: all was. Medians are judged, each with the machine's own noise added to what was
/// promised: who shares a machine with others stands still now and then without anybody's doing.
[[nodiscard]] std::vector<std::string> judge(const Promise& promise, const Measurement& measured);

}  // namespace tessera::drill
