#include "common/base/Error.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "common/base/Log.h"

namespace tessera {

tl::unexpected<Error> failWith(std::string_view context, const Error& error) {
    return fail(error.code, std::string(context) + ": " + error.message);
}

int exitCode(ErrorCode code) {
    switch (code) {
        case ErrorCode::kUsage:
            return 2;
        case ErrorCode::kBadInput:
        case ErrorCode::kNotFound:
        case ErrorCode::kLimit:
            return 3;
        case ErrorCode::kNetwork:
            return 4;
        case ErrorCode::kRefused:
        case ErrorCode::kUnsupported:
        case ErrorCode::kFailed:
            return 1;
    }
    return 1;
}

void checkFailed(const char* condition, const char* file, int line, std::string_view message) {
    flushLogs(std::chrono::milliseconds(500));  // what was said before it may say why
    std::fprintf(stderr, "tessera: internal error at %s:%d: CHECK(%s): %.*s\n", file, line, condition,
                 static_cast<int>(message.size()), message.data());
    std::abort();
}

}  // namespace tessera
