/// The lists of system calls: the one place that says what a confined process may ask of the kernel.
#pragma once

#include <seccomp.h>

namespace tessera {

/// Asked for by nobody who reads, decodes or compiles: the process dies, and its parent says so.
inline constexpr int kFatalCalls[] = {
    // programs, processes
    SCMP_SYS(execve), SCMP_SYS(execveat), SCMP_SYS(fork), SCMP_SYS(vfork), SCMP_SYS(setns), SCMP_SYS(unshare),
    SCMP_SYS(pidfd_open),
    // networks
    SCMP_SYS(socket), SCMP_SYS(socketpair), SCMP_SYS(connect), SCMP_SYS(bind), SCMP_SYS(listen), SCMP_SYS(accept),
    SCMP_SYS(accept4), SCMP_SYS(sendto), SCMP_SYS(sendmsg), SCMP_SYS(sendmmsg),
    // other processes
    SCMP_SYS(ptrace), SCMP_SYS(process_vm_readv), SCMP_SYS(process_vm_writev), SCMP_SYS(kill), SCMP_SYS(tkill),
    SCMP_SYS(rt_sigqueueinfo), SCMP_SYS(rt_tgsigqueueinfo), SCMP_SYS(pidfd_send_signal),
    // the machine
    SCMP_SYS(mount), SCMP_SYS(umount2), SCMP_SYS(pivot_root), SCMP_SYS(chroot), SCMP_SYS(bpf), SCMP_SYS(init_module),
    SCMP_SYS(finit_module), SCMP_SYS(kexec_load), SCMP_SYS(perf_event_open), SCMP_SYS(keyctl), SCMP_SYS(add_key),
    SCMP_SYS(userfaultfd), SCMP_SYS(open_by_handle_at), SCMP_SYS(reboot),
    // what would ask past the filter
    SCMP_SYS(io_uring_setup), SCMP_SYS(io_uring_enter), SCMP_SYS(io_uring_register)};

/// Of everybody: to compute, to read and write what is open, and to end. Whatever is in no list does not exist
/// (ENOSYS), which libraries cope with: they try an older call, or do without.
inline constexpr int kComputing[] = {SCMP_SYS(read),
                                     SCMP_SYS(readv),
                                     SCMP_SYS(pread64),
                                     SCMP_SYS(write),
                                     SCMP_SYS(writev),
                                     SCMP_SYS(close),
                                     SCMP_SYS(fstat),
                                     SCMP_SYS(lseek),
                                     SCMP_SYS(poll),
                                     SCMP_SYS(ppoll),
                                     SCMP_SYS(brk),
                                     SCMP_SYS(munmap),
                                     SCMP_SYS(mremap),
                                     SCMP_SYS(madvise),
                                     SCMP_SYS(futex),
                                     SCMP_SYS(getrandom),
                                     SCMP_SYS(clock_gettime),
                                     SCMP_SYS(clock_getres),
                                     SCMP_SYS(gettimeofday),
                                     SCMP_SYS(time),
                                     SCMP_SYS(sched_yield),
                                     SCMP_SYS(sched_getaffinity),
                                     SCMP_SYS(rt_sigaction),
                                     SCMP_SYS(rt_sigprocmask),
                                     SCMP_SYS(rt_sigreturn),
                                     SCMP_SYS(sigaltstack),
                                     SCMP_SYS(getpid),
                                     SCMP_SYS(gettid),
                                     SCMP_SYS(restart_syscall),
                                     SCMP_SYS(exit),
                                     SCMP_SYS(exit_group)};

/// Of those that look at files in a folder; opening them has rules of its own.
inline constexpr int kLookingAtFiles[] = {SCMP_SYS(newfstatat), SCMP_SYS(stat),       SCMP_SYS(lstat),
                                          SCMP_SYS(statx),      SCMP_SYS(access),     SCMP_SYS(faccessat),
                                          SCMP_SYS(faccessat2), SCMP_SYS(readlink),   SCMP_SYS(readlinkat),
                                          SCMP_SYS(getcwd),     SCMP_SYS(getdents64), SCMP_SYS(fadvise64)};

/// Of sanitizers, which look at memory through a pipe.
inline constexpr int kSanitizing[] = {SCMP_SYS(pipe), SCMP_SYS(pipe2)};

}  // namespace tessera
