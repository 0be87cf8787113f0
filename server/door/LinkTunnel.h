/// The native link inside a WebSocket: for programs that have a page's link and no way to the server's port.
#pragma once

#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>

#include "server/door/DoorContext.h"
#include "server/door/DoorStream.h"

namespace tessera {

/// `who` came with the WebSocket, by `token`; empty: by none. Render hosts do not come in so.
///
/// Binary messages carry the bytes of proto/WIRE.md in both directions; where one ends means nothing. Each channel of
/// the link is a WebSocket. Who comes in as what the link's own Hello says: the server looks at its token as ever. What
/// one side does not read the other is not asked for, so that a slow reader waits for itself.
void startLinkTunnel(DoorStream stream, boost::beast::http::request<boost::beast::http::string_body> upgrade,
                     const Entrant& who, std::string token, DoorContext& context);

}  // namespace tessera
