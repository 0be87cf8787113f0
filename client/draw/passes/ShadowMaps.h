/// The depths that lights see, in one texture.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "client/draw/passes/LightClusters.h"
#include "client/draw/passes/MapBlocks.h"
#include "client/draw/surface/GlState.h"
#include "client/render/scene/ShadowCasters.h"

namespace tessera {

/// Layers of 2048 pixels a side, of one map each or of four maps of 1024. Which layer a map lies in shows nowhere;
/// where it lies there follows from the list alone, so that all that is computed from it does, too.
///
/// A map stays as long as its view's kin is asked for: in this frame or in the one before; and while there is room for
/// maps of nobody, for kKeptFrames more. So whoever goes and comes back finds it, and what nobody asks for any more
/// gives its memory back. Frames are those that draw something: at rest nothing is asked for, and all stays. Where
/// something moves in a map, a layer beside it keeps the depths of what rests: then the map is that, in some blocks,
/// and what moves drawn over it. Belongs to the surface's thread.
class ShadowMaps {
public:
    static constexpr std::size_t kTexels = 18;
    /// Frames after which memory of what is not asked for goes; at the latest after twice as many. Where all maps
    /// together take more than maps of nobody may: the second number.
    static constexpr std::uint64_t kKeptFrames = 300, kKeptAbove = 30;
    static constexpr std::size_t kLayerBytes = std::size_t{4} * kSunMapPx * kSunMapPx;

    /// Above the budget maps go that are not asked for now, and nothing is kept beside them.
    ShadowMaps(GlState& gl, std::size_t budgetBytes);
    /// The surface is current, or gone.
    ~ShadowMaps();
    ShadowMaps(const ShadowMaps&) = delete;
    ShadowMaps& operator=(const ShadowMaps&) = delete;

    /// Maps of nobody stay while all maps together take no more than this, and than half of the budget. Above it a new
    /// map takes the place of one of them.
    void setSpare(std::size_t bytes) { spareBytes_ = std::min(bytes, budgetBytes_ / 2); }
    /// What is asked for until the next one belongs to one frame. Where nobody says so each `begin` is a frame.
    void beginFrame() { told_ = frameBegins_ = true; }
    /// Makes room for the maps of these casters.
    [[nodiscard]] Expected<void> begin(std::shared_ptr<const ShadowCasters> casters);
    [[nodiscard]] std::size_t views() const { return views_.size(); }
    [[nodiscard]] const ShadowView& view(std::size_t index) const { return *views_[index]; }
    /// Where the map of a view lies in its layer.
    [[nodiscard]] const PixelRect& place(std::size_t view) const { return slots_[slotOf_[view]].rect; }

    /// What makes a view's map what it should be, in this order. Blocks are those of the layer.
    struct Update {
        bool any = false;             ///< else it is
        bool throughKept = false;     ///< what rests is drawn into the layer beside the map; else into the map
        MapBlocks still;              ///< empty these, and draw what rests and meets them
        bool keep = false;            ///< copy all of the map to the layer beside it
        MapBlocks copied;             ///< copy these from that layer to the map
        MapBlocks moving;             ///< draw into the map what moves and meets these
        std::uint64_t forgotten = 0;  ///< how often all had been forgotten before
    };
    /// Until `setDrawn` nothing is known of the map any more.
    [[nodiscard]] Update update(std::size_t view);
    /// To draw into the map, or the layer beside it.
    void attach(std::size_t view, bool kept);
    [[nodiscard]] GLuint framebuffer() const { return framebuffer_; }
    void keep(std::size_t view);
    void copyKept(std::size_t view, const MapBlocks& blocks);
    /// Nothing where all has been forgotten since the update began.
    void setDrawn(std::size_t view, const Update& update);
    /// Maps may show what they should no longer: all are drawn anew, those that are being drawn, too.
    void forget();

    /// What shaders read of each light besides itself (Lighting.glsl), kTexels each: of three views, the finest first,
    /// where there is none the next one again: a matrix, by rows, from the screen's eye space to the texture and depth,
    /// all times w; how large a pixel of the map is (at w = 0, and for each w more), in metres, and the layer; the
    /// rectangle. Of a point light in place of the first rectangle -1, and where among `cubes` its six views begin.
    struct Texels {
        std::vector<std::array<float, 4>> lights, cubes;
    };
    [[nodiscard]] Texels texels(const ScreenCamera& camera) const;
    [[nodiscard]] static std::array<float, 2> pixelSize() { return {1.0f / kSunMapPx, 1.0f / kSunMapPx}; }
    void bind(GLuint unit) const;
    /// Of what has been allocated.
    [[nodiscard]] std::size_t bytes() const {
        return kLayerBytes * (static_cast<std::size_t>(std::max(layers_, textureLayers_)) + kept_.size());
    }

private:
    static constexpr std::size_t kNone = ~std::size_t{0};
    /// What a map shows. Names no mesh, which would stay for it.
    struct Drawn {
        std::uint64_t kin = 0, state = 0;
        struct Moving {
            ObjectId node;
            std::uint64_t since = 0;
            PixelRect rect;
        };
        std::vector<Moving> moving;
    };
    struct Slot {
        int layer = 0;
        PixelRect rect;
        std::optional<Drawn> drawn = {};   ///< none: nothing is known of it
        std::optional<Drawn> before = {};  ///< while an update runs
        bool keeps = false;                ///< the layer beside has what rests of `drawn`
        std::uint64_t usedIn = 0;
    };
    [[nodiscard]] std::size_t longestUnused(const PixelRect& rect, std::uint64_t usedBefore, bool known,
                                            const std::vector<bool>& taken) const;
    void addLayer(bool large);
    [[nodiscard]] Expected<void> reachLayers();
    [[nodiscard]] Expected<void> makeLayers(int layers, std::span<const int> from);
    /// What nobody has asked for in so many frames.
    [[nodiscard]] Expected<void> letGo(std::uint64_t keptFrames);
    /// For a layer more, within so many bytes.
    [[nodiscard]] bool hasRoom(std::size_t within) const {
        return layers_ < textureLayers_ || bytes() + kLayerBytes <= within;
    }
    [[nodiscard]] bool makeKept(int layer);
    void dropKept(int layer);
    [[nodiscard]] static std::vector<Drawn::Moving> movingOf(const ShadowView& view);
    /// A rectangle of the map's pixels in those of the layer.
    [[nodiscard]] static PixelRect inLayer(const Slot& slot, const PixelRect& rect);
    void makeTexture(int sidePx, int layers);
    void addTexels(std::size_t view, const ScreenCamera& camera, std::vector<std::array<float, 4>>& texels) const;

    GlState& gl_;
    std::size_t budgetBytes_, spareBytes_;
    GLuint texture_ = 0, sampler_ = 0, framebuffer_ = 0;
    int layers_ = 0, textureLayers_ = 0;
    std::map<int, GLuint> kept_;  ///< by layer
    std::vector<Slot> slots_;
    std::shared_ptr<const ShadowCasters> casters_;
    std::vector<std::shared_ptr<const ShadowView>> views_;  ///< the sun's finer ones are the last
    std::vector<std::size_t> slotOf_;                       ///< by view
    std::size_t middle_ = 0, near_ = 0;                     ///< among them; the sun's own where there is none
    std::uint64_t frame_ = 1, forgotten_ = 0;
    bool told_ = false, frameBegins_ = false;
};

}  // namespace tessera
