#include "common/net/AbsenceTimer.h"

#include <sys/timerfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <system_error>

namespace tessera {

AbsenceTimer::AbsenceTimer() : fd_(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC)) {
    if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "timerfd_create");
}

AbsenceTimer::~AbsenceTimer() {
    ::close(fd_);
}

void AbsenceTimer::wait() {
    std::uint64_t times = 0;
    [[maybe_unused]] const auto read = ::read(fd_, &times, sizeof times);
}

void AbsenceTimer::set(std::chrono::nanoseconds after) {
    itimerspec time{};
    time.it_value.tv_sec = after.count() / 1'000'000'000;
    time.it_value.tv_nsec = after.count() % 1'000'000'000;
    (void)::timerfd_settime(fd_, 0, &time, nullptr);
}

}  // namespace tessera
