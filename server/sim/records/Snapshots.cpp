#include "server/sim/records/Snapshots.h"

#include <utility>

#include "common/codec/ChangeCodec.h"
#include "common/codec/SnapshotCodec.h"
#include "server/sim/commit/EditHistory.h"

namespace tessera {

namespace {

/// Lists that wait for the thread: enough that it is not woken for each frame of a wall in motion.
constexpr std::size_t kMaxFresh = 64;
constexpr std::size_t kMaxFreshBytes = std::size_t{1} << 20;
constexpr std::size_t kMostOrders = 16;
/// Lists that the thread leaves to be applied later, so that the scene as it was before them can be asked about.
constexpr std::size_t kTrailing = 64;
constexpr std::size_t kTrailingBytes = std::size_t{8} << 20;
/// Behind the frame thread, hosts on the same machine, and their drawing.
constexpr int kNice = 10;

std::size_t bytesOf(const SnapshotMade& made) {
    return made.content.empty() ? made.snapshot.list->encoded.size() : made.content.sizeBytes();
}

SnapshotMade snapshotOf(const Aspect& scene, Sequence sequence) {
    CommittedList whole{.sequence = sequence, .stateHash = scene.stateHash(), .encoded = {}, .blobs = {}};
    std::vector<Blob> arrays;
    {
        const ChangeList list = snapshot(scene);  // as large as the scene: gone before the rest is made
        whole.encoded = encodeChangeList(list);
        arrays = blobsOf(list);
        for (const Blob& blob : arrays) whole.blobs.push_back({blob.id(), blob.sizeBytes()});
    }
    if (whole.encoded.size() + whole.blobs.size() * sizeof(BlobInfo) <= Snapshots::kSmallBytes)
        return {.snapshot = {.list = share(std::move(whole))}, .content = {}, .arrays = std::move(arrays)};
    Blob content = encodeSnapshot(whole);
    const BlobInfo named{content.id(), content.sizeBytes()};
    CommittedListPtr place = share(CommittedList{.sequence = sequence, .stateHash = whole.stateHash});
    return {.snapshot = {.list = std::move(place), .content = named},
            .content = std::move(content),
            .arrays = std::move(arrays)};
}

}  // namespace

/// An aspect that follows committed lists, some behind.
class Snapshots::Follower {
public:
    [[nodiscard]] const Aspect& scene() const { return scene_; }
    [[nodiscard]] Sequence sequence() const { return sequence_; }

    void follow(const WaitingLists& lists) {
        for (const WaitingLists::Waiting& waiting : lists.lists()) {
            trailingBytes_ += waiting.bytes;
            trailing_.push_back(waiting);
        }
        while (trailing_.size() > kTrailing || trailingBytes_ > kTrailingBytes) applyOne();
    }
    void catchUp() {
        while (!trailing_.empty()) applyOne();
    }
    /// Goes on to that list; false: it is beyond.
    [[nodiscard]] bool goTo(Sequence sequence) {
        while (!trailing_.empty() && trailing_.front().sequence <= sequence) applyOne();
        return sequence_ == sequence;
    }

private:
    void applyOne() {
        const WaitingLists::Waiting waiting = std::move(trailing_.front());
        trailing_.pop_front();
        trailingBytes_ -= waiting.bytes;
        const Expected<void> applied = scene_.apply(*waiting.list);
        TESSERA_CHECK(applied, "what has been committed can be applied again");
        sequence_ = waiting.sequence;
    }
    Aspect scene_;
    Sequence sequence_;
    std::deque<WaitingLists::Waiting> trailing_;
    std::size_t trailingBytes_ = 0;
};

Snapshots::Snapshots(ServerSession& session, BlobStore& blobs, std::function<void(SnapshotMade)> deliver,
                     const MakeLane& lane)
    : session_(session),
      blobs_(blobs),
      deliver_(std::move(deliver)),
      follower_(std::make_unique<Follower>()),
      lane_(lane({.nice = kNice})) {}

Snapshots::~Snapshots() = default;

/// On the lane.
void Snapshots::work(Order& order) {
    if (const auto* apply = std::get_if<Apply>(&order)) {
        follower_->follow(*apply->lists);
        waitingBytes_ -= apply->lists->bytes();
    } else if (const auto* at = std::get_if<LookAt>(&order)) {
        at->look(!at->sequence || follower_->goTo(*at->sequence) ? &follower_->scene() : nullptr);
    } else if (const auto* look = std::get_if<LookAtNewest>(&order)) {
        // Lists are orders, too: all that was followed before this is here.
        follower_->catchUp();
        (*look)(follower_->scene(), follower_->sequence());
    } else {
        follower_->catchUp();
        deliver_(snapshotOf(follower_->scene(), follower_->sequence()));
    }
    --ordersUnderWay_;
}

void Snapshots::follow(const CommittedFrame& committed) {
    forgetLast();
    pump(Room::kAsThereIs);
    if (!committed.list) return;
    holdArrays(committed);
    fresh_.push_back(committed);
    freshBytes_ += memoryOf(*committed.list);
    if (fresh_.size() >= kMaxFresh || freshBytes_ >= kMaxFreshBytes) handOver();
}

void Snapshots::holdArrays(const CommittedFrame& committed) {
    if (!last_ && !ordered_) return;
    Named named{.sequence = committed.sent->sequence, .arrays = blobsOf(*committed.list)};
    for (const RangeEdit& range : committed.list->ranges) named.arrays.push_back(range.result);
    if (named.arrays.empty()) return;
    for (const Blob& array : named.arrays) named.bytes += array.sizeBytes();
    namedBytes_ += named.bytes;
    named_.push_back(std::move(named));
    if (namedBytes_ > kMostArrayBytes && last_) freeLast();
}

void Snapshots::handOver() {
    if (fresh_.empty()) return;
    const bool behind = !late_.empty();
    if (!behind || !std::holds_alternative<Apply>(late_.back()))
        late_.emplace_back(Apply{std::make_shared<WaitingLists>()});
    WaitingLists& lists = *std::get<Apply>(late_.back()).lists;
    const std::size_t before = lists.bytes();
    for (const CommittedFrame& frame : fresh_)
        lists.add(frame, behind ? WaitingLists::Merge::kYes : WaitingLists::Merge::kNo);
    waitingBytes_ += lists.bytes() - before;
    fresh_.clear();
    freshBytes_ = 0;
    pump(Room::kAsThereIs);
}

void Snapshots::pump(Room room) {
    // An order that has gone over is the lane's alone.
    for (; !late_.empty() && (room == Room::kForAll || ordersUnderWay_ < kMostOrders); late_.pop_front()) {
        ++ordersUnderWay_;
        lane_->post([this, order = std::move(late_.front())]() mutable { work(order); });
    }
}

void Snapshots::sceneReady() {
    ready_ = true;
    if (!waiting_.empty()) order();
}

ServerActions Snapshots::wanted(ConnectionId connection, TimePoint now) {
    if (last_ && session_.snapshotServes(last_->snapshot.list->sequence, bytesOf(*last_))) return give(connection, now);
    waiting_.push_back(connection);
    if (ready_) order();
    return {};
}

void Snapshots::look(std::optional<Sequence> sequence, Look look) {
    ask(LookAt{sequence, std::move(look)});
}

void Snapshots::lookAtNewest(LookAtNewest look) {
    ask(std::move(look));
}

void Snapshots::ask(Order order) {
    handOver();
    late_.push_back(std::move(order));
    pump(Room::kForAll);
}

void Snapshots::order() {
    if (std::exchange(ordered_, true)) return;
    ask(Make{});  // one at a time, and whoever waits for it may be who frames wait for
}

ServerActions Snapshots::made(SnapshotMade snapshot, TimePoint now) {
    ordered_ = false;
    if (!snapshot.content.empty()) snapshot.content = blobs_.add(std::move(snapshot.content));
    if (last_) freeLast();
    last_ = std::make_shared<const SnapshotMade>(std::move(snapshot));
    for (; !named_.empty() && named_.front().sequence <= last_->snapshot.list->sequence; named_.pop_front())
        namedBytes_ -= named_.front().bytes;
    ServerActions actions;
    // Where too much has happened meanwhile the session asks again, and a newer one is made.
    for (const ConnectionId connection : std::exchange(waiting_, {})) append(actions, give(connection, now));
    return actions;
}

/// Nobody asks at a wall at rest: it goes all the same.
void Snapshots::forgetLast() {
    constexpr std::uint64_t kEvery = 64;  // the session goes through the lists since then
    if (last_ && looks_++ % kEvery == 0 && !session_.snapshotServes(last_->snapshot.list->sequence, bytesOf(*last_)))
        freeLast();
}

/// By the lane: of a large scene it takes longer than a frame.
void Snapshots::freeLast() {
    auto arrays = std::make_shared<std::deque<Named>>();
    if (!ordered_) {
        arrays->swap(named_);
        namedBytes_ = 0;
    }
    look(std::nullopt, [gone = std::exchange(last_, nullptr), arrays = std::move(arrays)](const Aspect*) {});
}

ServerActions Snapshots::give(ConnectionId connection, TimePoint now) {
    return session_.snapshotReady(connection, last_->snapshot, last_->content, now);
}

}  // namespace tessera
