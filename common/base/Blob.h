/// Big immutable arrays (vertices, indices, pixels, key frames), named by their content.
#pragma once

#include <cstring>
#include <memory>
#include <mutex>
#include <span>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/base/ByteSlice.h"
#include "common/base/Error.h"
#include "common/base/Hash.h"
#include "common/base/PagedBytes.h"

namespace tessera {

/// Name of a blob: the hash of its bytes. Equal bytes, equal id, on every host. Of more than one leaf of kBlobLeafBytes
/// it is the hash of the leaves' hashes, so that a change of a few bytes costs the hashes of the leaves that they lie
/// in.
using BlobId = Hash128;
inline constexpr std::size_t kBlobLeafBytes = 65536;
[[nodiscard]] BlobId blobIdOf(ByteSpan bytes);
/// The same, from the hashes of all its leaves, of which there are several.
[[nodiscard]] BlobId blobIdOf(std::uint64_t sizeBytes, const std::vector<Hash128>& leaves);

/// A handle on a blob; copying it shares the bytes. Thread-safe because the bytes never change.
///
/// Large ones share pages with those that `withRange` makes of them (PagedBytes.h), and yet lie in one piece for who
/// reads them.
///
/// A handle may be *absent*: its id and size are known, its bytes are not here (an application that follows the scene
/// without its bulk data). The default handle is *empty*: no blob at all.
class Blob {
public:
    Blob() = default;
    /// Takes the bytes and hashes them.
    explicit Blob(Bytes bytes);
    explicit Blob(std::shared_ptr<const PagedBytes> bytes);
    /// A blob of plain values, e.g. `Blob::of(std::span<const float>{…})`.
    template <typename T>
    requires std::is_trivially_copyable_v<T>
    [[nodiscard]] static Blob of(std::span<const T> values) {
        Bytes bytes(values.size_bytes());
        if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
        return Blob(std::move(bytes));
    }
    /// Where bytes lie that somebody else has put there: in a shared mapping, from its beginning on, versions can share
    /// its pages.
    enum class Place : std::uint8_t { kAnywhere, kSharedMapping };
    /// Bytes that lie where somebody else has put them, which never change while `owner` lives. Hashes them.
    Blob(std::shared_ptr<const void> owner, ByteSpan bytes, Place place = Place::kAnywhere);
    /// The same blob with its bytes, which the caller has copied there, in another place. Hashes nothing.
    [[nodiscard]] Blob movedTo(std::shared_ptr<const void> owner, ByteSpan sameBytes,
                               Place place = Place::kAnywhere) const;
    [[nodiscard]] static Blob absent(BlobId id, std::uint64_t sizeBytes);
    /// The same with other bytes from `offset` on. Hashes the leaves that change. One that is paged costs what changes;
    /// a large one that is not is copied into pages; one below kPagedBytes is copied. Refused where the range does not
    /// lie inside, or the bytes are not here.
    [[nodiscard]] Expected<Blob> withRange(std::uint64_t offset, ByteSpan bytes) const;
    static constexpr std::size_t kPagedBytes = std::size_t{1} << 20;
    /// The same blob, so that the first edit of it costs no more than a later one: copies one of kPagedBytes and more
    /// that is not paged yet. To be called where the bytes arrive, before others have a handle.
    [[nodiscard]] Blob paged() const;

    /// An earlier array that `withRange` has led from to this one: outside of [begin, end) the bytes are the same. What
    /// somebody derives from an array and keeps by its name can so be brought up to date for a part of it.
    struct Origin {
        BlobId id;
        std::uint64_t begin = 0, end = 0;
    };
    static constexpr std::size_t kOrigins = 4;
    /// The nearest first, at most kOrigins. None where the bytes came as a whole: this is not part of the content.
    [[nodiscard]] std::span<const Origin> origins() const {
        return content_ ? std::span<const Origin>(content_->origins) : std::span<const Origin>();
    }

    [[nodiscard]] const BlobId& id() const { return content_ ? content_->id : kNoId; }
    [[nodiscard]] std::uint64_t sizeBytes() const { return content_ ? content_->sizeBytes : 0; }
    [[nodiscard]] bool empty() const { return content_ == nullptr; }
    [[nodiscard]] bool resident() const { return content_ && content_->resident; }
    /// Nobody else holds a handle on these bytes.
    [[nodiscard]] bool soleHandle() const { return content_.use_count() == 1; }
    /// The bytes; an empty span where the blob is empty or absent. Storage is aligned for any scalar type.
    [[nodiscard]] ByteSpan bytes() const { return content_ ? content_->all() : ByteSpan(); }
    /// Bytes from `offset` on, as many as `to` holds; they lie inside. Costs what is read: of a version that nobody
    /// asks all bytes of, nobody needs to lay the pages side by side.
    void read(std::uint64_t offset, std::span<std::byte> to) const;
    /// Values [first, first + count) of T, which lie inside.
    template <typename T>
    requires std::is_trivially_copyable_v<T>
    [[nodiscard]] std::vector<T> values(std::uint64_t first, std::size_t count) const {
        std::vector<T> some(count);
        read(first * sizeof(T), std::as_writable_bytes(std::span(some)));
        return some;
    }
    /// The bytes as values of T; a tail shorter than one T is left off.
    template <typename T>
    requires std::is_trivially_copyable_v<T>
    [[nodiscard]] std::span<const T> as() const {
        const ByteSpan all = bytes();
        return {reinterpret_cast<const T*>(all.data()), all.size() / sizeof(T)};
    }
    /// The bytes with what keeps them alive.
    [[nodiscard]] ByteSlice slice() const {
        return content_ && content_->paged ? ByteSlice(content_->paged, content_->all())
               : content_                  ? content_->bytes
                                           : ByteSlice();
    }

    /// Two handles are equal when they name the same content, resident or not.
    bool operator==(const Blob& other) const { return id() == other.id(); }

private:
    friend class BlobStore;
    friend class BlobMaker;
    struct Content {
        BlobId id;
        std::uint64_t sizeBytes = 0;
        bool resident = false;
        ByteSlice bytes;  ///< or none, and paged
        std::shared_ptr<const PagedBytes> paged;
        std::vector<Hash128> leaves;  ///< their hashes, where there are several
        std::vector<Origin> origins;

        [[nodiscard]] ByteSpan all() const { return paged ? paged->view() : bytes.bytes(); }
    };
    static constexpr BlobId kNoId{};
    [[nodiscard]] static Content contentOf(ByteSlice bytes);
    static void lay(Content& content, std::shared_ptr<const void> owner, ByteSpan bytes, Place place);
    void setRange(Content& content, std::uint64_t offset, ByteSpan bytes) const;
    explicit Blob(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

    std::shared_ptr<const Content> content_;  ///< null: empty
};

/// Finds blobs by id as long as somebody holds a handle on them. Thread-safe; one per process.
class BlobStore {
public:
    /// Makes `blob` findable and returns the handle to use from now on (the one already known, where there is one).
    Blob add(Blob blob);
    /// The resident blob with this id, or an empty handle.
    [[nodiscard]] Blob find(const BlobId& id) const;

private:
    mutable std::mutex mutex_;
    mutable std::unordered_map<BlobId, std::weak_ptr<const Blob::Content>> known_;
    std::size_t sweepAt_ = 1024;
};

}  // namespace tessera
