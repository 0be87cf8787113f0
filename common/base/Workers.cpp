#include "common/base/Workers.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#include "common/base/Error.h"
#include "common/base/StartThread.h"

namespace tessera {

namespace {

/// How long somebody who waits keeps looking before he sleeps. Waking a thread costs about as much (more on a virtual
/// machine), so whoever waits wastes at most twice what he had to.
constexpr std::chrono::microseconds kPatience{100};

void pauseALittle() {
#if defined(__x86_64__) || defined(__i386__)
    for (int i = 0; i < 16; ++i) __builtin_ia32_pause();
#endif
}

/// Looks until `come` or the patience has run out; says which.
template <typename Come>
bool look(const Come& come) {
    if (come()) return true;
    const auto end = std::chrono::steady_clock::now() + kPatience;
    do {
        pauseALittle();
        if (come()) return true;
        // Costs nothing on a free machine. On a busy one, better that others take the processor now than in the middle
        // of a task, for which all would have to wait.
        std::this_thread::yield();
    } while (std::chrono::steady_clock::now() < end);
    return come();
}

constexpr std::uint64_t kLeftMask = 0xffff'ffffU;

}  // namespace

struct Workers::State {
    /// Which call of run (upper half), and how many of its tasks nobody has taken yet (lower half). A task is taken by
    /// counting this down by compare and exchange; that succeeds only while the call it was read from is under way, so
    /// `task` and `count`, read in between, are that call's.
    std::atomic<std::uint64_t> ticket{0};
    std::atomic<const std::function<void(std::size_t)>*> task{nullptr};
    std::atomic<std::uint64_t> count{0};
    std::atomic<std::uint64_t> done{0};
    std::atomic<bool> stop{false};

    std::atomic<unsigned> sleepers{0};
    std::atomic<bool> callerSleeps{false};
    std::mutex mutex;
    std::condition_variable work, finished;
    std::vector<std::thread> threads;

    [[nodiscard]] bool workLeft() const { return (ticket.load() & kLeftMask) != 0 || stop.load(); }

    /// Takes tasks and runs them until none is left.
    void runTasks() {
        std::uint64_t seen = ticket.load();
        while ((seen & kLeftMask) != 0) {
            const auto* const what = task.load(std::memory_order_relaxed);
            const std::uint64_t all = count.load(std::memory_order_relaxed);
            if (!ticket.compare_exchange_weak(seen, seen - 1)) continue;
            (*what)(static_cast<std::size_t>(all - (seen & kLeftMask)));
            if (done.fetch_add(1) + 1 == all && callerSleeps.load()) {
                const std::lock_guard lock(mutex);
                finished.notify_one();
            }
            seen = ticket.load();
        }
    }

    void serve() {
        while (!stop.load()) {
            if (!look([&] { return workLeft(); })) {
                std::unique_lock lock(mutex);
                sleepers.fetch_add(1);
                work.wait(lock, [&] { return workLeft(); });
                sleepers.fetch_sub(1);
            }
            runTasks();
        }
    }
};

Workers::Workers(unsigned threads) : state_(std::make_unique<State>()) {
    // Where the machine has no room for all of them those that there are do the work.
    for (unsigned i = 1; i < threads; ++i) {
        std::thread another = startThread([state = state_.get()] { state->serve(); });
        if (!another.joinable()) return;
        state_->threads.push_back(std::move(another));
    }
}

Workers::~Workers() {
    {
        const std::lock_guard lock(state_->mutex);
        state_->stop.store(true);
    }
    state_->work.notify_all();
    for (std::thread& thread : state_->threads) thread.join();
}

unsigned Workers::threads() const {
    return static_cast<unsigned>(state_->threads.size()) + 1;
}

void Workers::run(std::size_t count, const std::function<void(std::size_t)>& task) {
    State& s = *state_;
    if (s.threads.empty() || count < 2) {
        for (std::size_t i = 0; i < count; ++i) task(i);
        return;
    }
    TESSERA_CHECK(count <= kLeftMask, "too many tasks");
    s.task.store(&task, std::memory_order_relaxed);
    s.count.store(count, std::memory_order_relaxed);
    s.done.store(0);
    s.ticket.store(((s.ticket.load() >> 32U) + 1) << 32U | count);
    // Either a worker on its way to sleep sees the ticket, or it is seen here.
    if (s.sleepers.load() > 0) {
        { const std::lock_guard lock(s.mutex); }
        s.work.notify_all();
    }
    s.runTasks();
    const auto allDone = [&] { return s.done.load() == count; };
    if (look(allDone)) return;
    std::unique_lock lock(s.mutex);
    s.callerSleeps.store(true);
    s.finished.wait(lock, allDone);
    s.callerSleeps.store(false);
}

}  // namespace tessera
