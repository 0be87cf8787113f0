/// How much of the file a reader has done, for who waits for it.
#pragma once

#include <cstdint>

namespace tessera {

/// Of the one file of this process: `done` of `total`, in what the reader counts. Cheap: it is passed on ten times a
/// second at most, and nowhere where nobody listens. A reader that says nothing is read without a number.
void sayProgress(std::uint64_t done, std::uint64_t total);
/// From here to the next word on reading it is worked out what was read: normals, orders, pictures. 0 of 0: nobody
/// knows how much of that is done.
void sayConverting(std::uint64_t done = 0, std::uint64_t total = 0);

/// Where it goes, from the process' only thread.
void listenToProgress(void (*listener)(std::uint64_t done, std::uint64_t total, bool converting));

}  // namespace tessera
