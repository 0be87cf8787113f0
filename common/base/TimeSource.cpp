#include "common/base/TimeSource.h"

namespace tessera {

const TimeSource& machineTime() {
    class Machine final : public TimeSource {
        [[nodiscard]] TimePoint now() const override { return clockNow(); }
        [[nodiscard]] DateTime date() const override { return std::chrono::system_clock::now(); }
    };
    static const Machine machine;
    return machine;
}

}  // namespace tessera
