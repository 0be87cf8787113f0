#include "client/output/ShownFrames.h"

#include <algorithm>

namespace tessera {

namespace {

using SteadyClock = std::chrono::steady_clock;
using std::chrono::milliseconds;

}  // namespace

Expected<ShownFrames> ShownFrames::open(const std::vector<std::string>& paths) {
    ShownFrames shown;
    for (const std::string& path : paths) {
        auto reader = SharedFrameReader::open(path);
        if (!reader) return tl::unexpected(reader.error());
        shown.readers_.push_back(std::move(*reader));
    }
    return shown;
}

bool ShownFrames::replaced() const {
    return std::ranges::any_of(readers_, [](const SharedFrameReader& reader) { return reader.replaced(); });
}

bool ShownFrames::readAll() {
    frames_.clear();
    for (SharedFrameReader& reader : readers_) {
        const auto frame = reader.read();
        if (!frame || (!frames_.empty() && frame->number != frames_[0].number)) return false;
        frames_.push_back(*frame);
    }
    lastTimes_ = frames_[0].times;
    lastNumber_ = frames_[0].number;
    return true;
}

const std::vector<SharedFrameReader::Frame>* ShownFrames::again() {
    return readAll() ? &frames_ : nullptr;
}

const std::vector<SharedFrameReader::Frame>* ShownFrames::next(milliseconds atMost) {
    if (readers_.size() == 1) return readers_[0].waitForOther(lastTimes_, atMost) && readAll() ? &frames_ : nullptr;
    for (const auto end = SteadyClock::now() + atMost;;) {
        const SharedFrameReader::Glance first = readers_[0].glance(), second = readers_[1].glance();
        if (first.number == second.number && first.number != lastNumber_ && readAll()) return &frames_;
        const auto left = std::chrono::duration_cast<milliseconds>(end - SteadyClock::now());
        if (left.count() <= 0) return nullptr;
        // The one that is behind is waited for; who is ahead may go on meanwhile and be behind next.
        const bool secondIsBehind = second.number < first.number;
        (void)readers_[secondIsBehind ? 1 : 0].waitForOther((secondIsBehind ? second : first).times, left);
    }
}

}  // namespace tessera
