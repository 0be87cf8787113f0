/// A WebSocket: requests and answers as JSON, arrays and pictures as binary frames beside them.
#pragma once

#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>

#include "server/door/DoorContext.h"
#include "server/door/DoorStream.h"

namespace tessera {

/// Lives as long as its connection. With `?changes=1` it is told every list of changes, too.
/// `token`: that it came with; empty: it came otherwise.
void startSocketSession(DoorStream stream, boost::beast::http::request<boost::beast::http::string_body> upgrade,
                        const HttpTarget& target, const Entrant& who, std::string token, DoorContext& context);

}  // namespace tessera
