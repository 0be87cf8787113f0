/// Bodies of HTTP that are too large to be held: from a connection to the disk, and from the disk to a connection.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/door/DoorContext.h"
#include "server/door/HttpMessage.h"

namespace tessera {

class DoorStream;

/// Through one buffer of kPiece, written beside the door's thread; what comes meanwhile waits in the kernel. `file`
/// ends there, too. `came`: the beginning of the body, which has been read already. Each piece has to come within
/// `DoorLimits::pieceWait`: who stops is told so. `then` is called once, unless the peer has gone: where the file
/// is, whole, or what is wrong. `guest` owns `stream`.
void receiveFile(std::shared_ptr<Guest> guest, DoorStream& stream, DoorContext& context,
                 std::shared_ptr<UploadFolder::Incoming> file, std::string came, std::uint64_t length,
                 std::function<void(const tl::expected<std::string, HttpAnswer>& path)> then);

/// The same the other way round, behind a head that is sent. `then`: whether all of it is.
void sendFile(std::shared_ptr<Guest> guest, DoorStream& stream, DoorContext& context,
              std::shared_ptr<const AnswerFile> file, std::function<void(bool sent)> then);

}  // namespace tessera
