/// One process that we have started, and end.
#pragma once

#include <sys/types.h>

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

struct ChildCommand {
    std::string program;  ///< a path
    std::vector<std::string> arguments;
    std::vector<std::pair<std::string, std::string>> environment;  ///< beside our own
    bool feedInput = false;       ///< a pipe to its standard input; else it reads nothing
    std::string firstInput = {};  ///< what it is fed at once; at most what a pipe holds (64 KiB)
};

/// Where in the folders of PATH a program of this name is; one with a slash is a path already. Nothing: there is none.
[[nodiscard]] std::optional<std::string> findProgram(const std::string& name);

/// How a process ended.
struct ChildEnd {
    bool signalled = false;
    int value = 0;  ///< the exit code, or the signal
    [[nodiscard]] bool good() const { return !signalled && value == 0; }
};
/// e.g. "ended with exit code 3", "was killed by signal 9 (Killed)".
[[nodiscard]] std::string describe(const ChildEnd& end);
/// Where to look after one of our programs has crashed: "; `coredumpctl info tessera-client` shows where …". Empty: it
/// has not.
[[nodiscard]] std::string adviceAfter(const ChildEnd& end, const std::string& program);

/// Belongs to one thread, the one that started it: the child is killed by the kernel when that thread ends, however it
/// ends, so that nothing is left behind. It stands in a process group of its own: Ctrl-C reaches us alone. Its signals
/// are sent by pid, and the pid is ours until it is reaped.
class Child {
public:
    /// kNotFound when there is no such program.
    [[nodiscard]] static Expected<Child> start(const ChildCommand& command);
    /// Kills and reaps what still runs.
    ~Child();
    Child(Child&& other) noexcept;
    Child& operator=(Child&& other) noexcept;

    [[nodiscard]] pid_t pid() const { return pid_; }
    [[nodiscard]] bool running() const { return running_; }
    void send(int signal) const;
    /// True while somebody has stopped it (SIGSTOP): it would not notice SIGTERM.
    [[nodiscard]] bool stopped() const;
    /// Once it has ended: how. Never waits.
    std::optional<ChildEnd> reap();

    enum Stream { kOut = 0, kError = 1 };
    /// To poll for; -1 when the stream has ended.
    [[nodiscard]] int handle(Stream stream) const { return streams_[stream].handle; }
    /// The whole lines that have come; the last one without its end once the stream is over. Never waits. Lines are cut
    /// at 8 KiB.
    [[nodiscard]] std::vector<std::string> readLines(Stream stream);

    /// Waits until all is written; kFailed when the child no longer reads. Only with `feedInput`.
    [[nodiscard]] Expected<void> feed(const void* data, std::size_t bytes);
    void closeInput();

private:
    struct Pipe {
        int handle = -1;
        std::string partial;
    };
    Child() = default;
    void release();

    pid_t pid_ = -1;
    bool running_ = false;
    int input_ = -1;
    std::array<Pipe, 2> streams_;
};

}  // namespace tessera
