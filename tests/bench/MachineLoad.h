/// What the machine does beside what is measured: load put there, and load found there.
#pragma once

#include <sys/types.h>

#include <memory>
#include <vector>

namespace tessera::bench {

/// Processes that keep processors busy for as long as this lives.
class Load {
public:
    [[nodiscard]] static std::unique_ptr<Load> none() { return std::make_unique<Load>(); }
    [[nodiscard]] static std::unique_ptr<Load> loops(int count);
    /// So many compilers at a time, one file after the other.
    [[nodiscard]] static std::unique_ptr<Load> compilers(int count);
    Load() = default;
    ~Load();
    Load(const Load&) = delete;
    Load& operator=(const Load&) = delete;

private:
    std::vector<pid_t> groups_;  ///< processes that lead theirs
};

/// A reading of the machine's processors.
class MachineLoad {
public:
    [[nodiscard]] static MachineLoad now();
    /// Processors' worth of time, on average since `before`, that neither this program nor whatever it has started
    /// took; what other machines took from this one's hardware (steal) among it.
    [[nodiscard]] double othersSince(const MachineLoad& before) const;

private:
    double atSeconds_ = 0, busySeconds_ = 0, oursSeconds_ = 0;
};

}  // namespace tessera::bench
