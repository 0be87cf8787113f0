/// The state that the files of a journal lead to.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "server/sim/journal/JournalFolder.h"
#include "server/sim/journal/JournalPlaces.h"
#include "server/sim/journal/JournalState.h"

namespace tessera {

/// The files in the folder, read to their end, or before log `upTo`. Nothing in the folder is changed.
///
/// Each file follows the one that was there when it was begun, and `last` names the newest one. So a file that was
/// exchanged by one of another journal, or of an earlier time, is an error.
///
/// A torn end of the very last log is where the story ends, where nothing granted can have been in it: nothing that
/// `last` tells of is missing, and no later record follows. Behind what was synced before a power cut records may
/// follow: a disk writes them in any order, and a power cut may cost what was not synced. All else is an error.
struct JournalStory {
    JournalState state;
    std::uint64_t snapshotBytes = 0, logBytes = 0;
    journal::LogBefore before;  ///< the last whole log that was read, which a next file follows
    /// The last log that was read:
    std::uint64_t wholeBytes = 0, tornBytes = 0;
    bool hollow = false;         ///< not even its opening is whole
    bool afterPowerCut = false;  ///< what is torn may have been granted, and was not synced
};
/// `stop` ends it early, with kFailed. The scene's arrays are in `arrays` for as long as the state holds them.
[[nodiscard]] Expected<JournalStory> readJournal(const JournalFolder& folder, const JournalFiles& files,
                                                 BlobStore& arrays, const JournalLimits& limits,
                                                 std::optional<std::uint64_t> upTo = std::nullopt,
                                                 const std::atomic<bool>* stop = nullptr);
/// The same without arrays: `places` knows where they are, and the state names them.
[[nodiscard]] Expected<JournalStory> readJournal(const JournalFolder& folder, const JournalFiles& files,
                                                 JournalPlaces& places, const JournalLimits& limits, std::uint64_t upTo,
                                                 const std::atomic<bool>& stop);

}  // namespace tessera
