/// A request that came as JSON, asked of the server.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/json/Json.h"
#include "server/door/AnswerLanes.h"
#include "server/door/DoorLink.h"

namespace tessera {

/// What has more bytes is taken apart, and written, beside the door's thread: texts that come, answers as they come.
inline constexpr std::size_t kMostAtOnce = std::size_t{64} << 10;
/// The lane of such texts: as JSON they take sixteen times as much, and none more is read while two of them are kept.
inline const std::string kLargeTexts = "large texts";
[[nodiscard]] inline std::shared_ptr<const Json> keptWith(std::shared_ptr<const AnswerLanes::Ticket> ticket,
                                                          std::shared_ptr<const Json> json) {
    const Json* const what = json.get();
    return {what, [ticket = std::move(ticket), json = std::move(json)](const Json*) {}};
}

/// Reads `fields` as that request and asks it of the server; paths in it are looked up there first. Exactly one call of
/// `answered`, with the answer as it came (codec ApplicationCodec), unless the link is closed.
void askInJson(DoorLink& link, const std::string& request, std::shared_ptr<const Json> fields,
               std::vector<ByteSlice> binaries, std::function<void(const ApiExpected<ByteSlice>&)> answered);

}  // namespace tessera
