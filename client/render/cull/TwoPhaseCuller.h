/// The culler `twophase`: what was seen before makes a pyramid of depths, which everything is tested against.
#pragma once

#include "client/render/cull/DepthPyramid.h"
#include "client/render/cull/PartCuller.h"

namespace tessera {

/// What was seen in the frame before is drawn for depth; the tree is tested against the pyramid over that; of what
/// passes, the newcomers are drawn too, and if they cover enough to matter all that passed is tested once more. Two
/// waits at most.
class TwoPhaseCuller : public PartCuller {
public:
    [[nodiscard]] Expected<void> cull(const PartView& view, VisibilityDevice& device,
                                      std::vector<std::uint32_t>& visible, DeviceWork& work) override;

private:
    struct Seen {
        std::uint32_t item;
        BoxSight sight;
    };
    [[nodiscard]] Expected<void> drawSeenBefore(const PartView& view, VisibilityDevice& device, DeviceWork& work);
    [[nodiscard]] Expected<void> look(const PartView& view, VisibilityDevice& device, DeviceWork& work);
    void findSeen(const PartView& view, DeviceWork& work);
    void draw(const PartView& view, std::uint32_t item, DeviceWork& work);

    std::vector<std::uint32_t> before_;  ///< seen in the frame before
    std::vector<bool> drawn_;            ///< by item, in this frame
    std::uint64_t rebuilds_ = 0;         ///< of the scene that `before_` is of
    std::vector<Seen> seen_;
    DepthPyramid pyramid_;
    bool empty_ = true;  ///< the pyramid: nothing was drawn
    DepthDraws draws_;
};

}  // namespace tessera
