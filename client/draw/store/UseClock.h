/// When things were drawn, and when they will be again: what a budget of memory asks. Pure bookkeeping.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <functional>
#include <utility>
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

    /// One that nothing is drawn in tells nothing: the last one that tells stays that. False: so was the last one.
    bool beginFrame() {
        told_ = true;
        const bool drew = drawsNow_ > 0;
        if (drew) nextFrame();
        return drew;
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
    [[nodiscard]] std::uint64_t frame() const { return frame_; }
    /// Draws until it is needed: 0 in the one that has begun; kNever: it was not, since the last frame began.
    [[nodiscard]] std::uint64_t nextUse(const Uses& uses) const {
        const std::uint64_t now = uses.frame == frame_ ? uses.places : 0;
        const std::uint64_t last = uses.frame == frame_ ? uses.before : uses.frame + 1 == frame_ ? uses.places : 0;
        const std::uint64_t place = std::min<std::uint64_t>(place_, kLastBit);
        if (const std::uint64_t later = last >> place) return static_cast<std::uint64_t>(std::countr_zero(later));
        if (now) return std::max(drawsBefore_, place_ + 1) - place_ + static_cast<std::uint64_t>(std::countr_zero(now));
        return last ? kNever - 1 : kNever;
    }

    /// Of what nextUse says: nobody draws it.
    [[nodiscard]] static bool isIdle(std::uint64_t nextUse) { return nextUse >= kNever - 1; }

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
        return ordered(map, [this](const Uses& uses) { return nextUse(uses) > 0; });
    }
    /// In the midst of a draw: what it has not used so far, in that order; what it may yet need comes last.
    template <typename Map>
    [[nodiscard]] auto unusedSoFar(const Map& map) const {
        return ordered(map, [this](const Uses& uses) { return !usedNow(uses); });
    }
    /// What gave way and will be needed again keeps its uses: else nobody would know, once it is back, when it was
    /// drawn besides.
    template <typename UsesByKey, typename Key>
    void remember(UsesByKey& gone, const Key& key, const Uses& uses) const {
        std::erase_if(gone, [this](const auto& entry) { return isIdle(nextUse(entry.second)); });
        if (!isIdle(nextUse(uses))) gone[key] = uses;
    }
    template <typename UsesByKey, typename Key>
    [[nodiscard]] static Uses recall(UsesByKey& gone, const Key& key) {
        const auto known = gone.extract(key);
        return known.empty() ? Uses() : known.mapped();
    }
    /// What is not needed now, of any store that goes by this clock.
    struct Spare {
        std::uint64_t nextUse, lastDraw;
        std::function<void()> drop;
    };
    /// Adds those of a store. `drop(key)` frees one, and no other; the keys stay where they are.
    template <typename Map, typename Drop>
    void addSpares(const Map& map, std::vector<Spare>& spares, const Drop& drop) const {
        for (const auto& [key, thing] : map)
            if (const std::uint64_t next = nextUse(usesOf(thing)); next > 0)
                spares.push_back({next, usesOf(thing).lastDraw, [drop, at = &key] { drop(*at); }});
    }
    /// What a budget has no room for goes, the last needed first, whose ever it is. `held` says how many bytes all take
    /// now. What nobody draws leaves a quarter free, so that this does not happen in every frame; what will be drawn
    /// again goes as far as it must.
    template <typename Held>
    static void giveWay(std::vector<Spare>& spares, std::size_t budgetBytes, const Held& held) {
        std::sort(spares.begin(), spares.end(), [](const Spare& a, const Spare& b) {
            return a.nextUse != b.nextUse ? a.nextUse > b.nextUse : a.lastDraw < b.lastDraw;
        });
        for (const Spare& spare : spares) {
            if (held() <= (isIdle(spare.nextUse) ? budgetBytes / 4 * 3 : budgetBytes)) return;
            spare.drop();
        }
    }

private:
    template <typename Map, typename Wanted>
    [[nodiscard]] auto ordered(const Map& map, const Wanted& wanted) const {
        std::vector<Candidate<typename Map::key_type>> order;
        for (const auto& [key, thing] : map)
            if (const Uses& uses = usesOf(thing); wanted(uses)) order.push_back({nextUse(uses), uses.lastDraw, &key});
        std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
            return a.nextUse != b.nextUse ? a.nextUse > b.nextUse : a.lastDraw < b.lastDraw;
        });
        return order;
    }

    static constexpr std::uint64_t kLastBit = 63;
    void nextFrame() {
        ++frame_;
        drawsBefore_ = drawsNow_;
        drawsNow_ = place_ = 0;
    }

    bool told_ = false;
    std::uint64_t frame_ = 2, draw_ = 0, place_ = 0, drawsNow_ = 0, drawsBefore_ = 0;
};

}  // namespace tessera
