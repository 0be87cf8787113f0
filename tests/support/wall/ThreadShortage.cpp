#include "tests/support/wall/ThreadShortage.h"

#include <dlfcn.h>
#include <pthread.h>

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

/// In place of the C library's, which it calls: std::thread's calls alone are refused.
extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*),
                              void* argument) noexcept {
    using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
    static const auto create = reinterpret_cast<Create>(::dlsym(RTLD_NEXT, "pthread_create"));
    Dl_info caller{};
    if (isShort && ::dladdr(__builtin_return_address(0), &caller) != 0 && caller.dli_fname != nullptr &&
        std::strstr(caller.dli_fname, "libstdc++") != nullptr && --roomLeft < 0)
        return EAGAIN;
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

}  // namespace tessera::simulation
