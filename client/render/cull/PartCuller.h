/// Cullers that let the renderer say what is hidden, in one part of a tile.
#pragma once

#include <memory>
#include <vector>

#include "client/render/cull/PartView.h"
#include "common/wall/Culler.h"

namespace tessera {

/// What a look for hidden things took.
struct DeviceWork {
    std::uint64_t queries = 0;         ///< questions asked; of `twophase` boxes tested
    std::uint64_t waits = 0;           ///< times that it waited for the renderer
    std::uint64_t depthTriangles = 0;  ///< drawn for depth alone
};

/// Exact whatever it remembers. Opaque items go into a depth buffer in any order; another item is left away where all
/// of its plate is strictly behind that. Both hold for the picture too, as each of the drawn items is either in it or
/// itself strictly behind the others: the greatest depth of each sample is the picture's own or farther away.
class PartCuller {
public:
    PartCuller() = default;
    PartCuller(const PartCuller&) = delete;
    PartCuller& operator=(const PartCuller&) = delete;
    virtual ~PartCuller() = default;

    /// Appends the items that may be seen. The device's depth buffer is empty; the errors are its own.
    [[nodiscard]] virtual Expected<void> cull(const PartView& view, VisibilityDevice& device,
                                              std::vector<std::uint32_t>& visible, DeviceWork& work) = 0;
};

/// Null for a culler that asks no renderer (see `asksRenderer`).
[[nodiscard]] std::unique_ptr<PartCuller> makePartCuller(CullerKind kind);

/// Items waiting to be drawn for depth: kept from call to call for its memory.
class DepthDraws {
public:
    void add(const PartView& view, std::uint32_t item) { items_.push_back(view.drawItem(item)); }
    [[nodiscard]] bool empty() const { return items_.empty(); }
    [[nodiscard]] Expected<void> draw(VisibilityDevice& device) {
        if (items_.empty()) return {};
        auto drawn = device.drawDepth(items_);
        items_.clear();
        return drawn;
    }
    void forget() { items_.clear(); }

private:
    std::vector<DrawItem> items_;
};

}  // namespace tessera
