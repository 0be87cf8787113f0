#include "common/confine/Confinement.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/capability.h>
#include <linux/landlock.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <memory>
#include <span>
#include <type_traits>

#include "common/confine/OrdinaryFile.h"
#include "common/confine/SystemCalls.h"

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

/// Whoever started this may have set a tighter limit, which stands: to raise it is not for everybody.
bool limitResource(int resource, rlim_t soft, rlim_t hard) {
    const auto which = static_cast<decltype(RLIMIT_AS)>(resource);
    rlimit now{};
    if (::getrlimit(which, &now) != 0) return false;
    const rlimit limit{std::min({soft, hard, now.rlim_max}), std::min(hard, now.rlim_max)};
    return ::setrlimit(which, &limit) == 0;
}

/// What there is to grant, of this process.
struct Granting {
    rlim_t given = 0, most = 0, perMebibyte = 0;
    std::uint64_t readBytes = 0;
};
Granting granting;

/// Of the processor so far, rounded up.
rlim_t secondsUsed() {
    timespec used{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    return static_cast<rlim_t>(used.tv_sec) + (used.tv_nsec > 0 ? 1 : 0);
}

/// A sanitized child takes several times as long.
rlim_t allowance(std::chrono::seconds time) {
    return static_cast<rlim_t>(time.count()) * (kSanitized ? 3 : 1);
}

tl::unexpected<Error> noLimits() {
    return fail(ErrorCode::kUnsupported, fmt::format("limits cannot be set ({})", std::strerror(errno)));
}

/// All rights beyond a common user's; `reading`: but for that of reading any file, which a server that is an
/// administrator's has.
bool dropCapabilities(bool reading) {
    __user_cap_header_struct head{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct sets[_LINUX_CAPABILITY_U32S_3] = {};
    if (::syscall(SYS_capget, &head, sets) != 0) return false;
    for (std::size_t i = 0; i < std::size(sets); ++i) {
        const __u32 kept = reading && i == CAP_TO_INDEX(CAP_DAC_READ_SEARCH) ? CAP_TO_MASK(CAP_DAC_READ_SEARCH) : 0;
        sets[i].effective &= kept;
        sets[i].permitted &= kept;
        sets[i].inheritable = 0;
    }
    return ::syscall(SYS_capset, &head, sets) == 0;
}

/// What confines a thread leaves those beside it as they were.
bool isOneThread() {
    if (kSanitized) return true;  // a sanitizer may have one of its own
    // Refused to processes of several threads; else nothing.
    if (::unshare(CLONE_THREAD) == 0) return true;
    if (errno == EINVAL) return false;
    struct stat tasks {};
    return ::stat("/proc/self/task", &tasks) == 0 && tasks.st_nlink == 3;
}

// As in newer headers than some systems have.
struct RulesetAttributes {
    std::uint64_t files = 0, network = 0, scopes = 0;
};

long landlockVersion() {
    return ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
}

RulesetAttributes handledRights(long version) {
    RulesetAttributes handled{.files = (1ull << 13) - 1};  // execute … make_sym
    if (version >= 2) handled.files |= 1ull << 13;         // refer
    if (version >= 3) handled.files |= 1ull << 14;         // truncate
    if (version >= 4) handled.network = 0b11;              // bind, connect (TCP)
    if (version >= 5) handled.files |= 1ull << 15;         // ioctl_dev
    if (version >= 6) handled.scopes = 0b11;               // abstract sockets, signals
    return handled;
}

tl::unexpected<Error> noLandlock(std::string_view step) {
    return fail(ErrorCode::kUnsupported, fmt::format("Landlock: {} ({})", step, std::strerror(errno)));
}

Expected<void> allowReading(int ruleset, const std::string& file) {
    // Beside a file in the root folder would be the whole system.
    const std::size_t slash = file.rfind('/');
    const bool inRoot = slash == 0;
    const std::string readable = inRoot ? file : file.substr(0, slash);
    const Expected<FileHandle> place = openPlace(readable);
    if (!place) return failWith(readable, place.error());
    landlock_path_beneath_attr rule{};
    rule.allowed_access = LANDLOCK_ACCESS_FS_READ_FILE | (inRoot ? 0 : LANDLOCK_ACCESS_FS_READ_DIR);
    rule.parent_fd = place->get();
    if (::syscall(SYS_landlock_add_rule, ruleset, LANDLOCK_RULE_PATH_BENEATH, &rule, 0) != 0)
        return noLandlock("no rule");
    return {};
}

/// `file` empty: no file at all.
Expected<void> restrictFiles(const std::string& file) {
    const long version = landlockVersion();
    if (version < 1) return noLandlock("this kernel does not have it, or has it switched off");
    const RulesetAttributes attributes = handledRights(version);
    const FileHandle ruleset(
        static_cast<int>(::syscall(SYS_landlock_create_ruleset, &attributes, sizeof attributes, 0)));
    if (ruleset.get() < 0) return noLandlock("no rule set");
    if (!file.empty())
        if (Expected<void> allowed = allowReading(ruleset.get(), file); !allowed) return allowed;
    if (::syscall(SYS_landlock_restrict_self, ruleset.get(), 0) != 0) return noLandlock("not applied");
    return {};
}

/// The rules of a filter as they are added; good as long as all were taken.
class Filter {
public:
    Filter() : context_(seccomp_init(SCMP_ACT_ERRNO(ENOSYS)), &seccomp_release), good_(context_ != nullptr) {}

    void kill(std::span<const int> calls) {
        for (const int call : calls) add(SCMP_ACT_KILL_PROCESS, call);
    }
    void allow(std::span<const int> calls) {
        for (const int call : calls) add(SCMP_ACT_ALLOW, call);
    }
    template <typename... Conditions>
    void allowWhere(int call, Conditions... conditions) {
        add(SCMP_ACT_ALLOW, call, conditions...);
    }
    Expected<void> load() {
        if (!good_) return fail(ErrorCode::kUnsupported, "seccomp: the filter cannot be built");
        if (const int failure = seccomp_load(context_.get()); failure != 0)
            return fail(ErrorCode::kUnsupported, fmt::format("seccomp: {}", std::strerror(-failure)));
        return {};
    }

private:
    template <typename... Conditions>
    void add(std::uint32_t action, int call, Conditions... conditions) {
        good_ = good_ && seccomp_rule_add(context_.get(), action, call, sizeof...(conditions), conditions...) == 0;
    }

    std::unique_ptr<std::remove_pointer_t<scmp_filter_ctx>, decltype(&seccomp_release)> context_;
    bool good_;
};

/// For reading, and never so that the opening of a pipe would wait for somebody: with O_NONBLOCK, of a folder, or of a
/// place alone.
void allowOpening(Filter& filter) {
    constexpr std::uint64_t writing = O_ACCMODE | O_CREAT | O_TRUNC | (O_TMPFILE & ~O_DIRECTORY);
    for (const std::uint64_t how : {O_NONBLOCK, O_DIRECTORY, O_PATH}) {
        filter.allowWhere(SCMP_SYS(openat), SCMP_A2(SCMP_CMP_MASKED_EQ, writing | how, how));
        filter.allowWhere(SCMP_SYS(open), SCMP_A1(SCMP_CMP_MASKED_EQ, writing | how, how));
    }
}

Expected<void> restrictCalls(const ConfinementProfile& profile) {
    Filter filter;
    filter.kill(kFatalCalls);
    filter.allow(kComputing);
    if (kSanitized) filter.allow(kSanitizing);
    for (const int call : {SCMP_SYS(mmap), SCMP_SYS(mprotect)})
        if (profile.makesCode)
            filter.allowWhere(call);
        else
            filter.allowWhere(call, SCMP_A2(SCMP_CMP_MASKED_EQ, PROT_EXEC, 0));
    if (profile.readsFolder) {
        filter.allow(kLookingAtFiles);
        allowOpening(filter);
    }
    if (profile.extendsTime)
        filter.allowWhere(SCMP_SYS(prlimit64), SCMP_A0(SCMP_CMP_EQ, 0), SCMP_A1(SCMP_CMP_EQ, RLIMIT_CPU));
    // abort() sends a signal; only to itself.
    filter.allowWhere(SCMP_SYS(tgkill), SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(::getpid())));
    return filter.load();
}

Expected<void> restrict(const ConfinementProfile& profile, const std::string& file, bool allowUnconfined) {
    if (!isOneThread()) return fail(ErrorCode::kUnsupported, "it has several threads");
    if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return fail(ErrorCode::kUnsupported, "no PR_SET_NO_NEW_PRIVS");
    Expected<void> files = restrictFiles(file);
    // Where no file can be opened at all, the calls alone see to it.
    if (!files && files.error().code == ErrorCode::kUnsupported && (!profile.readsFolder || allowUnconfined))
        files = {};
    if (!files) return files;
    return restrictCalls(profile);
}

}  // namespace

Expected<void> boundResources(const ConfinementProfile& profile, pid_t parent) {
    if (parent != 0) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        // The parent may have gone before that.
        if (::getppid() != parent) return fail(ErrorCode::kFailed, "the parent process is gone");
    }
    ::prctl(PR_SET_DUMPABLE, 0);
    constexpr rlim_t kStack = rlim_t{16} << 20;
    bool done = limitResource(RLIMIT_CORE, 0, 0) && limitResource(RLIMIT_FSIZE, 0, 0) &&
                limitResource(RLIMIT_NOFILE, profile.openFiles, profile.openFiles) &&
                limitResource(RLIMIT_STACK, kStack, kStack);
    // The sanitizers' shadow memory is terabytes of address space.
    if (!kSanitized) done = done && limitResource(RLIMIT_AS, profile.memoryBytes, profile.memoryBytes);
    if (!done) return noLimits();
    // Nobody may raise them afterwards: root neither.
    if (!dropCapabilities(profile.readsFolder))
        return fail(ErrorCode::kUnsupported,
                    fmt::format("capabilities cannot be given away ({})", std::strerror(errno)));
    return {};
}

Expected<void> confine(const ConfinementProfile& profile, const std::string& file, bool allowUnconfined) {
    Expected<void> restricted = restrict(profile, profile.readsFolder ? file : std::string(), allowUnconfined);
    if (restricted || (restricted.error().code == ErrorCode::kUnsupported && allowUnconfined)) return {};
    if (restricted.error().code != ErrorCode::kUnsupported) return restricted;
    return fail(ErrorCode::kUnsupported, fmt::format("this system cannot confine {}, so {}: {}", profile.who,
                                                     profile.otherwise, restricted.error().message));
}

Expected<void> boundProcessorTime(const ProcessorTime& time) {
    const rlim_t given = allowance(time.given);
    granting = {.given = given,
                .most = std::max(given, static_cast<rlim_t>(time.most.count())),
                .perMebibyte = static_cast<rlim_t>(time.perMebibyte.count()),
                .readBytes = 0};
    // At the soft limit SIGXCPU says why; whoever ignores it dies at the hard one.
    if (!limitResource(RLIMIT_CPU, given, granting.most + 2)) return noLimits();
    return {};
}

Expected<void> boundFurtherTime(std::chrono::seconds more) {
    const rlim_t most = secondsUsed() + allowance(more);
    if (!limitResource(RLIMIT_CPU, most, most + 1)) return noLimits();
    return {};
}

void renewTime(std::chrono::seconds more) {
    rlimit now{};
    if (::getrlimit(RLIMIT_CPU, &now) == 0)
        (void)limitResource(RLIMIT_CPU, std::min(secondsUsed() + allowance(more), now.rlim_max), now.rlim_max);
}

void grantTimeFor(std::size_t bytes) {
    granting.readBytes += bytes;
    const rlim_t more = granting.given + granting.perMebibyte * (granting.readBytes >> 20);
    if (granting.given > 0) (void)limitResource(RLIMIT_CPU, std::min(more, granting.most), granting.most + 2);
}

std::uint64_t bytesGranted() {
    return granting.readBytes;
}

std::vector<std::string> missingForConfinement() {
    std::vector<std::string> missing;
    const std::uint32_t kill = SECCOMP_RET_KILL_PROCESS;
    if (::syscall(SYS_seccomp, SECCOMP_GET_ACTION_AVAIL, 0, &kill) != 0)
        missing.emplace_back(
            "this kernel has no seccomp: no file is read, no film played, no program of a material tried");
    if (landlockVersion() < 1)
        missing.emplace_back(
            "this kernel has no Landlock, or has it switched off: no file is read (--allow-unconfined-import reads "
            "files all the same)");
    return missing;
}

}  // namespace tessera
