#include "client/replica/ProcessorQueue.h"

#include <fcntl.h>
#include <unistd.h>

#include <charconv>
#include <cstring>

namespace tessera {

ProcessorQueue::ProcessorQueue(const TimeSource& time)
    : time_(time), file_(&time == &machineTime() ? ::open("/proc/thread-self/schedstat", O_RDONLY | O_CLOEXEC) : -1) {}

ProcessorQueue::~ProcessorQueue() {
    if (file_ >= 0) ::close(file_);
}

Duration ProcessorQueue::waited() const {
    char text[96];
    const ssize_t size = file_ < 0 ? 0 : ::pread(file_, text, sizeof text, 0);
    if (size <= 0) return Duration::zero();
    const char* const end = text + size;
    const auto* space = static_cast<const char*>(std::memchr(text, ' ', static_cast<std::size_t>(size)));
    std::int64_t ns = 0;
    if (!space || std::from_chars(space + 1, end, ns).ec != std::errc()) return Duration::zero();
    return Duration(ns);
}

}  // namespace tessera
