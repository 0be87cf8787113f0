#include "client/draw/shaders/LoopWatch.h"

#include <ctime>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "client/draw/shaders/PersonText.h"
#include "common/base/StartThread.h"

namespace tessera {
namespace {

namespace fs = std::filesystem;

/// Linux's clock of a thread by its number, as pthread_getcpuclockid makes it of a handle.
clockid_t processorClockOf(int thread) {
    return static_cast<clockid_t>(~static_cast<unsigned>(thread) << 3u | 6u);
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
    told_.close();
    if (thread_.joinable()) thread_.join();
    gl_.DeleteBuffers(1, &buffer_);
}

void LoopWatch::write(std::int32_t rounds) const {
    if (rounds_) std::atomic_ref(*rounds_).store(rounds);
}

void LoopWatch::begin(Duration most) {
    begun_ = clockNow();
    watching_ = rounds_ != nullptr;
    if (!watching_) return;
    if (!thread_.joinable()) thread_ = startThread([this] { run(); });
    if (!thread_.joinable()) {
        watching_ = false;  // the next one may find room again
        return;
    }
    told_.push(Watch{begun_, most});
}

Duration LoopWatch::end() {
    const Duration took = clockNow() - begun_;
    if (!std::exchange(watching_, false)) return {};
    told_.push(std::nullopt);
    stopped_ = ended_.pop().value_or(false) || stopped_;
    return took;
}

void LoopWatch::letGo() {
    stopped_ = false;
    write(kMostPersonRounds);
}

LoopWatch::ThreadTimes LoopWatch::threadTimes() {
    ThreadTimes times;
    std::error_code failed;
    for (fs::directory_iterator entry("/proc/self/task", failed), end; !failed && entry != end;
         entry.increment(failed)) {
        const int thread = std::atoi(entry->path().filename().c_str());
        timespec now{};
        if (::clock_gettime(processorClockOf(thread), &now) == 0)
            times[thread] = std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
    }
    return times;
}

bool LoopWatch::isOver(const Watch& watch, const ThreadTimes& before) const {
    if (clockNow() < watch.begun + watch.most) return false;
    if (!onProcessor_) return true;
    return std::ranges::any_of(threadTimes(), [&](const auto& entry) {
        const auto known = before.find(entry.first);
        return entry.second - (known == before.end() ? Duration{} : known->second) >= watch.most / 2;
    });
}

void LoopWatch::run() {
    constexpr std::chrono::milliseconds kLookAgain{10};
    constexpr std::chrono::hours kNever{24};
    while (const auto begun = told_.pop()) {
        if (!*begun) continue;
        const Watch watch = **begun;
        const ThreadTimes before = onProcessor_ ? threadTimes() : ThreadTimes();
        for (bool ended = false;;) {
            const Duration wait =
                ended ? Duration(kNever) : std::max<Duration>(watch.begun + watch.most - clockNow(), kLookAgain);
            if (told_.popFor(wait)) {
                ended_.push(ended);
                break;
            }
            if (told_.closed()) return;
            if (ended || !isOver(watch, before)) continue;
            ended = true;
            write(0);
        }
    }
}

}  // namespace tessera
