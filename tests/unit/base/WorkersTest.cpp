#include "common/base/Workers.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/unit/Eventually.h"

namespace tessera {
namespace {

/// A thread of this process waits and does not run (proc_pid_stat(5)).
bool sleeps(pid_t thread) {
    std::ifstream file("/proc/self/task/" + std::to_string(thread) + "/stat");
    std::string line;
    std::getline(file, line);
    const std::size_t name = line.rfind(')');
    return name != std::string::npos && line.substr(name, 3) == ") S";
}

TEST(Workers, RunEveryTaskOnceWhateverTheirNumber) {
    for (const unsigned threads : {0u, 1u, 2u, 3u, 8u}) {
        Workers workers(threads);
        EXPECT_EQ(workers.threads(), std::max(threads, 1u));
        for (const std::size_t count : {0u, 1u, 2u, 3u, 7u, 1000u}) {
            std::vector<std::atomic<int>> calls(count);
            workers.run(count, [&](std::size_t i) { calls[i].fetch_add(1); });
            for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(calls[i], 1) << threads << ' ' << count << ' ' << i;
        }
    }
}

TEST(Workers, WhatTasksWroteIsSeenAfterTheRun) {
    // Plain values, many short runs of changing size: a task of one run that were counted for another, or a run that
    // returned early, would leave a wrong sum (and a report of the thread sanitizer).
    Workers workers(3);
    std::vector<std::uint64_t> values(64);
    std::uint64_t expected = 0, sum = 0;
    for (std::uint64_t run = 1; run <= 20000; ++run) {
        const std::size_t count = run % values.size() + 1;
        workers.run(count, [&, run](std::size_t i) { values[i] = run * 64 + i; });
        for (std::size_t i = 0; i < count; ++i) {
            sum += values[i];
            expected += run * 64 + i;
        }
        ASSERT_EQ(sum, expected) << run;
    }
}

TEST(Workers, ShareTheWork) {
    // Each task waits for the other: one thread alone would never end.
    Workers workers(2);
    const pid_t caller = ::gettid();
    for (int round = 0; round < 2; ++round) {
        std::atomic<int> here{0};
        std::vector<pid_t> ids(2);
        workers.run(2, [&](std::size_t i) {
            ids[i] = ::gettid();
            here.fetch_add(1);
            while (here.load() < 2) std::this_thread::yield();
        });
        EXPECT_NE(ids[0], ids[1]);
        const pid_t other = ids[0] == caller ? ids[1] : ids[0];
        ASSERT_TRUE(test::eventually([&] { return sleeps(other); })) << "the second round wakes it";
    }
}

TEST(Workers, TheCallerWaitsForALongTaskOfAnother) {
    Workers workers(2);
    std::atomic<int> ended{0}, begun{0};
    const pid_t caller = ::gettid();
    workers.run(2, [&](std::size_t) {
        begun.fetch_add(1);
        while (begun.load() < 2) std::this_thread::yield();
        if (::gettid() != caller) {
            EXPECT_TRUE(test::eventually([&] { return sleeps(caller); })) << "its patience ends before the task does";
        }
        ended.fetch_add(1);
    });
    EXPECT_EQ(ended, 2);
}

TEST(Workers, TasksMayUseWorkersOfTheirOwn) {
    Workers outer(2);
    std::atomic<int> calls{0};
    outer.run(4, [&](std::size_t) {
        Workers inner(2);
        inner.run(5, [&](std::size_t) { calls.fetch_add(1); });
    });
    EXPECT_EQ(calls, 20);
}

TEST(Workers, ComeAndGoWithoutWork) {
    for (int i = 0; i < 50; ++i) {
        const Workers workers(4);
        EXPECT_EQ(workers.threads(), 4u);
    }
}

}  // namespace
}  // namespace tessera
