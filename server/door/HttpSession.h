/// One connection of a door: requests over HTTP, one after the other, until it becomes a socket.
#pragma once

#include "server/door/DoorStream.h"
#include "server/door/Routes.h"

namespace tessera {

/// Lives as long as its connection.
void startHttpSession(boost::asio::ip::tcp::socket socket, SourceAddress from, DoorContext& context);
/// That as many connections are open as may be: without waiting for anybody. Nothing more can be said afterwards.
void sayTooMany(DoorStream& stream, const DoorContext& context);

}  // namespace tessera
