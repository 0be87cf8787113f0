/// Errors of the world (files, peers, configuration, limits) as values, and CHECK for our own bugs.
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

namespace tessera {

/// What kind of thing went wrong. Decides the exit code of a program and how a peer is answered.
enum class ErrorCode {
    kUsage,        ///< the command line makes no sense
    kBadInput,     ///< a file, a configuration or a message is malformed
    kNotFound,     ///< a named thing (file, host, node, verb) does not exist
    kRefused,      ///< well-formed, but not allowed in the present state
    kLimit,        ///< a bound would be exceeded; refused before memory was taken
    kNetwork,      ///< a connection could not be made or broke
    kUnsupported,  ///< the system lacks something that is needed
    kFailed,       ///< anything else that stopped the work
};

/// A message for a person: what was wrong, where, and what to do. Never ends with a full stop or a newline.
struct Error {
    ErrorCode code = ErrorCode::kFailed;
    std::string message;
};

template <typename T>
using Expected = tl::expected<T, Error>;

/// `return fail(ErrorCode::kBadInput, "…")` from any function returning an Expected.
[[nodiscard]] inline tl::unexpected<Error> fail(ErrorCode code, std::string message) {
    return tl::unexpected<Error>(Error{code, std::move(message)});
}

/// The same error with `context` put in front: "context: message".
[[nodiscard]] tl::unexpected<Error> failWith(std::string_view context, const Error& error);

/// Exit codes of all programs: 0 done, 1 failed, 2 usage, 3 bad input file or configuration, 4 network.
[[nodiscard]] int exitCode(ErrorCode code);

[[noreturn]] void checkFailed(const char* condition, const char* file, int line, std::string_view message);

}  // namespace tessera

/// Our own invariants, always on. Never used on what a peer, a file or a clock said.
#define TESSERA_CHECK(condition, message) \
    ((condition) ? void() : ::tessera::checkFailed(#condition, __FILE__, __LINE__, message))
