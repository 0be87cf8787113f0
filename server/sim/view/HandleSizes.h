/// How large users see handles that have a size on the screen: chosen once for a wall, by the server, as a part of the
/// scene.
#pragma once

#include <cstdint>

#include "server/manipulators/ManipulatorDrags.h"
#include "server/sim/view/Lookers.h"

namespace tessera {

/// Says `Manipulator::sizes` of those with `pixels`, by where heads and what they move were in the frame before; and
/// tells drags where heads are.
///
/// Of users that share a byte of Node::levels the one counts who sees handles largest. Sizes go in steps of 1/128
/// octave (0.54 %), so that a head that trembles changes little, and depend on no history. What stands nowhere keeps
/// its size. A frame in which nothing moves costs nothing, another one a look at each such manipulator. Not
/// thread-safe.
class HandleSizes {
public:
    /// Of the edits that carry what is chosen; nobody waits for them.
    static constexpr std::uint64_t kTicket = ~std::uint64_t{7};

    /// `drags` outlives it.
    HandleSizes(const Wall& wall, ManipulatorDrags& drags);

    /// The scene has changed.
    void sceneChanged() { stale_ = true; }
    /// What is to be written. What is not applied is said again.
    [[nodiscard]] ChangeList choose(const Aspect& scene, ManipulatorDisplay& display, const View& view);

private:
    [[nodiscard]] double sizeFor(std::size_t byte, const Vec3d& at, double pixels) const;

    ManipulatorDrags& drags_;
    Lookers lookers_;
    std::size_t sights_;  ///< users that are told apart
    bool stale_ = true;
};

}  // namespace tessera
