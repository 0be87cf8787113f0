/// Memory of this process that others of the same user on the same machine may look into.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/Error.h"

namespace tessera {

/// What processes have in common that can reach each other's memory: machine (boot id), user and the namespace that
/// their process ids are in. Empty where that cannot be told: nobody is a neighbour then.
[[nodiscard]] std::string machineIdentity();
/// Of every file without a name that is shared: hosts that share have one user, and no other has a right to it.
inline constexpr unsigned kSharedMode = 0600;

/// A mapping; unmapped with the object.
class Mapping {
public:
    Mapping() = default;
    Mapping(std::byte* data, std::size_t bytes) : data_(data), bytes_(bytes) {}
    ~Mapping();
    Mapping(Mapping&& other) noexcept { *this = std::move(other); }
    Mapping& operator=(Mapping&& other) noexcept;

    [[nodiscard]] std::byte* data() const { return data_; }
    [[nodiscard]] std::size_t bytes() const { return bytes_; }

private:
    std::byte* data_ = nullptr;
    std::size_t bytes_ = 0;
};

/// A file in memory (memfd_create) that has no name and goes with its last process. Its size is sealed: who maps it can
/// never be made to touch what is not there. Pages that nobody has written take no memory.
class OwnMemory {
public:
    [[nodiscard]] static Expected<OwnMemory> create(std::size_t bytes);
    ~OwnMemory();
    OwnMemory(OwnMemory&& other) noexcept;
    OwnMemory& operator=(OwnMemory&&) = delete;

    [[nodiscard]] std::byte* data() const { return mapping_.data(); }
    /// Where others find it, "PID/FILE", as long as this process lives.
    [[nodiscard]] std::string place() const;

private:
    OwnMemory() = default;
    int file_ = -1;
    Mapping mapping_;
};

/// Another process's: `head` may be written to, `rest` only read. Its content is anything at any time, until the end.
struct OthersMemory {
    Mapping head, rest;

    /// kNotFound: nobody is there (any more), or may not be looked at; kBadInput: no sealed memory of just this size.
    [[nodiscard]] static Expected<OthersMemory> open(std::string_view place, std::size_t headBytes,
                                                     std::size_t restBytes);
};

/// Sleeps until the word is no longer `seen`, somebody rings, or the time is over; also for no reason. Between
/// processes, by their shared memory (futex(2)).
void waitForBell(const void* word, std::uint32_t seen, std::int64_t timeoutNs);
/// Wakes all who wait for that word.
void ringBell(const void* word);

}  // namespace tessera
