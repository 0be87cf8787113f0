#include "common/session/Messages.h"

#include <array>

namespace tessera {

std::string_view nameOf(const Message& message) {
    static constexpr std::array<std::string_view, std::variant_size_v<Message>> kNames = {
        "Heartbeat",  "Hello",     "Synced",    "Ready",        "Shown",    "BlobsHeld", "BlobRequest", "HashAnswer",
        "TileImage",  "Request",   "Welcome",   "Refused",      "Snapshot", "Changes",   "Begin",       "Swap",
        "BlobNotice", "BlobChunk", "HashQuery", "ImageRequest", "Reply",    "Notice",    "Over"};
    return kNames[message.index()];
}

}  // namespace tessera
