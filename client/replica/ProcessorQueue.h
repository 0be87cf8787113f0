/// How long this thread has waited for a processor.
#pragma once

#include "common/base/Clock.h"

namespace tessera {

/// Of the thread that makes it: time in which it was ready to run and no processor was free, as Linux counts it
/// (Documentation/scheduler/sched-stats.rst, /proc/PID/schedstat, second number). Where the kernel does not count,
/// always zero. A reading takes about a microsecond.
class ProcessorQueue {
public:
    ProcessorQueue();
    ~ProcessorQueue();
    ProcessorQueue(const ProcessorQueue&) = delete;
    ProcessorQueue& operator=(const ProcessorQueue&) = delete;

    /// Since the thread began.
    [[nodiscard]] Duration waited() const;

private:
    int file_ = -1;
};

}  // namespace tessera
