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

void putClone(proto::application::Clone& to, const request::CloneNode& from);
void putFind(proto::application::Find& to, const request::FindNodes& from);
void putGetTree(proto::application::GetTree& to, const request::GetTree& from);
void putLoad(proto::application::Load& to, const request::LoadFile& from);
void putMove(proto::application::Move& to, const request::MoveNode& from);
void putPicked(proto::application::Picked& to, const answer::Picked& from);

/// The ids of Find and GetTree are parts of the message.
[[nodiscard]] request::CloneNode readClone(const proto::application::Clone& from, ApplicationUnpacker& in);
[[nodiscard]] request::FindNodes readFind(const proto::application::Find& from, ApplicationUnpacker& in);
[[nodiscard]] request::GetTree readGetTree(const proto::application::GetTree& from, ApplicationUnpacker& in);
[[nodiscard]] request::LoadFile readLoad(const proto::application::Load& from, ApplicationUnpacker& in);
[[nodiscard]] request::MoveNode readMove(const proto::application::Move& from, ApplicationUnpacker& in);
[[nodiscard]] answer::Picked readPicked(const proto::application::Picked& from, ApplicationUnpacker& in);

}  // namespace tessera
