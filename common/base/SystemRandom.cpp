#include "common/base/SystemRandom.h"

#include <sys/random.h>

#include <cerrno>

#include "common/base/Error.h"

namespace tessera {

Hash128 systemRandom() {
    Hash128 bits;
    while (!bits) {
        // So few bytes come whole, once the source is seeded; before that, early in a boot, it waits.
        const ssize_t got = getrandom(&bits, sizeof bits, 0);
        TESSERA_CHECK(got == sizeof bits || errno == EINTR, "the kernel has a source of random numbers");
        if (got != sizeof bits) bits = {};
    }
    return bits;
}

}  // namespace tessera
