/// When things were drawn, and when they will be again: what a budget of memory asks. Pure bookkeeping.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

namespace tessera {

/// Counts frames, and in each of them draws: one for each tile, or part of one. What comes next is guessed: that a
/// frame goes as the one before went. Where nobody says that a frame begins each draw is one.
///
/// What is needed last goes first (Belady 1966, "A study of replacement algorithms for a virtual-storage computer"):
/// where tiles draw in turn more than there is room for, going by the last use would throw out each thing just before
/// it is needed, and upload all of them in each frame.
class UseClock {
public:
    static constexpr std::uint64_t kNever = ~std::uint64_t{0};
    /// Of one thing.
    struct Uses {
        std::uint64_t lastDraw = 0;
        std::uint64_t frame = 0;  ///< of the last use
        std::uint64_t places = 0,
                      before =
                          0;  ///< draws of that frame, and of the one before it: a bit each, the last for all beyond
    };

    void beginFrame() {
        told_ = true;
        nextFrame();
    }
    void beginDraw() {
        if (!told_) nextFrame();
        place_ = drawsNow_++;
        ++draw_;
    }
    /// In the draw that has begun.
    void use(Uses& uses) const {
        uses.lastDraw = draw_;
        if (uses.frame != frame_) {
            uses.before = uses.frame + 1 == frame_ ? uses.places : 0;
            uses.places = 0;
            uses.frame = frame_;
        }
        uses.places |= std::uint64_t{1} << std::min<std::uint64_t>(place_, kLastBit);
    }
    [[nodiscard]] bool usedNow(const Uses& uses) const { return uses.lastDraw == draw_; }
    [[nodiscard]] std::uint64_t draw() const { return draw_; }
    /// Draws until it is needed: 0 in the one that has begun; kNever: it was not, since the last frame began.
    [[nodiscard]] std::uint64_t nextUse(const Uses& uses) const {
        const std::uint64_t now = uses.frame == frame_ ? uses.places : 0;
        const std::uint64_t last = uses.frame == frame_ ? uses.before : uses.frame + 1 == frame_ ? uses.places : 0;
        const std::uint64_t place = std::min<std::uint64_t>(place_, kLastBit);
        if (const std::uint64_t later = last >> place) return static_cast<std::uint64_t>(std::countr_zero(later));
        if (now) return std::max(drawsBefore_, place_ + 1) - place_ + static_cast<std::uint64_t>(std::countr_zero(now));
        return last ? kNever - 1 : kNever;
    }

    /// Of a thing that has `uses`, or of what points to one.
    template <typename Thing>
    [[nodiscard]] static const Uses& usesOf(const Thing& thing) {
        if constexpr (requires { thing.uses; })
            return thing.uses;
        else
            return thing->uses;
    }

    /// Of what a budget holds.
    template <typename Key>
    struct Candidate {
        std::uint64_t nextUse, lastDraw;
        const Key* key;
    };
    /// In the order in which things give way, without what is needed now. `map`: of things that have `uses`.
    template <typename Map>
    [[nodiscard]] auto lastNeededFirst(const Map& map) const {
        std::vector<Candidate<typename Map::key_type>> order;
        for (const auto& [key, thing] : map)
            if (const std::uint64_t next = nextUse(usesOf(thing)); next > 0)
                order.push_back({next, usesOf(thing).lastDraw, &key});
        std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
            return a.nextUse != b.nextUse ? a.nextUse > b.nextUse : a.lastDraw < b.lastDraw;
        });
        return order;
    }
    /// What gave way and will be needed again keeps its uses: else nobody would know, once it is back, when it was
    /// drawn besides.
    template <typename UsesByKey, typename Key>
    void remember(UsesByKey& gone, const Key& key, const Uses& uses) const {
        std::erase_if(gone, [this](const auto& entry) { return nextUse(entry.second) >= kNever - 1; });
        if (nextUse(uses) < kNever - 1) gone[key] = uses;
    }
    template <typename UsesByKey, typename Key>
    [[nodiscard]] static Uses recall(UsesByKey& gone, const Key& key) {
        const auto known = gone.extract(key);
        return known.empty() ? Uses() : known.mapped();
    }
    /// Down to how many bytes: what nobody draws leaves a quarter free, so that this does not happen in every frame;
    /// what will be drawn again goes as far as it must.
    template <typename Key>
    [[nodiscard]] static std::size_t roomFor(const Candidate<Key>& candidate, std::size_t budgetBytes) {
        return candidate.nextUse >= kNever - 1 ? budgetBytes / 4 * 3 : budgetBytes;
    }

    /// What a budget has no room for goes, the last needed first. `held` says how many bytes all take now; `drop` frees
    /// one of them. `map`: of things that have `uses`.
    template <typename Map, typename UsesByKey, typename Held, typename Drop>
    void giveWay(Map& map, UsesByKey& gone, std::size_t budgetBytes, Held&& held, Drop&& drop) const {
        if (held() <= budgetBytes) return;
        for (const auto& candidate : lastNeededFirst(map)) {
            if (held() <= roomFor(candidate, budgetBytes)) return;
            const auto it = map.find(*candidate.key);
            remember(gone, *candidate.key, usesOf(it->second));
            drop(it->second);
            map.erase(it);
        }
    }

private:
    static constexpr std::uint64_t kLastBit = 63;
    void nextFrame() {
        ++frame_;
        drawsBefore_ = drawsNow_;
        drawsNow_ = 0;
    }

    bool told_ = false;
    std::uint64_t frame_ = 2, draw_ = 0, place_ = 0, drawsNow_ = 0, drawsBefore_ = 0;
};

}  // namespace tessera
