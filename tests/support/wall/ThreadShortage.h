/// A machine that has no room for many more threads or descriptors.
#pragma once

#include <sys/resource.h>

namespace tessera::simulation {

/// While one lives std::thread, and what Asio does in our programs, starts no thread, as if pthread_create refused.
/// Threads of libraries (Mesa's) start all the same. One at a time.
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

/// While one lives this process opens `room` files more, or fewer.
class DescriptorShortage {
public:
    explicit DescriptorShortage(int room);
    ~DescriptorShortage();
    DescriptorShortage(const DescriptorShortage&) = delete;
    DescriptorShortage& operator=(const DescriptorShortage&) = delete;

private:
    rlimit before_{};
};

}  // namespace tessera::simulation
