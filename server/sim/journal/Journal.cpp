#include "server/sim/journal/Journal.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "common/base/Version.h"
#include "common/scene/FieldTable.h"
#include "server/sim/display/ContactDisplay.h"
#include "server/sim/journal/JournalCompaction.h"
#include "server/sim/journal/JournalStory.h"
#include "server/sim/journal/NextEpoch.h"

namespace tessera {
namespace {

/// Records that wait: more are no disk's.
constexpr std::uint64_t kMostQueued = 1 << 16;

/// The same scene from wherever the server is started.
std::vector<std::string> absolute(std::vector<std::string> scenes) {
    for (std::string& scene : scenes) {
        if (scene.starts_with("asset://")) continue;
        std::error_code error;  // whoever reads it says what is wrong with it
        const std::filesystem::path file = std::filesystem::absolute(scene, error);
        if (!error) scene = file.lexically_normal().string();
    }
    return scenes;
}

std::string listed(const std::vector<std::string>& scenes) {
    std::string text;
    for (const std::string& scene : scenes) text += (scene.starts_with("--") ? " " : " --scene ") + scene;
    return text.empty() ? "no --scene" : text.substr(1);
}

/// What nobody has seen yet. How much a killed server has sent and not written nobody knows; journals of older versions
/// do not say either.
journal::Numbers nextNumbers(const JournalState& state, const JournalLimits& limits) {
    const std::uint64_t id = state.scene.nextFreeId(), list = state.sequence.value;
    if (state.numbers)
        return {.nextId = std::max(id, state.numbers->nextId),
                .lastList = {},
                .behind = std::max(state.sequence, state.numbers->lastList)};
    return {.nextId = state.begun ? id + limits.idsAhead : id,
            .lastList = {},
            .behind = Sequence(state.begun ? list + limits.listsAhead : list)};
}

/// Says how a start has found the end of the last log, and what it does. Nothing where that is whole.
std::vector<std::string> endInWords(const JournalStory& story, const std::string& log, const std::string& kept) {
    std::vector<std::string> said;
    const std::string beside = kept.empty() ? "" : ", and kept in " + kept;
    if (story.hollow)
        said.push_back(
            fmt::format("{}: not even its opening is whole (the server was killed): begun anew{}", log, beside));
    else if (story.tornBytes > 0)
        said.push_back(fmt::format("{}: the last {} bytes, from byte {} on, are no whole record (the {}): cut off{}",
                                   log, story.tornBytes, story.wholeBytes,
                                   story.afterPowerCut ? "power was cut" : "server was killed", beside));
    if (story.afterPowerCut)
        said.push_back(
            fmt::format("{}: the power was cut before the disk had all of it: edits of the last moment before "
                        "that are gone",
                        log));
    return said;
}

}  // namespace

Expected<Journal::Opened> Journal::open(JournalOptions options, BlobStore& arrays, Log& log,
                                        std::function<void()> onProgress) {
    options.scenes = absolute(std::move(options.scenes));
    // No path begins so once it is whole. Journals of those who said nothing of it are as they were.
    const bool saysScenes = !options.scenes.empty();
    if (!options.placing.empty()) options.scenes.push_back(std::move(options.placing));
    Expected<JournalFolder> folder = JournalFolder::hold(options.folder, options.calls);
    if (!folder) return tl::unexpected(folder.error());
    const Expected<JournalFiles> files = folder->files();
    if (!files) return failWith("--journal", files.error());
    Expected<JournalStory> story = readJournal(*folder, *files, arrays, options.limits);
    if (!story) return failWith("--journal", story.error());
    JournalState& state = story->state;
    state.history.endGestures();
    const auto same = [&] {
        if (saysScenes) return state.scenes == options.scenes;
        return options.scenes.empty() || (!state.scenes.empty() && state.scenes.back() == options.scenes.back());
    };
    if (state.begun && !same())
        return fail(
            ErrorCode::kUsage,
            fmt::format("--journal {}: it goes on from a wall that began with {}; this command says {}. Say the "
                        "same, or nothing of scenes and how they stand, or name another folder",
                        options.folder, listed(state.scenes), listed(options.scenes)));
    // How nothing stands is not to be told.
    if (!state.begun && !saysScenes) options.scenes.clear();
    if (state.begun) options.scenes = state.scenes;

    // What a killed server did not finish goes, so that only the very last log may ever be torn; what it had no time to
    // sync is synced before another log stands on it.
    std::uint64_t last = files->lastLog();
    std::string kept;
    if (story->tornBytes > 0) {
        Expected<std::string> path = folder->keepTornEnd(last, story->hollow ? 0 : story->wholeBytes);
        if (!path) return failWith("--journal", path.error());
        kept = std::move(*path);
    }
    for (const std::string& said : endInWords(*story, folder->logPath(last), kept)) log.warning(said);
    if (story->hollow && last > 0) {
        --last;  // its number is given again: were it missing, something would seem to be lost
    } else if (last > 0) {
        if (Expected<void> sealed = folder->sealLog(last, story->wholeBytes); !sealed)
            return tl::unexpected(sealed.error());
    }
    // Beside a log of this version `last` is never missing, whenever a server is killed.
    if (!files->isNamed(last) || !files->end->extent)
        if (Expected<void> named = folder->nameLast({last, story->before.opening}, story->before.bytes); !named)
            return tl::unexpected(named.error());
    for (const std::string& old : files->unfinished) folder->remove(old);

    std::unique_ptr<Journal> journal(new Journal(std::move(options), std::move(*folder), log, std::move(onProgress)));
    journal->epoch_ = nextEpoch(state.epoch, journal->time_.date());
    journal->writtenEpoch_ = journal->epoch_;
    journal->sequence_ = state.sequence;
    journal->stateHash_ = state.scene.stateHash();
    journal->logNumber_ = last + 1;
    journal->logsSinceSnapshot_ = files->logs.size() + 1;
    journal->earlierBytes_ = story->logBytes;
    journal->snapshotBytes_ = story->snapshotBytes;
    // The epoch and the numbers are given once they are on the disk.
    const journal::Numbers numbers = nextNumbers(state, journal->limits_);
    journal->framesTaken_ = FrameNumber(state.nextFrame.value + journal->limits_.framesAhead);
    journal->taken_ = {.nextId = numbers.nextId + journal->limits_.idsAhead,
                       .lastList = Sequence(numbers.behind.value + journal->limits_.listsAhead),
                       .behind = numbers.behind};
    Expected<JournalFile> file = journal->folder_.beginLog(
        journal->openingOf(last + 1, story->before),
        std::array{encodeJournal(journal::Frames{journal->framesTaken_}), encodeJournal(journal->taken_)});
    if (!file) return tl::unexpected(file.error());
    journal->file_ = std::move(*file);
    journal->syncedBytes_ = journal->file_.bytes();
    journal->sequence_ = numbers.behind;
    // (Names are synced by now: what is left over goes only once the disk has what replaces it.)
    for (const std::string& old : files->leftOver) journal->folder_.remove(old);
    journal->lane_->post([self = journal.get()] {
        self->compact();  // where earlier servers have left much
        self->lookAround();
    });
    return Opened{
        .journal = std::move(journal), .state = std::move(state), .nextId = numbers.nextId, .behind = numbers.behind};
}

Journal::Journal(JournalOptions options, JournalFolder folder, Log& log, std::function<void()> onProgress)
    : limits_(options.limits),
      scenes_(std::move(options.scenes)),
      folder_(std::move(folder)),
      log_(log),
      onProgress_(std::move(onProgress)),
      time_(*options.time),
      compactor_(options.lane({.nice = 10})),  // frames come first
      lane_(options.lane({})) {}

Journal::~Journal() {
    closing_ = true;
    lane_->finish();
    writeAtTheEnd();
    compactor_.reset();
}

void Journal::started(const CommittedFrame& scene) {
    takeNumbers(scene);
    hand({journal::Frame{.start = true,
                         .frame = {},
                         .sequence = scene.sent->sequence,
                         .stateHash = scene.sent->stateHash,
                         .list = scene.list,
                         .history = {},
                         .display = {},
                         .sent = scene.sent}});
}

void Journal::frameDone(FrameNumber frame, const FrameResult& result, const ContactDisplay& display) {
    if (frame.value + limits_.framesAhead / 2 >= framesTaken_.value) {
        framesTaken_ = FrameNumber(frame.value + limits_.framesAhead);
        hand({journal::Frames{framesTaken_}});
    }
    if (!result.commit.list && result.history.empty()) return;
    takeNumbers(result.commit);
    journal::Frame item{.start = false,
                        .frame = frame,
                        .sequence = result.commit.sent->sequence,
                        .stateHash = result.commit.sent->stateHash,
                        .list = result.commit.list,
                        .history = result.history,
                        .display = {},
                        .sent = result.commit.sent};
    if (displayVersion_ != display.version()) {
        displayVersion_ = display.version();
        item.display = display.ids();
    }
    std::uint64_t bytes = item.sent->encoded.size();
    if (item.list) bytes += memoryOf(*item.list);
    for (const HistoryEvent& event : item.history)
        if (event.inverse) bytes += memoryWithoutArrays(*event.inverse);  // what it leads back to was in the scene
    hand({std::move(item), bytes});
}

bool Journal::viewIs(const ViewSource& view) {
    if (viewVersion_ == view.version()) return false;
    viewVersion_ = view.version();
    hand({journal::View{view.state()}});
    return true;
}

void Journal::epochRaised(Epoch epoch) {
    hand({journal::Raised{epoch}});
}

void Journal::takeNumbers(const CommittedFrame& frame) {
    const Sequence before = std::exchange(taken_.behind, frame.sent->sequence);
    std::uint64_t nextId = 0;
    if (frame.list)
        for (const Creation& creation : frame.list->creations) nextId = std::max(nextId, creation.id.value + 1);
    const bool few = nextId + limits_.idsAhead / 2 > taken_.nextId ||
                     taken_.behind.value + limits_.listsAhead / 2 > taken_.lastList.value;
    if (!few) return;
    taken_.nextId = std::max(taken_.nextId, nextId) + limits_.idsAhead;
    taken_.lastList = Sequence(taken_.behind.value + limits_.listsAhead);
    hand({journal::Numbers{.nextId = taken_.nextId, .lastList = taken_.lastList, .behind = before}});
}

void Journal::ends(FrameNumber next) {
    framesTaken_ = next;
    hand({journal::Frames{next}});
    // All that was sent is written by then: the next server goes on with the very next numbers.
    hand({journal::Numbers{.nextId = 0, .lastList = {}, .behind = taken_.behind}});
}

void Journal::hand(Item item) {
    ++handed_;  // though it has ended: who waits for it is never told that it is written
    if (ended_) return;
    // One that is larger than all that may wait is taken, where nothing else waits.
    if (queuedBytes_.fetch_add(item.bytes) > limits_.maxQueuedBytes || queued_.fetch_add(1) >= kMostQueued)
        return end("the disk is too slow, or has been full for too long");
    lane_->post([this, taken = std::make_shared<const Item>(std::move(item))] { take(taken); });
}

void Journal::tellWhen(std::uint64_t written) {
    tellAt_ = written;
    // It may have been written in between: then nobody else says so.
    if (written_ >= written || error_ != 0 || ended_) tell();
}

void Journal::tell() {
    if (tellAt_.exchange(0) != 0 && onProgress_) onProgress_();
}

std::optional<Error> Journal::trouble() const {
    const int error = error_;
    if (ended_) {
        const std::string why = whyIsKnown_ ? ": " + whyEnded_ : std::string();
        return Error{ErrorCode::kFailed, fmt::format("the journal {} has ended{}", folder(), why)};
    }
    if (error == 0) return std::nullopt;
    return Error{ErrorCode::kFailed,
                 fmt::format("the journal {} cannot be written: {}", folder(), std::strerror(error))};
}

// ---- the writing lane

void Journal::take(std::shared_ptr<const Item> item) {
    left_.push_back(std::move(item));
    if (!retries_) writeLeft();
}

void Journal::writeLeft() {
    for (; !left_.empty(); left_.pop_front()) {
        if (!write(*left_.front())) {
            retries_ = true;
            return lane_->postAt(time_.now() + limits_.retryEvery, [this] {
                retries_ = false;
                writeLeft();
            });
        }
        if (!ended_) rotateIfLong();
        syncIfDue();  // its time may come while many records wait
    }
}

/// Keeps whoever waits for the end of the server about a second, where the disk takes nothing.
void Journal::writeAtTheEnd() {
    constexpr auto kLongestPause = std::chrono::milliseconds(100);
    int tries = 10;
    for (; !left_.empty(); left_.pop_front())
        while (!write(*left_.front())) {
            if (--tries == 0) {
                end(std::strerror(error_));
                break;
            }
            std::this_thread::sleep_for(std::min<std::chrono::milliseconds>(limits_.retryEvery, kLongestPause));
        }
    if (unsynced_) sync();
}

bool Journal::write(const Item& item) {
    if (!ended_) {
        int error = appended_ ? 0 : append(item);
        appended_ = error == 0;
        // Granted is what a later start will miss, were it gone.
        if (appended_) error = folder_.last().say(file_.bytes(), syncedBytes_);
        if (error < 0) {
            end("an array that a list names is not here");
        } else if (error > 0) {
            failed(error);
            return ended_;
        }
    }
    appended_ = false;
    endWhereItWasTakenAway();
    if (ended_) return true;
    if (error_.exchange(0) != 0) log_.info(fmt::format("{}: the journal is written again", folder()));
    if (const auto* frame = std::get_if<journal::Frame>(&item.what)) {
        sequence_ = frame->sequence;
        stateHash_ = frame->stateHash;
    }
    if (const auto* raised = std::get_if<journal::Raised>(&item.what)) writtenEpoch_ = raised->epoch;
    if (!std::exchange(unsynced_, true)) {
        unsyncedSince_ = time_.now();
        lane_->postAt(unsyncedSince_ + limits_.syncEvery, [this] { syncIfDue(); });
    }
    writtenBytes_ = earlierBytes_ + file_.bytes();
    queuedBytes_ -= item.bytes;
    --queued_;
    const std::uint64_t now = ++written_;
    if (const std::uint64_t at = tellAt_; at != 0 && now >= at) tell();
    return true;
}

int Journal::append(const Item& item) {
    const auto* frame = std::get_if<journal::Frame>(&item.what);
    if (const auto* view = std::get_if<journal::View>(&item.what)) return file_.append(encodeJournal(*view));
    if (const auto* frames = std::get_if<journal::Frames>(&item.what)) return file_.append(encodeJournal(*frames));
    if (const auto* numbers = std::get_if<journal::Numbers>(&item.what)) return file_.append(encodeJournal(*numbers));
    if (const auto* raised = std::get_if<journal::Raised>(&item.what)) return file_.append(encodeJournal(*raised));
    if (frame->list)
        if (const int error = arrays_.append(file_, *frame->list)) return error;
    for (const HistoryEvent& event : frame->history)
        if (const int error = event.inverse ? arrays_.append(file_, *event.inverse) : 0) return error;
    return file_.append(encodeJournal(*frame));
}

void Journal::syncIfDue() {
    if (unsynced_ && time_.now() >= unsyncedSince_ + limits_.syncEvery) sync();
}

void Journal::sync() {
    if (file_.sync() == 0) {
        syncedBytes_ = file_.bytes();
        // A line that is older tells of less, and is true.
        if (folder_.last().say(syncedBytes_, syncedBytes_) == 0) (void)folder_.last().sync();
    }
    endWhereASyncFailed();
    unsynced_ = false;
}

void Journal::endWhereASyncFailed() {
    // Nobody knows what the disk has.
    if (const int error = folder_.disk().failedSync())
        end(fmt::format("the disk could not be made to keep it: {}", std::strerror(error)));
}

/// What goes into a file that has no name any more fails nowhere, and is lost.
void Journal::endWhereItWasTakenAway() {
    if (ended_) return;
    if (const std::optional<std::string> loss = folder_.findLoss(file_, logNumber_))
        end(*loss, "look into the folder before another start");
}

void Journal::lookAround() {
    if (ended_) return;
    lane_->postAt(time_.now() + limits_.lookEvery, [this] { lookAround(); });
    endWhereItWasTakenAway();
    // (While a snapshot replaces logs, a list of names may have neither.)
    if (ended_ || compacting_) return;
    const Expected<JournalFiles> files = folder_.files();
    if (!files && files.error().code == ErrorCode::kBadInput)
        end(files.error().message, "look into the folder before another start");
}

void Journal::failed(int error) {
    if (error_.exchange(error) != error)
        log_.warning(fmt::format("{}: the journal cannot be written: {}; edits are refused until it can", folder(),
                                 std::strerror(error)));
    tell();
}

void Journal::end(const std::string& why, std::string_view whatIsLeft) {
    if (!ended_.exchange(true)) {
        whyEnded_ = fmt::format("{}; {}", why, whatIsLeft);
        whyIsKnown_ = true;
        log_.warning(fmt::format("{}: the journal ends here: {}; edits are refused; {}", folder(), why, whatIsLeft));
    }
    tell();
}

journal::Opening Journal::openingOf(std::uint64_t number, const journal::LogBefore& before) const {
    return {.schema = schemaHash(),
            .program = versionText("tessera-server"),
            .number = number,
            .epoch = writtenEpoch_,
            .scenes = scenes_,
            .sequence = sequence_,
            .stateHash = stateHash_,
            .before = before};
}

void Journal::rotateIfLong() {
    const bool isLong = earlierBytes_ + file_.bytes() > std::max(limits_.compactBytes, snapshotBytes_.load());
    if (!isLong || compacting_ || time_.now() < rotateAgainAt_) return;
    rotateAgainAt_ = time_.now() + std::chrono::seconds(1);
    // What is before the new log is whole for good, so only the very last log may ever be torn.
    sync();
    if (ended_) return;
    Expected<JournalFile> next =
        folder_.beginLog(openingOf(logNumber_ + 1, {.bytes = file_.bytes(), .opening = file_.openingHash()}));
    endWhereASyncFailed();
    if (!next) {  // the old one goes on
        if (!ended_ && !std::exchange(saidThatItGrows_, true))
            log_.warning(fmt::format("the journal goes on and grows: {}", next.error().message));
        return;
    }
    saidThatItGrows_ = false;
    earlierBytes_ += file_.bytes();
    file_ = std::move(*next);
    syncedBytes_ = file_.bytes();
    arrays_.clear();
    ++logNumber_;
    ++logsSinceSnapshot_;
    compact();
}

/// Makes a snapshot of all before the open log, where that is much.
void Journal::compact() {
    if (compacting_ || (earlierBytes_ <= std::max(limits_.compactBytes, snapshotBytes_.load()) &&
                        logsSinceSnapshot_ <= limits_.maxLogs))
        return;
    compacting_ = true;
    earlierBytes_ = 0;
    logsSinceSnapshot_ = 1;
    compactor_->post([this, upTo = logNumber_] {
        const Expected<std::uint64_t> bytes = compactJournal(folder_, upTo, limits_, closing_);
        endWhereASyncFailed();
        if (bytes)
            snapshotBytes_ = *bytes;
        else if (!closing_ && !ended_)
            log_.warning(fmt::format("the journal goes on and grows: {}", bytes.error().message));
        compacting_ = false;
    });
}

}  // namespace tessera
