#include "client/replica/PictureWriter.h"

#include <algorithm>
#include <utility>

namespace tessera {

PictureWriter::PictureWriter(Log& log) : log_(log), thread_([this] { run(); }) {}

PictureWriter::~PictureWriter() {
    (void)finish();
}

void PictureWriter::add(Job job) {
    jobs_.push_back(std::move(job));
    filled_.notify_one();
}

void PictureWriter::writePng(std::string path, std::shared_ptr<const Picture> picture, std::uint64_t frame) {
    Job job{.picture = std::move(picture), .frame = frame, .done = {}};
    job.done.emplace_back([this, path = std::move(path)](const SharedBytes& png) {
        if (auto written = writeFile(path, *png); !written) {
            log_.error(written.error().message);
            allWritten_ = false;
        }
    });
    std::unique_lock lock(mutex_);
    room_.wait(lock, [this] { return closed_ || jobs_.size() < kMostWaiting; });
    if (!closed_) add(std::move(job));
}

bool PictureWriter::encodePng(std::shared_ptr<const Picture> picture, std::uint64_t frame, std::function<void(SharedBytes)> done) {
    const std::scoped_lock lock(mutex_);
    if (closed_) return false;
    const auto same = std::ranges::find_if(jobs_, [&](const Job& job) { return job.picture == picture && job.frame == frame; });
    if (same != jobs_.end()) {
        same->done.push_back(std::move(done));
        return true;
    }
    if (jobs_.size() >= kMostWaiting) return false;
    Job job{.picture = std::move(picture), .frame = frame, .done = {}};
    job.done.push_back(std::move(done));
    add(std::move(job));
    return true;
}

bool PictureWriter::finish() {
    {
        const std::scoped_lock lock(mutex_);
        closed_ = true;
    }
    room_.notify_all();
    filled_.notify_all();
    if (thread_.joinable()) thread_.join();
    return allWritten_;
}

void PictureWriter::run() {
    std::unique_lock lock(mutex_);
    for (;;) {
        filled_.wait(lock, [this] { return closed_ || !jobs_.empty(); });
        if (jobs_.empty()) return;
        const std::shared_ptr<const Picture> picture = jobs_.front().picture;
        const std::uint64_t frame = jobs_.front().frame;
        lock.unlock();
        const SharedBytes png = share(tessera::encodePng(*picture, frame));
        lock.lock();
        // Whoever asked meanwhile is told, too.
        const auto done = std::move(jobs_.front().done);
        jobs_.pop_front();
        room_.notify_one();
        lock.unlock();
        for (const auto& tell : done) tell(png);
        lock.lock();
    }
}

}  // namespace tessera
