/// Owners of what OpenSSL hands out. For the .cpp files of this folder and of who reads its headers alone.
#pragma once

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include <fmt/format.h>

#include <memory>
#include <string>
#include <string_view>

namespace tessera {

template <auto kFree>
struct OpenSslFree {
    template <typename T>
    void operator()(T* what) const {
        kFree(what);
    }
};
using BioPtr = std::unique_ptr<BIO, OpenSslFree<BIO_free_all>>;
using KeyPtr = std::unique_ptr<EVP_PKEY, OpenSslFree<EVP_PKEY_free>>;
using CertificatePtr = std::unique_ptr<X509, OpenSslFree<X509_free>>;
using SslContextPtr = std::unique_ptr<SSL_CTX, OpenSslFree<SSL_CTX_free>>;
using SslPtr = std::unique_ptr<SSL, OpenSslFree<SSL_free>>;
using SslSessionPtr = std::unique_ptr<SSL_SESSION, OpenSslFree<SSL_SESSION_free>>;

/// What went wrong last, in the library's words. Forgets what came before it.
inline std::string openSslWords() {
    const unsigned long code = ERR_peek_last_error();
    ERR_clear_error();
    const char* const reason = code == 0 ? nullptr : ERR_reason_error_string(code);
    return reason == nullptr ? fmt::format("error {:x}", code) : reason;
}

inline BioPtr memoryOf(std::string_view text) {
    return BioPtr(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}
/// The first one in this PEM; null: there is none.
inline CertificatePtr readX509(std::string_view pem) {
    return CertificatePtr(PEM_read_bio_X509(memoryOf(pem).get(), nullptr, nullptr, nullptr));
}
inline std::string textIn(BIO* memory) {
    const char* data = nullptr;
    const long size = BIO_get_mem_data(memory, &data);
    return {data, static_cast<std::size_t>(size)};
}

}  // namespace tessera
