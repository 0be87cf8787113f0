#include "client/replica/RenderHost.h"

#include <fmt/format.h>

#include <algorithm>
#include <thread>
#include <utility>
#include <vector>

#include "client/render/scene/LineWidths.h"
#include "client/replica/TileWindows.h"
#include "client/testpicture/TestPicture.h"
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
      writer_(std::make_unique<PictureWriter>(log)) {}

RenderHost::~RenderHost() = default;

Expected<std::uint64_t> RenderHost::probe() {
    // Four samples whatever the wall will want: hosts are compared before they know the wall.
    if (!surface_) return std::uint64_t{0};
    samples_ = 4;
    auto renderer = Renderer::create(*surface_, {.samples = samples_, .onStep = options_.onStep});
    if (!renderer) return tl::unexpected(renderer.error());
    renderer_ = std::move(*renderer);
    auto probe = renderer_->pixelProbe();
    if (probe) probe_ = *probe;
    return probe;
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
    const TimePoint begin = clockNow();
    const bool more = aheadSlice();
    const TimePoint end = clockNow();
    nextAhead_ = end + kPausesAhead * (end - begin);
    lastSlice_ = now;
    return more;
}

/// Where each frame is drawn and the next one begins at once there is no other time. Those who are waited for have
/// shown the frame before.
void RenderHost::uploadWhereNoTimeIsLeft() {
    const TimePoint now = clockNow();
    if (!renderer_ || now < lastSlice_ + kLongestWithoutSlice) return;
    (void)uploadSlice();
    lastSlice_ = now;
}

bool RenderHost::aheadSlice() {
    return renderer_->prepare() || uploadSlice();
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
    for (const auto& state : tiles_) {
        ++state->painted;
        ++state->again;
        if (!state->drawn) state->drawn = state->shown;
        state->drawnFrame = begin.frame;
        if (!state->file) continue;
        state->file->prepareAgain(begin.frame.value);
        state->ready = state->file->ready();
    }
    return Outcome{work.attempt, drawnFrame(begin.frame, still_->stats)};
}

std::optional<Outcome> RenderHost::shownAgain(const Work& work) {
    // The disk may be behind with the pictures that are kept; who waits for an image gets it from the draw thread.
    if (options_.keepFrames || !waitingImages_.empty()) return std::nullopt;
    for (const auto& state : tiles_) noteShown(*state);
    flippedBy_ = clockNow() + kFlipsTake;
    return Outcome{work.attempt, outcome::Noted{}};
}

outcome::Drawn RenderHost::drawnFrame(FrameNumber frame, const ByteSlice& stats) {
    flippedBy_ = TimePoint::max();
    outcome::Drawn drawn{.frame = frame, .stateHash = aspect_.stateHash(), .stats = stats};
    if (options_.injection.kind == Injection::Kind::kLie && frame.value >= options_.injection.frame)
        drawn.stateHash.value ^= 1;
    for (const auto& state : tiles_)
        if (state->ready) drawn.pictures.push_back(*state->ready);
    return drawn;
}

bool RenderHost::on(const work::Configure& configure) {
    flippedBy_ = TimePoint{};
    // Images of an earlier connection are asked for again by whoever still wants them.
    waitingImages_.clear();
    for (const auto& state : tiles_) state->previewed.clear();
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
    const TimePoint before = clockNow();
    std::uint64_t helped = 0;
    const auto wantedHere = [this] { return options_.workWaits && options_.workWaits(); };
    while (!wantedHere() && options_.sharing->help(*renderer_, aspect_, scene_, wantedHere)) ++helped;
    if (helped == 0) return;
    helped_ += helped;
    helping_ += clockNow() - before;
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
        auto renderer = Renderer::create(*surface_, {.samples = samples_, .onStep = options_.onStep});
        if (!renderer) return tl::unexpected(renderer.error());
        renderer_ = std::move(*renderer);
    }
    // A tile that is as it was keeps the image it shows.
    std::vector<std::unique_ptr<TileState>> before = std::move(tiles_);
    tiles_.clear();
    for (Tile& tile : tilesOf(wall_, options_.name)) {
        auto state = std::make_unique<TileState>(std::move(tile), options_.culler.value_or(wall_.culler));
        for (auto& old : before) {
            if (!old || old->tile.name != state->tile.name || old->tile.rect.width != state->tile.rect.width ||
                old->tile.rect.height != state->tile.rect.height)
                continue;
            state->shown = old->shown;
            state->shownFrame = old->shownFrame;
            state->seen = std::move(old->seen);
            state->file = std::move(old->file);
            old.reset();
        }
        tiles_.push_back(std::move(state));
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
    const TimePoint begun = clockNow();
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
    const TimePoint applying = clockNow();
    const Duration queuedBefore = queue_.waited();
    if (auto applied = applyList(*draw.begin.list); !applied) {
        tell(outcome::ApplyFailed{fmt::format("frame {}: {}", frame.value, applied.error().message)});
        return true;
    }
    sequence_ = draw.begin.list->sequence;
    stats.applyMs = toMilliseconds(clockNow() - applying);
    stats.applyQueuedMs = toMilliseconds(queue_.waited() - queuedBefore);
    stats.helpedParts = std::exchange(helped_, 0);
    stats.helpMs = toMilliseconds(std::exchange(helping_, Duration::zero()));
    const bool scene = payload->showing == Showing::kScene;
    const bool shares = options_.sharing && surface_ && scene;
    if (shares) options_.sharing->begin(frame, digestOf(draw.begin), payload->view);
    std::uint64_t skipped = 0, dark = 0, scopeless = 0;
    NarrowedLines narrowed;
    std::string trouble;
    if (renderer_) renderer_->beginFrame();
    for (const auto& state : tiles_) {
        auto drawn = scene ? drawTile(*state, payload->view, frame) : drawTestPicture(*state, payload->showing, frame);
        if (!drawn)
            return broken({drawn.error().code,
                           fmt::format("frame {}, tile {}: {}", frame.value, state->tile.name, drawn.error().message)});
        stats.tiles.push_back(std::move(*drawn));
        skipped += state->skipped;
        dark = std::max(dark, state->lightsLeftOut);
        scopeless = std::max(scopeless, state->scopesLeftOut);
        if (!state->trouble.empty()) trouble = state->trouble;
        if (state->narrowed.items > 0) narrowed = state->narrowed;
    }
    if (skipped != skippedBefore_ && skipped > 0)
        log_.warning(fmt::format("frame {}: {} items cannot be drawn (their meshes are damaged or absent)", frame.value,
                                 skipped),
                     {.frame = frame.value});
    skippedBefore_ = skipped;
    if (const std::set<ObjectId>& undrawn = scene_.undrawn(); surface_ && undrawn != undrawnBefore_) {
        if (!undrawn.empty()) {
            const std::string others =
                undrawn.size() > 1 ? fmt::format(" (and {} things more)", undrawn.size() - 1) : std::string();
            log_.warning(fmt::format("frame {}: {}{}", frame.value, whyNotDrawn(aspect_, *undrawn.begin()), others),
                         {.frame = frame.value});
        }
        undrawnBefore_ = undrawn;
    }
    if (dark != darkBefore_ && dark > 0)
        log_.warning(fmt::format("frame {}: {} lights beyond the first {} are left out", frame.value, dark,
                                 DrawList::kMaxLights),
                     {.frame = frame.value});
    darkBefore_ = dark;
    if (scopeless != scopelessBefore_ && scopeless > 0)
        log_.warning(
            fmt::format("frame {}: {} lights are left out, as their scopes are beyond the first {} that lights name",
                        frame.value, scopeless, DrawList::kMaxScopes),
            {.frame = frame.value});
    scopelessBefore_ = scopeless;
    if (narrowed.items > 0 && !std::exchange(narrowedBefore_, narrowed.items > 0)) {
        const std::string others =
            narrowed.items > 1 ? fmt::format(" (and those of {} things more)", narrowed.items - 1) : std::string();
        log_.warning(fmt::format("frame {}: the lines of {}{} are drawn {:.1f} pixels wide in place of {:g}: all lines "
                                 "of the screen would cover {:.0f} million pixels, "
                                 "of which it has {:.0f}",
                                 frame.value, pathOf(aspect_, narrowed.node), others, narrowed.drawnPx,
                                 narrowed.wantedPx, narrowed.wantedPixels / 1e6, kMostLinePixels / 1e6),
                     {.frame = frame.value});
    }
    narrowedBefore_ = narrowed.items > 0;
    if (trouble != troubleBefore_ && !trouble.empty())
        log_.warning(fmt::format("frame {}: {}", frame.value, trouble), {.frame = frame.value});
    troubleBefore_ = trouble;
    if (renderer_)
        for (const HeldUpBy& held : renderer_->heldUpBy(aspect_)) {
            stats.heldUp.push_back({held.program, toMilliseconds(held.took)});
            if (heldUpBefore_.insert(held.program).second)
                log_.warning(
                    fmt::format("frame {}: SurfaceProgram #{} holds this host up ({:.0f} ms): drawn without it",
                                frame.value, held.program.value, toMilliseconds(held.took)),
                    {.frame = frame.value});
        }
    if (stats.heldUp.empty()) heldUpBefore_.clear();
    if (shares) options_.sharing->end();
    stats.workMs = toMilliseconds(clockNow() - begun);
    const ByteSlice encoded = encodeStats(stats);
    if (!draw.begin.list->changed() && stats.helpedParts == 0 &&
        std::ranges::all_of(tiles_, [](const auto& state) { return state->still; }))
        still_ = {.payload = draw.begin.payload, .stats = encoded};
    tell(drawnFrame(frame, encoded));
    helpNeighbours();
    return true;
}

Expected<TileStats> RenderHost::drawTile(TileState& state, const View& view, FrameNumber frame) {
    if (!surface_) {
        state.still = true;
        return TileStats{.tile = state.tile.name};
    }
    if (std::exchange(state.test, nullptr))
        state.painter.forget();  // what it has drawn is no longer where it was drawn to
    const ScreenCamera camera = tileCamera(wall_, state.tile, view);
    eye_ = camera.eyeWorld;
    if (auto ready = openFile(state); !ready) return tl::unexpected(ready.error());
    PartCounts parts;
    Duration readBack{};
    auto painted = state.painter.paint(aspect_, scene_, *renderer_, camera, queue_, [&](const DrawList& list) {
        const auto whole = [&] { return drawWhole(state, list, camera, readBack); };
        if (!options_.sharing) return whole();
        const auto heldUp = [&] {
            std::vector<ObjectId> programs;
            for (const HeldUpBy& held : renderer_->heldUpBy(aspect_)) programs.push_back(held.program);
            return programs;
        };
        const std::vector<ObjectId> before = heldUp();
        auto picture = options_.sharing->draw(*renderer_, aspect_, list, camera, state.tile, whole, parts);
        if (heldUp() == before) return picture;
        // Parts of before, and of neighbours, have the program that it is drawn without from here on: so have those
        // that would be drawn for them.
        options_.sharing->forget();
        return whole();
    });
    if (!painted) return tl::unexpected(painted.error());
    ++state.painted;
    state.again += painted->again ? 1 : 0;
    state.skipped = painted->skipped;
    state.trouble = painted->trouble;
    state.lightsLeftOut = painted->lightsLeftOut;
    state.scopesLeftOut = painted->scopesLeftOut;
    state.narrowed = painted->narrowed;
    state.still = painted->again && painted->cull == Duration::zero();
    state.drawn = painted->picture;
    state.drawnFrame = frame;
    const TimePoint painting = clockNow();
    if (state.file) {
        if (painted->again)
            state.file->prepareAgain(frame.value);
        else if (liesInFile(*state.drawn))
            state.file->prepared(frame.value);
        else
            state.file->prepare(frame.value, *state.drawn);
        state.ready = state.file->ready();
    }
    return TileStats{.tile = state.tile.name,
                     .cullMs = toMilliseconds(painted->cull),
                     .drawMs = toMilliseconds(painted->draw),
                     .inFrustum = painted->counts.inFrustum,
                     .drawn = painted->counts.drawn,
                     .trianglesDrawn = painted->counts.trianglesDrawn,
                     .queries = painted->counts.queries,
                     .waits = painted->counts.waits,
                     .depthTriangles = painted->counts.depthTriangles,
                     .handOverMs = toMilliseconds(readBack + (state.file ? clockNow() - painting : Duration::zero())),
                     .cullQueuedMs = toMilliseconds(painted->cullQueued),
                     .drawQueuedMs = toMilliseconds(painted->drawQueued),
                     .parts = parts.parts,
                     .partsHelped = parts.helped,
                     .partsTwice = parts.twice};
}

/// Once, and again only where it counts frames.
Expected<TileStats> RenderHost::drawTestPicture(TileState& state, Showing showing, FrameNumber frame) {
    state.still = true;
    if (!surface_) return TileStats{.tile = state.tile.name};
    if (auto ready = openFile(state); !ready) return tl::unexpected(ready.error());
    const bool counts = showing == Showing::kCountedTestPicture;
    const bool again = state.test && !counts && !state.testCounts;
    const TimePoint begin = clockNow();
    if (!again)
        state.test = std::make_shared<const Picture>(
            testPicture(wall_, state.tile, {.frame = counts ? std::optional(frame.value) : std::nullopt}));
    state.testCounts = counts;
    state.still = again;
    ++state.painted;
    state.again += again ? 1 : 0;
    state.drawn = state.test;
    state.drawnFrame = frame;
    const TimePoint drawn = clockNow();
    if (state.file && again)
        state.file->prepareAgain(frame.value);
    else if (state.file)
        state.file->prepare(frame.value, *state.drawn);
    if (state.file) state.ready = state.file->ready();
    return TileStats{.tile = state.tile.name,
                     .drawMs = toMilliseconds(drawn - begin),
                     .handOverMs = toMilliseconds(clockNow() - drawn)};
}

/// Where the tile's pictures will be shown, before the first of them is drawn.
Expected<void> RenderHost::openFile(TileState& state) const {
    if (state.file || options_.output.empty()) return {};
    auto file = SharedFrameWriter::create(fmt::format("{}/tiles/{}/shown.frame", options_.output, state.tile.name),
                                          state.tile.rect.width, state.tile.rect.height);
    if (!file) return tl::unexpected(file.error());
    state.file = std::move(*file);
    return {};
}

/// Straight to where it will be shown, where there is such a place: that picture has no pixels of its own.
Expected<Picture> RenderHost::drawWhole(TileState& state, const DrawList& list, const ScreenCamera& camera,
                                        Duration& readBack) {
    const PixelRect& rect = state.tile.rect;
    if (!state.file) return renderer_->draw(aspect_, list, camera, rect);
    if (auto drawn = renderer_->drawInto(aspect_, list, camera, rect, state.file->begin()); !drawn)
        return tl::unexpected(drawn.error());
    readBack = renderer_->lastCounts().readBack;
    return Picture{.widthPx = rect.width, .heightPx = rect.height, .rgb = {}};
}

bool RenderHost::on(const work::Shown& shown) {
    flippedBy_ = clockNow() + kFlipsTake;
    for (const auto& state : tiles_) {
        if (!state->drawn) continue;
        noteShown(*state);
        if (options_.keepFrames && !options_.output.empty())
            writer_->writePng(pngPath(*state), shownBy(*state), state->shownFrame.value);
    }
    std::erase_if(waitingImages_, [&](const WaitingImages& waiting) {
        if (waiting.request.frame > shown.frame) return false;
        sendImages(waiting);
        return true;
    });
    return true;
}

void RenderHost::noteShown(TileState& state) {
    if (!state.drawn) return;
    state.shown = std::exchange(state.drawn, nullptr);
    state.shownFrame = state.drawnFrame;
    state.seen = std::exchange(state.ready, std::nullopt);
    state.copied = nullptr;
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
    for (const auto& state : tiles_)
        log_.detail(fmt::format("tile {}: {} frames, {} of them without drawing anything anew", state->tile.name,
                                state->painted, state->again),
                    {.tile = state->tile.name});
    if (!options_.keepFrames && !options_.output.empty())
        for (const auto& state : tiles_)
            if (state->shown) writer_->writePng(pngPath(*state), shownBy(*state), state->shownFrame.value);
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

std::string RenderHost::pngPath(const TileState& state) const {
    return fmt::format("{}/tiles/{}/{:06}.png", options_.output, state.tile.name, state.shownFrame.value);
}

}  // namespace tessera
