/// Encodes and writes pictures beside the drawing: a PNG takes as long as a frame.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "client/image/Picture.h"
#include "common/base/Channel.h"
#include "common/base/Log.h"

namespace tessera {

/// Owns one thread. Few pictures wait at a time: who is ahead of the disk waits for it. Destruction finishes what is
/// queued.
class PictureWriter {
public:
    explicit PictureWriter(Log& log);
    ~PictureWriter();

    /// Files that cannot be written are logged; the wall goes on.
    void writePng(std::string path, std::shared_ptr<const Picture> picture, std::uint64_t frame);
    /// `done` is called on the writer's thread.
    void encodePng(std::shared_ptr<const Picture> picture, std::uint64_t frame, std::function<void(SharedBytes)> done);
    /// Waits until all is written, then stops. Whether everything could be written.
    bool finish();

private:
    struct Job {
        std::shared_ptr<const Picture> picture;
        std::uint64_t frame = 0;
        std::function<void(SharedBytes)> done;
    };

    void run();

    Log& log_;
    Channel<Job> jobs_;
    bool allWritten_ = true;  ///< the writer's own until it is joined
    std::thread thread_;
};

}  // namespace tessera
