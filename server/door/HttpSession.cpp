#include "server/door/HttpSession.h"

#include <fmt/format.h>

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/version.hpp>
#include <boost/beast/websocket.hpp>

#include "common/net/OwnAddress.h"
#include "server/door/FileBodies.h"
#include "server/door/FileRoutes.h"
#include "server/door/LinkTunnel.h"
#include "server/door/SocketSession.h"

namespace tessera {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;

constexpr std::string_view kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
    "form-action 'self'; base-uri 'none'; frame-ancestors 'none'";

class HttpSession : public Guest, public std::enable_shared_from_this<HttpSession> {
public:
    HttpSession(boost::asio::ip::tcp::socket socket, DoorContext& context)
        : Guest(context),
          stream_(std::move(socket)),
          context_(context),
          routes_(context, *this),
          patience_(context.io) {}
    ~HttpSession() override {
        context_.lanes.leave(this);
        letGo();
    }
    void giveWay() override {
        sayTooMany(stream_, context_);
        leave();
    }
    [[nodiscard]] bool waitsToBeRead() override { return stream_.waitsToBeRead(); }
    /// A guest who has not been let in yet, or is being refused, hears why in the answer.
    [[nodiscard]] std::string faultOfKey(const TlsContext& keys) const override {
        if (!letIn_) return {};
        const std::optional<Credential> peer = stream_.peer(keys);
        return peer ? peer->fault : std::string();
    }
    [[nodiscard]] std::size_t stalled(TimePoint now) override {
        return held_ > 0 && stream_.tookAt(now) + context_.limits.stalledAfter < now ? held_ : 0;
    }
    void leave() override {
        letGo();
        patience_.cancel();
        stream_.close();
    }

    void begin(SourceAddress from) {
        source = from;
        context_.isSilent(*this);
        awaitHead();
        if (!context_.options.reach.keys) return beginHead();
        const auto inTurn = [self = shared_from_this()](bool goesOn, std::function<void()> step) {
            self->context_.handshakes.push(self->source, goesOn, [self, step = std::move(step)] {
                step();
                if (self->silent) self->context_.isSilent(*self);  // what it has waited for us is not its silence
            });
        };
        stream_.seal(context_.options.reach.keys(), inTurn, [self = shared_from_this()](DoorStream::Greeting greeting) {
            if (greeting == DoorStream::Greeting::kSealed) return self->beginHead();
            self->patience_.cancel();
            if (greeting == DoorStream::Greeting::kGone) return self->leave();
            self->refuse(errorAnswer(400, "refused", "this door speaks https: begin its link with https://"));
        });
    }

private:
    /// It comes soon, a handshake before it included, or its sender is told so.
    void awaitHead() {
        patience_.expires_after(context_.limits.headWait);
        patience_.async_wait([self = shared_from_this()](beast::error_code stopped) {
            if (stopped) return;
            self->tooSlow_ = true;
            self->stream_.cancel();
        });
    }
    void readHead() {
        // A connection that is kept may rest.
        if (buffer_.size() == 0) {
            stream_.neverExpires();
            patience_.expires_after(context_.limits.idle);
            patience_.async_wait([self = shared_from_this()](beast::error_code stopped) {
                if (!stopped) self->leave();
            });
            constexpr std::size_t kFirst = 1024;
            return stream_.async_read_some(buffer_.prepare(kFirst),
                                           [self = shared_from_this()](beast::error_code error, std::size_t bytes) {
                                               self->patience_.cancel();
                                               if (error) return;
                                               self->buffer_.commit(bytes);
                                               self->awaitHead();
                                               self->beginHead();
                                           });
        }
        awaitHead();
        beginHead();
    }
    void beginHead() {
        parser_.emplace();
        parser_->header_limit(static_cast<std::uint32_t>(context_.limits.maxHeadBytes));
        parser_->body_limit(boost::none);  // looked at once it is known what comes
        stream_.expiresAfter(context_.limits.idle);
        http::async_read_header(
            stream_, buffer_, *parser_,
            [self = shared_from_this()](beast::error_code error, std::size_t) { self->onHead(error); });
    }

    void onHead(beast::error_code error) {
        patience_.cancel();
        if (tooSlow_) return refuse(errorAnswer(408, "network", "the head of a request has not come in time"));
        if (error == http::error::header_limit) return refuse(errorAnswer(431, "limit", "the head is too long"));
        if (error && error.category() == http::make_error_code(http::error::end_of_stream).category() &&
            error != http::error::end_of_stream && error != http::error::partial_message)
            return refuse(errorAnswer(400, "bad_input", "no HTTP"));
        if (error) return;
        const auto& head = parser_->get();
        const auto field = [&](http::field name) { return std::string(head[name]); };
        // Of two, others on the way may have looked at the other one.
        for (const http::field once : {http::field::host, http::field::origin, http::field::authorization})
            if (const auto twice = head.equal_range(once); std::distance(twice.first, twice.second) > 1)
                return refuse(errorAnswer(400, "bad_input", std::string(http::to_string(once)) + " is said twice"));
        request_ = {.method = std::string(head.method_string()),
                    .target = std::string(head.target()),
                    .host = field(http::field::host),
                    .origin = field(http::field::origin),
                    .authorization = field(http::field::authorization),
                    .contentType = field(http::field::content_type),
                    .wantsSocket = beast::websocket::is_upgrade(head),
                    .body = {},
                    .length = parser_->content_length() ? std::optional<std::uint64_t>(*parser_->content_length())
                                                        : std::nullopt,
                    .key = context_.options.reach.keys ? stream_.peer(*context_.options.reach.keys()) : std::nullopt,
                    .from = stream_.from()};
        // Chunks have extensions and trailers, for which the library knows no bounds.
        if (head.find(http::field::transfer_encoding) != head.end())
            return refuse(errorAnswer(411, "refused", "a body comes with its Content-Length, not in chunks"));
        if (!isUpload(request_) && request_.length.value_or(0) > context_.limits.maxTextBytes) return refuse(tooLong());
        std::optional<HttpAnswer> early = routes_.beforeBody(request_);
        letIn_ = !early;
        if (early) return routes_.wrongLogin() ? refuseLogin(std::move(*early)) : refuse(std::move(*early));
        if (routes_.knowsWho()) {
            if (!(who && who->isSameAs(routes_.who())) && !context_.hasPlaceFor(routes_.who(), *this, false))
                return refuse(tooManyOf(routes_.who(), "connections"));
            context_.isKnown(*this);
            who = routes_.who();
            token =
                context_.gate.tokenIn(request_, *readTarget(request_.target));  // it may end before its body has come
        }
        const std::string path = readTarget(request_.target)->path;
        if (request_.wantsSocket && (path == "/socket" || path == "/link")) {
            if (std::optional<HttpAnswer> wrong = wrongHandshake(head)) return refuse(std::move(*wrong));
            return becomeSocket(path == "/link");
        }
        waitsToBeAsked_ = beast::iequals(head[http::field::expect], "100-continue");
        if (isUpload(request_)) return readFile();
        askForBody([self = shared_from_this()] { self->readBody(); });
    }
    /// Whoever waits to be asked for the body is asked, once nothing speaks against it.
    void askForBody(std::function<void()> then) {
        stream_.expiresAfter(context_.limits.idle);
        if (!std::exchange(waitsToBeAsked_, false)) return then();
        auto go = std::make_shared<http::response<http::empty_body>>(http::status::continue_, 11);
        http::async_write(stream_, *go, [go, then = std::move(then)](beast::error_code wrong, std::size_t) {
            if (!wrong) then();  // who holds this session
        });
    }
    /// A file goes to the disk as it comes.
    void readFile() {
        if (std::optional<HttpAnswer> tooMany = routes_.tooFast()) return refuse(std::move(*tooMany));
        if (std::optional<HttpAnswer> none = noPlaceForUpload(routes_.who(), context_)) return refuse(std::move(*none));
        isUploading = true;
        const std::string path = readTarget(request_.target)->path.substr(kUploadPrefix.size());
        const std::uint64_t length = *request_.length;
        const auto begin = [folder = context_.options.uploads, path, length] {
            return UploadFolder::begin(folder, path, length);
        };
        context_.disk->run(
            begin, [self = shared_from_this(), length](const Expected<std::shared_ptr<UploadFolder::Incoming>>& file) {
                if (!file) return self->fileEnds(apiErrorAnswer({file.error().code, file.error().message}));
                self->askForBody([self, length, file = *file] { self->receive(file, length); });
            });
    }
    void receive(const std::shared_ptr<UploadFolder::Incoming>& file, std::uint64_t length) {
        const auto came = buffer_.data();
        receiveFile(shared_from_this(), stream_, context_, file,
                    std::string(static_cast<const char*>(came.data()), came.size()), length,
                    [self = shared_from_this(), length](const tl::expected<std::string, HttpAnswer>& whole) {
                        if (!whole) return self->fileEnds(whole.error());
                        const auto& onFile = self->context_.options.onFile;
                        if (onFile) onFile(self->routes_.who(), "PutFile", *whole);
                        self->fileEnds(uploadedAnswer(*whole, length));
                    });
    }
    void fileEnds(HttpAnswer answer) {
        isUploading = false;
        stream_.expiresAfter(context_.limits.headWait);
        write(std::move(answer), false);
    }
    void readBody() {
        http::async_read(stream_, buffer_, *parser_,
                         [self = shared_from_this()](beast::error_code error, std::size_t) { self->onBody(error); });
    }
    void onBody(beast::error_code error) {
        if (error) return;
        request_.body = std::move(parser_->get().body());
        const auto once = [weak = weak_from_this(), number = ++asked_](HttpAnswer answer) {
            const std::shared_ptr<HttpSession> self = weak.lock();
            if (!self || self->answered_ == number) return;
            self->answered_ = number;
            self->patience_.cancel();
            self->stream_.expiresAfter(self->context_.limits.answerWait);
            self->write(std::move(answer), self->parser_->keep_alive());
        };
        // Nothing is read or written meanwhile, so that the stream's own clock stands still.
        patience_.expires_after(context_.limits.answerWait);
        patience_.async_wait([self = shared_from_this(), once](beast::error_code stopped) {
            if (!stopped) once(errorAnswer(504, "network", "the wall has not answered in time"));
        });
        routes_.answer(request_, once);
    }

    /// This machine's programs are not slowed down: they have one address, and one user's would make another's wait.
    void refuseLogin(HttpAnswer answer) {
        beast::error_code error;
        const auto peer = stream_.socket().remote_endpoint(error);
        if (error || isOwnAddress(peer.address().to_string())) return refuse(std::move(answer));
        FailedLogins::Verdict verdict = context_.failedLogins.failed(source, std::chrono::steady_clock::now());
        if (verdict.begins && context_.options.tell) context_.options.tell(describeSlowed(source));
        if (verdict.close) return leave();
        if (!verdict.ticket) return refuse(std::move(answer));
        slowed_ = std::move(verdict.ticket);
        patience_.expires_after(verdict.wait);
        patience_.async_wait([self = shared_from_this(), answer = std::move(answer)](beast::error_code stopped) {
            self->slowed_.reset();
            if (!stopped) self->refuse(answer);
        });
    }
    static HttpAnswer tooManyOf(const Entrant& who, std::string_view what) {
        return errorAnswer(503, "limit",
                           fmt::format("as many {} of '{}' are open as may be of one name", what, who.name));
    }
    static HttpAnswer tooLong() { return errorAnswer(413, "limit", "the body is too long: arrays go through /socket"); }
    /// What was said may not have been read to its end.
    void refuse(HttpAnswer answer) {
        letIn_ = false;
        stream_.expiresAfter(context_.limits.headWait);
        write(std::move(answer), false);
    }
    template <typename Body>
    static std::shared_ptr<http::response<Body>> headOf(const HttpAnswer& answer, bool keep) {
        auto response = std::make_shared<http::response<Body>>(static_cast<http::status>(answer.status), 11);
        response->set(http::field::content_type, answer.type);
        response->set(http::field::cache_control, "no-store");
        response->set("Content-Security-Policy", kPolicy);
        response->set("Referrer-Policy", "no-referrer");
        response->set("X-Content-Type-Options", "nosniff");
        for (const auto& [name, value] : answer.fields) response->set(name, value);
        response->keep_alive(keep);
        return response;
    }
    void writeFile(const HttpAnswer& answer, bool keep) {
        const auto response = headOf<http::empty_body>(answer, keep);
        response->content_length(answer.file->bytes);
        const auto head = std::make_shared<http::response_serializer<http::empty_body>>(*response);
        http::async_write_header(stream_, *head,
                                 [self = shared_from_this(), response, head, keep, file = answer.file](
                                     beast::error_code error, std::size_t) {
                                     if (error) return;
                                     sendFile(self, self->stream_, self->context_, file, [self, keep](bool sent) {
                                         if (!sent) return self->leave();  // its reader counts the bytes
                                         if (keep) return self->readHead();
                                         self->bowOut();
                                     });
                                 });
    }
    void write(HttpAnswer answer, bool keep) {
        if (answer.file) return writeFile(answer, keep);
        auto response = headOf<http::string_body>(answer, keep);
        response->body() = std::move(answer.body);
        response->prepare_payload();
        hold(response->body().size());
        http::async_write(stream_, *response,
                          [self = shared_from_this(), response, keep](beast::error_code error, std::size_t) {
                              self->letGo();
                              if (error) return;
                              if (keep) return self->readHead();
                              self->bowOut();
                          });
    }
    /// Until it is taken an answer lies here, as those of sockets do.
    void hold(std::size_t bytes) {
        held_ = bytes;
        context_.held += bytes;
        stream_.waitsFrom(std::chrono::steady_clock::now());
        context_.relieve();
    }
    void letGo() { context_.held -= std::exchange(held_, 0); }
    /// What still comes is taken for a while: a close with unread bytes would take the answer away from who reads
    /// slowly, or first sends all of a file.
    void bowOut() {
        stream_.endSending();
        constexpr std::size_t kRest = std::size_t{16} << 10;
        rest_.resize(kRest);
        restUntil_ = std::chrono::steady_clock::now() + (routes_.knowsWho() ? context_.limits.headWait : kQuiet);
        takeRest();
    }
    void takeRest() {
        const TimePoint now = std::chrono::steady_clock::now();
        if (now >= restUntil_) return;
        stream_.expiresAfter(std::min<Duration>(kQuiet, restUntil_ - now));
        stream_.async_read_some(boost::asio::buffer(rest_),
                                [self = shared_from_this()](beast::error_code error, std::size_t) {
                                    if (!error) self->takeRest();
                                });
    }

    /// RFC 6455, 4.2.1 and 4.4.
    static std::optional<HttpAnswer> wrongHandshake(const http::request_header<>& head) {
        if (head[http::field::sec_websocket_version] != "13") {
            HttpAnswer answer = errorAnswer(426, "unsupported", "Sec-WebSocket-Version is to be 13");
            answer.fields.emplace_back("Sec-WebSocket-Version", "13");
            return answer;
        }
        constexpr std::size_t kKeyLetters = 24;  // of 16 bytes in base 64
        if (head[http::field::sec_websocket_key].size() != kKeyLetters)
            return errorAnswer(400, "bad_input", "Sec-WebSocket-Key is to be 16 bytes in base 64");
        return std::nullopt;
    }

    void becomeSocket(bool isLink) {
        if (context_.sockets >= context_.limits.maxSockets)
            return refuse(errorAnswer(
                503, "limit", "as many sockets are open as may be: " + std::to_string(context_.limits.maxSockets)));
        if (!context_.hasPlaceFor(routes_.who(), *this, true)) return refuse(tooManyOf(routes_.who(), "sockets"));
        stream_.neverExpires();
        const HttpTarget target = *readTarget(request_.target);
        if (isLink) return startLinkTunnel(std::move(stream_), parser_->release(), routes_.who(), token, context_);
        startSocketSession(std::move(stream_), parser_->release(), target, routes_.who(), token, context_);
    }

    DoorStream stream_;
    DoorContext& context_;
    Routes routes_;
    beast::flat_buffer buffer_;
    std::optional<http::request_parser<http::string_body>> parser_;
    HttpRequest request_;
    bool tooSlow_ = false, waitsToBeAsked_ = false, letIn_ = false;
    boost::asio::steady_timer patience_;              ///< for an answer
    std::size_t held_ = 0;                            ///< of `DoorContext::held`
    std::uint64_t asked_ = 0, answered_ = 0;          ///< numbers of requests on this connection
    static constexpr std::chrono::seconds kQuiet{1};  ///< of who has been refused
    std::vector<char> rest_;
    TimePoint restUntil_{};
    std::optional<FailedLogins::Ticket> slowed_;  ///< while a refusal waits
};

}  // namespace

void startHttpSession(boost::asio::ip::tcp::socket socket, SourceAddress from, DoorContext& context) {
    std::make_shared<HttpSession>(std::move(socket), context)->begin(from);
}

void sayTooMany(DoorStream& stream, const DoorContext& context) {
    static const std::string kBody = errorAnswer(503, "limit", "as many connections are open as may be").body;
    static const std::string kAnswer = fmt::format(
        "HTTP/1.1 503 Service Unavailable\r\nContent-Type: application/json\r\nContent-Length: {}\r\nRetry-After: "
        "1\r\nConnection: close\r\n\r\n{}",
        kBody.size(), kBody);
    stream.sayLast(kAnswer, !context.options.reach.keys);
}

}  // namespace tessera
