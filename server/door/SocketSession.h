/// A WebSocket: requests and answers as JSON, arrays and pictures as binary frames beside them.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>

#include "server/door/DoorContext.h"

namespace tessera {

/// Lives as long as its connection. With `?changes=1` it is told every list of changes, too.
void startSocketSession(boost::asio::ip::tcp::socket socket,
                        boost::beast::http::request<boost::beast::http::string_body> upgrade, const HttpTarget& target,
                        Role role, DoorContext& context);

}  // namespace tessera
