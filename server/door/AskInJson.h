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
/// Counts as brought until nobody holds it.
class TextRoom {
public:
    static constexpr std::size_t kOfAByte = 16;
    TextRoom(std::size_t& brought, std::size_t bytes) : brought_(brought), bytes_(bytes) { brought_ += bytes_; }
    ~TextRoom() { brought_ -= bytes_; }
    TextRoom(const TextRoom&) = delete;
    TextRoom& operator=(const TextRoom&) = delete;

private:
    std::size_t& brought_;
    const std::size_t bytes_;
};
/// Null: too much is there already.
[[nodiscard]] inline std::shared_ptr<const TextRoom> roomFor(std::size_t textBytes, std::size_t& brought,
                                                             std::size_t most) {
    const std::size_t bytes = TextRoom::kOfAByte * textBytes;
    return brought + bytes > most ? nullptr : std::make_shared<const TextRoom>(brought, bytes);
}
[[nodiscard]] inline std::shared_ptr<const Json> keptWith(std::shared_ptr<const TextRoom> room,
                                                          std::shared_ptr<const Json> json) {
    const Json* const what = json.get();
    return {what, [room = std::move(room), json = std::move(json)](const Json*) {}};
}

/// Reads `fields` as that request and asks it of the server; paths in it are looked up there first. Exactly one call of
/// `answered`, with the answer as it came (codec ApplicationCodec), unless the link is closed. `from`: as a DoorLink
/// takes it.
void askInJson(DoorLink& link, const std::string& request, std::shared_ptr<const Json> fields,
               std::vector<ByteSlice> binaries, std::function<void(const ApiExpected<ByteSlice>&)> answered,
               const std::string& from = {});

}  // namespace tessera
