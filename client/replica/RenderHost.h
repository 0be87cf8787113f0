/// The draw thread's side of a render host: a replica of the scene, the tiles, and their pictures.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "client/draw/passes/UploadAhead.h"
#include "client/replica/HostTile.h"
#include "client/replica/Injection.h"
#include "client/replica/PartSharing.h"
#include "client/replica/PictureWarnings.h"
#include "client/replica/PictureWriter.h"
#include "client/replica/Work.h"
#include "common/base/Log.h"
#include "common/codec/FrameCodec.h"

namespace tessera {

class TileWindows;

struct RenderHostOptions {
    std::string name;                  ///< of the host in the wall
    std::string output;                ///< folder of `tiles/`; empty: nothing is written
    std::optional<CullerKind> culler;  ///< none: the wall's
    bool keepFrames = false;           ///< every shown image as PNG, not only the last
    Injection injection;
    int anisotropy = 0;              ///< RendererOptions
    std::size_t glMemoryBytes = 0;   ///< RendererOptions::memoryBytes
    PartSharing* sharing = nullptr;  ///< with neighbours; null: no parts are shared
    /// Whether other work waits; while it does no neighbour is helped. May be empty.
    std::function<bool()> workWaits = {};
    /// Shows the tiles on monitors; null: nobody does.
    TileWindows* windows = nullptr;
    /// Called often while work takes long, as it gets on. May be empty.
    std::function<void()> onStep = {};
    /// What takes less to compile is made ahead of need on a wall in motion, too.
    Duration shortProgram = std::chrono::milliseconds(20);
    const TimeSource* time = &machineTime();
    MakeLane lane = LaneThreads::make;  ///< for pictures that are encoded
};

/// Applies and draws, one piece of work at a time. Lives on the thread of its surface. Knows no socket and no session:
/// work in, outcomes out. What it has drawn goes out with outcome::Drawn: whoever gets that shows it, whatever this
/// thread is at then, says so (work::Shown) before the next frame is to be drawn, and has shown it by then or never
/// does.
class RenderHost {
public:
    /// `report` is called on this thread, for images on the writer's. Blobs that lists name are found in `blobs`.
    /// Without a surface it follows the scene and says that it is ready, and draws nothing: it has no pictures.
    RenderHost(RenderHostOptions options, Surface* surface, const BlobStore& blobs, Log& log,
               std::function<void(Outcome)> report);
    ~RenderHost();

    /// Creates what drawing needs and draws the test image: its hash (without a surface 0). kUnsupported: this machine
    /// cannot draw a wall.
    [[nodiscard]] Expected<std::uint64_t> probe();

    /// Never throws and never refuses: what goes wrong is reported. False after Finish and when the host is broken.
    bool perform(const Work& work);
    /// A slice of what may be done while no work is in hand: programs that other lights would need, then uploads. What
    /// takes `shortProgram` or longer to compile (llvmpipe without a cache) would hold up a wall in motion: it waits
    /// for a frame that is the one before. Where
    /// other hosts may be on this machine nothing is done between Ready and a moment after Swap: it would stand in the
    /// way of their flips. On a wall that never rests a slice comes all the same every `kLongestWithoutSlice`: at any
    /// time where frames show nothing new, else (uploads alone) before one is drawn. False: nothing is left. On the
    /// thread of the surface; `again` may run beside it.
    [[nodiscard]] bool workAhead(TimePoint now);
    /// Does what takes no time, needs no surface and waits for nobody: a frame which is the one before once more, and
    /// taking note of what is shown. Nothing (and nothing done): `perform` it. On any thread, while no other is in the
    /// host, or in `workAhead`.
    [[nodiscard]] std::optional<Outcome> again(const Work& work);

private:
    /// A frame that had all its pictures already. One with the same payload and no list is the same, statistics and
    /// all.
    struct StillFrame {
        ByteSlice payload, stats;
    };
    struct WaitingImages {
        Attempt attempt;
        message::ImageRequest request;
    };

    bool on(const work::Configure& configure);
    bool on(const work::ApplySnapshot& apply);
    bool on(const work::ApplyChanges& apply);
    bool on(const work::Draw& draw);
    bool on(const work::Shown& shown);
    bool on(const work::Describe& describe);
    bool on(const work::SendImages& images);
    bool on(const work::Finish& finish);
    bool on(const work::Meet& meet);
    bool on(const work::Help& help);

    [[nodiscard]] Expected<std::unique_ptr<Renderer>> createRenderer() const;
    [[nodiscard]] Expected<void> useWall(Wall wall);
    [[nodiscard]] Expected<void> applySnapshot(const CommittedList& committed);
    [[nodiscard]] Expected<void> applyList(const CommittedList& committed);
    [[nodiscard]] Expected<TileStats> drawTile(HostTile& tile, const FramePayload& payload, FrameNumber frame);
    bool aheadSlice();
    bool programSlice();
    bool uploadSlice();
    void uploadWhereNoTimeIsLeft();
    [[nodiscard]] outcome::Drawn drawnFrame(FrameNumber frame, const ByteSlice& stats);
    void follow(const ChangeList* list);
    [[nodiscard]] Hash128 digestOf(const message::Begin& begin) const;
    void helpNeighbours();
    void restOnlyWith(std::uint64_t programs);
    /// While neighbours draw on the same processors, work ahead of need takes a twentieth of the time.
    static constexpr int kPausesAhead = 19;
    /// Of hosts that flip together the last one has done so by then, or is late for other reasons.
    static constexpr std::chrono::milliseconds kFlipsTake{2};
    static constexpr std::chrono::milliseconds kLongestWithoutSlice{100};
    [[nodiscard]] bool othersMayFlipHere() const { return !options_.sharing || !options_.sharing->isAlone(); }
    void injectBefore(FrameNumber frame);
    void corruptOneField();
    void sendImages(const WaitingImages& waiting);
    void sendPreview(const WaitingImages& waiting, HostTile& tile);
    /// Of tiles that there is no picture of, or no room for: the server names them.
    void sendNoImage(const WaitingImages& waiting, const HostTile& tile);
    [[nodiscard]] std::optional<Outcome> drawAgain(const Work& work, const message::Begin& begin);
    [[nodiscard]] std::optional<Outcome> shownAgain(const Work& work);
    bool broken(const Error& error);
    void tell(decltype(Outcome::what) what) { report_({attempt_, std::move(what)}); }

    RenderHostOptions options_;
    Surface* surface_;  ///< null: nothing is drawn
    const BlobStore& blobs_;
    Log& log_;
    std::function<void(Outcome)> report_;
    ProcessorQueue queue_;  ///< the draw thread's

    Attempt attempt_;
    Sequence sequence_;                            ///< of the replica
    std::uint64_t probe_ = 0, configuration_ = 0;  ///< of the pixels; of the wall's bytes
    std::uint64_t helped_ = 0;                     ///< parts drawn for neighbours since the last frame
    Duration helping_{};
    Wall wall_;
    Aspect aspect_;
    RenderScene scene_;
    std::unique_ptr<Renderer> renderer_;
    UploadAhead uploads_;
    std::optional<Vec3d> eye_;  ///< in the world, of the tile drawn last
    int samples_ = 0;
    std::vector<std::unique_ptr<HostTile>> tiles_;
    TimePoint nextAhead_{};  ///< where neighbours draw meanwhile
    Duration
        programTakes_{};     ///< as long as one that is made ahead takes here, by the last ones; at first by the probe
    TimePoint lastSlice_{};  ///< when the last slice began of what is done ahead
    std::atomic<TimePoint> flippedBy_{
        TimePoint{}};  ///< when the hosts here show the frame that this one has drawn; max: Swap is to come
    std::optional<StillFrame> still_;  ///< the frame drawn last, if nothing has happened since
    std::vector<WaitingImages> waitingImages_;
    std::unique_ptr<PictureWriter> writer_;
    PictureWarnings warnings_;
};

}  // namespace tessera
