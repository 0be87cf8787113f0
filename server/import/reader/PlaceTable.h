/// Which vertices of a mesh are the same: places by their coordinates, vertices at one place by what else they have.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace tessera {

/// Numbers of places: equal coordinates have one. A hash table with linear probing; eight bytes for each place beside
/// its coordinates, two thirds of them full at most. Fewer than 2^32 - 1 places.
class PlaceTable {
public:
    /// The number of the place, in the order in which they first came. -0 is 0.
    [[nodiscard]] std::uint32_t numberOf(const float* xyz) {
        const Key key = {std::bit_cast<std::uint32_t>(xyz[0] + 0.0f), std::bit_cast<std::uint32_t>(xyz[1] + 0.0f),
                         std::bit_cast<std::uint32_t>(xyz[2] + 0.0f)};
        if (3 * (keys_.size() + 1) > 2 * slots_.size()) grow(2 * slots_.size());
        const std::uint32_t hash = hashOf(key);
        const std::size_t mask = slots_.size() - 1;
        for (std::size_t at = slotOf(hash);; at = (at + 1) & mask) {
            Slot& slot = slots_[at];
            if (slot.number == 0) {
                keys_.push_back(key);
                slot = {hash, size()};
                return size() - 1;
            }
            if (slot.hash == hash && keys_[slot.number - 1] == key) return slot.number - 1;
        }
    }
    /// Takes the memory of so many places at once.
    void reserve(std::size_t places) {
        keys_.reserve(places);
        if (places > 0 && 3 * places > 2 * slots_.size()) grow(std::bit_ceil(3 * places / 2 + 1));
    }
    [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(keys_.size()); }
    void appendPlace(std::uint32_t number, std::vector<float>& positions) const {
        for (const std::uint32_t bits : keys_[number]) positions.push_back(std::bit_cast<float>(bits));
    }

private:
    using Key = std::array<std::uint32_t, 3>;
    struct Slot {
        std::uint32_t hash = 0;
        std::uint32_t number = 0;  ///< from 1; 0: it is free
    };

    static std::uint32_t hashOf(const Key& key) {
        std::uint64_t hash = 0x9e3779b97f4a7c15u;
        for (const std::uint32_t word : key) {
            hash = (hash ^ word) * 0xd6e8feb86659fd93u;
            hash ^= hash >> 32;
        }
        return static_cast<std::uint32_t>(hash * 0xd6e8feb86659fd93u >> 32);
    }
    /// By the highest bits: a table that grows is gone through in order.
    [[nodiscard]] std::size_t slotOf(std::uint32_t hash) const {
        return static_cast<std::size_t>(std::uint64_t{hash} * slots_.size() >> 32);
    }
    void grow(std::size_t slots) {
        constexpr std::size_t kFirst = 16;
        const std::vector<Slot> before = std::exchange(slots_, std::vector<Slot>(std::max(kFirst, slots)));
        const std::size_t mask = slots_.size() - 1;
        for (const Slot& slot : before) {
            if (slot.number == 0) continue;
            std::size_t at = slotOf(slot.hash);
            while (slots_[at].number != 0) at = (at + 1) & mask;
            slots_[at] = slot;
        }
    }

    std::vector<Slot> slots_;  ///< none, or a power of two
    std::vector<Key> keys_;
};

/// Vertices by their places. Of very many at one place the last ones are compared: files are written from neighbour to
/// neighbour, and a vertex that is there twice does no harm.
class VertexChains {
public:
    /// The vertex at this place for which `same(vertex)`; a new one, numbered by how many there are, where there is
    /// none.
    template <typename Same>
    [[nodiscard]] std::uint32_t vertexAt(std::uint32_t place, Same&& same) {
        constexpr int kMostCompared = 64;
        if (place >= last_.size()) last_.resize(std::size_t{place} + 1, kNone);
        int compared = 0;
        for (std::uint32_t vertex = last_[place]; vertex != kNone && compared < kMostCompared; ++compared) {
            if (same(vertex)) return vertex;
            vertex = before_[vertex];
        }
        const std::uint32_t made = size();
        before_.push_back(std::exchange(last_[place], made));
        return made;
    }
    [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(before_.size()); }
    /// Begins anew, where all vertices are at these places.
    void clear(const std::vector<std::uint32_t>& places) {
        for (const std::uint32_t place : places) last_[place] = kNone;
        before_.clear();
    }

private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    std::vector<std::uint32_t> last_;    ///< by place
    std::vector<std::uint32_t> before_;  ///< by vertex: the one before it at its place
};

}  // namespace tessera
