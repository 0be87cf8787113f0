#include "client/replica/PictureWriter.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace tessera {

PictureWriter::PictureWriter(Log& log, const MakeLane& lane) : log_(log), lane_(lane({})) {}

PictureWriter::~PictureWriter() {
    (void)finish();
}

PictureWriter::Job PictureWriter::jobOf(std::shared_ptr<const Picture> picture, std::uint64_t frame, Done done) {
    Job job{.picture = std::move(picture), .frame = frame, .wanted = std::make_shared<Channel<Done>>(kMostAskers)};
    (void)job.wanted->tryPush(std::move(done));
    return job;
}

void PictureWriter::writePng(std::string path, std::shared_ptr<const Picture> picture, std::uint64_t frame) {
    std::erase_if(open_, [](const Open& job) { return job.wanted->closed(); });
    Job job = jobOf(std::move(picture), frame, [this, path = std::move(path)](const SharedBytes& png) {
        if (auto written = writeFile(path, *png); !written) {
            log_.error(written.error().message);
            allWritten_ = false;
        }
    });
    open_.push_back(openOf(job));
    add(std::move(job), Wait::kForRoom);
}

bool PictureWriter::encodePng(std::shared_ptr<const Picture> picture, std::uint64_t frame,
                              std::function<void(SharedBytes)> done) {
    std::erase_if(open_, [](const Open& job) { return job.wanted->closed(); });
    const auto same = std::ranges::find_if(
        open_, [&](const Open& job) { return job.frame == frame && job.picture.lock() == picture; });
    if (same != open_.end() && same->wanted->tryPush(done)) return true;
    Job job = jobOf(std::move(picture), frame, std::move(done));
    Open open = openOf(job);
    if (!add(std::move(job), Wait::kNo)) return false;
    open_.push_back(std::move(open));
    return true;
}

bool PictureWriter::encodeJpeg(Picture picture, int quality, std::function<void(SharedBytes)> done) {
    Job job = jobOf(std::make_shared<const Picture>(std::move(picture)), 0, std::move(done));
    job.jpegQuality = quality;
    return add(std::move(job), Wait::kNo);
}

bool PictureWriter::add(Job job, Wait wait) {
    if (!(wait == Wait::kForRoom ? waiting_.push(0) : waiting_.tryPush(0))) return false;
    lane_->post([this, job = std::make_shared<Job>(std::move(job))] {
        (void)waiting_.tryPop();
        encode(*job);
    });
    return true;
}

bool PictureWriter::finish() {
    lane_->finish();
    return allWritten_;
}

void PictureWriter::encode(Job& job) {
    const SharedBytes encoded = share(job.jpegQuality ? tessera::encodeJpeg(*job.picture, *job.jpegQuality)
                                                      : tessera::encodePng(*job.picture, job.frame));
    // Whoever asked meanwhile is told, too; whoever comes now has another one.
    job.picture.reset();
    job.wanted->close();
    while (const auto done = job.wanted->tryPop()) (*done)(encoded);
}

}  // namespace tessera
