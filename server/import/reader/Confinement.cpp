#include "server/import/reader/Confinement.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/capability.h>
#include <linux/landlock.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <type_traits>

namespace tessera {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif
#else
constexpr bool kSanitized = false;
#endif

bool limitResource(int resource, rlim_t soft, rlim_t hard) {
    const rlimit limit{soft, hard};
    return ::setrlimit(static_cast<decltype(RLIMIT_AS)>(resource), &limit) == 0;
}

/// What there is to grant, of this process.
struct Granting {
    rlim_t given = 0, most = 0, perMebibyte = 0;
    std::uint64_t readBytes = 0;
};
Granting granting;

bool dropCapability(unsigned capability) {
    __user_cap_header_struct head{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct sets[_LINUX_CAPABILITY_U32S_3] = {};
    if (::syscall(SYS_capget, &head, sets) != 0) return false;
    __user_cap_data_struct& set = sets[CAP_TO_INDEX(capability)];
    for (__u32* const mask : {&set.effective, &set.permitted, &set.inheritable}) *mask &= ~CAP_TO_MASK(capability);
    return ::syscall(SYS_capset, &head, sets) == 0;
}

Expected<void> limitResources(const Confinement& confinement) {
    // A sanitized reader takes several times as long.
    const auto cpu = static_cast<rlim_t>(confinement.cpuTime.count()) * (kSanitized ? 3 : 1);
    granting = {.given = cpu, .most = std::max(cpu, static_cast<rlim_t>(confinement.mostCpuTime.count())),
                .perMebibyte = static_cast<rlim_t>(confinement.cpuTimePerMebibyte.count()), .readBytes = 0};
    // At the soft limit SIGXCPU says why; whoever ignores it dies at the hard one. As nobody may raise that, neither root may.
    if (!dropCapability(CAP_SYS_RESOURCE)) return fail(ErrorCode::kUnsupported, fmt::format("capabilities cannot be given away ({})", std::strerror(errno)));
    bool done = limitResource(RLIMIT_CPU, cpu, granting.most + 2) && limitResource(RLIMIT_CORE, 0, 0) &&
                limitResource(RLIMIT_FSIZE, 0, 0) && limitResource(RLIMIT_NOFILE, 64, 64) &&
                limitResource(RLIMIT_STACK, rlim_t{16} << 20, rlim_t{16} << 20);
    // The sanitizers' shadow memory is terabytes of address space.
    if (!kSanitized) done = done && limitResource(RLIMIT_AS, confinement.memoryBytes, confinement.memoryBytes);
    if (!done) return fail(ErrorCode::kUnsupported, fmt::format("limits cannot be set ({})", std::strerror(errno)));
    return {};
}

/// File rights of Landlock's versions 1 to 5; older headers do not name all of them.
std::uint64_t handledRights(long version) {
    std::uint64_t rights = (1ull << 13) - 1;  // execute … make_sym
    if (version >= 2) rights |= 1ull << 13;   // refer
    if (version >= 3) rights |= 1ull << 14;   // truncate
    if (version >= 5) rights |= 1ull << 15;   // ioctl_dev
    return rights;
}

Expected<void> restrictFiles(const std::string& file) {
    const auto unsupported = [](const char* step) {
        return fail(ErrorCode::kUnsupported, fmt::format("Landlock: {} ({})", step, std::strerror(errno)));
    };
    const long version = ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
    if (version < 1) return unsupported("this kernel does not have it, or has it switched off");
    landlock_ruleset_attr attributes{};
    attributes.handled_access_fs = handledRights(version);
    const long ruleset = ::syscall(SYS_landlock_create_ruleset, &attributes, sizeof(attributes.handled_access_fs), 0);
    if (ruleset < 0) return unsupported("no rule set");
    // Beside a file in the root folder would be the whole system.
    const std::size_t slash = file.rfind('/');
    const bool inRoot = slash == 0;
    const std::string readable = inRoot ? file : file.substr(0, slash);
    landlock_path_beneath_attr rule{};
    rule.allowed_access = LANDLOCK_ACCESS_FS_READ_FILE | (inRoot ? 0 : LANDLOCK_ACCESS_FS_READ_DIR);
    rule.parent_fd = ::open(readable.c_str(), O_PATH | O_CLOEXEC);
    if (rule.parent_fd < 0) return fail(ErrorCode::kNotFound, fmt::format("{}: {}", readable, std::strerror(errno)));
    const bool added =
        ::syscall(SYS_landlock_add_rule, static_cast<int>(ruleset), LANDLOCK_RULE_PATH_BENEATH, &rule, 0) == 0;
    ::close(rule.parent_fd);
    if (!added) return unsupported("no rule");
    if (::syscall(SYS_landlock_restrict_self, static_cast<int>(ruleset), 0) != 0) return unsupported("not applied");
    ::close(static_cast<int>(ruleset));
    return {};
}

/// Asked for by nobody who reads a file: the process dies, and the parent says so.
constexpr int kFatalCalls[] = {SCMP_SYS(execve),
                               SCMP_SYS(execveat),
                               SCMP_SYS(socket),
                               SCMP_SYS(socketpair),
                               SCMP_SYS(connect),
                               SCMP_SYS(bind),
                               SCMP_SYS(listen),
                               SCMP_SYS(accept),
                               SCMP_SYS(accept4),
                               SCMP_SYS(sendto),
                               SCMP_SYS(sendmsg),
                               SCMP_SYS(sendmmsg),
                               SCMP_SYS(ptrace),
                               SCMP_SYS(process_vm_readv),
                               SCMP_SYS(process_vm_writev),
                               SCMP_SYS(bpf),
                               SCMP_SYS(mount),
                               SCMP_SYS(umount2),
                               SCMP_SYS(pivot_root),
                               SCMP_SYS(chroot),
                               SCMP_SYS(setns),
                               SCMP_SYS(unshare),
                               SCMP_SYS(init_module),
                               SCMP_SYS(finit_module),
                               SCMP_SYS(kexec_load),
                               SCMP_SYS(io_uring_setup),
                               SCMP_SYS(perf_event_open),
                               SCMP_SYS(keyctl),
                               SCMP_SYS(userfaultfd),
                               SCMP_SYS(pidfd_open),
                               SCMP_SYS(fork),
                               SCMP_SYS(vfork)};

/// Enough to read files, compute, write to the pipe and end. Everything else does not exist (ENOSYS), which libraries
/// cope with: they try older calls instead.
constexpr int kAllowedCalls[] = {SCMP_SYS(read),         SCMP_SYS(readv),           SCMP_SYS(pread64),
                                 SCMP_SYS(write),        SCMP_SYS(writev),          SCMP_SYS(close),
                                 SCMP_SYS(fstat),        SCMP_SYS(newfstatat),      SCMP_SYS(stat),
                                 SCMP_SYS(lstat),        SCMP_SYS(statx),           SCMP_SYS(lseek),
                                 SCMP_SYS(access),       SCMP_SYS(faccessat),       SCMP_SYS(faccessat2),
                                 SCMP_SYS(readlink),     SCMP_SYS(readlinkat),      SCMP_SYS(getcwd),
                                 SCMP_SYS(getdents64),   SCMP_SYS(fadvise64),       SCMP_SYS(brk),
                                 SCMP_SYS(munmap),       SCMP_SYS(mremap),          SCMP_SYS(madvise),
                                 SCMP_SYS(futex),        SCMP_SYS(getrandom),       SCMP_SYS(clock_gettime),
                                 SCMP_SYS(clock_getres), SCMP_SYS(gettimeofday),    SCMP_SYS(time),
                                 SCMP_SYS(rt_sigaction), SCMP_SYS(rt_sigprocmask),  SCMP_SYS(rt_sigreturn),
                                 SCMP_SYS(sigaltstack),  SCMP_SYS(getpid),          SCMP_SYS(gettid),
                                 SCMP_SYS(sched_yield),  SCMP_SYS(restart_syscall), SCMP_SYS(exit),
                                 SCMP_SYS(exit_group)};

Expected<void> restrictCalls() {
    const std::unique_ptr<std::remove_pointer_t<scmp_filter_ctx>, decltype(&seccomp_release)> filter(
        seccomp_init(SCMP_ACT_ERRNO(ENOSYS)), &seccomp_release);
    if (!filter) return fail(ErrorCode::kUnsupported, "seccomp: no filter");
    bool good = true;
    for (const int call : kFatalCalls)
        good = good && seccomp_rule_add(filter.get(), SCMP_ACT_KILL_PROCESS, call, 0) == 0;
    for (const int call : kAllowedCalls) good = good && seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, call, 0) == 0;
    // UBSan looks at memory through a pipe.
    if (kSanitized)
        for (const int call : {SCMP_SYS(pipe), SCMP_SYS(pipe2)})
            good = good && seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, call, 0) == 0;
    // Memory, but never executable memory.
    for (const int call : {SCMP_SYS(mmap), SCMP_SYS(mprotect)})
        good = good &&
               seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, call, 1, SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0)) == 0;
    // Files, but never for writing.
    constexpr std::uint64_t writing = O_ACCMODE | O_CREAT | O_TRUNC | (O_TMPFILE & ~O_DIRECTORY);
    good = good && seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, SCMP_SYS(openat), 1,
                                    SCMP_A2(SCMP_CMP_MASKED_EQ, writing, 0)) == 0;
    good = good && seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, SCMP_SYS(open), 1,
                                    SCMP_A1(SCMP_CMP_MASKED_EQ, writing, 0)) == 0;
    // What `grantTimeFor` asks for.
    good = good && seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, SCMP_SYS(prlimit64), 2, SCMP_A0(SCMP_CMP_EQ, 0), SCMP_A1(SCMP_CMP_EQ, RLIMIT_CPU)) == 0;
    // abort() sends a signal; only to itself.
    good = good && seccomp_rule_add(filter.get(), SCMP_ACT_ALLOW, SCMP_SYS(tgkill), 1,
                                    SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(::getpid()))) == 0;
    if (!good) return fail(ErrorCode::kUnsupported, "seccomp: the filter cannot be built");
    if (const int failure = seccomp_load(filter.get()); failure != 0)
        return fail(ErrorCode::kUnsupported, fmt::format("seccomp: {}", std::strerror(-failure)));
    return {};
}

}  // namespace

Expected<void> confine(const Confinement& confinement) {
    if (confinement.parent != 0) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        // The parent may have gone before that.
        if (::getppid() != confinement.parent) return fail(ErrorCode::kFailed, "the parent process is gone");
    }
    ::prctl(PR_SET_DUMPABLE, 0);
    if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 && !confinement.allowUnconfined)
        return fail(ErrorCode::kUnsupported, "this system cannot confine the importer: no PR_SET_NO_NEW_PRIVS");
    if (Expected<void> limited = limitResources(confinement); !limited) return limited;
    Expected<void> restricted = restrictFiles(confinement.file);
    if (restricted) restricted = restrictCalls();
    if (!restricted && !(restricted.error().code == ErrorCode::kUnsupported && confinement.allowUnconfined))
        return fail(restricted.error().code,
                    fmt::format("this system cannot confine the importer, so the file was not read: {}; "
                                "--allow-unconfined-import reads it all the same, at your own risk",
                                restricted.error().message));
    return {};
}

void grantTimeFor(std::size_t bytes) {
    granting.readBytes += bytes;
    const rlim_t more = granting.given + granting.perMebibyte * (granting.readBytes >> 20);
    if (granting.given > 0) (void)limitResource(RLIMIT_CPU, std::min(more, granting.most), granting.most + 2);
}

}  // namespace tessera
