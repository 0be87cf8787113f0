/// How a server's status lies in a message.
#pragma once

#include "common/codec/ApplicationCodec.h"
#include "common/codec/ApplicationUnpacker.h"
#include "proto/application.pb.h"

namespace tessera {

void putStatus(proto::application::Status& to, const answer::Status& status);
/// What is wrong with it the unpacker is told.
[[nodiscard]] answer::Status readStatus(const proto::application::Status& from, ApplicationUnpacker& in);

}  // namespace tessera
