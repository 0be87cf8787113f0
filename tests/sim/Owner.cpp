#include "tests/sim/Owner.h"

#include <algorithm>

namespace tessera::simulation {

Owner::Owner(OwnerConfig config, Timeline& timeline, Network& network, Witness& witness, Random random)
    : config_(std::move(config)),
      timeline_(timeline),
      network_(network),
      witness_(witness),
      random_(random),
      session_(config_.session) {
    network_.serve(*this);
}

std::uint64_t Owner::faults(FaultKind kind) const {
    const auto it = faults_.find(kind);
    return it == faults_.end() ? 0 : it->second;
}

// ---- the process: an inbox, a clock to look at, frames to begin ----------------------------------------------------

void Owner::stall(Duration duration) {
    if (now() < stalledUntil_) return;
    witness_.trace("the server stands still for " + std::to_string(duration / 1ms) + " ms");
    stalledUntil_ = now() + duration;
    stalls_.emplace_back(now(), stalledUntil_);
    timeline_.at(stalledUntil_, [this] {
        // What runs first after a standstill is anybody's guess.
        if (random_.chance(0.3)) {
            sayingAt_ = now();
            carryOut(session_.advance(now()));
        }
        if (random_.chance(0.3)) maybeBegin();
        work();
    });
}

void Owner::freeze(Duration duration) {
    if (now() < stalledUntil_) return;
    witness_.trace("with its network thread:");
    stall(duration);
    unreadUntil_ = stalledUntil_;
}

Duration Owner::excuse(TimePoint since) const {
    const Duration moment = config_.session.sync.heartbeat;
    Duration all{};
    for (const auto& [begin, end] : stalls_)
        if (end + moment > since) all += end + moment - std::max(begin, since);
    return all + 1ms;
}

void Owner::opened(ConnectionId connection) {
    post([this, connection](TimePoint at) {
        open_.insert(connection);
        return session_.connectionOpened(connection, at);
    });
}

void Owner::received(ConnectionId connection, Epoch epoch, std::shared_ptr<const Message> message) {
    post([this, connection, epoch, message](TimePoint at) -> ServerActions {
        if (!open_.contains(connection)) return {};
        const auto host = hostOf_.find(connection);
        if (const auto* ready = std::get_if<message::Ready>(&*message); ready && host != hostOf_.end()) {
            if (frame_.open && ready->frame == frame_.number && frame_.drawing.contains(host->second))
                (ready->stateHash == frame_.stateHash ? frame_.ready : frame_.wrong).emplace(host->second, at);
            if (ready->frame == toldToDraw_[host->second]) answered_.insert(host->second);
        }
        if (const auto* shown = std::get_if<message::Shown>(&*message); shown && host != hostOf_.end())
            if (const auto told = toldToShow_.find(host->second); told != toldToShow_.end()) {
                if (shown->frame < told->second.first) {
                    told->second.second = std::max(told->second.second, at);  // an earlier one: it comes forward
                } else {
                    toldToShow_.erase(told);
                    if (std::uint32_t& left = toProve_[host->second]; left > 0) --left;
                }
            }
        return session_.received(connection, epoch, *message, at);
    });
}

void Owner::undecodable(ConnectionId connection) {
    post([this, connection](TimePoint at) { return session_.malformed(connection, "not a message", at); });
}

void Owner::closed(ConnectionId connection) {
    post([this, connection](TimePoint at) {
        open_.erase(connection);
        return session_.connectionClosed(connection, at);
    });
}

void Owner::post(std::function<ServerActions(TimePoint)> say) {
    const auto read = [this, say = std::move(say)] {
        inbox_.push_back({now(), say});
        work();
    };
    if (now() >= unreadUntil_) return read();
    unreadUntil_ += 20us;
    timeline_.at(unreadUntil_, read);
}

void Owner::drain() {
    while (!inbox_.empty()) {
        const Event event = std::move(inbox_.front());
        inbox_.pop_front();
        sayingAt_ = event.at;
        carryOut(event.say(event.at));
    }
}

void Owner::work() {
    if (now() < stalledUntil_) return;
    drain();
    if (now() >= session_.nextDeadline()) {
        sayingAt_ = now();
        carryOut(session_.advance(now()));
    }
    maybeBegin();
    planWork();
}

void Owner::planWork() {
    TimePoint next = session_.nextDeadline();
    if (!finished_ && session_.mayBegin(now())) next = std::min(next, nextBegin_);
    if (next == TimePoint::max()) return;
    next = std::max(next, now());
    if (workPlanned_ > now() && workPlanned_ <= next) return;
    workPlanned_ = next;
    timeline_.at(next, [this, next] {
        if (workPlanned_ == next) workPlanned_ = TimePoint::max();
        work();
    });
}

void Owner::maybeBegin() {
    if (finished_ || now() < nextBegin_ || !session_.mayBegin(now())) return;
    if (!prepared_) prepare();
    if (config_.session.sync.lateFrame == LateFramePolicy::kWait)
        for (const auto& [host, told] : toldToShow_)
            if (members_.contains(host) && toProve_[host] == 0)
                violated("begins a frame before " + host + " has said that it shows the last one");
    message::Begin begin = *std::exchange(prepared_, std::nullopt);
    begin.frame = session_.nextFrame();
    if (begin.frame.value != released_) violated("a frame begins that does not follow the last one released");
    nextBegin_ = now() + config_.frameInterval;
    frame_ = Frame{.number = begin.frame, .stateHash = begin.list->stateHash, .begun = now(), .open = true};
    sayingAt_ = now();
    carryOut(session_.beginFrame(begin, now()));
    // The next list is committed some time before its frame begins, as a pipelined frame loop does.
    timeline_.after(random_.between(0ms, config_.frameInterval), [this] {
        if (!prepared_ && now() >= stalledUntil_ && !finished_) prepare();
    });
}

void Owner::prepare() {
    CommittedList committed;
    if (random_.chance(0.7) || !everywhere_.empty()) {
        ModelList list{.sequence = scene_.sequence.next(), .content = random_.next()};
        for (const BlobInfo& blob : everywhere_) list.blobs.push_back(blob.id);
        scene_.apply(list);
        sceneBlobs_.insert(sceneBlobs_.end(), everywhere_.begin(), everywhere_.end());
        Numbers bytes;
        put(bytes, list);
        committed.encoded = bytes.share();
        committed.blobs = std::exchange(everywhere_, {});
    }
    committed.sequence = scene_.sequence;
    committed.stateHash = scene_.hash;
    prepared_ = message::Begin{.list = share(std::move(committed))};
}

void Owner::announceBlobs() {
    if (finished_) return;
    std::vector<BlobInfo> infos;
    for (std::uint64_t n = 1 + random_.below(3); n > 0; --n) {
        Bytes bytes(random_.chance(0.1) ? 0 : random_.below(40'000));
        for (std::size_t i = 0; i < bytes.size(); i += 97) bytes[i] = static_cast<std::byte>(random_.next());
        Blob blob(std::move(bytes));
        infos.push_back({blob.id(), blob.sizeBytes()});
        blobs_.emplace(blob.id(), std::move(blob));
    }
    post([this, infos](TimePoint at) {
        const std::uint64_t token = ++tokens_;
        announced_[token] = infos;
        return session_.announceBlobs(token, infos, at);
    });
}

void Owner::requestImages() {
    post([this](TimePoint) { return session_.requestImages(++imageRequests_, session_.nextFrame()); });
}

void Owner::finish() {
    post([this](TimePoint) {
        finished_ = true;
        return session_.finish("done");
    });
}

// ---- what the session wants done, and whether it may ---------------------------------------------------------------

void Owner::carryOut(ServerActions actions) {
    for (ServerAction& action : actions) std::visit([this](auto& a) { on(a); }, action);
    checkQuiet();
}

void Owner::on(const server_action::Send& action) {
    if (!open_.contains(action.connection))
        violated("sends " + std::string(nameOf(*action.message)) + " on a closed connection");
    const std::string& host = hostOf_[action.connection];
    if (const auto* begin = std::get_if<message::Begin>(action.message.get())) {
        if (begin->frame != frame_.number || !frame_.open) violated("sends a Begin of another frame");
        if (!members_.contains(host)) violated("sends Begin to " + host + ", which is not in the barrier");
        if (toldToDraw_.contains(host) && !answered_.contains(host))
            violated("sends Begin to " + host + ", which still draws");
        frame_.drawing.insert(host);
        behind_.erase(host);
        answered_.erase(host);
        toldToDraw_[host] = begin->frame;
        drawingSince_[host] = now();
    } else if (const auto* swap = std::get_if<message::Swap>(action.message.get())) {
        if (!frame_.open || swap->frame != frame_.number) violated("swaps a frame that is not open");
        if (!frame_.ready.contains(host)) violated("swaps on " + host + " before it is ready");
        toldToShow_.insert_or_assign(host, std::pair(swap->frame, now()));
    }
    network_.toClient(action.connection, session_.epoch(), *action.message);
}

void Owner::on(const server_action::Close& action) {
    if (open_.erase(action.connection) == 0) violated("closes a closed connection");
    witness_.trace("the server closes " + hostOf_[action.connection] + ": " + action.reason);
    network_.closeByServer(action.connection);
}

void Owner::on(const server_action::SnapshotWanted& action) {
    hostOf_[action.connection] = action.name;
    const auto make = [this] {
        Numbers bytes;
        bytes.put(scene_.sequence.value);
        bytes.put(scene_.hash.value);
        return message::Snapshot{share(CommittedList{scene_.sequence, scene_.hash, bytes.share(), sceneBlobs_})};
    };
    // Made when asked for, or when it is handed in: lists are committed in between.
    std::optional<message::Snapshot> early;
    if (random_.chance(0.5)) early = make();
    timeline_.after(random_.between(0ms, 40ms), [this, make, early, connection = action.connection] {
        post([this, make, early, connection](TimePoint at) {
            return session_.snapshotReady(connection, early ? *early : make(), at);
        });
    });
}

void Owner::on(const server_action::HostEntered& action) {
    witness_.trace(action.host + " enters at frame " + std::to_string(action.frame.value));
    if (action.frame != frame_.number || !frame_.open)
        violated(action.host + " enters at another frame than the one that begins");
    if (!members_.insert(action.host).second) violated(action.host + " enters twice");
    answered_.insert(action.host);
    toProve_[action.host] = action.framesToProve;
    ++entries_;
}

void Owner::on(const server_action::Fault& action) {
    witness_.trace("fault: " + action.host + " " + std::string(nameOf(action.kind)) + ", " + action.detail);
    ++faults_[action.kind];
    if (!mayFail_.contains(action.host))
        violated("false alarm: " + action.host + " " + std::string(nameOf(action.kind)));
    checkDetection(action);
    left(action.host);
}

void Owner::left(const std::string& host) {
    members_.erase(host);
    inStep_.erase(host);
    behind_.erase(host);
    frame_.drawing.erase(host);
    toldToDraw_.erase(host);
    toldToShow_.erase(host);
}

/// Nobody is condemned early, and nobody later than its deadline by more than our own standstills.
void Owner::checkDetection(const server_action::Fault& fault) const {
    const SyncPolicy& sync = config_.session.sync;
    if (fault.kind == FaultKind::kSilent) {
        if (fault.detectedAfter < sync.lostAfter) violated(fault.host + " is called silent too early");
        if (fault.detectedAfter > sync.lostAfter + excuse(sayingAt_ - fault.detectedAfter))
            violated(fault.host + " is called silent too late");
    }
    if (fault.kind == FaultKind::kNotShown) {
        const auto told = toldToShow_.find(fault.host);
        if (told == toldToShow_.end()) violated(fault.host + " is called to account for what it shows");
        const TimePoint since = told->second.second;
        const bool first = sync.lateFrame == LateFramePolicy::kWait;  // else it may owe an earlier frame too
        if (first && sayingAt_ < since + sync.lostAfter) violated(fault.host + " is called not to show too early");
        if (sayingAt_ > since + sync.lostAfter + excuse(since))
            violated(fault.host + " is called not to show too late");
    }
    if (fault.kind == FaultKind::kDrawStalled) {
        const Duration drawing = sayingAt_ - drawingSince_.at(fault.host);
        if (drawing < sync.frameDeadline) violated(fault.host + " is called stalled too early");
        if (drawing > std::max<Duration>(sync.frameDeadline, 3 * longestFrame_) + excuse(drawingSince_.at(fault.host)))
            violated(fault.host + " is called stalled too late");
    }
}

void Owner::on(const server_action::FrameReleased& action) {
    const SyncPolicy& sync = config_.session.sync;
    if (!frame_.open || action.frame != frame_.number || action.frame.value != released_)
        violated("frame " + std::to_string(action.frame.value) + " is released out of turn");
    TimePoint first = TimePoint::max();
    for (const std::string& host : action.shown) {
        if (!frame_.ready.contains(host)) violated("shows a frame on " + host + ", which is not ready");
        first = std::min(first, frame_.ready.at(host));
    }
    const auto isIn = [](const std::vector<std::string>& names, const std::string& host) {
        return std::find(names.begin(), names.end(), host) != names.end();
    };
    for (const std::string& host : frame_.drawing) {
        if (frame_.ready.contains(host)) {
            if (!isIn(action.shown, host)) violated("leaves out " + host + ", which is ready");
            continue;
        }
        if (sync.lateFrame == LateFramePolicy::kWait && !(toProve_[host] > 0 && isIn(action.held, host))) {
            // The only other way out of a frame is a stall, or what it does not show while it draws: its fault follows.
            const bool owesWord = toProve_[host] > 0 && toldToShow_.contains(host);
            if (sayingAt_ - frame_.begun < sync.frameDeadline && !owesWord) violated("does not wait for " + host);
            continue;
        }
        if (isIn(action.held, host)) {
            if (sayingAt_ < first + sync.lateAfter) violated("holds " + host + " before it is late");
            behind_.insert(host);
            inStep_.erase(host);
            if (sync.lateFrame == LateFramePolicy::kDrop) members_.erase(host);
        } else if (sayingAt_ - frame_.begun < sync.frameDeadline && !toldToShow_.contains(host)) {
            violated("forgets " + host);  // who does not show what it was told to is out, and its fault follows
        }
    }
    for (const std::string& host : action.held)
        if (!behind_.contains(host) && !frame_.wrong.contains(host)) violated("holds " + host + " for no reason");
    if (!action.shown.empty()) longestFrame_ = std::max(longestFrame_, action.frameTime);
    frame_.open = false;
    ++released_;
    lastReleased_ = now();
}

void Owner::on(const server_action::FrameStats& action) {
    if (FrameNumber(Numbers(action.stats).get()) != action.frame) violated("mixes up statistics");
}

void Owner::on(const server_action::FrameShown& action) {
    witness_.heard(action.host, action.frame, TimePoint(Duration(action.shownAtNs)));
}

void Owner::on(const server_action::StateMismatch& action) {
    if (action.expected == action.actual) violated("calls equal hashes a mismatch");
}

void Owner::on(const server_action::HashesReceived& action) {
    if (config_.ignoresMismatches) return;
    timeline_.after(random_.between(0ms, 20ms), [this, action] {
        post([this, action](TimePoint at) {
            return action.objects ? session_.repair(action.host, at)
                                  : session_.queryObjects(action.host, action.entries.at(0).key);
        });
    });
}

void Owner::on(const server_action::RequestReceived& action) {
    ++requests_;
    timeline_.after(random_.between(0ms, 20ms), [this, action] {
        post([this, action](TimePoint) { return session_.reply(action.connection, {.id = action.id}); });
    });
}

void Owner::on(const server_action::BlobsEverywhere& action) {
    const auto announced = announced_.find(action.token);
    if (announced == announced_.end()) violated("blobs are everywhere that nobody announced, or twice");
    everywhere_.insert(everywhere_.end(), announced->second.begin(), announced->second.end());
    announced_.erase(announced);
}

void Owner::on(const server_action::BlobRequested& action) {
    timeline_.after(random_.between(0ms, 2ms), [this, connection = action.connection, request = action.request] {
        if (!open_.contains(connection)) return;
        message::BlobChunk chunk{.id = request.id, .offset = request.offset};
        if (const auto blob = blobs_.find(request.id); blob != blobs_.end()) {
            const ByteSpan all = blob->second.bytes();
            if (request.offset + request.length > all.size()) violated("is asked for bytes that a blob does not have");
            const ByteSpan part = all.subspan(request.offset, request.length);
            Bytes bytes(part.begin(), part.end());
            if (config_.damagedChunkEvery && ++chunks_ % config_.damagedChunkEvery == 0) bytes[0] ^= std::byte{1};
            chunk.totalBytes = all.size();
            chunk.bytes = share(std::move(bytes));
        }
        network_.toClient(connection, session_.epoch(), std::move(chunk));
    });
}

/// A frame is open only as long as somebody is waited for who was told to draw it.
void Owner::checkQuiet() const {
    if (!frame_.open) return;
    const std::vector<std::string> waiting = session_.waitingFor();
    if (waiting.empty()) violated("a frame stays open, and nobody is waited for");
    for (const std::string& host : waiting)
        if (!frame_.drawing.contains(host)) violated("waits for " + host + ", which does not draw this frame");
}

}  // namespace tessera::simulation
