/// What pictures lack, said in the log when it comes or changes: once, not sixty times a second.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "client/replica/TilePainter.h"
#include "common/base/Log.h"

namespace tessera {

/// Belongs to one thread.
class PictureWarnings {
public:
    explicit PictureWarnings(Log& log) : log_(log) {}

    /// `tiles`: each tile of the host, as it was painted last. `undrawn`: RenderScene::undrawn.
    void tell(FrameNumber frame, const Aspect& aspect, const std::vector<const PaintedTile*>& tiles,
              const std::set<ObjectId>& undrawn, const std::vector<HeldUpBy>& heldUp);

private:
    void tellUndrawn(const Aspect& aspect, const std::set<ObjectId>& undrawn);
    void tellNarrowed(const Aspect& aspect, const NarrowedLines& narrowed);
    void tellHeldUp(const std::vector<HeldUpBy>& heldUp);
    void warn(const std::string& text);

    Log& log_;
    FrameNumber frame_;
    // Of the frame before.
    std::string trouble_;                                  ///< with the surroundings, or a person's program
    bool narrowed_ = false;                                ///< some lines were drawn narrower
    std::uint64_t lights_ = 0, scopes_ = 0, skipped_ = 0;  ///< left out
    std::set<ObjectId> heldUp_;                            ///< programs that take too long here
    std::set<ObjectId> undrawn_;                           ///< RenderScene::undrawn
};

}  // namespace tessera
