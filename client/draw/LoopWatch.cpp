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
    if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
    told_.push(Watch{begun_, most, processorTime()});
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

bool LoopWatch::isOver(const Watch& watch) const {
    return clockNow() >= watch.begun + watch.most && (!onProcessor_ || processorTime() - watch.processorBefore >= watch.most / 2);
}

void LoopWatch::run() {
    constexpr std::chrono::milliseconds kLookAgain{10};
    constexpr std::chrono::hours kNever{24};
    while (const auto begun = told_.pop()) {
        if (!*begun) continue;
        const Watch watch = **begun;
        for (bool ended = false;;) {
            const Duration wait = ended ? Duration(kNever) : std::max<Duration>(watch.begun + watch.most - clockNow(), kLookAgain);
            if (told_.popFor(wait)) {
                ended_.push(ended);
                break;
            }
            if (told_.closed()) return;
            if (ended || !isOver(watch)) continue;
            ended = true;
            write(0);
        }
    }
}

}  // namespace tessera
