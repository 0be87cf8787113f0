#include "tests/bench/MachineLoad.h"

#include <dirent.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

namespace tessera::bench {
namespace {

/// In a group of its own, which ends with it and with this program.
template <typename F>
pid_t startGroup(F what) {
    std::fflush(nullptr);
    const pid_t pid = ::fork();
    if (pid != 0) {
        ::setpgid(pid, pid);
        return pid;
    }
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::setpgid(0, 0);
    what();
    ::_exit(0);
}

double secondsOf(const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

/// Of this process' children that live, and theirs, with what those have waited for: user and system.
double livingDescendants() {
    struct Row {
        pid_t parent = 0;
        double seconds = 0;
    };
    std::map<pid_t, Row> rows;
    const double tick = 1.0 / static_cast<double>(::sysconf(_SC_CLK_TCK));
    DIR* const all = ::opendir("/proc");
    if (!all) return 0;
    while (const dirent* entry = ::readdir(all)) {
        const pid_t pid = std::atoi(entry->d_name);
        if (pid <= 0) continue;
        std::ifstream file("/proc/" + std::string(entry->d_name) + "/stat");
        std::string line;
        std::getline(file, line);
        const std::size_t name = line.rfind(')');
        if (name == std::string::npos) continue;
        std::istringstream rest(line.substr(name + 2));
        std::string state;
        Row row;
        rest >> state >> row.parent;
        double skipped = 0, ticks[4] = {};
        for (int field = 0; field < 9; ++field) rest >> skipped;
        for (double& one : ticks) rest >> one;
        row.seconds = tick * (ticks[0] + ticks[1] + ticks[2] + ticks[3]);
        rows[pid] = row;
    }
    ::closedir(all);
    double seconds = 0;
    for (const auto& [pid, row] : rows) {
        pid_t above = row.parent;
        for (int depth = 0; depth < 64 && above > 1 && above != ::getpid(); ++depth)
            above = rows.contains(above) ? rows.at(above).parent : 0;
        if (above == ::getpid()) seconds += row.seconds;
    }
    return seconds;
}

}  // namespace

std::unique_ptr<Load> Load::loops(int count) {
    auto load = std::make_unique<Load>();
    for (int i = 0; i < count; ++i)
        load->groups_.push_back(startGroup([] {
            volatile unsigned turns = 0;
            for (;;) (void)turns;
        }));
    return load;
}

std::unique_ptr<Load> Load::compilers(int count) {
    auto load = std::make_unique<Load>();
    for (int i = 0; i < count; ++i)
        load->groups_.push_back(startGroup([] {
            const char* const script =
                "while :; do printf '#include <regex>\\n#include <map>\\n#include <iostream>\\n#include "
                "<algorithm>\\n#include <random>\\n"
                "int f(const std::string& s){std::regex r(s);std::map<std::string,std::regex> m;m[s]=r;return "
                "(int)m.size();}\\n'"
                " | c++ -x c++ -std=c++20 -O2 -c -o /dev/null - || sleep 1; done";
            ::execl("/bin/sh", "sh", "-c", script, nullptr);
        }));
    return load;
}

Load::~Load() {
    for (const pid_t group : groups_) {
        ::kill(-group, SIGKILL);
        ::waitpid(group, nullptr, 0);
    }
}

MachineLoad MachineLoad::now() {
    MachineLoad load;
    load.atSeconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
    std::ifstream stat("/proc/stat");
    std::string cpu;
    stat >> cpu;
    // user nice system idle iowait irq softirq steal
    double ticks[8] = {};
    for (double& one : ticks) stat >> one;
    load.busySeconds_ =
        (ticks[0] + ticks[1] + ticks[2] + ticks[5] + ticks[6] + ticks[7]) / static_cast<double>(::sysconf(_SC_CLK_TCK));
    for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
        rusage used{};
        ::getrusage(who, &used);
        load.oursSeconds_ += secondsOf(used.ru_utime) + secondsOf(used.ru_stime);
    }
    load.oursSeconds_ += livingDescendants();
    return load;
}

double MachineLoad::othersSince(const MachineLoad& before) const {
    const double time = atSeconds_ - before.atSeconds_;
    const double others = (busySeconds_ - before.busySeconds_) - (oursSeconds_ - before.oursSeconds_);
    return time > 0 ? std::max(0.0, others / time) : 0;
}

}  // namespace tessera::bench
