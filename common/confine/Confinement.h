/// Takes away from the running process whatever its work does not need.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "common/confine/Profiles.h"

namespace tessera {

/// First of all, before anything is read: memory, open files and writing are bounded, rights of an administrator given
/// up (but for reading, where the profile reads files), and the process ends with `parent` (0: does not matter).
/// kUnsupported where that cannot be; kFailed where the parent is gone.
[[nodiscard]] Expected<void> boundResources(const ConfinementProfile& profile, pid_t parent);

/// Irrevocable, after `boundResources`, while the process is one thread. Afterwards there are the system calls that the
/// profile's work needs and no others (seccomp): those of networks, processes, tracing and the like end the process,
/// the rest does not exist. With `readsFolder` the folder of `file`, an absolute path without symbolic links, can be
/// read (Landlock), and files there are opened without ever waiting for one (O_NONBLOCK); of a file in the root folder
/// itself alone. Fails closed: kUnsupported, in words that say what is not done, where the kernel lacks what the
/// profile needs; kRefused where a link has come to stand on the way to the folder. With `allowUnconfined` what the
/// kernel has is applied, and lacking is no failure.
[[nodiscard]] Expected<void> confine(const ConfinementProfile& profile, const std::string& file = {},
                                     bool allowUnconfined = false);

/// Of the processor, from the process's beginning: at the limit SIGXCPU ends it.
struct ProcessorTime {
    std::chrono::seconds given{0};
    std::chrono::seconds perMebibyte{0};  ///< see `grantTimeFor`
    std::chrono::seconds most{0};         ///< with all that was granted; less than `given` is as much as that
};
[[nodiscard]] Expected<void> boundProcessorTime(const ProcessorTime& time);
/// So much from now on, rounded up, and no more ever.
[[nodiscard]] Expected<void> boundFurtherTime(std::chrono::seconds more);
/// So much from now on, rounded up, until this is called again: for a process that lives long and does a bounded piece
/// of work at a time (`extendsTime`).
void renewTime(std::chrono::seconds more);
/// Whoever has read so many bytes of a file has more time to make something of them. Before `boundProcessorTime`:
/// nothing.
void grantTimeFor(std::size_t bytes);
/// All bytes that were told of so.
[[nodiscard]] std::uint64_t bytesGranted();

/// What this kernel lacks of what the children need, for a log: a line each, with what is therefore not done. Empty:
/// all is there.
[[nodiscard]] std::vector<std::string> missingForConfinement();

}  // namespace tessera
