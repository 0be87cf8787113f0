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
/// The lane of such texts while they are read. As JSON they take sixteen times as much, which counts as brought.
inline const std::string kLargeTexts = "large texts";
/// Counts until nobody holds it. Null: too much is there already.
[[nodiscard]] inline std::shared_ptr<const void> roomFor(std::size_t textBytes, std::size_t& brought,
                                                         std::size_t most) {
    constexpr std::size_t kOfAByte = 16;
    const std::size_t bytes = kOfAByte * textBytes;
    if (brought + bytes > most) return nullptr;
    brought += bytes;
    return {&brought, [bytes](const void* all) {
                *const_cast<std::size_t*>(static_cast<const std::size_t*>(all)) -= bytes;
            }};
}
[[nodiscard]] inline std::shared_ptr<const Json> keptWith(std::shared_ptr<const void> room,
                                                          std::shared_ptr<const Json> json) {
    const Json* const what = json.get();
    return {what, [room = std::move(room), json = std::move(json)](const Json*) {}};
}

/// Reads `fields` as that request and asks it of the server; paths in it are looked up there first. Exactly one call of
/// `answered`, with the answer as it came (codec ApplicationCodec), unless the link is closed.
void askInJson(DoorLink& link, const std::string& request, std::shared_ptr<const Json> fields,
               std::vector<ByteSlice> binaries, std::function<void(const ApiExpected<ByteSlice>&)> answered);

}  // namespace tessera
