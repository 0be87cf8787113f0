#include "deploy/wall/Signals.h"

#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace tessera {

namespace {

/// Somebody who ignores SIGHUP (nohup) wants to outlive the terminal.
bool hangUpEnds() {
    struct sigaction now = {};
    return ::sigaction(SIGHUP, nullptr, &now) == 0 && now.sa_handler != SIG_IGN;
}

sigset_t ours() {
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGCHLD);
    if (hangUpEnds()) sigaddset(&set, SIGHUP);
    return set;
}

}  // namespace

Expected<Signals> Signals::take() {
    const sigset_t set = ours();
    const int handle = ::signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
    if (handle < 0)
        return fail(ErrorCode::kFailed, std::string("signals cannot be waited for: ") + std::strerror(errno));
    ::pthread_sigmask(SIG_BLOCK, &set, nullptr);
    ::signal(SIGPIPE, SIG_IGN);
    return Signals(handle);
}

Signals::Signals(Signals&& other) noexcept : handle_(std::exchange(other.handle_, -1)) {}

Signals::~Signals() {
    if (handle_ < 0) return;
    ::close(handle_);
    const sigset_t set = ours();
    ::pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
    ::signal(SIGPIPE, SIG_DFL);
}

bool Signals::takeStopRequest() {
    bool stop = false;
    signalfd_siginfo info{};
    while (::read(handle_, &info, sizeof(info)) == static_cast<ssize_t>(sizeof(info))) {
        stop = stop || info.ssi_signo == SIGINT || info.ssi_signo == SIGTERM || info.ssi_signo == SIGHUP;
    }
    return stop;
}

}  // namespace tessera
