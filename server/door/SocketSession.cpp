#include "server/door/SocketSession.h"

#include <fmt/format.h>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>

#include <deque>
#include <functional>
#include <iterator>
#include <list>
#include <nlohmann/json.hpp>

#include "common/base/Utf8.h"
#include "common/request/ApplicationLimits.h"
#include "common/request/Catalogue.h"
#include "common/request/Check.h"
#include "server/door/AskInJson.h"
#include "server/door/Envelope.h"

namespace tessera {
namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;

/// What a request without an answer counts as: the largest piece of an array.
constexpr std::size_t kAnswerBytes = ApplicationLimits().maxPieceBytes;

/// Null: there is none of that name.
const RequestInfo* requestOf(std::string_view name) {
    const auto all = allRequests();
    const auto known = std::ranges::find(all, name, [](const RequestText& each) { return each.info.name; });
    return known == all.end() ? nullptr : &known->info;
}

class SocketSession : public Guest, public std::enable_shared_from_this<SocketSession> {
public:
    SocketSession(DoorStream stream, const HttpTarget& target, const Entrant& entrant, DoorContext& context)
        : Guest(context),
          stream_(std::move(stream)),
          clock_(context.io),
          context_(context),
          rate_(context.limits.socketPerSecond, 2 * context.limits.socketPerSecond) {
        ++context_.sockets;
        isSocket = true;
        who = entrant;
        const auto name = target.query.find("name");
        name_ =
            name == target.query.end() || name->second.empty() || name->second.size() > 64 ? "socket" : name->second;
        const auto changes = target.query.find("changes");
        follows_ = changes != target.query.end() && changes->second == "1";
    }
    ~SocketSession() override {
        --context_.sockets;
        context_.lanes.leave(this);
        context_.held -= held_;
        context_.brought -= collected_ + underWay_;
        if (link_) link_->close();
    }

    void accept(const beast::http::request<beast::http::string_body>& upgrade) {
        websocket::stream_base::timeout patience{};
        patience.handshake_timeout = context_.limits.headWait;
        patience.idle_timeout = websocket::stream_base::none();  // `look` knows of what it takes, too
        stream_.set_option(patience);
        stream_.read_message_max(0);   // onRead looks at it
        stream_.auto_fragment(false);  // else each 4 KiB would be a frame, and a write, of its own
        stream_.async_accept(upgrade, [self = shared_from_this()](beast::error_code error) {
            if (!error) self->begin();
        });
    }

private:
    using Weak = std::weak_ptr<SocketSession>;
    using Ticket = std::shared_ptr<const AnswerLanes::Ticket>;

    void begin() {
        alive_ = shared_from_this();
        link_ = context_.dial(name_, *who, follows_);
        const auto with = [weak = Weak(shared_from_this())](auto&& tell) {
            return [weak, tell](const auto& what) {
                if (const std::shared_ptr<SocketSession> self = weak.lock()) tell(*self, what);
            };
        };
        link_->on({.notice = with([](SocketSession& self, const ApplicationNotice& notice) {
                       Binaries binaries;
                       const SaidJson said = noticeJson(notice, binaries);
                       const std::string text = noticeText(said.name, said.fields, binaries.size());
                       self.sayNews(text, std::move(binaries));
                   }),
                   .list = with([](SocketSession& self, const incoming::List& list) {
                       self.sayNews(changesText(list.committed->sequence, *list.list, list.whole), {});
                   }),
                   .ended = with([](SocketSession& self, const Error& error) {
                       self.finish(websocket::close_code::going_away, error.message);
                   })});
        read();
        lookLater();
    }

    // ---- whether it lives

    /// A ping waits behind what has been said: one who reads slowly answers it late, and lives. One that is closed is
    /// looked at, too: its last word may wait behind what it does not read.
    void lookLater() {
        clock_.expires_after(context_.limits.idle / kLooks);
        clock_.async_wait([weak = Weak(shared_from_this())](beast::error_code stopped) {
            const std::shared_ptr<SocketSession> self = stopped ? nullptr : weak.lock();
            if (self && self->alive_) self->look();
        });
    }
    void look() {
        const bool waitsForUs = !reading_ && link_->open() > 0;
        const bool moved = std::exchange(stream_.next_layer().progress().moved, false);
        quiet_ = moved || waitsForUs ? 0 : quiet_ + 1;
        if (quiet_ == kLooks) return leave();
        // A second one behind one that waits would take its place in the library, and who waits for it would stay.
        if (quiet_ == kLooks / 2 && !closed_ && !std::exchange(pinging_, true))
            stream_.async_ping({}, [self = shared_from_this()](beast::error_code) {
                self->pinging_ = false;
                self->stream_.next_layer().progress().moved = false;  // that was the ping
            });
        lookLater();
    }

    // ---- what comes

    void read() {
        if (reading_ || readsBeside_ || closing_) return;
        // Whoever asks for much waits; what is held for this one comes back here once it is gone.
        const DoorLimits& limits = context_.limits;
        if (held_ > limits.maxHeldBytes || (held_ > 0 && context_.held > limits.maxHeldOfAllBytes)) return;
        reading_ = true;
        constexpr std::size_t kAtOnce = std::size_t{64} << 10;
        stream_.async_read_some(buffer_, kAtOnce, [self = shared_from_this()](beast::error_code error, std::size_t) {
            self->onRead(error);
        });
    }
    void onRead(beast::error_code error) {
        reading_ = false;
        if (error) return leave();
        if (closing_) return;
        // Looked at here, and not by the library: it would close at once, and with unread bytes the word would be lost.
        if (buffer_.size() > (stream_.got_text() ? context_.limits.maxTextBytes : context_.limits.maxBinaryBytes))
            return finish(websocket::close_code::too_big, "a message is too long");
        // Before it is whole: nobody counts what is not awaited.
        if (discards_ == 0 && !awaited_ && !stream_.got_text())
            return finish(websocket::close_code::protocol_error, "a binary frame that no text has announced");
        if (discards_ > 0 && !stream_.got_text()) buffer_.clear();
        if (!collect(binariesBytes_ + (awaited_ ? buffer_.size() : 0))) return;
        if (!stream_.is_message_done()) return read();
        // An answer that comes at once reads on: the buffer is free before anything is done.
        const bool isText = stream_.got_text();
        const auto data = buffer_.cdata();
        const auto* from = static_cast<const std::byte*>(data.data());
        Bytes bytes(from, from + data.size());
        buffer_.clear();
        if (buffer_.capacity() > (std::size_t{1} << 20)) buffer_.shrink_to_fit();
        if (isText)
            onText(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
        else
            onBinary(std::move(bytes));
        read();
    }
    void onText(std::string text) {
        if (awaited_ || discards_ > 0)
            return finish(websocket::close_code::protocol_error, "binary frames were announced, and a text came");
        if (text.size() <= kMostAtOnce) return onEnvelope(readEnvelope(text));
        const std::shared_ptr<const TextRoom> room =
            roomFor(text.size(), context_.brought, context_.limits.maxBroughtBytes);
        if (!room) return finish(websocket::close_code::try_again_later, "too many large texts come at once");
        readsBeside_ = true;
        const auto readIt = [weak = Weak(shared_from_this()), room, text = std::move(text)](const Ticket& ticket) {
            const std::shared_ptr<SocketSession> alive = weak.lock();
            if (!alive || alive->closed_) return;
            alive->context_.beside.run([text] { return readEnvelope(text); },
                                       [weak, room, ticket](SaidEnvelope said) {
                                           const std::shared_ptr<SocketSession> self = weak.lock();
                                           if (!self || self->closed_) return;
                                           self->readsBeside_ = false;
                                           if (said.envelope)
                                               said.envelope->fields = keptWith(room, said.envelope->fields);
                                           self->onEnvelope(std::move(said));
                                           self->read();
                                       });
        };
        context_.lanes.enter(this, kLargeTexts, readIt);
    }
    void onEnvelope(SaidEnvelope said) {
        ApiExpected<Envelope>& envelope = said.envelope;
        if (!envelope) return say(errorText(said.id, envelope.error()), {});
        tooMany_ = !rate_.take(std::chrono::steady_clock::now());
        // What nobody will look at is not kept until it is whole.
        if (envelope->binaries > 0) {
            const RequestInfo* const known = requestOf(envelope->request);
            if (!known || who->role < known->role) discards_ = std::exchange(envelope->binaries, 0);
            if (known && who->role < known->role)
                return say(errorText(said.id, {ErrorCode::kRefused, roleRefusal(*known, who->role).message}), {});
        }
        awaited_ = std::move(*envelope);
        binaries_.clear();
        binariesBytes_ = 0;
        askWhenWhole();
    }
    void onBinary(Bytes bytes) {
        if (discards_ > 0) return void(--discards_);
        binariesBytes_ += bytes.size();
        if (binariesBytes_ > context_.limits.maxBinariesBytes)
            return finish(websocket::close_code::too_big, "the binaries of one request are too long");
        binaries_.emplace_back(std::move(bytes));
        askWhenWhole();
    }
    void askWhenWhole() {
        if (binaries_.size() < awaited_->binaries) return;
        const Envelope envelope = *std::exchange(awaited_, std::nullopt);
        if (tooMany_)
            return say(errorText(envelope.id, {ErrorCode::kLimit, fmt::format("more than {} requests in a second",
                                                                              context_.limits.socketPerSecond)}),
                       {});
        hold(kAnswerBytes);
        const std::size_t brings = std::exchange(collected_, 0);
        underWay_ += brings;
        binariesBytes_ = 0;
        const auto ask = [weak = Weak(shared_from_this()), envelope, brings,
                          binaries = std::exchange(binaries_, {})](const Ticket& ticket) {
            const std::shared_ptr<SocketSession> self = weak.lock();
            if (!self || self->closed_) return;
            askInJson(*self->link_, envelope.request, envelope.fields, binaries,
                      [weak, id = envelope.id, brings, ticket](const ApiExpected<ByteSlice>& answer) {
                          const std::shared_ptr<SocketSession> alive = weak.lock();
                          if (!alive) return;
                          alive->underWay_ -= brings;
                          alive->context_.brought -= brings;
                          alive->answered(id, answer, ticket);
                      });
        };
        // Names that are none are refused at once, and not kept.
        waitingAsks_.push_back({ask, requestOf(envelope.request) ? envelope.request : std::string()});
        askNext();
    }
    /// Of what is answered faster than it is taken the rest is asked for later.
    void askNext() {
        while (!waitingAsks_.empty() && unsent_ <= context_.limits.maxHeldBytes && !closed_) {
            const WaitingAsk next = std::move(waitingAsks_.front());
            waitingAsks_.pop_front();
            context_.lanes.enter(this, next.lane, next.ask);
        }
    }
    void answered(const std::string& id, const ApiExpected<ByteSlice>& answer, const Ticket& ticket) {
        if (answer && answer->size() > kMostAtOnce) return answerBeside(id, *answer, ticket);
        letGo(kAnswerBytes);
        SaidAnswer said = answer ? sayAnswer(id, *answer) : SaidAnswer{errorText(id, answer.error()), {}};
        ticket->answered(said.size());
        say(std::move(said.text), std::move(said.binaries));
        read();
    }
    /// What is said after it waits behind it, as it came.
    void answerBeside(const std::string& id, const ByteSlice& answer, const Ticket& ticket) {
        if (closing_) return;
        const Unsent::iterator place = unsentFrames_.insert(unsentFrames_.end(), Frame{.isMade = false});
        context_.beside.run([id, answer] { return sayAnswer(id, answer); },
                            [weak = Weak(shared_from_this()), place, ticket](SaidAnswer said) {
                                ticket->answered(said.size());
                                if (const std::shared_ptr<SocketSession> self = weak.lock())
                                    self->fill(place, std::move(said));
                            });
    }

    /// False: it has brought too much, and goes.
    bool collect(std::size_t bytes) {
        context_.brought += bytes - collected_;
        collected_ = bytes;
        if (context_.brought <= context_.limits.maxBroughtBytes || bytes == 0) return true;
        finish(websocket::close_code::try_again_later, "too many arrays come at once");
        // Now: nobody else is to go for what this one has brought, however long it takes to close.
        binaries_ = {};
        buffer_ = {};
        context_.brought -= std::exchange(collected_, 0);
        return false;
    }

    // ---- what goes

    struct Frame {
        std::string text = {};
        ByteSlice binary = {};
        bool isText = true;
        bool isMade = true;  ///< false: nothing behind it is written before it
        bool isNews = false;
        [[nodiscard]] std::size_t size() const { return isText ? text.size() : binary.size(); }
    };
    using Unsent = std::list<Frame>;
    void say(std::string text, Binaries binaries, bool isNews = false) {
        if (!closing_)
            fill(unsentFrames_.insert(unsentFrames_.end(), Frame{.isNews = isNews}),
                 {std::move(text), std::move(binaries)});
    }
    /// What nobody has asked for comes however slowly it is read.
    void sayNews(std::string text, Binaries binaries) {
        if (unsentNews_ > context_.limits.maxUnsentBytes) return leave();
        say(std::move(text), std::move(binaries), true);
    }
    /// Of a socket that is closed, `place` is none any more.
    void fill(Unsent::iterator place, SaidAnswer said) {
        if (closed_) return;
        if (unsent_ == 0) stream_.next_layer().waitsFrom(std::chrono::steady_clock::now());
        unsent_ += said.size();
        hold(said.size());
        if (place->isNews) unsentNews_ += said.size();
        place->text = std::move(said.text);
        if (!std::exchange(place->isMade, true)) {
            letGo(kAnswerBytes);
            read();
        }
        const Unsent::iterator next = std::next(place);
        for (ByteSlice& binary : said.binaries)
            unsentFrames_.insert(next, {.binary = std::move(binary), .isText = false, .isNews = place->isNews});
        write();
        context_.relieve();
    }
    void hold(std::size_t bytes) {
        held_ += bytes;
        context_.held += bytes;
    }
    void letGo(std::size_t bytes) {
        bytes = std::min(bytes, held_);  // one that was sent away has let go of all
        held_ -= bytes;
        context_.held -= bytes;
    }
    void write() {
        if (writing_ || unsentFrames_.empty() || !unsentFrames_.front().isMade) return;
        writing_ = true;
        const Frame& frame = unsentFrames_.front();
        stream_.text(frame.isText);
        const auto done = [self = shared_from_this()](beast::error_code error, std::size_t) { self->onWritten(error); };
        if (frame.isText)
            stream_.async_write(boost::asio::buffer(frame.text), done);
        else
            stream_.async_write(boost::asio::buffer(frame.binary.data(), frame.binary.size()), done);
    }
    void onWritten(beast::error_code error) {
        writing_ = false;
        if (error) return leave();
        const std::size_t bytes = unsentFrames_.front().size();
        unsent_ -= bytes;
        if (unsentFrames_.front().isNews) unsentNews_ -= bytes;
        letGo(bytes);
        unsentFrames_.pop_front();
        askNext();
        if (!unsentFrames_.empty()) return write();
        if (closing_) return close();
        read();
    }

    // ---- the end

    /// After what is on its way.
    void finish(websocket::close_code code, std::string_view why) {
        if (closing_) return;
        closing_ = true;
        reason_ = {code, cutUtf8(why, 120)};
        if (unsentFrames_.empty()) close();
    }
    void close() {
        if (closed_) return;
        closed_ = true;
        stream_.async_close(reason_, [self = shared_from_this()](beast::error_code) { self->alive_.reset(); });
    }

public:
    [[nodiscard]] std::size_t stalled(TimePoint now) override {
        if (!writing_ || closed_) return 0;
        return stream_.next_layer().tookAt(now) + context_.limits.stalledAfter < now ? unsent_ : 0;
    }
    void leave() override {
        const std::shared_ptr<SocketSession> self = std::move(alive_);
        closing_ = closed_ = true;
        clock_.cancel();
        letGo(held_);
        // The first one may be on its way.
        if (unsentFrames_.size() > 1) unsentFrames_.resize(1);
        stream_.next_layer().close();
    }
    [[nodiscard]] std::string faultOfKey(const TlsContext& keys) const override {
        const std::optional<Credential> peer = stream_.next_layer().peer(keys);
        return peer ? peer->fault : std::string();
    }
    void sendAway(const std::string& why) override {
        waitingAsks_.clear();
        context_.lanes.leave(this);
        finish(websocket::close_code::policy_error, why);
    }

private:
    static constexpr int kLooks = 4;  ///< within `DoorLimits::idle`

    websocket::stream<DoorStream> stream_;
    boost::asio::steady_timer clock_;
    int quiet_ = 0;         ///< so often it has neither said nor taken anything
    bool pinging_ = false;  ///< a ping is on its way, or waits behind what is
    DoorContext& context_;
    RateLimit rate_;
    std::string name_;
    bool follows_ = false;
    std::shared_ptr<DoorLink> link_;
    /// Until it ends: while much is open nothing is read, and perhaps nothing written.
    std::shared_ptr<SocketSession> alive_;

    beast::flat_buffer buffer_;
    bool reading_ = false, readsBeside_ = false, tooMany_ = false;
    std::optional<Envelope> awaited_;  ///< its binaries are on their way
    std::vector<ByteSlice> binaries_;
    std::size_t binariesBytes_ = 0, discards_ = 0;
    struct WaitingAsk {
        std::function<void(const Ticket&)> ask;
        std::string lane;
    };
    std::deque<WaitingAsk> waitingAsks_;
    /// Bytes of `DoorContext::brought`: of the request that comes, of open ones.
    std::size_t collected_ = 0, underWay_ = 0;

    Unsent unsentFrames_;
    std::size_t unsent_ = 0;  ///< bytes
    std::size_t held_ = 0;    ///< `DoorLimits::maxHeldBytes`
    std::size_t unsentNews_ = 0;
    bool writing_ = false, closing_ = false, closed_ = false;
    websocket::close_reason reason_;
};

}  // namespace

void startSocketSession(DoorStream stream, beast::http::request<beast::http::string_body> upgrade,
                        const HttpTarget& target, const Entrant& who, std::string token, DoorContext& context) {
    const auto session = std::make_shared<SocketSession>(std::move(stream), target, who, context);
    session->token = std::move(token);
    session->accept(upgrade);
}

}  // namespace tessera
