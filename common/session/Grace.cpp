#include "common/session/Grace.h"

namespace tessera {

void Grace::look(TimePoint now) {
    if (lastLook_ && now - *lastLook_ > longest_) {
        inARow_ = *lastLook_ < until_ ? inARow_ + 1 : 1;
        if (inARow_ <= kInARow) until_ = now + moment_;
    }
    lastLook_ = lastLook_ ? std::max(*lastLook_, now) : now;
    if (now >= until_) knownUntil_ = std::max(knownUntil_, now);
}

Duration Grace::stoodStill(TimePoint now) {
    const Duration since = lastLookAtClock_ ? now - *lastLookAtClock_ : Duration::zero();
    lastLookAtClock_ = now;
    return since > longest_ ? since : Duration::zero();
}

}  // namespace tessera
