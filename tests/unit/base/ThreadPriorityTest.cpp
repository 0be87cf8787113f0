/// What threads ask of the scheduler, here and as a user who gets nothing.
#include "common/base/ThreadPriority.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

namespace tessera {
namespace {

int policyHere() {
    return ::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
}

/// In a process that may not ask for anything; its exit code.
template <typename F>
int withoutPrivileges(F what) {
    const pid_t pid = ::fork();
    if (pid == 0) {
        const rlimit none{0, 0};
        const bool dropped = ::setrlimit(RLIMIT_RTPRIO, &none) == 0 && ::setrlimit(RLIMIT_NICE, &none) == 0 &&
                             (::geteuid() != 0 || (::setgid(65534) == 0 && ::setuid(65534) == 0));
        ::_exit(dropped ? what() : 99);
    }
    int status = 0;
    ::waitpid(pid, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(ThreadPriority, SaysWhatTheSystemGaveAndWhatItRefused) {
    std::thread([] {
        const PriorityAnswer answer = askToRunAhead(Urgency::kShowing);
        EXPECT_NE(answer.realTime, !answer.refused.empty());
        EXPECT_EQ(policyHere() == SCHED_RR, answer.realTime);
        EXPECT_FALSE(answer.got.empty());
    }).join();
    EXPECT_EQ(policyHere(), SCHED_OTHER) << "it is the thread's own";
}

TEST(ThreadPriority, WhatSuchAThreadStartsIsOrdinary) {
    std::thread([] {
        (void)askToRunAhead(Urgency::kShowing);
        std::thread([] {
            EXPECT_EQ(policyHere(), SCHED_OTHER);
            EXPECT_GE(::getpriority(PRIO_PROCESS, 0), 0);
        }).join();
        const pid_t pid = ::fork();
        if (pid == 0) ::_exit(policyHere() == SCHED_OTHER ? 0 : 1);
        int status = 0;
        ::waitpid(pid, &status, 0);
        EXPECT_EQ(status, 0);
    }).join();
}

TEST(ThreadPriority, WithoutPrivilegesItSaysSoAndTheThreadIsOrdinary) {
    EXPECT_EQ(withoutPrivileges([] {
                  const PriorityAnswer answer = askToRunAhead(Urgency::kShowing);
                  if (answer.realTime || policyHere() != SCHED_OTHER) return 1;
                  if (answer.refused.find("SCHED_RR 1: Operation not permitted") == std::string::npos) return 2;
                  if (answer.refused.find("nice -10: ") == std::string::npos) return 3;
                  return AheadForNow::refusal().find("SCHED_RR 2: Operation not permitted") == std::string::npos ? 4
                                                                                                                 : 0;
              }),
              0);
}

TEST(ThreadPriority, AheadForNowEndsWithItsScope) {
    std::thread([] {
        const bool granted = AheadForNow::refusal().empty();
        {
            const AheadForNow ahead;
            EXPECT_EQ(policyHere() == SCHED_RR, granted);
        }
        EXPECT_EQ(policyHere(), SCHED_OTHER);
    }).join();
    EXPECT_EQ(withoutPrivileges([] {
                  const AheadForNow ahead;
                  return policyHere() == SCHED_OTHER ? 0 : 1;
              }),
              0);
}

TEST(ThreadPriority, WhatSomebodyHasGivenStays) {
    std::thread([] {
        const sched_param given{.sched_priority = 7};
        if (::sched_setscheduler(0, SCHED_FIFO, &given) != 0) GTEST_SKIP() << "no real-time priorities here";
        EXPECT_TRUE(askToRunAhead(Urgency::kShowing).realTime);
        EXPECT_TRUE(AheadForNow::refusal().empty());
        { const AheadForNow ahead; }
        EXPECT_EQ(policyHere(), SCHED_FIFO);
        sched_param now{};
        EXPECT_EQ(::sched_getparam(0, &now), 0);
        EXPECT_EQ(now.sched_priority, 7);
    }).join();
}

}  // namespace
}  // namespace tessera
