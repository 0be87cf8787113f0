/// Values of ApplicationTracking.h in the heads of messages. Inside of the codec only.
#pragma once

#include "common/codec/ApplicationTracking.h"

namespace tessera {

class ApplicationUnpacker;
namespace proto::application {
class Trackers;
class Poses;
}  // namespace proto::application

void putTrackers(proto::application::Trackers& to, const answer::Trackers& from);
void putPoses(proto::application::Poses& to, const notice::Poses& from);
[[nodiscard]] answer::Trackers readTrackers(const proto::application::Trackers& from, ApplicationUnpacker& in);
[[nodiscard]] notice::Poses readPoses(const proto::application::Poses& from, ApplicationUnpacker& in);

}  // namespace tessera
