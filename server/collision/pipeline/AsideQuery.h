/// Picks and searches that take longer than a frame has: put together on the frame thread, answered on any other one.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "common/change/Value.h"
#include "common/math/Ray.h"
#include "server/collision/objects/ShapeCache.h"
#include "server/collision/pipeline/SceneHits.h"

namespace tessera {

/// What may be hit, as it was in the scene then: an answer holds of that scene, whatever has become of it meanwhile.
class AsideQuery {
public:
    /// A question with more things in its way is refused.
    static constexpr std::size_t kMostThings = 8192;

    struct Thing {
        ObjectId node;
        std::uint64_t rank = 0;  ///< ascending in document order
        Box box;                 ///< world
        Affine3d world = Affine3d::Identity();
        UnmadeShape geometry;
        bool made = false;  ///< geometry has its shape, and that its tree
    };

    std::vector<Thing> things;  ///< the nearest first
    /// What the answer has needed, for ScenePicker::put.
    std::vector<MadeShape> made;
    /// It has taken too long, or was to end: there is no answer.
    bool exhausted = false;

protected:
    class Budget;
    /// With its tree; null: nothing comes of it.
    [[nodiscard]] std::shared_ptr<const CollisionShape> shapeOf(const Thing& thing);
    /// But for what was made nothing is held any more.
    void forget();

private:
    ShapeCache cache_;
};

class AsidePick : public AsideQuery {
public:
    explicit AsidePick(const Ray& ray) : ray_(ray) {}
    /// Once. `stop`: set by any thread, it ends before the next thing is looked at; may be null.
    void answer(const std::atomic<bool>* stop = nullptr);
    std::optional<PickHit> found;  ///< as of ScenePicker::pick

private:
    Ray ray_;
};

class AsideNearest : public AsideQuery {
public:
    explicit AsideNearest(const Vec3d& place) : place_(place) {}
    /// As of AsidePick.
    void answer(const std::atomic<bool>* stop = nullptr);
    std::optional<NearestSurface> found;  ///< as of ScenePicker::nearest

    double within = 0;   ///< something of what the things show is no farther away, if anything comes of each of them
    bool again = false;  ///< nothing comes of some: put what was made, and ask again

private:
    Vec3d place_;
};

}  // namespace tessera
