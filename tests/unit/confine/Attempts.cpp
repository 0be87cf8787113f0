#include "tests/unit/confine/Attempts.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/io_uring.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <array>
#include <cerrno>

namespace tessera::test {
namespace {

bool opens(const std::string& path, int flags) {
    return ::open(path.c_str(), flags | O_CLOEXEC | O_NONBLOCK, 0600) >= 0;
}

bool connects(int port) {
    const int out = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in there{};
    there.sin_family = AF_INET;
    there.sin_port = htons(static_cast<std::uint16_t>(port));
    there.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return out >= 0 && ::connect(out, reinterpret_cast<const sockaddr*>(&there), sizeof there) == 0;
}

bool readsMemoryOf(pid_t process) {
    char here = 0;
    iovec into{&here, 1}, from{&here, 1};
    // EFAULT: it was looked at.
    return ::process_vm_readv(process, &into, 1, &from, 1, 0) >= 0 || errno == EFAULT;
}

bool sharesMemory() {
    const int shared = ::shmget(IPC_PRIVATE, 4096, IPC_CREAT | 0600);
    return shared >= 0 && (::shmctl(shared, IPC_RMID, nullptr), true);
}

bool watchesFile(const std::string& file) {
    const long watch = ::syscall(SYS_inotify_init1, 0);
    return watch >= 0 && ::syscall(SYS_inotify_add_watch, watch, file.c_str(), 1) >= 0;
}

bool startsThread() {
    pthread_t thread{};
    return ::pthread_create(
               &thread, nullptr, [](void*) -> void* { return nullptr; }, nullptr) == 0;
}

bool forks(pid_t child) {
    if (child == 0) ::_exit(0);
    if (child > 0) ::waitpid(child, nullptr, 0);
    return child > 0;
}

template <typename... Numbers>
bool calls(long number, Numbers... arguments) {
    return ::syscall(number, arguments...) >= 0;
}

}  // namespace

std::vector<Attempt> forbiddenAttempts() {
    using V = const Victims&;
    return {
        {"open /etc/passwd", [](V) { return opens("/etc/passwd", O_RDONLY); }},
        {"open what the kernel tells of processes",
         [](V) { return opens("/proc/self/maps", O_RDONLY) || opens("/proc/1/status", O_RDONLY); }},
        {"open a terminal", [](V) { return opens("/dev/tty", O_RDWR) || opens("/dev/ptmx", O_RDWR); }},
        {"read somebody's file", [](V v) { return opens(v.file, O_RDONLY); }},
        {"write it", [](V v) { return opens(v.file, O_WRONLY); }},
        {"make a file", [](V v) { return opens(v.folder + "/new", O_CREAT | O_RDWR); }},
        {"make a file without a name", [](V v) { return opens(v.folder, O_TMPFILE | O_RDWR); }},
        {"empty it", [](V v) { return ::truncate(v.file.c_str(), 0) == 0; }},
        {"change who may",
         [](V v) {
             return ::chmod(v.file.c_str(), 0777) == 0 || ::lchown(v.file.c_str(), ::getuid(), ::getgid()) == 0;
         }},
        {"change its times", [](V v) { return ::utimensat(AT_FDCWD, v.file.c_str(), nullptr, 0) == 0; }},
        {"note something at it",
         [](V v) {
             return ::setxattr(v.file.c_str(), "user.note", "x", 1, 0) == 0 ||
                    ::setxattr(v.file.c_str(), "trusted.note", "x", 1, 0) == 0;
         }},
        {"remove it", [](V v) { return ::unlink(v.file.c_str()) == 0; }},
        {"rename it", [](V v) { return ::rename(v.file.c_str(), (v.file + "2").c_str()) == 0; }},
        {"link to it",
         [](V v) {
             return ::link(v.file.c_str(), (v.file + "3").c_str()) == 0 ||
                    ::symlink(v.file.c_str(), (v.file + "4").c_str()) == 0;
         }},
        {"make a folder", [](V v) { return ::mkdir((v.folder + "/folder").c_str(), 0700) == 0; }},
        {"make a pipe with a name", [](V v) { return ::mkfifo((v.folder + "/fifo").c_str(), 0600) == 0; }},
        {"make a file in memory", [](V) { return ::memfd_create("x", 0) >= 0; }},
        {"share memory", [](V) { return sharesMemory(); }},
        {"watch files",
         [](V v) {
             return calls(SYS_fanotify_init, 0, 0) || calls(SYS_open_by_handle_at, 0, 0, 0) || watchesFile(v.file);
         }},
        {"make a socket", [](V) { return ::socket(AF_INET, SOCK_STREAM, 0) >= 0; }},
        {"make a local socket", [](V) { return ::socket(AF_UNIX, SOCK_STREAM, 0) >= 0; }},
        {"talk to the kernel's own", [](V) { return ::socket(AF_NETLINK, SOCK_RAW, 0) >= 0; }},
        {"make two sockets",
         [](V) {
             std::array<int, 2> ends{};
             return ::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) == 0;
         }},
        {"connect", [](V v) { return connects(v.listener); }},
        {"fork", [](V) { return forks(::fork()); }},
        {"fork by the oldest call", [](V) { return forks(static_cast<pid_t>(::syscall(SYS_fork))); }},
        {"fork by clone3",
         [](V) {
             std::array<std::uint64_t, 11> how{};
             how[4] = SIGCHLD;
             return forks(static_cast<pid_t>(::syscall(SYS_clone3, how.data(), sizeof how)));
         }},
        {"start a thread", [](V) { return startsThread(); }},
        {"start a program",
         [](V) { return ::execl("/bin/false", "false", nullptr) == 0; }},  // which ends as one that succeeds
        {"be traced", [](V) { return ::ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) == 0; }},
        {"trace", [](V v) { return ::ptrace(PTRACE_SEIZE, v.process, nullptr, nullptr) == 0; }},
        {"read another's memory", [](V v) { return readsMemoryOf(v.process); }},
        {"signal another", [](V v) { return ::kill(v.process, 0) == 0; }},
        {"signal another's thread",
         [](V v) { return calls(SYS_tgkill, v.process, v.process, 0) || calls(SYS_tkill, v.process, 0); }},
        {"signal another with a word",
         [](V v) {
             siginfo_t word{};
             word.si_code = SI_QUEUE;
             return calls(SYS_rt_sigqueueinfo, v.process, 0, &word);
         }},
        {"hold another", [](V v) { return calls(SYS_pidfd_open, v.process, 0); }},
        {"slow another down", [](V v) { return ::setpriority(PRIO_PROCESS, static_cast<id_t>(v.process), 19) == 0; }},
        {"bind another to a processor",
         [](V v) {
             cpu_set_t all;
             CPU_ZERO(&all);
             for (int i = 0; i < CPU_SETSIZE; ++i) CPU_SET(i, &all);
             return ::sched_setaffinity(v.process, sizeof all, &all) == 0;
         }},
        {"limit another",
         [](V v) {
             const rlimit same{RLIM_INFINITY, RLIM_INFINITY};
             return ::prlimit(v.process, RLIMIT_FSIZE, &same, nullptr) == 0;
         }},
        {"raise its own limits",
         [](V) {
             const rlimit more{RLIM_INFINITY, RLIM_INFINITY};
             return ::setrlimit(RLIMIT_AS, &more) == 0 || ::setrlimit(RLIMIT_FSIZE, &more) == 0 ||
                    ::prlimit(0, RLIMIT_NOFILE, &more, nullptr) == 0;
         }},
        {"mount",
         [](V v) {
             return ::mount("none", v.folder.c_str(), "tmpfs", 0, nullptr) == 0 && (::umount(v.folder.c_str()), true);
         }},
        {"mount by the newer calls",
         [](V) { return calls(SYS_fsopen, "tmpfs", 0) || calls(SYS_open_tree, -100, "/", 0); }},
        {"be in another world", [](V) { return ::unshare(CLONE_NEWUSER) == 0 || ::unshare(CLONE_NEWNS) == 0; }},
        {"be in another root", [](V v) { return ::chroot(v.folder.c_str()) == 0; }},
        {"submit calls past the filter",
         [](V) {
             io_uring_params asked{};
             return calls(SYS_io_uring_setup, 4, &asked);
         }},
        {"load code into the kernel", [](V) { return calls(SYS_bpf, 0, 0, 0) || errno == EINVAL || errno == EFAULT; }},
        {"measure the kernel", [](V) { return calls(SYS_perf_event_open, 0, 0, -1, -1, 0) || errno == EFAULT; }},
        {"handle faults of memory", [](V) { return calls(SYS_userfaultfd, 0) || calls(SYS_userfaultfd, 1); }},
        {"keep keys", [](V) { return calls(SYS_add_key, "user", "x", "x", 1, -2); }},
        {"name the machine",
         [](V) {
             char name[256] = {};
             return ::gethostname(name, sizeof name - 1) == 0 &&
                    ::sethostname(name, std::char_traits<char>::length(name)) == 0;
         }},
        {"have another user", [](V) { return ::setuid(65534) == 0; }},
        {"have more memory than there may be",
         [](V) {
             return ::mmap(nullptr, std::size_t{3} << 30, PROT_READ | PROT_WRITE,
                           MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0) != MAP_FAILED;
         }},
    };
}

Attempt makingCode() {
    return {"make code", [](const Victims&) {
                void* const page = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
                return ::mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) != MAP_FAILED ||
                       ::mprotect(page, 4096, PROT_READ | PROT_EXEC) == 0;
            }};
}

}  // namespace tessera::test
