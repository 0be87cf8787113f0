#include "client/replica/RenderHost.h"

#include <fmt/format.h>

#include <algorithm>
#include <thread>
#include <utility>
#include <vector>

#include "client/replica/TileWindows.h"
#include "common/codec/ChangeCodec.h"
#include "common/codec/WallCodec.h"
#include "common/scene/FieldTable.h"

namespace tessera {

RenderHost::RenderHost(RenderHostOptions options, Surface* surface, const BlobStore& blobs, Log& log,
                       std::function<void(Outcome)> report)
    : options_(std::move(options)),
      surface_(surface),
      blobs_(blobs),
      log_(log),
      report_(std::move(report)),
      queue_(*options_.time),
      writer_(std::make_unique<PictureWriter>(log, options_.lane)),
      warnings_(log) {}

RenderHost::~RenderHost() = default;

Expected<std::uint64_t> RenderHost::probe() {
    // Four samples whatever the wall will want: hosts are compared before they know the wall.
    if (!surface_) return std::uint64_t{0};
    samples_ = 4;
    auto renderer = createRenderer();
    if (!renderer) return tl::unexpected(renderer.error());
    renderer_ = std::move(*renderer);
    const TimePoint begin = queue_.now();
    auto probe = renderer_->pixelProbe();
    constexpr int kProgramsOfTheProbe = 16;  // about
    programTakes_ = (queue_.now() - begin) / kProgramsOfTheProbe;
    if (probe) probe_ = *probe;
    return probe;
}

Expected<std::unique_ptr<Renderer>> RenderHost::createRenderer() const {
    return Renderer::create(*surface_, {.samples = samples_,
                                        .time = options_.time,
                                        .memoryBytes = options_.glMemoryBytes,
                                        .anisotropy = options_.anisotropy,
                                        .onStep = options_.onStep});
}

bool RenderHost::perform(const Work& work) {
    attempt_ = work.attempt;
    const bool leavesPictures = std::holds_alternative<work::Shown>(work.what) ||
                                std::holds_alternative<work::Help>(work.what) ||
                                std::holds_alternative<work::Meet>(work.what);
    if (!leavesPictures) still_.reset();
    return std::visit([this](const auto& what) { return on(what); }, work.what);
}

bool RenderHost::workAhead(TimePoint now) {
    if (!renderer_) return false;
    // Frames without a pause that show nothing new leave no moment between flips: what is shown then is the same,
    // whoever is late.
    const bool starves = still_ && now >= lastSlice_ + kLongestWithoutSlice;
    if (othersMayFlipHere() && now < flippedBy_.load() && !starves) return true;
    if (now < nextAhead_ && options_.sharing && options_.sharing->neighboursDraw()) return true;
    const TimePoint begin = queue_.now();
    const std::uint64_t programs = renderer_->programChanges();
    const bool more = aheadSlice();
    restOnlyWith(programs);  // a program may have been refused
    const TimePoint end = queue_.now();
    nextAhead_ = end + kPausesAhead * (end - begin);
    lastSlice_ = now;
    return more;
}

/// Where each frame is drawn and the next one begins at once there is no other time. Those who are waited for have
/// shown the frame before.
void RenderHost::uploadWhereNoTimeIsLeft() {
    const TimePoint now = queue_.now();
    if (!renderer_ || now < lastSlice_ + kLongestWithoutSlice) return;
    (void)uploadSlice();
    lastSlice_ = now;
}

bool RenderHost::aheadSlice() {
    return programSlice() || uploadSlice() || renderer_->mayPrepare();
}

bool RenderHost::programSlice() {
    if (!still_ && programTakes_ >= options_.shortProgram) return false;
    const TimePoint begin = queue_.now();
    if (!renderer_->prepare()) return false;
    programTakes_ = std::max<Duration>(queue_.now() - begin, programTakes_ * 3 / 4);
    return true;
}

bool RenderHost::uploadSlice() {
    if (!eye_) return false;
    const auto more = uploads_.step(*renderer_, aspect_, scene_, *eye_);
    if (more) return *more;
    const Error error{more.error().code, "uploads ahead of need: " + more.error().message};
    // Nothing will be drawn here any more: better to end than to stand at the last picture until it has to change.
    if (error.code == ErrorCode::kUnsupported) return broken(error);
    log_.warning(error.message);
    return false;
}

std::optional<Outcome> RenderHost::again(const Work& work) {
    if (const auto* draw = std::get_if<work::Draw>(&work.what)) return drawAgain(work, draw->begin);
    if (std::holds_alternative<work::Shown>(work.what)) return shownAgain(work);
    return std::nullopt;
}

std::optional<Outcome> RenderHost::drawAgain(const Work& work, const message::Begin& begin) {
    if (!still_ || begin.list->changed() || !(begin.payload == still_->payload)) return std::nullopt;
    if (options_.injection.frame == begin.frame.value) return std::nullopt;  // for the draw thread, as all of them
    sequence_ = begin.list->sequence;
    for (const auto& tile : tiles_) tile->drawAgain(begin.frame);
    return Outcome{work.attempt, drawnFrame(begin.frame, still_->stats)};
}

std::optional<Outcome> RenderHost::shownAgain(const Work& work) {
    // The disk may be behind with the pictures that are kept; who waits for an image gets it from the draw thread.
    if (options_.keepFrames || !waitingImages_.empty()) return std::nullopt;
    for (const auto& tile : tiles_) tile->show();
    flippedBy_ = queue_.now() + kFlipsTake;
    return Outcome{work.attempt, outcome::Noted{}};
}

outcome::Drawn RenderHost::drawnFrame(FrameNumber frame, const ByteSlice& stats) {
    flippedBy_ = TimePoint::max();
    outcome::Drawn drawn{.frame = frame, .stateHash = aspect_.stateHash(), .stats = stats};
    if (options_.injection.kind == Injection::Kind::kLie && frame.value >= options_.injection.frame)
        drawn.stateHash.value ^= 1;
    for (const auto& tile : tiles_)
        if (tile->ready()) drawn.pictures.push_back(*tile->ready());
    return drawn;
}

bool RenderHost::on(const work::Configure& configure) {
    flippedBy_ = TimePoint{};
    // Images of an earlier connection are asked for again by whoever still wants them.
    waitingImages_.clear();
    for (const auto& tile : tiles_) tile->forgetPreviews();
    auto wall = decodeWall(configure.configuration);
    if (!wall) return broken({wall.error().code, "the server's wall: " + wall.error().message});
    if (auto used = useWall(std::move(*wall)); !used) return broken(used.error());
    configuration_ = hash64(configure.configuration.bytes());
    if (options_.sharing) options_.sharing->useWall(wall_, options_.name);
    return true;
}

bool RenderHost::on(const work::Meet& meet) {
    if (options_.sharing) options_.sharing->meet(meet.neighbours.boards);
    return true;
}

bool RenderHost::on(const work::Help&) {
    helpNeighbours();
    return true;
}

/// As long as nothing else is to be done: a part that is under way then is left.
void RenderHost::helpNeighbours() {
    if (!options_.sharing || !renderer_) return;
    const TimePoint before = queue_.now();
    std::uint64_t helped = 0;
    const std::uint64_t programs = renderer_->programChanges();
    const auto wantedHere = [this] { return options_.workWaits && options_.workWaits(); };
    while (!wantedHere() && options_.sharing->help(*renderer_, aspect_, scene_, wantedHere)) ++helped;
    restOnlyWith(programs);  // one may have been left out for a neighbour's part
    if (helped == 0) return;
    helped_ += helped;
    helping_ += queue_.now() - before;
}

/// Where persons' programs are drawn otherwise since then, own tiles may show them as before, or their shadows.
void RenderHost::restOnlyWith(std::uint64_t programs) {
    if (renderer_->programChanges() != programs) still_.reset();
}

/// Of all that a picture of this frame depends on but its rectangle and its eye: what is drawn without programs that
/// take too long here, too.
Hash128 RenderHost::digestOf(const message::Begin& begin) const {
    Bytes bytes;
    const auto add = [&](std::uint64_t number) {
        const auto* from = reinterpret_cast<const std::byte*>(&number);
        bytes.insert(bytes.end(), from, from + sizeof number);
    };
    for (const std::uint64_t number :
         {begin.frame.value, sequence_.value, aspect_.stateHash().value, probe_, configuration_})
        add(number);
    if (renderer_)
        for (const HeldUpBy& held : renderer_->heldUpBy(aspect_)) add(held.program.value);
    const ByteSpan payload = begin.payload.bytes();
    bytes.insert(bytes.end(), payload.begin(), payload.end());
    return hash128(bytes);
}

Expected<void> RenderHost::useWall(Wall wall) {
    wall_ = std::move(wall);
    if (surface_ && (samples_ != wall_.samples || !renderer_)) {
        samples_ = wall_.samples;
        uploads_ = {};
        renderer_.reset();
        auto renderer = createRenderer();
        if (!renderer) return tl::unexpected(renderer.error());
        renderer_ = std::move(*renderer);
    }
    std::vector<std::unique_ptr<HostTile>> before = std::move(tiles_);
    const std::vector<Tile> all = layoutTiles(wall_);
    tiles_.clear();
    for (Tile& tile : tilesOf(wall_, options_.name)) {
        std::vector<PixelRect> elsewhere = countedElsewhere(all, tile);
        std::string folder =
            options_.output.empty() ? std::string() : fmt::format("{}/tiles/{}", options_.output, tile.name);
        tiles_.push_back(std::make_unique<HostTile>(std::move(tile), std::move(elsewhere),
                                                    options_.culler.value_or(wall_.culler), std::move(folder)));
        for (auto& old : before)
            if (old && tiles_.back()->takeOver(*old)) old.reset();
    }
    if (options_.windows) options_.windows->follow(wall_, tilesOf(wall_, options_.name));
    return {};
}

bool RenderHost::on(const work::ApplySnapshot& apply) {
    if (options_.sharing) options_.sharing->forget();
    if (auto applied = applySnapshot(*apply.snapshot.list); !applied) {
        tell(outcome::ApplyFailed{"the snapshot: " + applied.error().message});
        return true;
    }
    sequence_ = apply.snapshot.list->sequence;
    tell(outcome::Applied{sequence_, aspect_.stateHash()});
    return true;
}

bool RenderHost::on(const work::ApplyChanges& apply) {
    if (options_.sharing) options_.sharing->forget();
    if (auto applied = applyList(*apply.changes.list); !applied) {
        tell(outcome::ApplyFailed{
            fmt::format("list {}: {}", apply.changes.list->sequence.value, applied.error().message)});
        return true;
    }
    sequence_ = apply.changes.list->sequence;
    tell(outcome::Applied{sequence_, aspect_.stateHash()});
    return true;
}

Expected<void> RenderHost::applySnapshot(const CommittedList& committed) {
    // A snapshot starts from nothing: what was known of the scene before is void, come what may.
    aspect_ = Aspect();
    Expected<void> done;
    if (committed.changed()) {
        const auto list = decodeChangeList(committed.encoded, blobs_);
        done = list ? aspect_.apply(*list) : tl::unexpected(list.error());
    }
    follow(nullptr);
    return done;
}

Expected<void> RenderHost::applyList(const CommittedList& committed) {
    if (!committed.changed()) return {};
    const auto list = decodeChangeList(committed.encoded, blobs_);
    if (!list) return tl::unexpected(list.error());
    if (auto applied = aspect_.apply(*list); !applied) return applied;
    follow(&*list);
    return {};
}

/// What is drawn follows the scene; null: anything may have changed.
void RenderHost::follow(const ChangeList* list) {
    if (surface_) scene_.update(aspect_, list);
}

bool RenderHost::on(const work::Draw& draw) {
    const FrameNumber frame = draw.begin.frame;
    const TimePoint begun = queue_.now();
    uploadWhereNoTimeIsLeft();
    injectBefore(frame);
    if (options_.injection.at(Injection::Kind::kDrawFail, frame.value))
        return broken({ErrorCode::kFailed, fmt::format("frame {}: an error injected by --inject", frame.value)});
    const auto payload = decodeFrame(draw.begin.payload);
    if (!payload) {
        tell(outcome::ApplyFailed{fmt::format("frame {}: {}", frame.value, payload.error().message)});
        return true;
    }
    HostStats stats;
    const TimePoint applying = queue_.now();
    const Duration queuedBefore = queue_.waited();
    if (auto applied = applyList(*draw.begin.list); !applied) {
        tell(outcome::ApplyFailed{fmt::format("frame {}: {}", frame.value, applied.error().message)});
        return true;
    }
    sequence_ = draw.begin.list->sequence;
    stats.applyMs = toMilliseconds(queue_.now() - applying);
    stats.applyQueuedMs = toMilliseconds(queue_.waited() - queuedBefore);
    stats.helpedParts = std::exchange(helped_, 0);
    stats.helpMs = toMilliseconds(std::exchange(helping_, Duration::zero()));
    const std::uint64_t programs = renderer_ ? renderer_->programChanges() : 0;
    const bool scene = payload->showing == Showing::kScene;
    const bool shares = options_.sharing && surface_ && scene;
    if (shares) options_.sharing->begin(frame, digestOf(draw.begin), payload->view);
    if (renderer_) renderer_->beginFrame();
    scene_.beginFrame();
    std::vector<const PaintedTile*> painted;
    for (const auto& tile : tiles_) {
        auto drawn = drawTile(*tile, *payload, frame);
        if (!drawn)
            return broken({drawn.error().code, fmt::format("frame {}, tile {}: {}", frame.value, tile->tile().name,
                                                           drawn.error().message)});
        if (surface_) stats.tiles.push_back(std::move(*drawn));  // else it has drawn none, and left none away
        painted.push_back(&tile->painted());
        if (tile->light()) stats.light = (stats.light ? *stats.light : LightHistogram()) + *tile->light();
    }
    if (renderer_) {
        const std::vector<HeldUpBy> heldUp = renderer_->heldUpBy(aspect_);
        for (const HeldUpBy& held : heldUp) stats.heldUp.push_back({held.program, toMilliseconds(held.took)});
        warnings_.tell(frame, aspect_, painted, scene_.undrawn(), heldUp);
    }
    if (shares) options_.sharing->end();
    stats.workMs = toMilliseconds(queue_.now() - begun);
    const ByteSlice encoded = encodeStats(stats);
    if (!draw.begin.list->changed() && stats.helpedParts == 0 &&
        std::ranges::all_of(tiles_, [](const auto& tile) { return tile->still(); }))
        still_ = {.payload = draw.begin.payload, .stats = encoded};
    if (renderer_) restOnlyWith(programs);
    tell(drawnFrame(frame, encoded));
    helpNeighbours();
    return true;
}

Expected<TileStats> RenderHost::drawTile(HostTile& tile, const FramePayload& payload, FrameNumber frame) {
    if (!surface_) return tile.drawNothing();
    if (payload.showing != Showing::kScene) return tile.drawTestPicture(wall_, payload.showing, frame, queue_);
    const ScreenCamera camera = tileCamera(wall_, tile.tile(), payload.view);
    eye_ = camera.eyeWorld;
    return tile.drawScene({.wall = wall_,
                           .aspect = aspect_,
                           .scene = scene_,
                           .renderer = *renderer_,
                           .queue = queue_,
                           .sharing = options_.sharing},
                          camera, frame);
}

bool RenderHost::on(const work::Shown& shown) {
    flippedBy_ = queue_.now() + kFlipsTake;
    for (const auto& tile : tiles_)
        if (tile->show() && options_.keepFrames && !options_.output.empty())
            writer_->writePng(tile->pngPath(), tile->shown(), tile->shownFrame().value);
    std::erase_if(waitingImages_, [&](const WaitingImages& waiting) {
        if (waiting.request.frame > shown.frame) return false;
        sendImages(waiting);
        return true;
    });
    return true;
}

bool RenderHost::on(const work::Describe& describe) {
    message::HashAnswer answer{.sequence = sequence_, .objects = describe.query.objects};
    if (describe.query.objects) {
        for (const Aspect::ObjectHash& object : aspect_.objectHashes(describe.query.leaf))
            answer.entries.push_back({object.id.value, object.hash});
    } else {
        for (const Aspect::LeafHash& leaf : aspect_.leafHashes()) answer.entries.push_back({leaf.leaf, leaf.hash});
    }
    tell(outcome::Described{std::move(answer)});
    return true;
}

bool RenderHost::on(const work::Finish&) {
    if (renderer_)
        log_.detail(
            fmt::format("pictures, meshes, images and voxels take {} MiB of GL's memory, of {} that they may; "
                        "buffers of meshes were copied {} times",
                        renderer_->lastCounts().memoryBytes >> 20, renderer_->lastCounts().memoryBudget >> 20,
                        renderer_->lastCounts().bufferCopies));
    for (const auto& tile : tiles_)
        log_.detail(fmt::format("tile {}: {} frames, {} of them without drawing anything anew", tile->tile().name,
                                tile->frames(), tile->framesAgain()),
                    {.tile = tile->tile().name});
    if (!options_.keepFrames && !options_.output.empty())
        for (const auto& tile : tiles_)
            if (tile->showsAny()) writer_->writePng(tile->pngPath(), tile->shown(), tile->shownFrame().value);
    if (!writer_->finish()) return broken({ErrorCode::kFailed, "not every picture could be written"});
    return false;
}

void RenderHost::injectBefore(FrameNumber frame) {
    const Injection& injection = options_.injection;
    if (injection.at(Injection::Kind::kDrawHang, frame.value)) {
        log_.warning(fmt::format("frame {}: the draw thread hangs, as --inject asks for", frame.value));
        while (true) std::this_thread::sleep_for(std::chrono::hours(1));
    }
    if (injection.at(Injection::Kind::kDrawSlow, frame.value)) {
        log_.warning(fmt::format("frame {}: the draw thread pauses, as --inject asks for", frame.value));
        std::this_thread::sleep_for(injection.pause);
    }
    if (injection.at(Injection::Kind::kCorrupt, frame.value)) corruptOneField();
}

void RenderHost::corruptOneField() {
    const TypeInfo& transform = *findType(typeOf<Transform>());
    const FieldEntry& translation = *findField(transform, "translation");
    for (const ObjectId id : aspect_.ids()) {
        const Object object = aspect_.find(id);
        if (&object.info() != &transform) continue;
        auto value = std::get<Doubles>(translation.load(object));
        value.values[0] += 0.25;
        ChangeListBuilder builder;
        builder.set(id, transform.type, translation.id, value);
        const ChangeList list = builder.take();
        if (!aspect_.apply(list)) continue;
        follow(&list);
        log_.warning(fmt::format("the translation of object {} is corrupted, as --inject asks for", id.value));
        return;
    }
    log_.warning("nothing to corrupt: the scene has no transform");
}

bool RenderHost::broken(const Error& error) {
    tell(outcome::Broken{error});
    return false;
}

}  // namespace tessera
