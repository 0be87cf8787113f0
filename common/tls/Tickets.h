/// Sessions that may be resumed. For TlsContext.cpp and TlsChannel.cpp alone.
#pragma once

#include <map>
#include <string>

#include "common/base/Turn.h"
#include "common/tls/OpenSsl.h"

namespace tessera {

/// The last of each server that was dialled. Any thread.
class Tickets {
public:
    void put(const std::string& target, SslSessionPtr session) {
        const Turn::Hold hold = turn_.take();
        if (sessions_.size() >= kMost && !sessions_.contains(target)) sessions_.clear();
        sessions_[target] = std::move(session);
    }
    /// Each is used once: who listens could else see that two links are of one program (RFC 8446, C.4).
    [[nodiscard]] SslSessionPtr take(const std::string& target) {
        const Turn::Hold hold = turn_.take();
        const auto found = sessions_.find(target);
        if (found == sessions_.end()) return nullptr;
        SslSessionPtr session = std::move(found->second);
        sessions_.erase(found);
        return session;
    }

private:
    static constexpr std::size_t kMost = 64;

    Turn turn_;
    std::map<std::string, SslSessionPtr> sessions_;
};

}  // namespace tessera
