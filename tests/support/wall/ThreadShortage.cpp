#include "tests/support/wall/ThreadShortage.h"

#include <dlfcn.h>
#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>

namespace {

std::atomic<bool> isShort = false;
std::atomic<int> roomLeft = 0;

}  // namespace

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TESSERA_SANITIZER
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define TESSERA_SANITIZER
#endif
#endif

#ifdef TESSERA_SANITIZER
const bool tessera::simulation::ThreadShortage::kRefuses = false;
#else
const bool tessera::simulation::ThreadShortage::kRefuses = true;

/// In place of the C library's, which it calls: calls of std::thread and of headers (Asio) are refused.
extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*),
                              void* argument) noexcept {
    using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
    static const auto create = reinterpret_cast<Create>(::dlsym(RTLD_NEXT, "pthread_create"));
    Dl_info caller{};
    Dl_info self{};
    const bool isOurs = isShort && ::dladdr(__builtin_return_address(0), &caller) != 0 &&
                        ::dladdr(&isShort, &self) != 0 && caller.dli_fname != nullptr &&
                        (caller.dli_fbase == self.dli_fbase || std::strstr(caller.dli_fname, "libstdc++") != nullptr);
    if (isOurs && --roomLeft < 0) return EAGAIN;
    return create(thread, attributes, start, argument);
}
#endif

namespace tessera::simulation {

ThreadShortage::ThreadShortage(int room) {
    roomLeft = room;
    isShort = true;
}

ThreadShortage::~ThreadShortage() {
    isShort = false;
}

DescriptorShortage::DescriptorShortage(int room) {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    const int next = ::dup(0);
    ::close(next);
    rlimit few = before_;
    few.rlim_cur = static_cast<rlim_t>(next + room);
    ::setrlimit(RLIMIT_NOFILE, &few);
}

DescriptorShortage::~DescriptorShortage() {
    ::setrlimit(RLIMIT_NOFILE, &before_);
}

}  // namespace tessera::simulation
