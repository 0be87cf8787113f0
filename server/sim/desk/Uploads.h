/// Puts the arrays together that applications send in pieces, off the frame thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "common/base/BlobMaker.h"
#include "common/base/LaneThreads.h"
#include "common/session/ServerSession.h"

namespace tessera {

/// What has come before a proposal: its arrays, each proved to be what its name says. Or why not.
struct UploadFinished {
    std::uint64_t upload = 0;
    Expected<std::vector<Blob>> blobs;
};

/// Owns a lane, which copies each piece to its place and hashes it there, with the lowest priority that there is.
/// `onFinished` is called on it. Everything else is for the frame thread, which looks at no byte of an array and waits
/// for nobody.
class Uploads {
public:
    struct Limits {
        std::uint64_t maxBytes = limits::kMaxUploadBytes;  ///< of one proposal
        std::size_t maxBlobs = 65'536;                     ///< likewise
        /// Of all applications together: announced and not yet handed over; and come and not yet handed over or thrown
        /// away.
        std::uint64_t maxBytesOfAll = 4 * std::uint64_t{limits::kMaxUploadBytes};
        /// Pieces that wait for the lane.
        std::size_t maxPieces = 65'536;
    };
    Uploads(std::function<void(UploadFinished)> onFinished, const Limits& limits,
            const MakeLane& lane = LaneThreads::make);
    explicit Uploads(std::function<void(UploadFinished)> onFinished, const MakeLane& lane = LaneThreads::make)
        : Uploads(std::move(onFinished), Limits(), lane) {}

    void take(ConnectionId connection, const message::Upload& piece);
    /// What has come of this application belongs to the proposal that is here now; its end follows by `onFinished`.
    /// Number 0: nothing has come. kLimit: it was too much.
    struct Closed {
        std::uint64_t upload = 0, bytes = 0;
    };
    [[nodiscard]] Expected<Closed> close(ConnectionId connection);
    /// It is nobody's: the application has gone, or its proposal is refused.
    void drop(ConnectionId connection);
    /// After `onFinished`: it needs no room here any more.
    void handedOver(std::uint64_t upload);
    /// Lets go of these. Where nobody else holds them they are freed here: that takes a large one longer than a frame
    /// has.
    void letGo(std::vector<Blob> blobs);
    void letGo(std::vector<std::shared_ptr<const void>> unneeded);

private:
    /// The lane's.
    struct Assembly {
        std::deque<BlobInfo> expected;  ///< the first is being put together
        std::optional<BlobMaker> first;
        std::uint64_t filled = 0;  ///< of it
        std::vector<Blob> whole;
        std::uint64_t held = 0;  ///< bytes that have come and are here
        std::optional<Error> error;
    };
    void put(std::uint64_t upload, const message::Upload& piece);
    void finishUpload(std::uint64_t upload, bool wanted);
    static void add(Assembly& assembly, const message::Upload& piece);
    [[nodiscard]] static Expected<std::vector<Blob>> finish(Assembly assembly);

    /// The frame thread's: what comes of an application now.
    struct Coming {
        std::uint64_t upload = 0, bytes = 0, sent = 0;
        std::size_t blobs = 0;
        std::optional<Error> refused;  ///< what follows is thrown away
    };
    [[nodiscard]] std::optional<Error> tooMuch(const Coming& coming, const message::Upload& piece) const;

    Limits limits_;
    std::function<void(UploadFinished)> onFinished_;
    std::map<ConnectionId, Coming> coming_;
    std::unordered_map<std::uint64_t, std::uint64_t> claimed_;  ///< bytes, by upload
    std::uint64_t claimedBytes_ = 0, lastUpload_ = 0;
    std::atomic<std::size_t> waiting_{0};                     ///< pieces
    std::atomic<std::uint64_t> held_{0};                      ///< bytes of these, and of what is being put together
    std::unordered_map<std::uint64_t, Assembly> assemblies_;  ///< the lane's
    std::unique_ptr<Lane> lane_;                              ///< last
};

}  // namespace tessera
