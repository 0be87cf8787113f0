/// A program of Tessera's as a child of this process: what reads strangers' bytes does so where it can harm nobody.
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

/// In the running program's folder; installed, in `../libexec/tessera` from there.
[[nodiscard]] std::string pathBesideThisProgram(std::string_view name);

/// Killed and reaped at the latest when this goes. Not thread-safe; with PR_SET_PDEATHSIG the child ends with the
/// thread that starts it.
class ChildProgram {
public:
    /// An open file of this process, and its number in the child.
    struct Given {
        int file = -1, as = 0;
    };
    struct Options {
        std::string path;
        std::vector<std::string> arguments;
        std::vector<std::string> environment;  ///< beside LC_ALL=C: no variable of this process steers a library there
        std::vector<Given>
            files;  ///< all that it has, whatever their numbers; of 0, 1 and 2 what is not named is /dev/null
    };
    /// In a process group of its own, no signal blocked or handled. Ctrl-C at a terminal so reaches this process alone,
    /// which then ends the child. Fails with "'PATH' cannot be started: why; it belongs beside the running program".
    [[nodiscard]] static Expected<ChildProgram> start(const Options& options);

    ChildProgram() = default;
    ChildProgram(ChildProgram&& other) noexcept : pid_(std::exchange(other.pid_, -1)) {}
    ChildProgram& operator=(ChildProgram&& other) noexcept {
        std::swap(pid_, other.pid_);
        return *this;
    }
    ~ChildProgram() { (void)kill(); }

    /// Below 0: there is none any more.
    [[nodiscard]] pid_t pid() const { return pid_; }
    /// Waits for its end; waitpid's status. 0 where there is none.
    int reap();
    /// Ends it where it has not ended, and reaps it.
    int kill();

private:
    pid_t pid_ = -1;
};

}  // namespace tessera
