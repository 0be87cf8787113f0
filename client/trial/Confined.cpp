#include "client/trial/Confined.h"

#include <errno.h>
#include <fmt/format.h>
#include <linux/landlock.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <memory>
#include <type_traits>

namespace tessera {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitizedTrial = true;
#else
constexpr bool kSanitizedTrial = false;
#endif

bool limitTo(int resource, rlim_t soft, rlim_t hard) {
    const rlimit limit{soft, hard};
    return ::setrlimit(static_cast<decltype(RLIMIT_AS)>(resource), &limit) == 0;
}

/// Of no use to who draws: the process dies, and the server says so.
constexpr int kNeverCalled[] = {SCMP_SYS(execve), SCMP_SYS(execveat), SCMP_SYS(socket), SCMP_SYS(connect), SCMP_SYS(bind), SCMP_SYS(listen), SCMP_SYS(accept), SCMP_SYS(accept4),
                                SCMP_SYS(fork), SCMP_SYS(vfork), SCMP_SYS(ptrace), SCMP_SYS(process_vm_readv), SCMP_SYS(process_vm_writev), SCMP_SYS(bpf), SCMP_SYS(mount),
                                SCMP_SYS(umount2), SCMP_SYS(pivot_root), SCMP_SYS(chroot), SCMP_SYS(setns), SCMP_SYS(unshare), SCMP_SYS(init_module), SCMP_SYS(finit_module),
                                SCMP_SYS(kexec_load), SCMP_SYS(io_uring_setup), SCMP_SYS(perf_event_open), SCMP_SYS(keyctl), SCMP_SYS(userfaultfd), SCMP_SYS(kill), SCMP_SYS(tkill),
                                SCMP_SYS(pidfd_open), SCMP_SYS(prlimit64), SCMP_SYS(setrlimit)};

}  // namespace

Expected<void> boundResources(pid_t parent) {
    if (parent != 0) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        // The parent may have gone before that.
        if (::getppid() != parent) return fail(ErrorCode::kFailed, "the parent process is gone");
    }
    constexpr rlim_t kMemory = rlim_t{2} << 30, kStack = rlim_t{16} << 20;
    bool done = limitTo(RLIMIT_CORE, 0, 0) && limitTo(RLIMIT_FSIZE, 0, 0) && limitTo(RLIMIT_NOFILE, 64, 64) && limitTo(RLIMIT_STACK, kStack, kStack);
    // The sanitizers' shadow memory is terabytes of address space.
    if (!kSanitizedTrial) done = done && limitTo(RLIMIT_AS, kMemory, kMemory);
    if (!done) return fail(ErrorCode::kUnsupported, fmt::format("limits cannot be set ({})", std::strerror(errno)));
    return {};
}

Expected<void> confineDrawing(int seconds) {
    rusage used{};
    ::getrusage(RUSAGE_SELF, &used);
    const double so = static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) + 1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
    const auto most = static_cast<rlim_t>(std::ceil(so + seconds));
    if (!limitTo(RLIMIT_CPU, most, most + 1)) return fail(ErrorCode::kUnsupported, "the processor's time cannot be bounded");
    ::prctl(PR_SET_DUMPABLE, 0);
    if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return fail(ErrorCode::kUnsupported, "this system has no PR_SET_NO_NEW_PRIVS");
    // No rule: no file, where the kernel has Landlock. What reads a person's text is Mesa's compiler; the other bounds hold without.
    landlock_ruleset_attr attributes{};
    attributes.handled_access_fs = (1ull << 13) - 1;
    const long ruleset = ::syscall(SYS_landlock_create_ruleset, &attributes, sizeof(attributes.handled_access_fs), 0);
    if (ruleset >= 0) {
        (void)::syscall(SYS_landlock_restrict_self, static_cast<int>(ruleset), 0);
        ::close(static_cast<int>(ruleset));
    }
    const std::unique_ptr<std::remove_pointer_t<scmp_filter_ctx>, decltype(&seccomp_release)> filter(seccomp_init(SCMP_ACT_ALLOW), &seccomp_release);
    bool good = filter != nullptr;
    for (const int call : kNeverCalled) good = good && seccomp_rule_add(filter.get(), SCMP_ACT_KILL_PROCESS, call, 0) == 0;
    if (!good || seccomp_load(filter.get()) != 0) return fail(ErrorCode::kUnsupported, "this system cannot confine the trial of a program (seccomp)");
    return {};
}

}  // namespace tessera
