/// Records that no library would send: a peer that has shaken hands, and seals what it likes.
#include <gtest/gtest.h>
#include <openssl/hmac.h>

#include <array>
#include <cstdint>
#include <random>
#include <string>

#include "WallOfKeys.h"
#include "common/tls/OpenSsl.h"
#include "common/tls/TlsChannel.h"

namespace tessera {
namespace {

using test::WallOfKeys;

constexpr std::uint8_t kAlert = 21, kHandshake = 22, kContent = 23;

/// Shakes hands by OpenSSL; its records it seals by itself (RFC 8446, 5.2 and 7.3).
class HandmadePeer {
public:
    explicit HandmadePeer(TlsChannel& server) : server_(server), context_(SSL_CTX_new(TLS_client_method())) {
        SSL_CTX_set_ciphersuites(context_.get(), "TLS_AES_128_GCM_SHA256");
        SSL_CTX_set_app_data(context_.get(), this);
        SSL_CTX_set_keylog_callback(context_.get(), [](const SSL* ssl, const char* line) {
            static_cast<HandmadePeer*>(SSL_CTX_get_app_data(SSL_get_SSL_CTX(ssl)))->takeSecret(line);
        });
        ssl_.reset(SSL_new(context_.get()));
        in_ = BIO_new(BIO_s_mem());
        out_ = BIO_new(BIO_s_mem());
        SSL_set_bio(ssl_.get(), in_, out_);
        SSL_set_connect_state(ssl_.get());
        while (!server_.ready()) {
            SSL_do_handshake(ssl_.get());
            Bytes wire(BIO_ctrl_pending(out_));
            if (wire.empty()) return;
            BIO_read(out_, wire.data(), static_cast<int>(wire.size()));
            server_.arrived(wire);
            if (!server_.shake()) return;
            server_.keep();
            Bytes& answer = server_.outgoing();
            if (!answer.empty()) BIO_write(in_, answer.data(), static_cast<int>(answer.size()));
            answer.clear();
        }
        key_ = expanded("key", 16);
        nonce_ = expanded("iv", 12);
    }
    [[nodiscard]] bool open() const { return server_.ready() && !secret_.empty(); }

    [[nodiscard]] Bytes record(std::uint8_t kind, std::string content) {
        content += static_cast<char>(kind);
        const std::size_t size = content.size() + kTag;
        std::string sealed{'\x17', '\x03', '\x03', static_cast<char>(size >> 8), static_cast<char>(size & 0xff)};
        std::string nonce = nonce_;
        for (std::size_t i = 0; i < 8; ++i) nonce[11 - i] ^= static_cast<char>(number_ >> (8 * i));
        ++number_;
        const std::unique_ptr<EVP_CIPHER_CTX, OpenSslFree<EVP_CIPHER_CTX_free>> cipher(EVP_CIPHER_CTX_new());
        std::string body(content.size(), '\0'), tag(kTag, '\0');
        int done = 0;
        EVP_EncryptInit_ex(cipher.get(), EVP_aes_128_gcm(), nullptr, raw(key_), raw(nonce));
        EVP_EncryptUpdate(cipher.get(), nullptr, &done, raw(sealed), static_cast<int>(sealed.size()));
        EVP_EncryptUpdate(cipher.get(), raw(body), &done, raw(content), static_cast<int>(content.size()));
        EVP_EncryptFinal_ex(cipher.get(), nullptr, &done);
        EVP_CIPHER_CTX_ctrl(cipher.get(), EVP_CTRL_GCM_GET_TAG, kTag, tag.data());
        sealed += body + tag;
        const auto* const bytes = reinterpret_cast<const std::byte*>(sealed.data());
        return {bytes, bytes + sealed.size()};
    }

private:
    static constexpr int kTag = 16;
    static unsigned char* raw(std::string& text) { return reinterpret_cast<unsigned char*>(text.data()); }

    void takeSecret(const std::string& line) {
        if (!line.starts_with("CLIENT_TRAFFIC_SECRET_0 ")) return;
        const std::string hex = line.substr(line.rfind(' ') + 1);
        for (std::size_t at = 0; at + 1 < hex.size(); at += 2)
            secret_ += static_cast<char>(std::stoi(hex.substr(at, 2), nullptr, 16));
    }
    [[nodiscard]] std::string expanded(const std::string& label, std::uint8_t size) {
        const std::string said = "tls13 " + label;
        std::string info{'\0', static_cast<char>(size), static_cast<char>(said.size())};
        info += said + '\0' + '\1';
        std::array<unsigned char, EVP_MAX_MD_SIZE> hash{};
        HMAC(EVP_sha256(), secret_.data(), static_cast<int>(secret_.size()), raw(info), info.size(), hash.data(),
             nullptr);
        return {reinterpret_cast<const char*>(hash.data()), size};
    }

    TlsChannel& server_;
    SslContextPtr context_;
    SslPtr ssl_;
    BIO *in_ = nullptr, *out_ = nullptr;  // the SSL's
    std::string secret_, key_, nonce_;
    std::uint64_t number_ = 0;
};

std::shared_ptr<const TlsContext> recordsContext() {
    static const WallOfKeys keys;
    static const auto context = test::contextOf(keys.keysOf(keys.server()));
    return context;
}

const std::string kKeyUpdate{"\x18\0\0\1\0", 5};

Expected<std::size_t> readAll(TlsChannel& server, ByteSpan wire) {
    server.arrived(wire);
    std::size_t all = 0;
    Bytes room(4000);
    for (;;) {
        const Expected<std::size_t> count = server.read(room);
        if (!count) return count;
        if (*count == 0) break;
        all += *count;
    }
    server.keep();
    return all;
}

TEST(TlsRecords, OfContentAreRead) {
    TlsChannel server(recordsContext(), TlsChannel::Side::kAccepts);
    HandmadePeer peer(server);
    ASSERT_TRUE(peer.open());
    EXPECT_EQ(readAll(server, peer.record(kContent, "hello")).value_or(0), 5u);
    EXPECT_EQ(readAll(server, peer.record(kHandshake, kKeyUpdate)).value_or(9), 0u);
    EXPECT_TRUE(server.seal(asBytes("answer")));
}

/// Behind its head OpenSSL would be within a handshake until the rest has come, and seal nothing.
TEST(TlsRecords, AMessageOfTlsThatComesInPiecesEndsTheLinkOrIsAnswered) {
    constexpr std::size_t kHead = 4;
    for (std::size_t size = 1; size < kKeyUpdate.size(); ++size) {
        TlsChannel server(recordsContext(), TlsChannel::Side::kAccepts);
        HandmadePeer peer(server);
        ASSERT_TRUE(peer.open());
        Bytes wire = peer.record(kContent, "hello");
        const Bytes piece = peer.record(kHandshake, kKeyUpdate.substr(0, size));
        wire.insert(wire.end(), piece.begin(), piece.end());
        const Expected<std::size_t> came = readAll(server, wire);
        EXPECT_EQ(!came, size >= kHead) << size;
        if (!came) {
            EXPECT_EQ(came.error().code, ErrorCode::kNetwork);
        }
        const Expected<void> sealed = server.seal(asBytes("answer"));
        EXPECT_EQ(sealed.has_value(), came.has_value()) << size;
    }
}

/// Whatever comes: who is still read can be answered.
TEST(TlsRecords, OfAnyKindAndContentLeaveAChannelThatReadsAndSealsOrSaysWhyNot) {
    const char* const only = std::getenv("TESSERA_SEED");
    const unsigned first = only ? static_cast<unsigned>(std::stoul(only)) : 1;
    std::size_t refused = 0;
    for (unsigned seed = first; seed < first + (only ? 1 : 500); ++seed) {
        SCOPED_TRACE("TESSERA_SEED=" + std::to_string(seed));
        std::mt19937 random(seed);
        const auto below = [&](unsigned n) { return random() % n; };
        TlsChannel server(recordsContext(), TlsChannel::Side::kAccepts);
        HandmadePeer peer(server);
        ASSERT_TRUE(peer.open());
        for (unsigned step = 1 + below(6); step > 0; --step) {
            std::string content = kKeyUpdate.substr(0, below(6));
            if (below(3) == 0) content = std::string{static_cast<char>(1 + below(2)), static_cast<char>(below(120))};
            if (below(3) == 0)
                for (unsigned size = below(40); size > 0; --size) content += static_cast<char>(random());
            const std::array<std::uint8_t, 6> kinds{20,         kAlert,   kHandshake,
                                                    kHandshake, kContent, static_cast<std::uint8_t>(below(256))};
            Bytes wire = peer.record(kinds[below(kinds.size())], content);
            const std::size_t cut = below(static_cast<unsigned>(wire.size()));
            Expected<std::size_t> came = readAll(server, ByteSpan(wire).first(cut));
            if (came) came = readAll(server, ByteSpan(wire).subspan(cut));
            const Expected<void> sealed = server.seal(asBytes("answer"));
            EXPECT_TRUE(!came || sealed) << sealed.error().message;
            if (came) continue;
            ++refused;
            break;
        }
        server.end();
    }
    EXPECT_TRUE(only || refused > 100) << refused;
}

}  // namespace
}  // namespace tessera
