#include "common/base/ThreadPriority.h"

#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

namespace tessera {
namespace {

constexpr int kAheadNice = -10;

/// As Linux has it (sched_setattr(2)); the library has no such call.
struct SchedulerAttributes {
    std::uint32_t size = sizeof(SchedulerAttributes);
    std::uint32_t policy = 0;
    std::uint64_t flags = 0;
    std::int32_t nice = 0;
    std::uint32_t priority = 0;
    std::uint64_t runtimeNs = 0, deadlineNs = 0, periodNs = 0;
};
constexpr std::uint64_t kFlagResetOnFork = 1;

pid_t thisThread() {
    return static_cast<pid_t>(::syscall(SYS_gettid));
}

/// Of ordinary threads the one with the shorter slice comes first when it wakes; everybody may ask for one. Kernels
/// before 6.12 take no notice.
bool askForShortSlice() {
    constexpr std::uint64_t kShortestNs = 100'000;
    errno = 0;
    const int nice = ::getpriority(PRIO_PROCESS, static_cast<id_t>(thisThread()));
    if (errno != 0) return false;
    SchedulerAttributes wanted{
        .policy = SCHED_OTHER, .flags = kFlagResetOnFork, .nice = nice, .runtimeNs = kShortestNs};
    return ::syscall(SYS_sched_setattr, 0, &wanted, 0) == 0;
}

bool isRealTime(int policy) {
    const int bare = policy & ~SCHED_RESET_ON_FORK;
    return bare == SCHED_FIFO || bare == SCHED_RR;
}

void add(std::string& to, const std::string& what) {
    to += (to.empty() ? "" : "; ") + what;
}

void askForEveryProcessor(PriorityAnswer& answer) {
    // What the process may not use at all the kernel leaves out.
    cpu_set_t all;
    CPU_ZERO(&all);
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) CPU_SET(cpu, &all);
    if (::sched_setaffinity(0, sizeof all, &all) != 0)
        add(answer.refused, std::string("all processors: ") + std::strerror(errno));
}

}  // namespace

PriorityAnswer askToRunAhead(Urgency urgency) {
    PriorityAnswer answer;
    if (isRealTime(::sched_getscheduler(0))) {  // somebody has seen to it
        answer.realTime = true;
        answer.got = "the real-time priority that it was started with";
        return answer;
    }
    askForEveryProcessor(answer);
    const int priority = static_cast<int>(urgency);
    const std::string roundRobin = "SCHED_RR " + std::to_string(priority);
    const sched_param wanted{.sched_priority = priority};
    if (::sched_setscheduler(0, SCHED_RR | SCHED_RESET_ON_FORK, &wanted) == 0) {
        answer.realTime = true;
        answer.got = roundRobin;
        return answer;
    }
    add(answer.refused, roundRobin + ": " + std::strerror(errno));
    const std::string nice = "nice " + std::to_string(kAheadNice);
    if (::setpriority(PRIO_PROCESS, static_cast<id_t>(thisThread()), kAheadNice) == 0)
        answer.got = nice;
    else
        add(answer.refused, nice + ": " + std::strerror(errno));
    if (askForShortSlice()) add(answer.got, "a short time slice");
    return answer;
}

std::string AheadForNow::refusal() {
    if (isRealTime(::sched_getscheduler(0))) return {};
    const AheadForNow tried;
    const int error = errno;
    if (tried.before_ >= 0) return {};
    return "SCHED_RR " + std::to_string(static_cast<int>(Urgency::kReleasing)) + ": " + std::strerror(error);
}

AheadForNow::AheadForNow() {
    const int before = ::sched_getscheduler(0);
    const sched_param wanted{.sched_priority = static_cast<int>(Urgency::kReleasing)};
    if (before >= 0 && isRealTime(before)) return;  // and stays so
    if (before >= 0 && ::sched_setscheduler(0, SCHED_RR | SCHED_RESET_ON_FORK, &wanted) == 0) before_ = before;
}

AheadForNow::~AheadForNow() {
    if (before_ < 0) return;
    // The flag cannot be taken back by everybody, and changes nothing for ordinary threads.
    const sched_param ordinary{.sched_priority = 0};
    (void)::sched_setscheduler(0, (before_ & ~SCHED_RESET_ON_FORK) | SCHED_RESET_ON_FORK, &ordinary);
}

}  // namespace tessera
