#include "common/tls/Certificate.h"

#include <arpa/inet.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <limits>

#include "common/tls/OpenSsl.h"

namespace tessera {
namespace {

constexpr int kVersion3 = 2;  // counted from 0

std::string hexadecimal(const unsigned char* bytes, std::size_t count) {
    std::string text;
    for (std::size_t i = 0; i < count; ++i) text += fmt::format("{:02x}", bytes[i]);
    return text;
}

/// No time that can be read is in the past of all: nothing holds then.
DateTime timeOf(const ASN1_TIME* time) {
    std::tm broken{};
    if (time == nullptr || ASN1_TIME_to_tm(time, &broken) != 1) return DateTime();
    // Beyond what this clock counts to (the year 2262) it is for ever.
    constexpr std::time_t kLast = std::chrono::duration_cast<std::chrono::seconds>(DateTime::duration::max()).count();
    return DateTime(std::chrono::seconds(std::min(timegm(&broken), kLast)));
}

/// Those who hold it, and the names that browsers may know them by.
struct Holders {
    std::optional<Identity> holder;
    std::vector<std::string> names;
};

std::string textOf(const ASN1_STRING* text) {
    return {reinterpret_cast<const char*>(ASN1_STRING_get0_data(text)),
            static_cast<std::size_t>(ASN1_STRING_length(text))};
}

std::string addressIn(const std::string& bytes) {
    std::array<char, INET6_ADDRSTRLEN> text{};
    const int family = bytes.size() == 4 ? AF_INET : AF_INET6;
    if ((bytes.size() != 4 && bytes.size() != 16) || !inet_ntop(family, bytes.data(), text.data(), text.size()))
        return {};
    return text.data();
}

Holders holdersOf(const X509& certificate) {
    Holders found;
    int uris = 0;
    auto* const names =
        static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(&certificate, NID_subject_alt_name, nullptr, nullptr));
    for (int i = 0; i < sk_GENERAL_NAME_num(names); ++i) {
        const GENERAL_NAME* const name = sk_GENERAL_NAME_value(names, i);
        if (name->type == GEN_DNS) found.names.push_back(textOf(name->d.dNSName));
        if (name->type == GEN_IPADD) found.names.push_back(addressIn(textOf(name->d.iPAddress)));
        if (name->type != GEN_URI) continue;
        // Of two it would be unclear which one counts.
        const Expected<Identity> identity = parseIdentity(textOf(name->d.uniformResourceIdentifier));
        found.holder = identity && ++uris == 1 ? std::optional(*identity) : std::nullopt;
        if (!identity) ++uris;
    }
    GENERAL_NAMES_free(names);
    return found;
}

std::string serialOf(const X509& certificate) {
    const ASN1_INTEGER* const serial = X509_get0_serialNumber(&certificate);
    return hexadecimal(ASN1_STRING_get0_data(serial), static_cast<std::size_t>(ASN1_STRING_length(serial)));
}

KeyPtr freshKey() {
    KeyPtr key(EVP_EC_gen("P-256"));
    TESSERA_CHECK(key != nullptr, "OpenSSL makes no key");
    return key;
}

void extend(X509& certificate, X509& issuer, int what, const std::string& value) {
    X509V3_CTX context;
    X509V3_set_ctx_nodb(&context);
    X509V3_set_ctx(&context, &issuer, &certificate, nullptr, nullptr, 0);
    X509_EXTENSION* const extension = X509V3_EXT_conf_nid(nullptr, &context, what, value.c_str());
    TESSERA_CHECK(extension != nullptr && X509_add_ext(&certificate, extension, -1) == 1, "an extension that is none");
    X509_EXTENSION_free(extension);
}

bool nameIt(X509& certificate, const std::string& name) {
    return X509_NAME_add_entry_by_txt(X509_get_subject_name(&certificate), "CN", MBSTRING_UTF8,
                                      reinterpret_cast<const unsigned char*>(name.data()),
                                      static_cast<int>(name.size()), -1, 0) == 1;
}

/// Without issuer and extensions.
CertificatePtr freshCertificate(const std::string& kind, const std::string& commonName, EVP_PKEY& key, DateTime from,
                                DateTime until) {
    std::array<unsigned char, 16> serial{};
    TESSERA_CHECK(RAND_bytes(serial.data(), serial.size()) == 1, "OpenSSL has no randomness");
    serial[0] = static_cast<unsigned char>((serial[0] & 0x3F) | 0x40);  // positive, and of one length
    CertificatePtr certificate(X509_new());
    TESSERA_CHECK(certificate != nullptr, "OpenSSL has no memory");
    X509_set_version(certificate.get(), kVersion3);
    BIGNUM* const number = BN_bin2bn(serial.data(), serial.size(), nullptr);
    BN_to_ASN1_INTEGER(number, X509_get_serialNumber(certificate.get()));
    BN_free(number);
    ASN1_TIME_set(X509_getm_notBefore(certificate.get()), std::chrono::system_clock::to_time_t(from));
    ASN1_TIME_set(X509_getm_notAfter(certificate.get()), std::chrono::system_clock::to_time_t(until));
    X509_set_pubkey(certificate.get(), &key);
    // The common name is for people, who see it in the lists of their browsers.
    // Too long, or no UTF-8: an authority's must not be that of a server, which would look self-signed.
    if (!nameIt(*certificate, commonName)) nameIt(*certificate, kind);
    return certificate;
}

std::string pemOf(EVP_PKEY& key) {
    const BioPtr memory(BIO_new(BIO_s_mem()));
    PEM_write_bio_PrivateKey(memory.get(), &key, nullptr, nullptr, 0, nullptr, nullptr);
    return textIn(memory.get());
}
std::string pemOf(X509& certificate) {
    const BioPtr memory(BIO_new(BIO_s_mem()));
    PEM_write_bio_X509(memory.get(), &certificate);
    return textIn(memory.get());
}

/// Nothing where it is neither a host name nor an address.
std::optional<std::string> alternativeName(const std::string& name) {
    if (ASN1_OCTET_STRING* const address = a2i_IPADDRESS(name.c_str())) {
        ASN1_OCTET_STRING_free(address);
        return "IP:" + name;
    }
    const bool good = !name.empty() && name.size() <= 253 && std::ranges::all_of(name, [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '.' ||
               c == '_';
    });
    return good ? std::optional("DNS:" + name) : std::nullopt;
}

std::string nameOfAuthority(const Identity& wall) {
    return "Tessera authority of the wall " + wall.wall;
}

}  // namespace

std::string toText(DateTime time) {
    return fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::chrono::system_clock::to_time_t(time)));
}

std::string hashOfToken(std::string_view word) {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned size = 0;
    TESSERA_CHECK(EVP_Digest(word.data(), word.size(), digest.data(), &size, EVP_sha256(), nullptr) == 1,
                  "OpenSSL does not hash");
    return hexadecimal(digest.data(), size);
}

Certificate Certificate::of(const X509& certificate) {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned size = 0;
    X509_digest(&certificate, EVP_sha256(), digest.data(), &size);
    Holders holders = holdersOf(certificate);
    const bool mayIssue = X509_get_ext_by_NID(&certificate, NID_basic_constraints, -1) >= 0;
    return {.holder = mayIssue ? std::nullopt : holders.holder,
            .serial = serialOf(certificate),
            .fingerprint = hexadecimal(digest.data(), size),
            .from = timeOf(X509_get0_notBefore(&certificate)),
            .until = timeOf(X509_get0_notAfter(&certificate)),
            .names = std::move(holders.names)};
}

Expected<Certificate> Certificate::read(std::string_view pem) {
    const CertificatePtr certificate = readX509(pem);
    if (!certificate) return fail(ErrorCode::kBadInput, "holds no certificate: " + openSslWords());
    return of(*certificate);
}

struct Authority::Parts {
    KeyPtr key;
    CertificatePtr certificate;
};

Authority::Authority(std::unique_ptr<Parts> parts)
    : parts_(std::move(parts)), told_(Certificate::of(*parts_->certificate)) {}
Authority::~Authority() = default;
Authority::Authority(Authority&&) noexcept = default;
Authority& Authority::operator=(Authority&&) noexcept = default;

Authority Authority::make(const std::string& wall, DateTime now) {
    auto parts = std::make_unique<Parts>();
    parts->key = freshKey();
    const Identity named{.wall = wall, .kind = Identity::Kind::kServer, .name = {}};
    parts->certificate =
        freshCertificate("Tessera authority", nameOfAuthority(named), *parts->key, now - kBefore, now + kLives);
    X509& self = *parts->certificate;
    X509_set_issuer_name(&self, X509_get_subject_name(&self));
    extend(self, self, NID_basic_constraints, "critical,CA:TRUE,pathlen:0");
    extend(self, self, NID_key_usage, "critical,keyCertSign,cRLSign");
    extend(self, self, NID_subject_key_identifier, "hash");
    // Which wall it is for: what it signs for another one is nobody's.
    extend(self, self, NID_subject_alt_name, "URI:" + toUri(named));
    TESSERA_CHECK(X509_sign(&self, parts->key.get(), EVP_sha256()) > 0, "OpenSSL does not sign");
    Authority made(std::move(parts));
    made.wall_ = wall;
    return made;
}

Expected<Authority> Authority::read(std::string_view pem) {
    auto parts = std::make_unique<Parts>();
    parts->key.reset(PEM_read_bio_PrivateKey(memoryOf(pem).get(), nullptr, nullptr, nullptr));
    if (!parts->key) return fail(ErrorCode::kBadInput, "holds no key: " + openSslWords());
    parts->certificate = readX509(pem);
    if (!parts->certificate) return fail(ErrorCode::kBadInput, "holds no certificate: " + openSslWords());
    if (X509_check_private_key(parts->certificate.get(), parts->key.get()) != 1)
        return fail(ErrorCode::kBadInput, "its certificate is not of its key: " + openSslWords());
    const std::optional<Identity> wall = holdersOf(*parts->certificate).holder;
    if (X509_check_ca(parts->certificate.get()) != 1 || !wall)
        return fail(ErrorCode::kBadInput, "holds the key of a server, host or person, and not that of an authority");
    Authority read(std::move(parts));
    read.wall_ = wall->wall;
    return read;
}

std::string Authority::pem() const {
    return pemOf(*parts_->key) + pemOf(*parts_->certificate);
}

std::string Authority::certificatePem() const {
    return pemOf(*parts_->certificate);
}

Expected<Authority::Issued> Authority::issue(const Identity& holder, const std::vector<std::string>& names,
                                             DateTime now, std::chrono::seconds serves) const {
    if (holder.wall != wall_)
        return fail(ErrorCode::kBadInput,
                    fmt::format("the authority is that of the wall '{}', not of '{}'", wall_, holder.wall));
    std::string known = "URI:" + toUri(holder);
    for (const std::string& name : names) {
        const std::optional<std::string> good = alternativeName(name);
        if (!good) return fail(ErrorCode::kBadInput, fmt::format("'{}' is neither a host name nor an address", name));
        known += "," + *good;
    }
    if (now >= told_.until)
        return fail(ErrorCode::kRefused, fmt::format("the authority ended on {}: a new one has to be made, and all its "
                                                     "keys with it",
                                                     toText(told_.until)));
    const KeyPtr key = freshKey();
    const bool server = holder.kind == Identity::Kind::kServer;
    const CertificatePtr certificate = freshCertificate(server ? "Tessera server" : "Tessera key",
                                                        server ? "Tessera wall " + holder.wall : holder.name, *key,
                                                        now - kBefore, std::min(now + serves, told_.until));
    X509& issuer = *parts_->certificate;
    X509_set_issuer_name(certificate.get(), X509_get_subject_name(&issuer));
    extend(*certificate, issuer, NID_key_usage, "critical,digitalSignature");
    extend(*certificate, issuer, NID_ext_key_usage, server ? "serverAuth" : "clientAuth");
    extend(*certificate, issuer, NID_subject_key_identifier, "hash");
    extend(*certificate, issuer, NID_authority_key_identifier, "keyid:always");
    extend(*certificate, issuer, NID_subject_alt_name, known);
    TESSERA_CHECK(X509_sign(certificate.get(), parts_->key.get(), EVP_sha256()) > 0, "OpenSSL does not sign");
    return Issued{.certificate = Certificate::of(*certificate), .pem = pemOf(*key) + pemOf(*certificate)};
}

}  // namespace tessera
