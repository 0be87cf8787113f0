/// How the collision benchmark takes time: per call the smaller of the thread's processor time and the wall's, without
/// what reading the clocks costs; after one pass to warm up, the least over some passes for each call.
#pragma once

#include <time.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <vector>

namespace tessera {

class CallTimer {
public:
    CallTimer() {
        for (int i = 0; i < 2000; ++i) {
            const Reading r = read([] {});
            cpuCost_ = std::min(cpuCost_, r.cpu);
            wallCost_ = std::min(wallCost_, r.wall);
        }
    }
    template <typename Call>
    [[nodiscard]] double seconds(Call&& call) const {
        const Reading r = read(call);
        return std::max(0.0, std::min(r.cpu - cpuCost_, r.wall - wallCost_));
    }
    /// Where several threads share the work.
    template <typename Call>
    [[nodiscard]] double wallSeconds(Call&& call) const {
        return std::max(0.0, read(call).wall - wallCost_);
    }

private:
    struct Reading {
        double cpu, wall;
    };
    static double now(clockid_t clock) {
        timespec t{};
        clock_gettime(clock, &t);
        return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
    }
    template <typename Call>
    static Reading read(Call&& call) {
        const double cpu = now(CLOCK_THREAD_CPUTIME_ID);
        const double wall = now(CLOCK_MONOTONIC);
        call();
        const double wallEnd = now(CLOCK_MONOTONIC);
        return {now(CLOCK_THREAD_CPUTIME_ID) - cpu, wallEnd - wall};
    }

    double cpuCost_ = std::numeric_limits<double>::infinity();
    double wallCost_ = std::numeric_limits<double>::infinity();
};

/// One contender: answers question i.
using Contender = std::function<void(std::size_t)>;

enum class Clock { kThread, kWall };

/// Seconds per contender and question. The contenders take turns pass by pass, so that what disturbs the machine
/// disturbs them alike.
inline std::vector<std::vector<double>> raceInTurns(std::size_t questions, int passes,
                                                    const std::vector<Contender>& contenders,
                                                    Clock clock = Clock::kThread) {
    const CallTimer timer;
    std::vector<std::vector<double>> best(contenders.size(),
                                          std::vector<double>(questions, std::numeric_limits<double>::infinity()));
    for (int pass = 0; pass <= passes; ++pass)
        for (std::size_t c = 0; c < contenders.size(); ++c)
            for (std::size_t i = 0; i < questions; ++i) {
                const auto call = [&] { contenders[c](i); };
                const double taken = clock == Clock::kThread ? timer.seconds(call) : timer.wallSeconds(call);
                if (pass > 0) best[c][i] = std::min(best[c][i], taken);
            }
    return best;
}

/// In microseconds.
struct Summary {
    double mean = 0, median = 0, p99 = 0;
};

[[nodiscard]] inline Summary summarise(std::vector<double> seconds) {
    if (seconds.empty()) return {};
    std::sort(seconds.begin(), seconds.end());
    Summary s;
    for (const double x : seconds) s.mean += x;
    const auto at = [&](double share) {
        return 1e6 * seconds[std::min(seconds.size() - 1,
                                      static_cast<std::size_t>(share * static_cast<double>(seconds.size())))];
    };
    s.mean *= 1e6 / static_cast<double>(seconds.size());
    s.median = at(0.5);
    s.p99 = at(0.99);
    return s;
}

}  // namespace tessera
