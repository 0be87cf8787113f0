/// The time, and how long this thread has waited for a processor.
#pragma once

#include "common/base/TimeSource.h"

namespace tessera {

/// Of the thread that makes it: time in which it was ready to run and no processor was free, as Linux counts it
/// (Documentation/scheduler/sched-stats.rst, /proc/PID/schedstat, second number). Where the kernel does not count,
/// always zero, and so where the time is not the machine's. A reading takes about a microsecond.
class ProcessorQueue {
public:
    explicit ProcessorQueue(const TimeSource& time = machineTime());
    ~ProcessorQueue();
    ProcessorQueue(const ProcessorQueue&) = delete;
    ProcessorQueue& operator=(const ProcessorQueue&) = delete;

    [[nodiscard]] TimePoint now() const { return time_.now(); }
    /// Since the thread began.
    [[nodiscard]] Duration waited() const;

private:
    const TimeSource& time_;
    int file_ = -1;
};

}  // namespace tessera
