#include "server/sim/view/FrameBudget.h"

#include <algorithm>
#include <utility>

namespace tessera {
namespace {

constexpr unsigned kLastStep = static_cast<unsigned>(kDetailSteps.size()) - 1;
/// A step that was tried and has lasted so many frames in motion was no mistake.
constexpr unsigned kProof = FrameBudget::kMostPatience;

}  // namespace

void FrameBudget::set(double milliseconds) {
    milliseconds_ = milliseconds;
    patience_ = patienceAtFirst();
    held_ = 0;
    finer_ = false;
    if (milliseconds == 0) take(0);
}

void FrameBudget::drawn(const HostStats& host) {
    anyHost_ = true;
    slowest_ = std::max(slowest_, host.workMs);
    for (const TileStats& tile : host.tiles) anyDrawn_ = anyDrawn_ || tile.drawMs > 0;
}

void FrameBudget::released() {
    const bool told = std::exchange(anyHost_, false), moved = std::exchange(anyDrawn_, false);
    // What a frame takes that nobody draws anew no detail can make less.
    const double slowest = std::exchange(slowest_, 0.0), took = moved ? slowest : 0;
    if (!told) return;
    ++framesAt_[step_];
    if (milliseconds_ == 0) return;
    if (took > milliseconds_) ++late_;
    judge(took, !moved);
}

void FrameBudget::judge(double took, bool still) {
    if (++framesHere_ == 1 && !still) return;
    if (took > milliseconds_) {
        inTime_ = 0;
        overdue_ += kLateWithin;
        if (overdue_ < 2 * kLateWithin || step_ == kLastStep) return;
        if (finer_ && framesHere_ < kProof) patience_[step_] = std::min(2 * patience_[step_], kMostPatience);
        return take(std::max(step_ + 1, held_));
    }
    if (overdue_ > 0) --overdue_;
    if (!still) {
        held_ = step_;
        if (finer_ && framesHere_ >= kProof) patience_[step_] = kFirstPatience;
    }
    inTime_ = took < kRoom * milliseconds_ ? inTime_ + 1 : 0;
    if (step_ == 0 || inTime_ < patience_[step_ - 1]) return;
    take(step_ - 1);
    finer_ = !still;
}

void FrameBudget::take(unsigned step) {
    if (step != step_) ++changes_;
    step_ = step;
    framesHere_ = inTime_ = overdue_ = 0;
    finer_ = false;
}

}  // namespace tessera
