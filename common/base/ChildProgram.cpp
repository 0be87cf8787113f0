#include "common/base/ChildProgram.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "common/base/FileHandle.h"
#include "common/base/Shortage.h"

namespace tessera {
namespace {

/// As execve takes them; `words` stay where they are.
std::vector<char*> pointersTo(std::vector<std::string>& words) {
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    return pointers;
}

}  // namespace

std::string pathBesideThisProgram(std::string_view name) {
    std::array<char, 4096> self{};
    const ssize_t length = ::readlink("/proc/self/exe", self.data(), self.size() - 1);
    const std::string path(self.data(), length > 0 ? static_cast<std::size_t>(length) : 0);
    const std::string folder = path.substr(0, path.rfind('/') + 1);
    std::string beside = folder + std::string(name), installed = folder + "../libexec/tessera/" + std::string(name);
    return ::access(beside.c_str(), X_OK) != 0 && ::access(installed.c_str(), X_OK) == 0 ? installed : beside;
}

Expected<ChildProgram> ChildProgram::start(const Options& options) {
    std::vector<std::string> words = {options.path}, variables = {"LC_ALL=C"};
    words.insert(words.end(), options.arguments.begin(), options.arguments.end());
    variables.insert(variables.end(), options.environment.begin(), options.environment.end());
    const std::vector<char*> arguments = pointersTo(words), environment = pointersTo(variables);

    int last = 2;
    for (const Given& given : options.files) last = std::max(last, given.as);
    // Under numbers that none of the child's own has: one would be written over before it is passed on, or keep its
    // close-on-exec.
    std::vector<FileHandle> apart;
    for (const Given& given : options.files) {
        apart.emplace_back(::fcntl(given.file, F_DUPFD_CLOEXEC, last + 1));
        if (apart.back().get() < 0) {
            noteFailedCall(errno);
            return fail(ErrorCode::kFailed, fmt::format("'{}' cannot be started: a file of its own: {}", options.path,
                                                        std::strerror(errno)));
        }
    }
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    for (int number = 0; number <= last; ++number) {
        if (std::ranges::find(options.files, number, &Given::as) != options.files.end()) continue;
        if (number <= 2)
            posix_spawn_file_actions_addopen(&files, number, "/dev/null", number == 0 ? O_RDONLY : O_WRONLY, 0);
        else
            posix_spawn_file_actions_addclose(&files, number);
    }
    for (std::size_t i = 0; i < apart.size(); ++i)
        posix_spawn_file_actions_adddup2(&files, apart[i].get(), options.files[i].as);
    posix_spawn_file_actions_addclosefrom_np(&files, last + 1);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    ChildProgram child;
    const int failure =
        ::posix_spawn(&child.pid_, options.path.c_str(), &files, &attributes, arguments.data(), environment.data());
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
    if (failure == 0) return child;
    child.pid_ = -1;
    noteFailedCall(failure);
    if (isShortage(failure))
        return fail(ErrorCode::kFailed,
                    fmt::format("'{}' cannot be started: {}", options.path, std::strerror(failure)));
    return fail(ErrorCode::kFailed, fmt::format("'{}' cannot be started: {}; it belongs beside the running program",
                                                options.path, std::strerror(failure)));
}

int ChildProgram::reap() {
    int status = 0;
    if (pid_ > 0)
        while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
        }
    pid_ = -1;
    return status;
}

int ChildProgram::kill() {
    if (pid_ > 0) ::kill(pid_, SIGKILL);
    return reap();
}

}  // namespace tessera
