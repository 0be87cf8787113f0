#include "client/replica/PictureWriter.h"

namespace tessera {
namespace {

constexpr std::size_t kMaxWaitingPictures = 8;

}  // namespace

PictureWriter::PictureWriter(Log& log) : log_(log), jobs_(kMaxWaitingPictures), thread_([this] { run(); }) {}

PictureWriter::~PictureWriter() {
    (void)finish();
}

void PictureWriter::writePng(std::string path, std::shared_ptr<const Picture> picture, std::uint64_t frame) {
    encodePng(std::move(picture), frame, [this, path = std::move(path)](const SharedBytes& png) {
        if (auto written = writeFile(path, *png); !written) {
            log_.error(written.error().message);
            allWritten_ = false;
        }
    });
}

void PictureWriter::encodePng(std::shared_ptr<const Picture> picture, std::uint64_t frame,
                              std::function<void(SharedBytes)> done) {
    jobs_.push({.picture = std::move(picture), .frame = frame, .done = std::move(done)});
}

bool PictureWriter::finish() {
    jobs_.close();
    if (thread_.joinable()) thread_.join();
    return allWritten_;
}

void PictureWriter::run() {
    while (const auto job = jobs_.pop()) job->done(share(tessera::encodePng(*job->picture, job->frame)));
}

}  // namespace tessera
