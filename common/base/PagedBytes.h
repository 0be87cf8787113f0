/// Large bytes of which many versions share pages, and each of which can be read as if it lay in one piece.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/Bytes.h"

namespace tessera {

/// One version of an array. It never changes; a change of a few bytes makes another version, which costs the pages that
/// the change lies in, whatever the array's size.
///
/// The pages lie in a file in memory (memfd_create). An array has a *home* in it, where its pages lie in their order; a
/// version that differs has some of them *away*. Whoever reads it as one piece has the home mapped, and over it what is
/// away. A page comes home again once no version that still lives needs the one that is there: so a version has few
/// pieces, however many changes have led to it. Where that fails, because an old version is kept, the array moves into
/// a home of its own.
///
/// Any thread.
class PagedBytes {
    class Slot;

public:
    static constexpr std::size_t kPageBytes = 4096;
    /// More pieces than this, and the array moves into a new home: a copy of all of it.
    static constexpr std::size_t kMostPieces = 1024;

    /// A copy. Null where there is no such memory: an old kernel, a limit, a full machine.
    [[nodiscard]] static std::shared_ptr<const PagedBytes> copyOf(ByteSpan bytes);
    /// Bytes that lie in one shared mapping (MAP_SHARED, from its beginning on) that nobody ever writes to, for as long
    /// as `owner` lives. Copies nothing.
    [[nodiscard]] static std::shared_ptr<const PagedBytes> over(std::shared_ptr<const void> owner, ByteSpan mapped);

    /// What comes piece after piece. Memory is taken as it comes, whatever its size will be. Ranges lie inside.
    class Maker {
    public:
        explicit Maker(std::size_t size);
        /// False: there is no memory for it.
        [[nodiscard]] bool write(std::size_t offset, ByteSpan bytes);
        /// Of what has come.
        void read(std::size_t offset, std::span<std::byte> to) const;
        /// Once all of it has come and had room.
        [[nodiscard]] std::shared_ptr<const PagedBytes> finish();

    private:
        std::shared_ptr<const Slot> slot_;
        std::size_t size_;
    };

    /// The same with other bytes from `offset` on; the range is not empty and lies inside. Null as above.
    [[nodiscard]] std::shared_ptr<const PagedBytes> withRange(std::size_t offset, ByteSpan bytes) const;
    /// Bytes from `offset` on, as many as `to` holds; they lie inside.
    void read(std::size_t offset, std::span<std::byte> to) const;
    /// All of them. Maps them when it is called for the first time.
    [[nodiscard]] ByteSpan view() const;
    [[nodiscard]] std::size_t sizeBytes() const { return size_; }
    /// Runs of pages that are not at home.
    [[nodiscard]] std::size_t pieces() const { return away_.size(); }

    ~PagedBytes();
    PagedBytes(const PagedBytes&) = delete;
    PagedBytes& operator=(const PagedBytes&) = delete;

private:
    class Home;
    /// Pages [first, end) that lie in a slot from its page `at` on.
    struct Piece {
        std::uint32_t first = 0, end = 0;
        std::shared_ptr<const Slot> slot;
        std::uint32_t at = 0;
    };
    using Pieces = std::vector<Piece>;

    [[nodiscard]] static std::shared_ptr<const PagedBytes> livingIn(std::shared_ptr<Home> home, std::size_t size);
    PagedBytes(std::shared_ptr<Home> home, Pieces away, std::size_t size)
        : home_(std::move(home)), away_(std::move(away)), size_(size) {}
    [[nodiscard]] static Pieces without(const Pieces& away, std::uint32_t first, std::uint32_t end);
    /// One for what lies before, between and behind the pieces, one for each piece.
    [[nodiscard]] std::size_t mappingsOfView() const { return 2 * away_.size() + 1; }
    [[nodiscard]] std::byte* map() const;
    void unmap(std::byte* view) const;

    const std::shared_ptr<Home> home_;
    const Pieces away_;  ///< in their order, apart
    const std::size_t size_;
    mutable std::atomic<std::byte*> view_{nullptr};
};

}  // namespace tessera
