/// Values of ApplicationNavigation.h in the heads of messages. Inside of the codec only.
#pragma once

#include "common/codec/ApplicationNavigation.h"

namespace tessera {

class ApplicationUnpacker;
namespace proto::application {
class Navigate;
}

void putNavigate(proto::application::Navigate& to, const request::Navigate& from);
/// Its input is the message's part.
[[nodiscard]] request::Navigate readNavigate(const proto::application::Navigate& from, ApplicationUnpacker& in);

}  // namespace tessera
