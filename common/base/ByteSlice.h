/// Bytes that travel without being copied: a part of a buffer, and parts of several buffers as one message.
#pragma once

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"

namespace tessera {

/// Immutable bytes in a buffer that others may hold too: all of it or a part. Copying shares, and keeps the whole
/// buffer alive. The default is no bytes; there is no difference between that and a slice of length 0.
class ByteSlice {
public:
    ByteSlice() = default;
    ByteSlice(std::nullptr_t) {}
    /// All of a buffer; null is no bytes.
    ByteSlice(SharedBytes buffer) : bytes_(buffer ? ByteSpan(*buffer) : ByteSpan()), owner_(std::move(buffer)) {}
    ByteSlice(Bytes&& bytes) : ByteSlice(share(std::move(bytes))) {}
    /// `bytes` live as long as `owner` does.
    ByteSlice(std::shared_ptr<const void> owner, ByteSpan bytes) : bytes_(bytes), owner_(std::move(owner)) {}

    [[nodiscard]] ByteSpan bytes() const { return bytes_; }
    operator ByteSpan() const { return bytes_; }
    [[nodiscard]] auto begin() const { return bytes_.begin(); }
    [[nodiscard]] auto end() const { return bytes_.end(); }
    [[nodiscard]] const std::byte* data() const { return bytes_.data(); }
    [[nodiscard]] std::size_t size() const { return bytes_.size(); }
    [[nodiscard]] bool empty() const { return bytes_.empty(); }
    /// `part` is a part of these bytes, and shares their owner.
    [[nodiscard]] ByteSlice slice(ByteSpan part) const {
        TESSERA_CHECK(part.empty() || (part.data() >= data() && part.data() + part.size() <= data() + size()),
                      "a part of other bytes");
        return {owner_, part};
    }

    /// The same bytes, wherever they lie.
    friend bool operator==(const ByteSlice& a, ByteSpan b) {
        return std::equal(a.begin(), a.end(), b.begin(), b.end());
    }
    friend bool operator==(const ByteSlice& a, const ByteSlice& b) { return a == b.bytes(); }

private:
    ByteSpan bytes_;
    std::shared_ptr<const void> owner_;
};

/// Slices that are one message, in their order: what a socket writes without anybody putting it together first.
class ByteChain {
public:
    ByteChain() = default;
    ByteChain(ByteSlice whole) { append(std::move(whole)); }

    void append(ByteSlice slice) {
        if (slice.empty()) return;
        size_ += slice.size();
        slices_.push_back(std::move(slice));
    }
    /// None of them is empty.
    [[nodiscard]] const std::vector<ByteSlice>& slices() const { return slices_; }
    /// Of all of them.
    [[nodiscard]] std::size_t size() const { return size_; }
    [[nodiscard]] bool empty() const { return size_ == 0; }
    /// A copy in one piece.
    [[nodiscard]] Bytes joined() const;
    /// The hash64 of `joined`, without the copy.
    [[nodiscard]] std::uint64_t hash64(std::uint64_t seed = 0) const;

private:
    std::vector<ByteSlice> slices_;
    std::size_t size_ = 0;
};

/// One message for many: immutable once shared.
using SharedChain = std::shared_ptr<const ByteChain>;

[[nodiscard]] inline SharedChain share(ByteChain chain) {
    return std::make_shared<const ByteChain>(std::move(chain));
}

}  // namespace tessera
