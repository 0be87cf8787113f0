/// Gives parts of this host's pictures to neighbours that have nothing to do, and draws parts of theirs.
///
/// Any rectangle of a screen has the same bytes whoever draws it (client/draw, Seams), so nothing here can change a
/// picture; only when it is there.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/draw/passes/Renderer.h"
#include "client/render/order/RenderAction.h"
#include "client/replica/ShareMode.h"
#include "client/share/Board.h"
#include "common/base/HistoryIds.h"
#include "common/base/Log.h"
#include "common/wall/LightHistogram.h"
#include "common/wall/View.h"

namespace tessera {

struct SharingOptions {
    ShareMode mode = ShareMode::kAuto;
    unsigned cores = 1;        ///< of this machine, for all its hosts
    unsigned threadsEach = 1;  ///< that a host's drawing keeps busy
    /// Idle time beside a frame that may be worth dividing the next one: half of it is gained, and pieces cost a
    /// millisecond or two each.
    std::chrono::milliseconds worthwhile{12};
};

/// What became of one picture.
struct PartCounts {
    std::uint64_t parts = 0;    ///< it was cut into; 0: it was not
    std::uint64_t helped = 0;   ///< of them, neighbours drew
    std::uint64_t twice = 0;    ///< and these the owner drew too, as a neighbour did not come back in time
    LightHistogram light = {};  ///< of all parts, where an exposure is metered
};

/// The parts that a tile is cut into: halved along the longer side until there are `count`, on multiples of 64 pixels
/// of the screen, where cells and scissors lie (client/draw), so that no pixel is drawn for two. Fewer where it is
/// small.
[[nodiscard]] std::vector<PixelRect> cutIntoParts(const PixelRect& tile, std::size_t count);

/// Belongs to the draw thread. Neighbours may be stopped, killed or mad at any instant: once its own parts are done,
/// the owner waits for theirs twice as long as one took here on average, and then draws them itself.
class PartSharing {
public:
    PartSharing(SharingOptions options, Board& board, Log& log) : options_(options), board_(board), log_(log) {}

    void useWall(const Wall& wall, const std::string& host);
    /// "HOST BOARD" a line (message::Neighbours).
    void meet(const std::string& boards);

    /// This host begins to draw a frame; `digest` stands for all that its pictures depend on. Nobody else's parts are
    /// drawn until `end`, and then those of this very frame and digest.
    void begin(FrameNumber frame, const Hash128& digest, const View& view);
    /// All its pictures are there.
    void end();
    /// The replica is no longer what it was.
    void forget() { digest_ = {}; }

    /// The tile's picture, as Renderer::draw makes it, errors too; by `whole` where it is not divided.
    [[nodiscard]] Expected<Picture> draw(Renderer& renderer, const Aspect& aspect, const DrawList& list,
                                         const ScreenCamera& camera, const Tile& tile,
                                         const std::function<Expected<Picture>()>& whole, PartCounts& counts);
    /// Some neighbour is at its own tiles.
    [[nodiscard]] bool neighboursDraw() const;
    /// No other host that this one has been told of is on this machine.
    [[nodiscard]] bool isAlone() const { return neighbours_.empty(); }
    /// Draws one part for a neighbour. False: nobody wants one that this host can draw, no processor is free, or this
    /// host is `wantedElsewhere` before it is done: then the part is given back.
    bool help(Renderer& renderer, const Aspect& aspect, const RenderScene& scene,
              const std::function<bool()>& wantedElsewhere);

private:
    struct Neighbour {
        HostIndex host = 0;
        std::string name, place;
        std::optional<NeighbourBoard> board;
    };
    /// One picture under way: which parts are in it, and how long those took that were drawn here.
    struct Assembly {
        const Tile& tile;
        /// Adds the light of what it draws to `light`.
        std::function<Expected<Picture>(const PixelRect&)> drawHere;
        std::vector<PixelRect> parts = {};
        std::vector<bool> there = {}, distrusted = {};
        Picture whole = {};
        LightHistogram light = {};
        std::size_t missing = 0, own = 0;
        Duration ownTook = {};
    };
    [[nodiscard]] std::vector<PixelRect> partsOf(const Tile& tile, std::uint32_t index) const;
    [[nodiscard]] Expected<void> assemble(Assembly& assembly, PartCounts& counts);
    [[nodiscard]] Expected<void> drawFree(Assembly& assembly, PartCounts& counts);
    [[nodiscard]] static Expected<void> drawRun(Assembly& assembly, std::size_t first, std::size_t count);
    [[nodiscard]] bool divides() const;
    void collect(Assembly& assembly, PartCounts& counts) const;
    [[nodiscard]] const Tile* wantedTile(const Posting& posting) const;
    [[nodiscard]] bool processorFree() const;
    void callIdle();
    [[nodiscard]] std::size_t room() const;
    [[nodiscard]] Duration idleBeside(TimePoint now) const;
    void judge(TimePoint now);
    void judgeTrial();

    SharingOptions options_;
    Board& board_;
    Log& log_;
    Wall wall_;
    std::vector<Tile> tiles_;  ///< of the whole wall
    HostIndex self_ = 0;
    std::vector<Neighbour> neighbours_;
    std::map<std::uint32_t, std::unique_ptr<RenderAction>> actions_;  ///< of others' tiles

    Hash128 digest_;
    FrameNumber frame_;
    View view_;
    TimePoint begun_{};
    std::map<std::uint32_t, Duration> wholeTook_;  ///< the tile's picture, when it was drawn here alone last

    // What the last frames say about dividing the next one.
    bool pays_ = false;
    bool drew_ = false;  ///< in this frame
    PartCounts frameCounts_;
    std::vector<Duration> alone_;  ///< what the last undivided frames took
    struct Trial {
        Duration took{};
        PartCounts counts;
        unsigned frames = 0;
    } trial_;                                ///< of divided ones
    unsigned goodTrials_ = 0, divided_ = 0;  ///< divided: frames in a row
    unsigned pause_ = 0, nextPause_ = 8;     ///< frames
};

}  // namespace tessera
