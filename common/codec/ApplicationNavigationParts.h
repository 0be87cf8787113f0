/// Values of ApplicationNavigation.h and ApplicationManipulation.h in the heads of messages. Inside of the codec only.
#pragma once

#include "common/codec/ApplicationManipulation.h"
#include "common/codec/ApplicationNavigation.h"

namespace tessera {

class ApplicationUnpacker;
namespace proto::application {
class Manipulate;
class Navigate;
}

void putNavigate(proto::application::Navigate& to, const request::NavigateView& from);
/// Its input is the message's part.
[[nodiscard]] request::NavigateView readNavigate(const proto::application::Navigate& from, ApplicationUnpacker& in);

void putManipulate(proto::application::Manipulate& to, const request::Manipulate& from);
[[nodiscard]] request::Manipulate readManipulate(const proto::application::Manipulate& from, ApplicationUnpacker& in);

}  // namespace tessera
