#include "server/sim/FrameMaker.h"

#include <fmt/format.h>

#include "common/codec/FrameCodec.h"
#include "server/sim/desk/CollisionAnswers.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {

/// Arrays of one content become one: what the scene holds is what hosts and files find by name.
static void unify(ChangeList& list, BlobStore& blobs) {
    for (FieldColumn& column : list.columns)
        if (auto* values = std::get_if<std::vector<Blob>>(&column.values))
            for (Blob& blob : *values) blob = blobs.add(std::move(blob));
}

Expected<void> FrameMaker::record(const std::string& path, unsigned threads) {
    auto writer = RecordingWriter::create(path, openingOfThisServer(threads), around_.log, {}, around_.lane);
    if (!writer) return tl::unexpected(writer.error());
    recording_ = std::move(*writer);
    return {};
}

void FrameMaker::follow(const CommittedFrame& committed) const {
    if (around_.snapshots) around_.snapshots->follow(committed);
}

Expected<void> FrameMaker::load(std::vector<ChangeList> lists) {
    for (ChangeList& list : lists) unify(list, around_.blobs);
    if (recording_) recording_->startScene(lists);
    Expected<CommittedFrame> loaded = around_.simulation.load(std::move(lists));
    if (!loaded) return tl::unexpected(loaded.error());
    follow(*loaded);
    if (recording_) recording_->started(*loaded);
    if (around_.journal) around_.journal->started(*loaded);
    for (const Blob& blob : loaded->list ? blobsOf(*loaded->list) : std::vector<Blob>()) around_.blobs.add(blob);
    return sceneIsThere();
}

Expected<void> FrameMaker::goOnFrom(Journal::Opened& opened) {
    JournalState& state = opened.state;
    if (state.view) around_.view.goOnFrom(*state.view);
    around_.simulation.goOnFrom({.scene = std::move(state.scene),
                                 .sequence = state.sequence,
                                 .history = std::move(state.history),
                                 .display = std::move(state.display)});
    around_.simulation.skipNumbers(opened.nextId, opened.behind);
    const Aspect& scene = around_.simulation.scene();
    const auto whole = std::make_shared<const ChangeList>(snapshot(scene));
    follow({.sent = share(CommittedList{.sequence = around_.simulation.sequence(), .stateHash = scene.stateHash()}),
            .list = whole});
    // Whoever joins fetches them by name, those that ranges have made too.
    for (const Blob& blob : blobsOf(*whole)) around_.blobs.add(blob);
    return sceneIsThere();
}

Expected<void> FrameMaker::sceneIsThere() {
    const SceneCounts counts = countScene(around_.simulation.scene());
    around_.log.info(fmt::format("scene: {} nodes, {} cores, {} triangles ({} stored)", counts.nodes, counts.cores,
                                 counts.triangles, counts.trianglesStored));
    around_.view.update(around_.simulation.scene(), nullptr);
    around_.simulation.actors().follow(Actor::Each::kFrame, around_.simulation.scene(), nullptr);
    const Expected<View> first = around_.view.view(around_.simulation.scene());
    if (!first) return tl::unexpected(first.error());
    lastView_ = *first;
    return {};
}

FrameResult FrameMaker::make(FrameNumber number, std::vector<Edit> edits, const std::vector<Reply>& replies,
                             TimePoint now) {
    const bool first = number == FrameNumber(0);
    const ActorTable& actors = around_.simulation.actors();
    // By where heads were in the frame before. Edits like others, so that whoever follows, records or keeps a journal
    // has them.
    actors.say({.scene = around_.simulation.scene(),
                .view = lastView_,
                .frame = number,
                .first = first,
                .stepUnderWay = around_.simulation.stepUnderWay(),
                .now = now},
               edits);
    for (const std::string& remark : actors.takeRemarks()) around_.log.warning(remark);
    for (Edit& edit : edits) unify(edit.list, around_.blobs);
    if (recording_) recording_->frameBegins(number, first, edits, replies);
    around_.simulation.forgetLists();  // whoever is told of the last frame has been told, or asks too late
    FrameResult frame = around_.simulation.step(first, std::move(edits), replies);
    follow(frame.commit);
    for (const std::string& remark : frame.remarks) around_.log.warning(remark);
    if (frame.commit.list) hold(number, *frame.commit.list, frame.unneeded);
    for (const std::string& note : frame.notes) around_.log.info(note);
    if (recording_) recording_->frameDone(number, frame);
    if (around_.journal) around_.journal->frameDone(number, frame, around_.simulation.display());
    around_.report.frameCommitted(frame);

    if (frame.commit.list) {
        around_.view.update(around_.simulation.scene(), frame.commit.list.get());
        actors.follow(Actor::Each::kFrame, around_.simulation.scene(), frame.commit.list.get());
    }
    if (around_.moveHeads) around_.moveHeads();
    if (around_.steering) around_.steering->frame(now);
    for (const std::string& remark : around_.steering ? around_.steering->takeRemarks() : std::vector<std::string>())
        around_.log.info(remark);
    if (const Expected<View> view = around_.view.view(around_.simulation.scene())) {
        lastView_ = *view;
    } else if (!std::exchange(cameraComplaint_, true)) {
        around_.log.warning(view.error().message + "; the view stays where it was");
    }
    if (around_.journal) around_.journal->viewIs(around_.view);
    lastView_.detail = 0;
    actors.look(lastView_);
    return frame;
}

message::Begin FrameMaker::begin(FrameNumber number, const FrameResult& frame) const {
    return {.frame = number,
            .payload = encodeFrame({.view = lastView_,
                                    .collision = numbersOf(frame.collision),
                                    .showing = around_.showing ? *around_.showing : Showing::kScene}),
            .list = frame.commit.sent};
}

bool FrameMaker::ready(TimePoint now) {
    constexpr Duration kPatience = std::chrono::seconds(10);
    if (!readyUntil_) readyUntil_ = now + kPatience;
    const ActorTable& actors = around_.simulation.actors();
    const std::vector<Actor::Awaited> awaited = actors.awaited(around_.simulation.scene(), now);
    for (const std::string& remark : actors.takeRemarks()) around_.log.warning(remark);
    if (now < *readyUntil_) return awaited.empty();
    for (const Actor::Awaited& some : awaited)
        if (!some.missing.empty()) around_.log.warning(fmt::format("{} {}", some.count, some.missing));
    return true;
}

void FrameMaker::hold(FrameNumber frame, const ChangeList& list, std::vector<std::shared_ptr<const void>>& unneeded) {
    constexpr std::uint64_t kFrames = 600, kBytes = std::uint64_t{256} << 20;
    Named named{.frame = frame, .blobs = blobsOf(list)};
    // What ranges have made: hosts make it themselves, and those that come later ask for it by name.
    for (const RangeEdit& range : list.ranges) named.blobs.push_back(range.result);
    for (Blob& blob : named.blobs) {
        blob = around_.blobs.add(std::move(blob));
        named.bytes += blob.sizeBytes();
    }
    if (named.blobs.empty()) return;
    namedBytes_ += named.bytes;
    named_.push_back(std::move(named));
    while (named_.size() > 1 && (namedBytes_ > kBytes || named_.front().frame.value + kFrames < frame.value)) {
        namedBytes_ -= named_.front().bytes;
        unneeded.push_back(std::make_shared<const std::vector<Blob>>(std::move(named_.front().blobs)));
        named_.pop_front();
    }
}

}  // namespace tessera
