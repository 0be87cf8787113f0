/// Lights' views of a scene, kept from frame to frame: one for each camera, whoever asks.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "client/render/scene/RenderScene.h"
#include "client/render/scene/ShadowCasters.h"
#include "client/render/scene/ShadowReach.h"

namespace tessera {

/// Follows what casts shadows at the cost of what has changed. Things that change are listed as moving, and as still
/// again once they have rested: so that a map may keep the depths of what rests. Screens, eyes and users of one host
/// share a view or have their own; none makes another's go. Views that nobody asks for stay for a while, as far as
/// there is room for them: who comes back, or looks there again, finds the maps of before. They hold meshes of things
/// that may be gone meanwhile, so none stays for longer.
class ShadowStore {
public:
    /// Nothing is known of the scene any more.
    void clear();
    /// What is asked for until the next one belongs to one frame. Where nobody says so each look is a frame.
    void beginFrame();
    /// One look begins: a number of views will be asked for, or none.
    void beginLook();
    /// What this item casts, as any view sees it, may be another shadow than before.
    void changed(std::uint32_t item);

    /// The scene as it is looked at now. `user`: whose, where users see different things; else 0.
    [[nodiscard]] std::shared_ptr<const ShadowView> view(const RenderScene::Impl& scene, const ScreenCamera& camera,
                                                         bool sun, unsigned user);

    /// What has changed in a view: where something was that cast a shadow, or is.
    struct Change {
        std::uint64_t state = 0;
        MapShade shade;
    };
    /// After a state of its kin, up to now. None: it is not known any more.
    [[nodiscard]] std::optional<std::span<const Change>> changesAfter(std::uint64_t kin, std::uint64_t state) const;

    /// Somebody has held changes against so many things.
    void count(std::uint64_t asked) const { work_ += asked; }
    /// Those, and casters that have been looked at or copied, so far: what tests of cost count.
    [[nodiscard]] std::uint64_t work() const { return work_; }

private:
    struct Moving {
        ShadowCaster caster;
        std::uint64_t frame = 0;  ///< in which it changed
    };
    struct Entry {
        Entry(const ScreenCamera& camera, bool sun, unsigned user);
        ShadowSight sight;
        unsigned user;
        bool sun;
        std::uint64_t known = 0;  ///< of the scene's changes, the last
        std::uint64_t usedIn = 0, joinedIn = 0;
        std::shared_ptr<const ShadowView> now;
        std::unordered_map<std::uint32_t, CasterRank> still;  ///< items: where they stand in `now->still->all`
        std::map<std::uint32_t, Moving> moving;
        std::vector<Change> changes;
        std::uint64_t knownAfter = 0;  ///< all changes after this state are here

        [[nodiscard]] std::size_t casters() const { return still.size() + moving.size(); }
    };
    /// A change of the scene's items that is remembered, and one of a view.
    static constexpr std::size_t kMostChanges = 1u << 16, kMostSteps = 1u << 12;
    static constexpr std::uint64_t kRestFrames = 30;  ///< until something rests
    /// Views that are not asked for now, and things in them; for so many frames with looks.
    static constexpr std::size_t kMostViews = 64, kMostKept = 1u << 16;
    static constexpr std::uint64_t kKeptFrames = 300;

    void start(Entry& entry, const RenderScene::Impl& scene) const;
    void follow(Entry& entry, const RenderScene::Impl& scene) const;
    /// What has rested joins what is still.
    void join(Entry& entry) const;
    /// Its view with these, in another state or as before.
    static void renew(Entry& entry, std::uint64_t state, std::shared_ptr<const StillCasters> still);
    static void shorten(Entry& entry);
    void forgetOld();
    void shortenChanges();

    struct ItemChange {
        std::uint64_t number = 0;  ///< ascending
        std::uint32_t item = 0;
    };
    std::vector<std::unique_ptr<Entry>> entries_;
    std::vector<ItemChange> changes_;
    std::uint64_t changed_ = 0, changesFrom_ = 0;  ///< the last; all later ones than this are here
    std::uint64_t frame_ = 1;
    bool told_ = false, frameBegins_ = false;
    mutable std::uint64_t work_ = 0;
};

}  // namespace tessera
