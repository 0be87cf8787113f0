/// Files in memory that hold arrays, and the list of them that a process keeps for its neighbours.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <thread>
#include <utility>

#include "common/base/Channel.h"
#include "common/session/Messages.h"

namespace tessera {

/// A file in memory (memfd_create): of one array, written and then sealed, from where on nobody can change it. Closed
/// with the object.
class ArrayFile {
public:
    /// None where `handle` is below 0.
    explicit ArrayFile(int handle) : handle_(handle) {}
    ArrayFile(ArrayFile&& other) noexcept : handle_(other.release()) {}
    ~ArrayFile();
    ArrayFile(const ArrayFile&) = delete;
    ArrayFile& operator=(const ArrayFile&) = delete;
    /// A new one; none where there is no such memory.
    [[nodiscard]] static ArrayFile make();

    [[nodiscard]] int get() const { return handle_; }
    [[nodiscard]] bool open() const { return handle_ >= 0; }
    [[nodiscard]] int release() { return std::exchange(handle_, -1); }
    /// False: there is no memory for them.
    [[nodiscard]] bool write(std::size_t offset, ByteSpan bytes) const;
    /// Of what has been written.
    void read(std::size_t offset, std::span<std::byte> to) const;
    [[nodiscard]] bool seal() const;
    [[nodiscard]] bool isSealed(std::uint64_t bytes) const;
    /// Of two that are both long enough.
    [[nodiscard]] static bool areSame(const ArrayFile& a, const ArrayFile& b, std::size_t offset, std::size_t bytes);

private:
    int handle_;
};

/// What a process says of one of its arrays, read by others while it is written: believed by nobody.
struct ArrayEntry;

/// Ours, that others read. Entries are given out on one thread and given back on any; so is memory.
class ArrayDirectory {
public:
    /// At most so many arrays, each an open file.
    static constexpr std::size_t kMost = 4096;

    /// Null: there is no such memory.
    [[nodiscard]] static std::shared_ptr<ArrayDirectory> make();
    ArrayDirectory();
    ArrayDirectory(const ArrayDirectory&) = delete;
    ArrayDirectory& operator=(const ArrayDirectory&) = delete;
    ~ArrayDirectory();

    /// A place for one more; none where all are taken.
    [[nodiscard]] std::optional<std::size_t> place();
    void fill(std::size_t place, const BlobInfo& info, int file);
    void free(std::size_t place);

    /// Arrays that come or have come, each with a file.
    void counts(int more) { arrays_ += more; }
    [[nodiscard]] bool full() const { return arrays_ >= static_cast<int>(allowed_); }

    /// What nobody needs any more.
    struct Memory {
        void* memory = nullptr;
        std::size_t bytes = 0;
        int file = -1;
        void giveBack() const;
    };
    /// Of an array of `bytes`. Hundreds of megabytes take tens of milliseconds, which a host may not be silent for: a
    /// thread does that.
    void giveBack(const Memory& memory, std::size_t bytes);

private:
    [[nodiscard]] std::thread helper();

    int file_ = -1;
    ArrayEntry* entries_ = nullptr;
    std::size_t allowed_ = 0, next_ = 0;
    static constexpr std::size_t kMostUnneeded = 64;  // each an open file
    Channel<Memory> unneeded_{kMostUnneeded};
    std::atomic<int> arrays_{0};
    std::thread thread_ = helper();
};

/// A neighbour's.
class OthersArrayDirectory {
public:
    /// Null: it has none.
    [[nodiscard]] static std::unique_ptr<OthersArrayDirectory> open(pid_t process);
    OthersArrayDirectory() = default;
    OthersArrayDirectory(const OthersArrayDirectory&) = delete;
    OthersArrayDirectory& operator=(const OthersArrayDirectory&) = delete;
    ~OthersArrayDirectory();

    /// How many of its entries for one blob are tried.
    static constexpr std::size_t kMostTries = 4;

    /// Its file with that blob, sealed and as long; none where it has none. The bytes are still to be proved.
    [[nodiscard]] ArrayFile find(const BlobInfo& wanted) const;
    /// Its bytes were not what it said: nothing is found with it any more.
    void distrust() { trusted_ = false; }
    [[nodiscard]] bool trusted() const { return trusted_; }

private:
    pid_t process_ = -1;
    const ArrayEntry* entries_ = nullptr;
    bool trusted_ = true;
};

}  // namespace tessera
