/// A machine that has no room for many more threads: std::thread refuses to start one, as pthread_create would.
#pragma once

namespace tessera::simulation {

/// While one lives. Threads of libraries (Mesa's) start all the same. One at a time.
class ThreadShortage {
public:
    /// False: it does nothing, as a sanitizer stands there itself.
    static const bool kRefuses;

    /// `room`: so many start before.
    explicit ThreadShortage(int room = 0);
    ~ThreadShortage();
    ThreadShortage(const ThreadShortage&) = delete;
    ThreadShortage& operator=(const ThreadShortage&) = delete;
};

}  // namespace tessera::simulation
