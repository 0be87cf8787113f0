/// The culler `queries-wait`: one question at a time, each answer waited for. What others are measured against.
#pragma once

#include "client/render/cull/PartCuller.h"

namespace tessera {

/// As OpenSG's first mode does it (2006), over the tree of boxes: the nearest box of those known is asked for; if it
/// shows, it is opened, or the item is drawn for depth at once. Remembers nothing.
class WaitingCuller : public PartCuller {
public:
    [[nodiscard]] Expected<void> cull(const PartView& view, VisibilityDevice& device,
                                      std::vector<std::uint32_t>& visible, DeviceWork& work) override;

private:
    struct Box {
        BoxSight sight;
        std::uint32_t index = 0;
        bool isItem = false;
    };
    void add(const BoxSight& sight, std::uint32_t index, bool isItem);

    std::vector<Box> nearestFirst_;  ///< a heap
    DepthDraws draws_;
};

}  // namespace tessera
