/// Both sides of a session, each alone with a peer that says whatever the input says, at any time, in any order.
#include <deque>
#include <map>
#include <optional>

#include "common/codec/MessageCodec.h"
#include "common/session/ClientSession.h"
#include "common/session/ServerSession.h"
#include "tests/fuzz/FuzzInput.h"
#include "tests/unit/AnyMessage.h"

namespace tessera::fuzz {
namespace {

using namespace std::chrono_literals;

/// Small numbers mean something more often than large ones do.
struct FieldSource {
    FuzzInput& in;

    std::uint64_t number() { return in.below(4) > 0 ? in.below(6) : in.number<std::uint64_t>(); }
    std::uint64_t word(std::uint64_t last) { return in.below(last + 2); }
    std::size_t count() { return in.below(4); }
    std::string text() {
        constexpr const char* kNames[] = {"left", "right", "nobody", ""};
        return kNames[in.below(4)];
    }
    ByteSlice bytes() {
        const ByteSpan bytes = in.bytes(in.below(64));
        return Bytes(bytes.begin(), bytes.end());
    }
};

/// A message of any kind, Hellos more often, which begin everything: field by field, or from raw bytes.
std::optional<Message> anyMessage(FuzzInput& in) {
    constexpr std::size_t kKinds = std::variant_size_v<Message>;
    FieldSource source{in};
    test::MessageMaker maker(source);
    const std::size_t kind = in.below(kKinds + 2);
    if (kind < kKinds) return maker.make(kind);
    if (kind == kKinds) {
        auto hello = maker.make<message::Hello>();
        hello.protocol = kProtocolVersion;
        return hello;
    }
    const auto type = static_cast<std::uint16_t>(in.below(32));
    const ByteSpan bytes = in.bytes(in.below(200));
    Expected<Message> message = decodeMessage(type, share(Bytes(bytes.begin(), bytes.end())));
    return message ? std::optional(std::move(*message)) : std::nullopt;
}

/// Most often the right one.
Epoch anyEpoch(FuzzInput& in, Epoch right) {
    return in.below(8) > 0 ? right : Epoch(in.below(4));
}

class Server {
public:
    explicit Server(FuzzInput& in) : in_(in), session_(config(in)) {}

    void run() {
        for (int steps = 0; steps < 400 && !in_.empty(); ++steps) step();
        // However it went, nobody holds the wall up: with the deadlines over frames go on without whom they wait for.
        for (int i = 0; i < 40; ++i) {
            now_ += 1s;
            keep(session_.advance(now_));
        }
        must(frameOpen_ == false || session_.waitingFor().empty(), "past every deadline no frame waits for anybody");
    }

private:
    static ServerSessionConfig config(FuzzInput& in) {
        ServerSessionConfig config;
        config.hosts = {"left", "right"};
        config.schema = 1;
        config.newToken = [given = std::uint64_t{0}]() mutable { return SessionToken{++given, 0}; };
        config.maxTailLists = 4;
        config.maxApplications = 2;
        config.sync.lateFrame = static_cast<LateFramePolicy>(in.below(3));
        return config;
    }
    void step() {
        now_ += std::chrono::milliseconds(in_.below(4) == 0 ? in_.below(2000) : in_.below(10));
        const ConnectionId connection{1 + in_.below(4)};
        switch (in_.below(10)) {
            case 0:
                if (open_.insert(std::pair(connection, true)).second) keep(session_.connectionOpened(connection, now_));
                break;
            case 1:
                if (open_.erase(connection) > 0) keep(session_.connectionClosed(connection, now_));
                break;
            case 2:
                keep(session_.malformed(connection, "bytes that are no message", now_));
                break;
            case 3:
                keep(session_.advance(now_));
                break;
            case 4:
            case 5:
                if (session_.mayBegin(now_)) beginFrame();
                break;
            case 6:
                if (!wanted_.empty()) {
                    CommittedList list;
                    list.sequence = sequence_;
                    keep(session_.snapshotReady(wanted_.front(), {share(std::move(list))}, now_));
                    wanted_.pop_front();
                }
                break;
            case 7: {
                const std::uint64_t token = ++tokens_;
                keep(session_.announceBlobs(token, {{{token, 1}, 8}}, now_));
                if (in_.below(2) == 0) session_.forgetBlobs(token);
                break;
            }
            default:
                if (const std::optional<Message> message = anyMessage(in_))
                    if (open_.contains(connection))
                        keep(session_.received(connection, anyEpoch(in_, session_.epoch()), *message, now_));
        }
    }
    void beginFrame() {
        message::Begin begin{.frame = session_.nextFrame(), .payload = {}};
        CommittedList list;
        if (in_.below(3) > 0) {
            sequence_ = sequence_.next();
            list.encoded = Bytes(4);
            list.stateHash = StateHash(sequence_.value);
        }
        list.sequence = sequence_;
        begin.list = share(std::move(list));
        frameOpen_ = true;
        keep(session_.beginFrame(begin, now_));
    }
    void keep(const ServerActions& actions) {
        for (const ServerAction& action : actions) {
            if (const auto* wanted = std::get_if<server_action::SnapshotWanted>(&action))
                wanted_.push_back(wanted->connection);
            if (const auto* close = std::get_if<server_action::Close>(&action)) open_.erase(close->connection);
            if (const auto* released = std::get_if<server_action::FrameReleased>(&action)) {
                frameOpen_ = false;
                must(released->shown.size() + released->held.size() <= 2, "a frame is shown by hosts of the wall");
            }
            if (const auto* mismatch = std::get_if<server_action::StateMismatch>(&action))
                keep(session_.repair(mismatch->host, now_));
            if (const auto* sent = std::get_if<server_action::Send>(&action)) (void)encodeMessage(*sent->message);
        }
        must(wanted_.size() < 1000, "snapshots are asked for once per peer");
    }

    FuzzInput& in_;
    TimePoint now_{1h};
    ServerSession session_;
    std::map<ConnectionId, bool> open_;
    std::deque<ConnectionId> wanted_;
    Sequence sequence_;
    std::uint64_t tokens_ = 0;
    bool frameOpen_ = false;
};

class Client {
public:
    explicit Client(FuzzInput& in)
        : in_(in),
          session_({.name = "left",
                    .schema = 1,
                    .maxBlobBytes = 1 << 16,
                    .chunkBytes = 16,
                    .maxQueuedMessages = 16,
                    .maxQueuedBytes = 1 << 16}) {}

    void run() {
        keep(session_.channelOpened(ChannelKind::kControl, now_));
        for (int steps = 0; steps < 400 && !in_.empty() && !ended_; ++steps) step();
    }

private:
    void step() {
        now_ += std::chrono::milliseconds(in_.below(4) == 0 ? in_.below(2000) : in_.below(10));
        const auto channel = static_cast<ChannelKind>(in_.below(2));
        switch (in_.below(8)) {
            case 0:
                keep(session_.advance(now_));
                break;
            case 1:
                if (std::exchange(bulkWanted_, false)) keep(session_.channelOpened(ChannelKind::kBulk, now_));
                break;
            case 2:
                if (in_.below(4) == 0) keep(session_.channelClosed(ChannelKind::kBulk, now_));
                break;
            case 3:
            case 4:
                answer();
                break;
            default:
                if (const std::optional<Message> message = anyMessage(in_))
                    keep(session_.received(channel, anyEpoch(in_, session_.epoch()), *message, now_));
        }
    }
    /// Answers the oldest order, as its owner must.
    void answer() {
        if (orders_.empty()) return;
        const ClientAction order = std::move(orders_.front());
        orders_.pop_front();
        const bool fails = in_.below(8) == 0;
        const StateHash hash{in_.below(6)};
        if (const auto* snapshot = std::get_if<client_action::ApplySnapshot>(&order))
            keep(fails ? session_.applyFailed("no") : session_.applied(snapshot->snapshot.list->sequence, hash));
        else if (const auto* changes = std::get_if<client_action::ApplyChanges>(&order))
            keep(fails ? session_.applyFailed("no") : session_.applied(changes->changes.list->sequence, hash));
        else if (const auto* draw = std::get_if<client_action::Draw>(&order))
            keep(fails ? session_.applyFailed("no") : session_.drawn(draw->begin.frame, hash, {}));
        else if (const auto* show = std::get_if<client_action::Show>(&order))
            keep(session_.shown(show->frame, now_));
        else if (const auto* describe = std::get_if<client_action::DescribeState>(&order))
            keep(session_.hashes({Sequence(0), describe->query.objects, {}}));
    }
    void keep(const ClientActions& actions) {
        for (const ClientAction& action : actions) {
            if (std::holds_alternative<client_action::OpenBulk>(action)) bulkWanted_ = true;
            if (std::holds_alternative<client_action::Disconnect>(action) ||
                std::holds_alternative<client_action::Finish>(action))
                ended_ = true;
            if (const auto* sent = std::get_if<client_action::Send>(&action)) (void)encodeMessage(sent->message);
            if (const auto* stored = std::get_if<client_action::StoreBlob>(&action))
                must(stored->blob.sizeBytes() <= 1 << 16, "no blob is larger than allowed");
            if (std::holds_alternative<client_action::ApplySnapshot>(action) ||
                std::holds_alternative<client_action::ApplyChanges>(action) ||
                std::holds_alternative<client_action::Draw>(action) ||
                std::holds_alternative<client_action::Show>(action) ||
                std::holds_alternative<client_action::DescribeState>(action)) {
                must(orders_.empty(), "work is handed out one at a time");
                orders_.push_back(action);
            }
        }
    }

    FuzzInput& in_;
    TimePoint now_{1h};
    ClientSession session_;
    std::deque<ClientAction> orders_;
    bool bulkWanted_ = false, ended_ = false;
};

}  // namespace
}  // namespace tessera::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    tessera::fuzz::FuzzInput in(data, size);
    if (in.below(2) == 0)
        tessera::fuzz::Server(in).run();
    else
        tessera::fuzz::Client(in).run();
    return 0;
}
