/// What applications ask of the scene, and what a pick has found, in the heads of messages. Inside of the codec only.
#pragma once

#include "common/codec/ApplicationCodec.h"

namespace tessera {

class ApplicationUnpacker;
namespace proto::application {
class Clone;
class Find;
class GetTree;
class Load;
class Move;
class Picked;
}  // namespace proto::application

void putClone(proto::application::Clone& to, const request::Clone& from);
void putFind(proto::application::Find& to, const request::Find& from);
void putGetTree(proto::application::GetTree& to, const request::GetTree& from);
void putLoad(proto::application::Load& to, const request::Load& from);
void putMove(proto::application::Move& to, const request::Move& from);
void putPicked(proto::application::Picked& to, const answer::Picked& from);

/// The ids of Find and GetTree are parts of the message.
[[nodiscard]] request::Clone readClone(const proto::application::Clone& from, ApplicationUnpacker& in);
[[nodiscard]] request::Find readFind(const proto::application::Find& from, ApplicationUnpacker& in);
[[nodiscard]] request::GetTree readGetTree(const proto::application::GetTree& from, ApplicationUnpacker& in);
[[nodiscard]] request::Load readLoad(const proto::application::Load& from, ApplicationUnpacker& in);
[[nodiscard]] request::Move readMove(const proto::application::Move& from, ApplicationUnpacker& in);
[[nodiscard]] answer::Picked readPicked(const proto::application::Picked& from, ApplicationUnpacker& in);

}  // namespace tessera
