/// A door to a running wall for programs of every language: HTTP, and WebSockets at /socket.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/base/AccessToken.h"
#include "common/net/Transport.h"
#include "server/door/Gatekeeper.h"
#include "server/door/UploadFolder.h"

namespace tessera {

struct DoorOptions {
    Address listen;          ///< on loopback, or where `reach` says who comes from elsewhere
    Address server;          ///< where applications dial in
    std::string wall;        ///< the wall's name, for people
    AccessTokens tokens;     ///< whoever has one may come in
    std::string owner = {};  ///< whose tokens they are, for people
    DoorReach reach = {};
    std::vector<DoorPanel> panels = {};
    std::function<void(const std::string&)> tell = {};  ///< what people should know, on the door's thread; may be empty
    std::shared_ptr<UploadFolder> uploads = {};         ///< null: nobody brings files
    /// Told of each file that somebody has brought, or removed, on the door's thread; may be empty.
    std::function<void(const Entrant& who, std::string_view did, const std::string& path)> onFile = {};
};

/// Has a thread of its own at nice 10: no frame waits for it. Towards the server each socket is an application like
/// others.
class Door {
public:
    /// kUsage: not on loopback, without keys; kNetwork: the port is taken, or no such address.
    [[nodiscard]] static Expected<std::unique_ptr<Door>> open(const DoorOptions& options);
    /// Sends everybody away.
    ~Door();
    Door(const Door&) = delete;
    Door& operator=(const Door&) = delete;

    [[nodiscard]] const Address& address() const;
    /// Returns `http://127.0.0.1:7001/?token=…`; with keys `https://…/?token=…&authority=SHA256`, by which a program
    /// knows the wall's authority.
    [[nodiscard]] std::string linkWith(const std::string& token) const;
    /// Lets in by these tokens from now on. Whoever came in by another one is sent away at the next look
    /// (`DoorReach::look`). The door's own token stays.
    void renew(AccessTokens tokens, std::vector<DoorPanel> panels);

private:
    struct Impl;
    explicit Door(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
