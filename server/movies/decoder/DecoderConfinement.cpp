#include "server/movies/decoder/DecoderConfinement.h"

#include <fmt/format.h>
#include <linux/landlock.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <type_traits>

namespace tessera {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitizedDecoder = true;
#else
constexpr bool kSanitizedDecoder = false;
#endif

bool bound(int resource, rlim_t most) {
    const rlimit limit{most, most};
    return ::setrlimit(static_cast<decltype(RLIMIT_AS)>(resource), &limit) == 0;
}

/// Asked for by nobody who decodes: the process dies, and the server says so.
constexpr int kFatal[] = {SCMP_SYS(execve), SCMP_SYS(execveat), SCMP_SYS(socket), SCMP_SYS(connect), SCMP_SYS(bind), SCMP_SYS(listen), SCMP_SYS(accept), SCMP_SYS(accept4),
                          SCMP_SYS(sendto), SCMP_SYS(sendmsg), SCMP_SYS(ptrace), SCMP_SYS(process_vm_readv), SCMP_SYS(process_vm_writev), SCMP_SYS(bpf), SCMP_SYS(mount),
                          SCMP_SYS(umount2), SCMP_SYS(pivot_root), SCMP_SYS(chroot), SCMP_SYS(setns), SCMP_SYS(unshare), SCMP_SYS(io_uring_setup), SCMP_SYS(perf_event_open),
                          SCMP_SYS(keyctl), SCMP_SYS(userfaultfd), SCMP_SYS(fork), SCMP_SYS(vfork), SCMP_SYS(prlimit64), SCMP_SYS(setrlimit)};

/// Everything else does not exist (ENOSYS). The film is open already: none of these opens a file.
constexpr int kAllowed[] = {SCMP_SYS(read), SCMP_SYS(readv), SCMP_SYS(pread64), SCMP_SYS(write), SCMP_SYS(writev), SCMP_SYS(close), SCMP_SYS(fstat), SCMP_SYS(lseek), SCMP_SYS(poll),
                            SCMP_SYS(ppoll), SCMP_SYS(brk), SCMP_SYS(munmap), SCMP_SYS(mremap), SCMP_SYS(madvise), SCMP_SYS(futex), SCMP_SYS(getrandom), SCMP_SYS(clock_gettime),
                            SCMP_SYS(clock_getres), SCMP_SYS(gettimeofday), SCMP_SYS(time), SCMP_SYS(sched_getaffinity), SCMP_SYS(sched_yield), SCMP_SYS(rt_sigaction),
                            SCMP_SYS(rt_sigprocmask), SCMP_SYS(rt_sigreturn), SCMP_SYS(sigaltstack), SCMP_SYS(getpid), SCMP_SYS(gettid), SCMP_SYS(restart_syscall), SCMP_SYS(exit),
                            SCMP_SYS(exit_group)};

}  // namespace

Expected<void> confineDecoder(pid_t parent) {
    if (parent != 0) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        // The parent may have gone before that.
        if (::getppid() != parent) return fail(ErrorCode::kFailed, "the parent process is gone");
    }
    constexpr rlim_t kMemory = rlim_t{2} << 30, kStack = rlim_t{16} << 20;
    bool good = bound(RLIMIT_CORE, 0) && bound(RLIMIT_FSIZE, 0) && bound(RLIMIT_NOFILE, 16) && bound(RLIMIT_STACK, kStack);
    // The sanitizers' shadow memory is terabytes of address space.
    if (!kSanitizedDecoder) good = good && bound(RLIMIT_AS, kMemory);
    ::prctl(PR_SET_DUMPABLE, 0);
    if (!good || ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return fail(ErrorCode::kUnsupported, fmt::format("limits cannot be set ({})", std::strerror(errno)));
    landlock_ruleset_attr attributes{};
    attributes.handled_access_fs = (1ull << 13) - 1;
    // Without a rule: no file at all.
    const long ruleset = ::syscall(SYS_landlock_create_ruleset, &attributes, sizeof(attributes.handled_access_fs), 0);
    if (ruleset >= 0) {
        (void)::syscall(SYS_landlock_restrict_self, static_cast<int>(ruleset), 0);
        ::close(static_cast<int>(ruleset));
    }
    const std::unique_ptr<std::remove_pointer_t<scmp_filter_ctx>, decltype(&seccomp_release)> filter(seccomp_init(SCMP_ACT_ERRNO(ENOSYS)), &seccomp_release);
    good = filter != nullptr;
    for (const int call : kFatal) good = good && seccomp_rule_add(filter.get(), SCMP_ACT_KILL_PROCESS, call, 0) == 0;
    for (const int call : kAllowed) good = good && seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, call, 0) == 0;
    // Memory, but never executable memory.
    for (const int call : {SCMP_SYS(mmap), SCMP_SYS(mprotect)})
        good = good && seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, call, 1, SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0)) == 0;
    // abort() sends a signal; only to itself.
    good = good && seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, SCMP_SYS(tgkill), 1, SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(::getpid()))) == 0;
    if (!good || seccomp_load(filter.get()) != 0) return fail(ErrorCode::kUnsupported, "this system cannot confine who decodes films (seccomp), so none is");
    return {};
}

}  // namespace tessera
