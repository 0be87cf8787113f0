/// Encodes and writes pictures beside the drawing: a PNG takes as long as a frame.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/base/Channel.h"
#include "common/base/LaneThreads.h"
#include "common/base/Log.h"
#include "common/image/Picture.h"

namespace tessera {

/// Owns a lane, and belongs to a thread. Few pictures wait at a time. Destruction finishes what is queued.
class PictureWriter {
public:
    static constexpr std::size_t kMostWaiting = 16;  ///< one request asks for all tiles of a host

    explicit PictureWriter(Log& log, const MakeLane& lane = LaneThreads::make);
    ~PictureWriter();
    PictureWriter(const PictureWriter&) = delete;
    PictureWriter& operator=(const PictureWriter&) = delete;

    /// Every picture that is asked for: who is ahead of the disk waits for it. Files that cannot be written are logged;
    /// the wall goes on.
    void writePng(std::string path, std::shared_ptr<const Picture> picture, std::uint64_t frame);
    /// Never waits. `done` is called on the lane, with what is encoded once for all who ask for this picture
    /// while it is not done. False: kMostWaiting others wait already, and `done` is never called.
    [[nodiscard]] bool encodePng(std::shared_ptr<const Picture> picture, std::uint64_t frame,
                                 std::function<void(SharedBytes)> done);
    /// The same as JPEG, for one who asks.
    [[nodiscard]] bool encodeJpeg(Picture picture, int quality, std::function<void(SharedBytes)> done);
    /// Waits until all is written, then stops. Whether everything could be written.
    bool finish();

private:
    using Done = std::function<void(SharedBytes)>;
    struct Job {
        std::shared_ptr<const Picture> picture;
        std::uint64_t frame = 0;
        std::shared_ptr<Channel<Done>> wanted;  ///< who is told; closed once it is encoded
        std::optional<int> jpegQuality = {};    ///< none: a PNG is made
    };
    /// As many as one answer can be wanted by.
    static constexpr std::size_t kMostAskers = 1024;

    void encode(Job& job);
    enum class Wait : bool { kNo, kForRoom };
    /// False: others wait already.
    bool add(Job job, Wait wait);
    /// What others may join: who is done with it holds no picture.
    struct Open {
        std::weak_ptr<const Picture> picture;
        std::uint64_t frame = 0;
        std::shared_ptr<Channel<Done>> wanted;
    };
    [[nodiscard]] static Job jobOf(std::shared_ptr<const Picture> picture, std::uint64_t frame, Done done);
    [[nodiscard]] static Open openOf(const Job& job) { return {job.picture, job.frame, job.wanted}; }

    Log& log_;
    Channel<char> waiting_{kMostWaiting};  ///< one for each job that has not begun
    std::deque<Open> open_;                ///< the owner's
    bool allWritten_ = true;               ///< the lane's until it has finished
    std::unique_ptr<Lane> lane_;
};

}  // namespace tessera
