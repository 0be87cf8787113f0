#include "common/tls/TlsChannel.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <climits>
#include <cstring>
#include <utility>

#include "common/tls/TlsContextImpl.h"

namespace tessera {
namespace {

constexpr std::size_t kClockBytes = 8;  // seconds since 1970, the largest first

DateTime now() {
    return std::chrono::system_clock::now();
}

/// What a channel reads from and writes to, as OpenSSL wants it.
struct Wires {
    ByteSpan* incoming;
    Bytes* outgoing;
    std::size_t messages = 0;   ///< of TLS itself, that came: the handshake's, tickets, new keys
    std::uint64_t content = 0;  ///< bytes that came beside these

    /// New keys take 50 us each, and nine thousand of them are in one read: to work through them stopped the frames.
    [[nodiscard]] bool tooMany() const {
        constexpr std::size_t kFree = 64;
        constexpr std::uint64_t kBytesOfEach = std::uint64_t{1} << 20;
        return messages > kFree + content / kBytesOfEach;
    }
};

void countMessage(int isSent, int, int type, const void*, std::size_t, SSL*, void* given) {
    if (isSent == 0 && type == SSL3_RT_HANDSHAKE) ++static_cast<Wires*>(given)->messages;
}

int writeWire(BIO* bio, const char* bytes, int count) {
    const Wires& wires = *static_cast<Wires*>(BIO_get_data(bio));
    const auto* const from = reinterpret_cast<const std::byte*>(bytes);
    wires.outgoing->insert(wires.outgoing->end(), from, from + count);
    return count;
}

int readWire(BIO* bio, char* room, int count) {
    const Wires& wires = *static_cast<Wires*>(BIO_get_data(bio));
    ByteSpan& incoming = *wires.incoming;
    BIO_clear_retry_flags(bio);
    if (wires.tooMany()) return -1;  // for good: `read` says why
    if (incoming.empty()) {
        BIO_set_retry_read(bio);
        return -1;
    }
    const std::size_t part = std::min(incoming.size(), static_cast<std::size_t>(count));
    std::memcpy(room, incoming.data(), part);
    incoming = incoming.subspan(part);
    return static_cast<int>(part);
}

long controlWire(BIO*, int command, long, void*) {
    return command == BIO_CTRL_FLUSH ? 1 : 0;
}

BIO_METHOD* wireMethod() {
    static BIO_METHOD* const method = [] {
        BIO_METHOD* const made = BIO_meth_new(BIO_get_new_index() | BIO_TYPE_SOURCE_SINK, "a link of Tessera");
        TESSERA_CHECK(made != nullptr, "OpenSSL has no memory");
        BIO_meth_set_write(made, writeWire);
        BIO_meth_set_read(made, readWire);
        BIO_meth_set_ctrl(made, controlWire);
        return made;
    }();
    return method;
}

Error network(std::string message) {
    return {ErrorCode::kNetwork, std::move(message)};
}

}  // namespace

struct TlsChannel::Impl {
    Wires wires;
    SslPtr ssl;
};

// ---- what OpenSSL calls
// ------------------------------------------------------------------------------------------------

int TlsCallbacks::channelIndex() {
    static const int index = SSL_get_ex_new_index(0, nullptr, nullptr, nullptr, nullptr);
    return index;
}

namespace {

/// Else a chain that leads to the authority is wrong in itself.
bool isOfAnotherAuthority(int why) {
    return why == X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT || why == X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY ||
           why == X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE || why == X509_V_ERR_CERT_SIGNATURE_FAILURE ||
           why == X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT || why == X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN;
}

}  // namespace

int TlsCallbacks::verify(X509_STORE_CTX* chain, void* given) {
    const TlsContext& context = *static_cast<const TlsContext*>(given);
    auto* const ssl = static_cast<SSL*>(X509_STORE_CTX_get_ex_data(chain, SSL_get_ex_data_X509_STORE_CTX_idx()));
    TlsChannel* const channel = channelOf(ssl);
    // Where the authority is known by its fingerprint alone, the one that was sent is it, or nobody is.
    STACK_OF(X509)* const trusted = sk_X509_new_null();
    STACK_OF(X509)* const sent = X509_STORE_CTX_get0_untrusted(chain);
    for (int i = 0; i < sk_X509_num(sent); ++i)
        if (X509* const each = sk_X509_value(sent, i);
            Certificate::of(*each).fingerprint == context.authorityFingerprint())
            sk_X509_push(trusted, each);
    if (sk_X509_num(trusted) > 0) X509_STORE_CTX_set0_trusted_stack(chain, trusted);
    const bool good = X509_verify_cert(chain) == 1;
    sk_X509_free(trusted);
    if (good) return 1;
    const int why = X509_STORE_CTX_get_error(chain);
    if (channel == nullptr) return 0;
    const X509* const leaf = X509_STORE_CTX_get0_cert(chain);
    const Certificate shown = leaf == nullptr ? Certificate{} : Certificate::of(*leaf);
    // Both sides read it: who is refused, and who refuses.
    const char* const words = X509_verify_cert_error_string(why);
    if (!shown.holder)
        channel->refusal_ = fmt::format("the certificate is not one of this wall's ({})", words);
    else if (isOfAnotherAuthority(why))
        channel->refusal_ = fmt::format("the certificate of {} was made by another authority than this wall's ({})",
                                        describe(*shown.holder), words);
    else
        channel->refusal_ = fmt::format("the certificate of {} is not one that tessera-keys makes ({})",
                                        describe(*shown.holder), words);
    if (channel->side_ == TlsChannel::Side::kDials) return 0;
    // It is told why in words. The result stays with the session, which nobody is to resume.
    SSL_set_num_tickets(ssl, 0);
    return 1;
}

int TlsCallbacks::addClock(SSL*, unsigned, unsigned, const unsigned char** out, std::size_t* size, X509*, std::size_t,
                           int*, void*) {
    const std::time_t seconds = std::chrono::system_clock::to_time_t(now());
    auto* const bytes = new unsigned char[kClockBytes];
    for (std::size_t i = 0; i < kClockBytes; ++i)
        bytes[i] = static_cast<unsigned char>(static_cast<std::uint64_t>(seconds) >> (8 * (kClockBytes - 1 - i)));
    *out = bytes;
    *size = kClockBytes;
    return 1;
}

void TlsCallbacks::freeClock(SSL*, unsigned, unsigned, const unsigned char* out, void*) {
    delete[] out;
}

int TlsCallbacks::readClock(SSL* ssl, unsigned, unsigned, const unsigned char* in, std::size_t size, X509*, std::size_t,
                            int*, void*) {
    TlsChannel* const channel = channelOf(ssl);
    if (channel == nullptr || size != kClockBytes) return 1;  // it is for words alone
    std::uint64_t seconds = 0;
    for (std::size_t i = 0; i < size; ++i) seconds = seconds << 8 | in[i];
    constexpr std::uint64_t kLast = 253'402'300'799;  // of the year 9999
    constexpr std::uint64_t kCounted =
        std::chrono::duration_cast<std::chrono::seconds>(DateTime::duration::max()).count();
    channel->otherClock_ = DateTime(std::chrono::seconds(std::min({seconds, kLast, kCounted})));
    return 1;
}

int TlsCallbacks::newSession(SSL* ssl, SSL_SESSION* session) {
    const TlsChannel* const channel = channelOf(ssl);
    if (channel == nullptr || channel->side_ != TlsChannel::Side::kDials) return 0;
    channel->context_->impl_->tickets.put(channel->target_, SslSessionPtr(session));
    return 1;  // it is ours now
}

// ---- the channel
// -------------------------------------------------------------------------------------------------------

TlsChannel::TlsChannel(std::shared_ptr<const TlsContext> context, Side side, std::string target)
    : context_(std::move(context)), side_(side), target_(std::move(target)), impl_(std::make_unique<Impl>()) {
    impl_->wires = {&incoming_, &outgoing_};
    impl_->ssl.reset(SSL_new(context_->native()));
    SSL* const ssl = impl_->ssl.get();
    BIO* const wire = BIO_new(wireMethod());
    TESSERA_CHECK(ssl != nullptr && wire != nullptr, "OpenSSL has no memory");
    BIO_set_data(wire, &impl_->wires);
    BIO_set_init(wire, 1);
    SSL_set_bio(ssl, wire, wire);
    SSL_set_ex_data(ssl, TlsCallbacks::channelIndex(), this);
    SSL_set_msg_callback(ssl, countMessage);
    SSL_set_msg_callback_arg(ssl, &impl_->wires);
    if (side == Side::kAccepts) {
        SSL_set_accept_state(ssl);
    } else {
        SSL_set_connect_state(ssl);
        if (const SslSessionPtr known = context_->impl_->tickets.take(target_)) SSL_set_session(ssl, known.get());
    }
}

TlsChannel::~TlsChannel() = default;

void TlsChannel::arrived(ByteSpan wire) {
    if (!firstSeen_ && !wire.empty()) {
        firstSeen_ = true;
        constexpr std::byte kAlert{0x15};
        plain_ = wire.front() != kFirstByte && wire.front() != kAlert;
    }
    if (incoming_.empty()) {
        incoming_ = wire;
        return;
    }
    Bytes all(incoming_.begin(), incoming_.end());
    all.insert(all.end(), wire.begin(), wire.end());
    kept_ = std::move(all);
    incoming_ = kept_;
}

void TlsChannel::keep() {
    if (incoming_.empty()) return;
    Bytes rest(incoming_.begin(), incoming_.end());  // it may lie in `kept_`
    kept_ = std::move(rest);
    incoming_ = kept_;
}

Expected<void> TlsChannel::shake() {
    ERR_clear_error();
    const int done = SSL_do_handshake(impl_->ssl.get());
    if (done == 1) {
        if (const Expected<void> good = judge(); !good) return good;
        ready_ = true;
        return {};
    }
    const int why = SSL_get_error(impl_->ssl.get(), done);
    if (why == SSL_ERROR_WANT_READ || why == SSL_ERROR_WANT_WRITE) return {};
    return tl::unexpected(faultOfHandshake());
}

Error TlsChannel::faultOfHandshake() const {
    if (!refusal_.empty()) return {ErrorCode::kRefused, refusal_};
    if (plain_)
        return network(side_ == Side::kDials ? "the server speaks without keys, and this program was given some"
                                             : "the peer does not speak TLS");
    const unsigned long code = ERR_peek_last_error();
    const std::string words = openSslWords();
    const int reason = ERR_GET_REASON(code);
    // The other side's alerts are these numbers and a thousand.
    if (reason >= SSL_AD_REASON_OFFSET)
        return {ErrorCode::kRefused, fmt::format("the other side refuses the handshake: {}", words)};
    return network(fmt::format("the handshake (TLS 1.3) failed: {}", words));
}

/// The chain is good, or `refusal_` says why not; of a resumed session the result was kept.
Expected<void> TlsChannel::judge() {
    const SSL* const ssl = impl_->ssl.get();
    const X509* const shown = SSL_get0_peer_certificate(ssl);
    const bool dials = side_ == Side::kDials;
    if (shown == nullptr) {
        if (dials) return fail(ErrorCode::kRefused, "the server shows no certificate");
        return {};
    }
    const Certificate certificate = Certificate::of(*shown);
    std::string fault = refusal_;
    if (fault.empty() && SSL_get_verify_result(ssl) != X509_V_OK) fault = "its certificate is not believed";
    if (fault.empty()) fault = context_->faultOf(certificate, now(), otherClock_);
    if (fault.empty() && dials != (certificate.holder->kind == Identity::Kind::kServer))
        fault = fmt::format("the certificate is of {}, and {}", describe(*certificate.holder),
                            dials ? "not of a server" : "a server dials nobody");
    if (dials && !fault.empty()) return fail(ErrorCode::kRefused, fault);
    shown_ = certificate;
    peer_ = Credential{
        .identity = certificate.holder.value_or(Identity()), .serial = certificate.serial, .fault = std::move(fault)};
    return {};
}

std::string TlsChannel::faultNow(const TlsContext& context) const {
    return shown_ ? context.faultOf(*shown_, now(), otherClock_) : std::string();
}

bool TlsChannel::resumed() const {
    return SSL_session_reused(impl_->ssl.get()) == 1;
}

Expected<std::size_t> TlsChannel::read(std::span<std::byte> room) {
    ERR_clear_error();
    std::size_t count = 0;
    const int done = SSL_read_ex(impl_->ssl.get(), room.data(), room.size(), &count);
    impl_->wires.content += count;
    if (done == 1) return count;
    const int why = SSL_get_error(impl_->ssl.get(), done);
    if (why == SSL_ERROR_WANT_READ || why == SSL_ERROR_WANT_WRITE) {
        // Until the rest has come nothing could be sealed. Whom we know sends such a message in one piece.
        if (SSL_in_init(impl_->ssl.get()) == 0) return 0;
        return tl::unexpected(network("a message of TLS itself comes in pieces (TLS 1.3)"));
    }
    if (impl_->wires.tooMany()) return tl::unexpected(network("the peer changes its keys again and again (TLS 1.3)"));
    if (why == SSL_ERROR_ZERO_RETURN) {
        peerEnded_ = true;
        return 0;
    }
    const unsigned long code = ERR_peek_last_error();
    const std::string words = openSslWords();
    return tl::unexpected(ERR_GET_REASON(code) >= SSL_AD_REASON_OFFSET
                              ? Error{ErrorCode::kRefused, fmt::format("the other side ends the link: {}", words)}
                              : network(fmt::format("what came is not what was sent (TLS 1.3: {})", words)));
}

Expected<void> TlsChannel::seal(ByteSpan bytes) {
    if (bytes.empty()) return {};
    ERR_clear_error();
    std::size_t sealed = 0;
    // The wire takes all that it is given.
    if (SSL_write_ex(impl_->ssl.get(), bytes.data(), bytes.size(), &sealed) == 1 && sealed == bytes.size()) return {};
    return tl::unexpected(network(fmt::format("nothing more can be sent (TLS 1.3: {})", openSslWords())));
}

void TlsChannel::end() {
    ERR_clear_error();
    if (ready_) SSL_shutdown(impl_->ssl.get());
    ERR_clear_error();
}

}  // namespace tessera
