/// Logs become a snapshot.
#pragma once

#include <atomic>
#include <cstdint>

#include "server/sim/journal/JournalFolder.h"

namespace tessera {

/// Writes what the files before log `upTo` lead to as snapshot `upTo`, and removes them; gives its bytes. Whenever it
/// is interrupted, what lies in the folder tells the same story. Arrays go from file to file through a buffer of 1 MiB.
/// In memory are the scene and the history without arrays and without the bytes of ranges; one record; and names and
/// places of arrays (JournalPlaces).
[[nodiscard]] Expected<std::uint64_t> compactJournal(const JournalFolder& folder, std::uint64_t upTo,
                                                     const JournalLimits& limits, const std::atomic<bool>& stop);

}  // namespace tessera
