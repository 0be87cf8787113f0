/// One tile of a host: the picture of the frame in hand, the one that is shown, and the file in which others see it.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/replica/PartSharing.h"
#include "client/replica/TilePainter.h"
#include "common/codec/FrameCodec.h"
#include "common/image/SharedFrame.h"
#include "common/wall/LightHistogram.h"

namespace tessera {

/// What all tiles of a host are drawn from, and with.
struct TileSources {
    const Wall& wall;
    const Aspect& aspect;
    const RenderScene& scene;
    Renderer& renderer;
    const ProcessorQueue& queue;  ///< of the draw thread
    PartSharing* sharing;         ///< with neighbours; null: no parts are shared
};

/// A frame goes through `draw…`, which makes its picture, and `show`, after which that picture is the one that others
/// see. Belongs to the draw thread; `drawAgain` and `show` may be called by another while that one has no work.
class HostTile {
public:
    /// `elsewhere`: see countedElsewhere. `folder`: where the tile's files are; empty: there are none.
    HostTile(Tile tile, std::vector<PixelRect> elsewhere, CullerKind culler, std::string folder)
        : tile_(std::move(tile)),
          elsewhere_(std::move(elsewhere)),
          folder_(std::move(folder)),
          painter_(tile_.rect, culler) {}

    [[nodiscard]] const Tile& tile() const { return tile_; }
    /// The same tile in another wall: keeps the picture that is shown, and the file. False: it is another.
    [[nodiscard]] bool takeOver(HostTile& before);

    /// Errors are the renderer's, and those of the file.
    [[nodiscard]] Expected<TileStats> drawScene(const TileSources& from, const ScreenCamera& camera, FrameNumber frame);
    /// Once, and again only where it counts frames.
    [[nodiscard]] Expected<TileStats> drawTestPicture(const Wall& wall, Showing showing, FrameNumber frame,
                                                      const ProcessorQueue& queue);
    /// Of a host without a surface, which has no pictures.
    [[nodiscard]] TileStats drawNothing();
    /// The picture before, which is this frame's, too.
    void drawAgain(FrameNumber frame);
    /// Nothing that the picture of the last frame is made from had changed.
    [[nodiscard]] bool still() const { return still_; }
    /// Of the last picture of the scene: what it lacks.
    [[nodiscard]] const PaintedTile& painted() const { return painted_; }
    /// Of the picture of the frame in hand, where an exposure is metered.
    [[nodiscard]] const std::optional<LightHistogram>& light() const { return light_; }

    /// What was drawn last is shown from now on. False: nothing has been drawn since.
    bool show();
    /// Drawn and to be shown, in the tile's file. None: there is no file.
    [[nodiscard]] const std::optional<ReadyFrame>& ready() const { return ready_; }

    [[nodiscard]] bool showsAny() const { return shown_ != nullptr; }
    [[nodiscard]] FrameNumber shownFrame() const { return shownFrame_; }
    /// With its pixels. Only where it shows any.
    [[nodiscard]] std::shared_ptr<const Picture> shown();
    /// Each side divided by `by`. None: that is what was sent last, at this size. Only where it shows any.
    [[nodiscard]] std::optional<Picture> preview(std::uint32_t by, bool newsAlone);
    /// The preview of that size has been sent.
    void notePreview(std::uint32_t by) { previewed_[by] = shown_; }
    /// Nobody has been sent any.
    void forgetPreviews() { previewed_.clear(); }
    [[nodiscard]] std::string pngPath() const;  ///< of what is shown
    [[nodiscard]] std::uint64_t frames() const { return frames_; }
    [[nodiscard]] std::uint64_t framesAgain() const { return again_; }  ///< of these, without a new picture

private:
    /// A picture without pixels: they are in the file alone.
    [[nodiscard]] static bool liesInFile(const Picture& picture) { return picture.rgb.empty(); }
    [[nodiscard]] Expected<void> openFile();
    [[nodiscard]] Expected<Picture> drawWhole(const TileSources& from, const DrawList& list, const ScreenCamera& camera,
                                              Duration& readBack);
    void handOver(FrameNumber frame, bool again);

    Tile tile_;
    std::vector<PixelRect> elsewhere_;
    std::string folder_;
    TilePainter painter_;
    PaintedTile painted_;
    std::optional<LightHistogram> light_;
    std::shared_ptr<const Picture> drawn_, shown_;
    std::shared_ptr<const Picture> copied_;  ///< of `shown_` from the file, while somebody wants it
    FrameNumber drawnFrame_, shownFrame_;
    std::optional<SharedFrameWriter> file_;
    std::optional<ReadyFrame> ready_, seen_;  ///< of `drawn_` and `shown_`, in that file
    std::uint64_t frames_ = 0, again_ = 0;
    std::shared_ptr<const Picture> test_;  ///< drawn last; null: the scene was
    bool testCounts_ = false;
    bool still_ = false;
    std::map<std::uint32_t, std::weak_ptr<const Picture>> previewed_;  ///< sent last, by how much it was shrunk
};

}  // namespace tessera
