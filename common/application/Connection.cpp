#include "common/application/Connection.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/access/LocalWalls.h"

namespace tessera {

namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMaxEvents = 16'384;
/// Replies, the end and whatever else must find room behind the lists that wait.
constexpr std::size_t kSpareRoom = 4096;

/// What counts as waiting for a caller who does not poll.
std::size_t bytesOf(const Incoming& incoming) {
    if (const auto* list = std::get_if<incoming::List>(&incoming)) return list->committed->encoded.size();
    if (const auto* notice = std::get_if<incoming::Notice>(&incoming)) return notice->encodedBytes;
    return 0;
}

}  // namespace

Expected<ConnectionOptions> connectionOptionsOf(const Application::Options& options) {
    ConnectionOptions made;
    Expected<ServerMeant> meant = serverMeant(options.address);
    if (!meant) return tl::unexpected(meant.error());
    made.address = meant->address;
    made.addressNamedBy = std::move(meant->namedBy);
    made.name = options.name;
    made.lists = options.followScene;
    made.blobs = options.followScene && options.wantBlobs;
    made.connectTimeout = options.timeout;
    if (!options.keys.empty()) {
        Expected<CurrentKeys> keys = keysOfPerson(options.keys);
        if (!keys) return tl::unexpected(keys.error());
        made.keys = std::move(*keys);
    }
    auto access = accessLater(options.tokenFile, made.keys != nullptr);
    if (!access) return tl::unexpected(access.error());
    made.access = std::move(*access);
    return made;
}

Connection::Connection(ConnectionOptions options)
    : options_(std::move(options)),
      events_(kMaxEvents),
      out_(options_.maxWaiting + kSpareRoom),
      lane_(options_.platform.lane({})) {
    transport_ = options_.platform.transport(ApplicationSession::limits(options_.keys),
                                             [this](LinkEvent event) { put(std::move(event)); });
    session_ = std::make_unique<ApplicationSession>(options_, *transport_,
                                                    [this](Incoming incoming) { give(std::move(incoming)); });
    lane_->post([this] { turn(); });
}

Connection::~Connection() {
    lane_->finish();
    events_.close();
    session_.reset();
    transport_.reset();
}

std::optional<Incoming> Connection::next(TimePoint until) {
    const Platform& platform = options_.platform;
    if (platform.wait) platform.wait(until, [this] { return !out_.empty(); });
    std::optional<Incoming> value =
        platform.wait ? out_.tryPop() : out_.popFor(std::max<Duration>(until - platform.now(), 0ns));
    if (value) {
        --waiting_;
        waitingBytes_ -= bytesOf(*value);
    }
    return value;
}

void Connection::request(std::uint64_t id, ByteSlice body) {
    put(message::Request{id, std::move(body)});
}

void Connection::upload(std::span<const Blob> blobs) {
    forEachUpload(blobs, [this](message::Upload piece) { put(std::move(piece)); });
}

void Connection::put(Event event) {
    if (!events_.push(std::move(event)) || turnWaits_.exchange(true)) return;
    lane_->post([this] { turn(); });
}

void Connection::turn() {
    turnWaits_ = false;
    while (!session_->ended()) {
        std::optional<Event> event = events_.tryPop();
        if (!event) break;
        if (const auto* link = std::get_if<LinkEvent>(&*event))
            session_->on(*link);
        else if (auto* upload = std::get_if<message::Upload>(&*event))
            session_->upload(std::move(*upload));
        else if (auto* request = std::get_if<message::Request>(&*event))
            session_->request(request->id, std::move(request->body));
        session_->advance(options_.platform.now());
    }
    if (!session_->ended()) session_->advance(options_.platform.now());
    if (session_->ended()) return events_.close();
    const TimePoint next = session_->nextDeadline();
    if (next >= wake_) return;
    wake_ = next;
    lane_->postAt(next, [this, next] {
        if (wake_ == next) wake_ = TimePoint::max();
        turn();
    });
}

/// One who does not poll misses notices, the newest first; a list it must not miss.
bool Connection::hasRoom(const Incoming& incoming) {
    if (std::holds_alternative<incoming::Notice>(incoming))
        return waiting_ < options_.maxWaiting && waitingBytes_ + bytesOf(incoming) <= options_.maxWaitingBytes / 2;
    if (!std::holds_alternative<incoming::List>(incoming) ||
        (waiting_ < options_.maxWaiting && waitingBytes_ <= options_.maxWaitingBytes))
        return true;
    session_->end({.error = {ErrorCode::kLimit,
                             fmt::format("{} changes waited for the application to poll, which is the most that may",
                                         waiting_.load())}});
    return false;
}

void Connection::give(Incoming incoming) {
    if (!hasRoom(incoming)) return;
    waitingBytes_ += bytesOf(incoming);
    ++waiting_;
    out_.tryPush(std::move(incoming));
    if (options_.arrived) options_.arrived();
}

}  // namespace tessera
