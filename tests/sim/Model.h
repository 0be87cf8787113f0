/// The smallest scene that can be wrong: a hash over all lists. And the bytes it travels as.
#pragma once

#include <cstring>
#include <vector>

#include "common/session/Messages.h"

namespace tessera::simulation {

struct ModelList {
    Sequence sequence;
    std::uint64_t content = 0;
    std::vector<BlobId> blobs;
};

struct ModelScene {
    Sequence sequence;
    StateHash hash{0x5eed};

    void apply(const ModelList& list) {
        sequence = list.sequence;
        const std::uint64_t mixed = (hash.value ^ list.content) * 0x9E3779B97F4A7C15ull + list.sequence.value;
        hash = StateHash(mixed ^ (mixed >> 29));
    }
};

/// Numbers in a row; lists and snapshots are a few of them.
class Numbers {
public:
    Numbers() = default;
    explicit Numbers(const ByteSlice& bytes) : bytes_(bytes.begin(), bytes.end()) {}
    void put(std::uint64_t value) {
        const std::size_t end = bytes_.size();
        bytes_.resize(end + sizeof value);
        std::memcpy(bytes_.data() + end, &value, sizeof value);
    }
    std::uint64_t get() {
        std::uint64_t value = 0;
        std::memcpy(&value, bytes_.data() + at_, sizeof value);
        at_ += sizeof value;
        return value;
    }
    [[nodiscard]] bool done() const { return at_ == bytes_.size(); }
    [[nodiscard]] SharedBytes share() const { return tessera::share(bytes_); }

private:
    Bytes bytes_;
    std::size_t at_ = 0;
};

inline void put(Numbers& out, const ModelList& list) {
    out.put(list.sequence.value);
    out.put(list.content);
    out.put(list.blobs.size());
    for (const BlobId& id : list.blobs) {
        out.put(id.low);
        out.put(id.high);
    }
}

inline ModelList getList(Numbers& in) {
    ModelList list{.sequence = Sequence(in.get()), .content = in.get()};
    for (std::uint64_t n = in.get(); n > 0; --n) {
        const std::uint64_t low = in.get();
        list.blobs.push_back({low, in.get()});
    }
    return list;
}

}  // namespace tessera::simulation
