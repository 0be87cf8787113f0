#include "client/draw/LoopWatch.h"

#include <ctime>

#include <algorithm>
#include <array>
#include <atomic>
#include <utility>

#include "client/draw/PersonText.h"

namespace tessera {
namespace {

Duration processorTime() {
    timespec now{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

}  // namespace

LoopWatch::LoopWatch(GlState& gl, bool onProcessor) : gl_(gl), onProcessor_(onProcessor) {
    constexpr GLbitfield kShared = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
    constexpr std::array<std::int32_t, 4> kAtFirst{kMostPersonRounds, 0, 0, 0};
    gl_.CreateBuffers(1, &buffer_);
    gl_.NamedBufferStorage(buffer_, sizeof kAtFirst, kAtFirst.data(), kShared);
    rounds_ = static_cast<std::int32_t*>(gl_.MapNamedBufferRange(buffer_, 0, sizeof kAtFirst, kShared));
}

LoopWatch::~LoopWatch() {
    {
        const std::lock_guard lock(mutex_);
        quit_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
    gl_.DeleteBuffers(1, &buffer_);
}

void LoopWatch::write(std::int32_t rounds) const {
    if (rounds_) std::atomic_ref(*rounds_).store(rounds);
}

void LoopWatch::begin(Duration most) {
    if (!rounds_) return;
    if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
    {
        const std::lock_guard lock(mutex_);
        watching_ = true;
        begun_ = clockNow();
        most_ = most;
        processorBefore_ = processorTime();
    }
    changed_.notify_all();
}

Duration LoopWatch::end() {
    const std::lock_guard lock(mutex_);
    const Duration took = std::exchange(watching_, false) ? clockNow() - begun_ : Duration::zero();
    changed_.notify_all();
    stopped_ = stoppedNow_;
    return took;
}

void LoopWatch::letGo() {
    const std::lock_guard lock(mutex_);
    stopped_ = stoppedNow_ = false;
    write(kMostPersonRounds);
}

bool LoopWatch::isOver(TimePoint now) const {
    return now >= begun_ + most_ && (!onProcessor_ || processorTime() - processorBefore_ >= most_ / 2);
}

void LoopWatch::run() {
    constexpr std::chrono::milliseconds kLookAgain{10};
    std::unique_lock lock(mutex_);
    while (!quit_) {
        if (!watching_ || stoppedNow_) {
            changed_.wait(lock);
            continue;
        }
        const TimePoint now = clockNow();
        if (isOver(now)) {
            stoppedNow_ = true;
            write(0);
            continue;
        }
        changed_.wait_until(lock, std::max(begun_ + most_, now + kLookAgain));
    }
}

}  // namespace tessera
