/// Big immutable arrays (vertices, indices, pixels, key frames), named by their content.
#pragma once

#include <cstring>
#include <memory>
#include <mutex>
#include <span>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/base/Hash.h"

namespace tessera {

/// Name of a blob: the hash of its bytes. Equal bytes, equal id, on every host.
using BlobId = Hash128;

/// A handle on a blob; copying it shares the bytes. Thread-safe because the bytes never change.
///
/// A handle may be *absent*: its id and size are known, its bytes are not here (an application that follows the scene
/// without its bulk data). The default handle is *empty*: no blob at all.
class Blob {
public:
    Blob() = default;
    /// Takes the bytes and hashes them.
    explicit Blob(Bytes bytes);
    /// A blob of plain values, e.g. `Blob::of(std::span<const float>{…})`.
    template <typename T>
    requires std::is_trivially_copyable_v<T>
    [[nodiscard]] static Blob of(std::span<const T> values) {
        Bytes bytes(values.size_bytes());
        if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
        return Blob(std::move(bytes));
    }
    [[nodiscard]] static Blob absent(BlobId id, std::uint64_t sizeBytes);

    [[nodiscard]] const BlobId& id() const { return id_; }
    [[nodiscard]] std::uint64_t sizeBytes() const { return sizeBytes_; }
    [[nodiscard]] bool empty() const { return !id_; }
    [[nodiscard]] bool resident() const { return bytes_ != nullptr; }
    /// The bytes; an empty span where the blob is empty or absent. Storage is aligned for any scalar type.
    [[nodiscard]] ByteSpan bytes() const { return bytes_ ? ByteSpan(*bytes_) : ByteSpan(); }
    /// The bytes as values of T; a tail shorter than one T is left off.
    template <typename T>
    requires std::is_trivially_copyable_v<T>
    [[nodiscard]] std::span<const T> as() const {
        const ByteSpan all = bytes();
        return {reinterpret_cast<const T*>(all.data()), all.size() / sizeof(T)};
    }
    [[nodiscard]] const SharedBytes& shared() const { return bytes_; }

    /// Two handles are equal when they name the same content, resident or not.
    bool operator==(const Blob& other) const { return id_ == other.id_; }

private:
    friend class BlobStore;
    Blob(BlobId id, SharedBytes bytes) : id_(id), sizeBytes_(bytes->size()), bytes_(std::move(bytes)) {}

    BlobId id_;
    std::uint64_t sizeBytes_ = 0;
    SharedBytes bytes_;
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
    mutable std::unordered_map<BlobId, std::weak_ptr<const Bytes>> known_;
    std::size_t sweepAt_ = 1024;
};

}  // namespace tessera
