/// What is said to ssh, and what ssh says.
#pragma once

#include <chrono>
#include <string>
#include <string_view>
#include <vector>

#include "common/wall/Machine.h"
#include "deploy/wall/Child.h"

namespace tessera {

/// How long a client lives on without a word from here, and how often there is one (`tessera-client --while-input`).
inline constexpr int kPatienceOfClientsSeconds = 30;
inline constexpr std::chrono::seconds kSignOfLife(2);

/// `text` as one word of a POSIX shell, in single quotes; meant for csh and fish too, which no test has. No line breaks
/// in it.
[[nodiscard]] std::string shellWord(std::string_view text);

/// `script`, for a POSIX shell, on that machine. Nobody is asked for anything; the user's own configuration of ssh
/// holds (names, keys, ways over other machines), but for what would tie this connection to others. Its input is fed.
[[nodiscard]] ChildCommand overSsh(const std::string& ssh, const Machine& machine, const std::string& script);

/// Starts the client there. The shell waits for it, so that its end by a signal comes back as 128 + the signal and not
/// as a lost connection.
[[nodiscard]] std::string scriptOfClient(const Machine& machine, const std::vector<std::string>& arguments);
/// Asks for the address that it sees us by, the client's version, and what the client lacks (Machines.h reads the
/// answer).
[[nodiscard]] std::string scriptOfQuestion(const Machine& machine, const std::vector<std::string>& arguments);

/// What ssh ends with where it is ssh that failed: no connection, or a lost one.
inline constexpr int kSshFailed = 255;
/// Why there was no connection, in words, from what it wrote: "nobody can be reached there: …". `login`: how a person
/// would try it by hand.
[[nodiscard]] std::string whySshFailed(const std::vector<std::string>& errorLines, const std::string& login);
/// e.g. "ssh -p 2222 user@wall-3".
[[nodiscard]] std::string loginByHand(const Machine& machine);
/// How a client there, or ssh, ended.
[[nodiscard]] std::string describeRemote(const ChildEnd& end, const std::string& destination);

}  // namespace tessera
