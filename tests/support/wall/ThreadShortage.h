/// A machine that has no room for another thread: std::thread refuses to start one, as pthread_create would.
#pragma once

namespace tessera::simulation {

/// While one lives. Threads of libraries (Mesa's) start all the same. For one thread.
class ThreadShortage {
public:
    /// False: it does nothing, as a sanitizer stands there itself.
    static const bool kRefuses;

    ThreadShortage();
    ~ThreadShortage();
    ThreadShortage(const ThreadShortage&) = delete;
    ThreadShortage& operator=(const ThreadShortage&) = delete;
};

}  // namespace tessera::simulation
