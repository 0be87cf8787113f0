/// What a context holds of OpenSSL's. For TlsContext.cpp and TlsChannel.cpp alone.
#pragma once

#include "common/tls/Tickets.h"
#include "common/tls/TlsContext.h"

namespace tessera {

struct TlsContext::Impl {
    SslContextPtr context;
    mutable Tickets tickets;
};

class TlsChannel;

/// What OpenSSL calls of the channel that an SSL belongs to.
struct TlsCallbacks {
    /// The place of a channel in its SSL; null in an SSL of somebody else's (the door's).
    static int channelIndex();
    static TlsChannel* channelOf(const SSL* ssl) {
        return static_cast<TlsChannel*>(SSL_get_ex_data(ssl, channelIndex()));
    }
    static int verify(X509_STORE_CTX* chain, void* context);
    static int addClock(SSL* ssl, unsigned type, unsigned where, const unsigned char** out, std::size_t* size,
                        X509* certificate, std::size_t index, int* alert, void* context);
    static void freeClock(SSL* ssl, unsigned type, unsigned where, const unsigned char* out, void* context);
    static int readClock(SSL* ssl, unsigned type, unsigned where, const unsigned char* in, std::size_t size,
                         X509* certificate, std::size_t index, int* alert, void* context);
    static int newSession(SSL* ssl, SSL_SESSION* session);
};

}  // namespace tessera
