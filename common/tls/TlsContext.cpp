#include "common/tls/TlsContext.h"

#include <fmt/format.h>

#include <openssl/crypto.h>

#include <algorithm>

#include "common/tls/TlsContextImpl.h"

namespace tessera {
namespace {

constexpr unsigned kClockExtension = 0xFF54;  // of the numbers for private use (RFC 8446, 11)
constexpr long kMostCertificateBytes = 16 * 1024;

using StackPtr = std::unique_ptr<STACK_OF(X509), decltype([](STACK_OF(X509) * stack) { sk_X509_free(stack); })>;

tl::unexpected<Error> fault(const std::string& file, std::string_view what) {
    return fail(ErrorCode::kBadInput, fmt::format("{}{}{}", file, file.empty() ? "" : ": ", what));
}
/// What OpenSSL does not do, in its words.
tl::unexpected<Error> faultInOpenSsl(const std::string& file, std::string_view what) {
    return fault(file, fmt::format("{} ({})", what, openSslWords()));
}

bool isFingerprint(std::string_view text) {
    constexpr std::size_t kDigits = 64;
    return text.size() == kDigits && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

}  // namespace

TlsContext::TlsContext() = default;
TlsContext::~TlsContext() = default;

ssl_ctx_st* TlsContext::native() const {
    return impl_->context.get();
}

Expected<std::shared_ptr<const TlsContext>> TlsContext::make(TlsKeys keys) {
    ERR_clear_error();
    std::shared_ptr<TlsContext> made(new TlsContext);
    made->impl_ = std::make_unique<Impl>();
    made->revoked_ = std::move(keys.revoked);
    made->tokens_ = std::move(keys.tokens);
    for (auto& [name, text] : keys.panels)
        made->panels_.emplace(name, std::make_shared<const std::string>(std::move(text)));
    made->ends_ = std::move(keys.ends);
    made->faults_ = std::move(keys.faults);
    made->impl_->context.reset(SSL_CTX_new(TLS_method()));
    SSL_CTX* const context = made->impl_->context.get();
    TESSERA_CHECK(context != nullptr, "OpenSSL makes no context");
    SSL_CTX_set_min_proto_version(context, TLS1_3_VERSION);
    SSL_CTX_set_max_cert_list(context, kMostCertificateBytes);
    // 128 bits are enough, and half as fast again as 256.
    TESSERA_CHECK(SSL_CTX_set_ciphersuites(context, "TLS_AES_128_GCM_SHA256:TLS_CHACHA20_POLY1305_SHA256") == 1,
                  "OpenSSL lacks the ciphers");
    SSL_CTX_set_mode(context, SSL_MODE_RELEASE_BUFFERS);

    CertificatePtr authority;
    if (!keys.authority.empty()) {
        authority = readX509(keys.authority);
        if (!authority) return faultInOpenSsl(keys.authorityFile, "the authority's certificate cannot be read");
        made->authority_ = Certificate::of(*authority).fingerprint;
        // Written anew: whatever else stood in that text is nobody's to see.
        const BioPtr text(BIO_new(BIO_s_mem()));
        if (PEM_write_bio_X509(text.get(), authority.get()) == 1) made->authorityPem_ = textIn(text.get());
        if (!keys.pinned.empty() && keys.pinned != made->authority_)
            return fail(ErrorCode::kBadInput, fmt::format("the keys are of another authority ({}) than the link ({})",
                                                          made->authority_, keys.pinned));
        X509_STORE_add_cert(SSL_CTX_get_cert_store(context), authority.get());
    } else if (isFingerprint(keys.pinned)) {
        made->authority_ = keys.pinned;
    } else {
        return fail(ErrorCode::kBadInput,
                    fmt::format("'{}' is not the SHA-256 of an authority: 64 digits of 0-9a-f", keys.pinned));
    }

    if (!keys.own.empty()) {
        const KeyPtr key(PEM_read_bio_PrivateKey(memoryOf(keys.own).get(), nullptr, nullptr, nullptr));
        if (!key) return faultInOpenSsl(keys.ownFile, "holds no key");
        const CertificatePtr certificate = readX509(keys.own);
        if (!certificate) return faultInOpenSsl(keys.ownFile, "holds no certificate");
        made->own_ = Certificate::of(*certificate);
        if (!made->own_->holder) return fault(keys.ownFile, "its certificate is not one of tessera-keys");
        if (authority && X509_verify(certificate.get(), X509_get0_pubkey(authority.get())) != 1)
            return faultInOpenSsl(keys.ownFile, fmt::format("its certificate, of {}, was made by another authority",
                                                            describe(*made->own_->holder)));
        if (SSL_CTX_use_certificate(context, certificate.get()) != 1 || SSL_CTX_use_PrivateKey(context, key.get()) != 1)
            return faultInOpenSsl(keys.ownFile, "its certificate is not of its key");
        // Who knows the authority by its fingerprint finds it in the chain.
        if (authority) SSL_CTX_add1_chain_cert(context, authority.get());
    }

    if (made->own_ && std::ranges::find(made->ends_, *made->own_->holder, &KeyEnd::holder) == made->ends_.end())
        made->ends_.push_back({*made->own_->holder, made->own_->until});
    std::ranges::sort(made->ends_, {}, &KeyEnd::until);
    X509_VERIFY_PARAM_set_flags(SSL_CTX_get0_param(context), X509_V_FLAG_NO_CHECK_TIME);  // we do, in words
    SSL_CTX_set_verify(context, SSL_VERIFY_PEER, nullptr);
    SSL_CTX_set_cert_verify_callback(context, &TlsCallbacks::verify, made.get());
    if (authority) SSL_CTX_add_client_CA(context, authority.get());
    TESSERA_CHECK(
        SSL_CTX_add_custom_ext(context, kClockExtension, SSL_EXT_CLIENT_HELLO | SSL_EXT_TLS1_3_ENCRYPTED_EXTENSIONS,
                               &TlsCallbacks::addClock, &TlsCallbacks::freeClock, nullptr, &TlsCallbacks::readClock,
                               nullptr) == 1,
        "OpenSSL takes no extension");
    constexpr std::string_view kSessions = "tessera";
    SSL_CTX_set_session_id_context(context, reinterpret_cast<const unsigned char*>(kSessions.data()), kSessions.size());
    SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_CLIENT | SSL_SESS_CACHE_NO_INTERNAL);
    SSL_CTX_sess_set_new_cb(context, &TlsCallbacks::newSession);
    return made;
}

std::optional<AccessPass> TlsContext::passOf(std::string_view word, DateTime now) const {
    const std::string hash = hashOfToken(word);
    std::optional<AccessPass> found;
    for (const KeptToken& token : tokens_)
        if (CRYPTO_memcmp(token.hash.data(), hash.data(), hash.size()) == 0 && now < token.until) found = token.pass;
    return found;
}

std::shared_ptr<const std::string> TlsContext::panelOf(const std::string& name) const {
    const auto found = panels_.find(name);
    return found == panels_.end() ? nullptr : found->second;
}

std::vector<KeyEnd> TlsContext::endsSoon(DateTime now) const {
    std::vector<KeyEnd> soon = ends_;
    std::erase_if(soon, [&](const KeyEnd& end) { return end.until > now + kEndsSoon; });
    return soon;
}

std::string toText(const KeyEnd& end, DateTime now) {
    const std::string holder = describe(end.holder);
    if (end.until <= now)
        return fmt::format("the key of {} ended on {}: tessera-keys renew", holder, toText(end.until));
    return fmt::format("the key of {} ends on {}, in {} days: tessera-keys renew", holder, toText(end.until),
                       std::chrono::floor<std::chrono::days>(end.until - now).count());
}

std::string TlsContext::faultOf(const Certificate& certificate, DateTime now, DateTime otherClock) const {
    if (!certificate.holder) return "it has a certificate that no tessera-keys made";
    const std::string holder = describe(*certificate.holder);
    if (revoked_.contains(certificate.serial)) return fmt::format("the certificate of {} has been revoked", holder);
    if (own_ && certificate.holder->wall != own_->holder->wall)
        return fmt::format("the certificate is of {}, and this is the wall '{}'", holder, own_->holder->wall);
    if (now >= certificate.from && now < certificate.until) return {};
    const std::string clocks =
        otherClock == DateTime()
            ? fmt::format("it is {} by this side's clock", toText(now))
            : fmt::format("it is {} by this side's clock and {} by the other's", toText(now), toText(otherClock));
    return now < certificate.from
               ? fmt::format("the certificate of {} holds from {} on, and {}: set the clocks", holder,
                             toText(certificate.from), clocks)
               : fmt::format("the certificate of {} held until {}, and {}: tessera-keys renew makes another one",
                             holder, toText(certificate.until), clocks);
}

}  // namespace tessera
