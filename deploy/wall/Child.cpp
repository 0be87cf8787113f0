#include "deploy/wall/Child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>

namespace tessera {

namespace {

constexpr std::size_t kLongestLine = 8192;

struct PipeEnds {
    int read = -1, write = -1;
    PipeEnds() = default;
    PipeEnds(const PipeEnds&) = delete;
    PipeEnds& operator=(const PipeEnds&) = delete;
    ~PipeEnds() {
        if (read >= 0) ::close(read);
        if (write >= 0) ::close(write);
    }
    [[nodiscard]] bool open() {
        int ends[2];
        if (::pipe2(ends, O_CLOEXEC) != 0) return false;
        read = ends[0];
        write = ends[1];
        return true;
    }
};

/// Between fork and exec: nothing but calls that a signal handler may make.
[[noreturn]] void becomeProgram(const char* program, char* const* arguments, char* const* environment, pid_t parent,
                                int input, int output, int error, int failure) {
    const auto giveUp = [&] {
        const int reason = errno;
        [[maybe_unused]] const ssize_t told = ::write(failure, &reason, sizeof(reason));
        ::_exit(127);
    };
    if (::prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) giveUp();
    if (::getppid() != parent) ::_exit(127);  // gone before the line above
    ::setpgid(0, 0);
    sigset_t none;
    sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    ::signal(SIGPIPE, SIG_DFL);
    if (::dup2(input, STDIN_FILENO) < 0 || ::dup2(output, STDOUT_FILENO) < 0 || ::dup2(error, STDERR_FILENO) < 0)
        giveUp();
    ::execve(program, arguments, environment);
    giveUp();
    ::_exit(127);
}

/// Our environment with changes; the texts live as long as the vector of strings.
std::vector<std::string> changedEnvironment(const std::vector<std::pair<std::string, std::string>>& changes) {
    std::vector<std::string> all;
    for (char** entry = environ; *entry != nullptr; ++entry) {
        const std::string text(*entry);
        const bool replaced = std::any_of(changes.begin(), changes.end(), [&](const auto& change) {
            return text.compare(0, change.first.size() + 1, change.first + "=") == 0;
        });
        if (!replaced) all.push_back(text);
    }
    for (const auto& [name, value] : changes) all.push_back(fmt::format("{}={}", name, value));
    return all;
}

std::vector<char*> pointersTo(std::vector<std::string>& texts) {
    std::vector<char*> pointers;
    for (std::string& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    return pointers;
}

}  // namespace

std::optional<std::string> findProgram(const std::string& name) {
    namespace fs = std::filesystem;
    const auto runs = [](const fs::path& path) {
        std::error_code ignored;
        return fs::is_regular_file(path, ignored) && ::access(path.c_str(), X_OK) == 0;
    };
    if (name.find('/') != std::string::npos) return runs(name) ? std::optional(name) : std::nullopt;
    const char* const path = std::getenv("PATH");
    std::istringstream folders(path != nullptr ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');)
        if (const fs::path candidate = fs::path(folder.empty() ? "." : folder) / name; runs(candidate))
            return candidate.string();
    return std::nullopt;
}

std::string describe(const ChildEnd& end) {
    if (end.signalled) return fmt::format("was killed by signal {} ({})", end.value, ::strsignal(end.value));
    return fmt::format("ended with exit code {}", end.value);
}

std::string adviceAfter(const ChildEnd& end, const std::string& program) {
    constexpr std::array kCrashes{SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSYS, SIGTRAP};
    if (!end.signalled || std::ranges::find(kCrashes, end.value) == kCrashes.end()) return "";
    return fmt::format("; `coredumpctl info {}` shows where (troubleshooting.md, \"A program has crashed\")", program);
}

Expected<Child> Child::start(const ChildCommand& command) {
    const auto wrong = [&](int error) {
        return fail(error == ENOENT ? ErrorCode::kNotFound : ErrorCode::kFailed,
                    fmt::format("{} cannot be started: {}", command.program, std::strerror(error)));
    };
    PipeEnds input, output, error, failure;
    if (!output.open() || !error.open() || !failure.open()) return wrong(errno);
    if (command.feedInput) {
        if (!input.open()) return wrong(errno);
    } else {
        input.read = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
        if (input.read < 0) return wrong(errno);
    }
    std::vector<std::string> arguments = command.arguments;
    arguments.insert(arguments.begin(), command.program);
    std::vector<std::string> environment = changedEnvironment(command.environment);
    const std::vector<char*> argumentPointers = pointersTo(arguments);
    const std::vector<char*> environmentPointers = pointersTo(environment);

    const pid_t parent = ::getpid();
    const pid_t pid = ::fork();
    if (pid < 0) return wrong(errno);
    if (pid == 0) {
        becomeProgram(command.program.c_str(), argumentPointers.data(), environmentPointers.data(), parent, input.read,
                      output.write, error.write, failure.write);
    }

    Child child;
    child.pid_ = pid;
    child.running_ = true;
    ::close(std::exchange(failure.write, -1));
    int reason = 0;
    ssize_t told = 0;
    do {
        told = ::read(failure.read, &reason, sizeof(reason));
    } while (told < 0 && errno == EINTR);
    if (told == static_cast<ssize_t>(sizeof(reason))) return wrong(reason);

    child.streams_[kOut].handle = std::exchange(output.read, -1);
    child.streams_[kError].handle = std::exchange(error.read, -1);
    for (const Pipe& stream : child.streams_) ::fcntl(stream.handle, F_SETFL, O_NONBLOCK);
    child.input_ = std::exchange(input.write, -1);
    // One that has ended already says so itself.
    if (!command.firstInput.empty()) (void)child.feed(command.firstInput.data(), command.firstInput.size());
    return child;
}

Child::Child(Child&& other) noexcept
    : pid_(other.pid_),
      running_(std::exchange(other.running_, false)),
      input_(std::exchange(other.input_, -1)),
      streams_(std::move(other.streams_)) {
    for (Pipe& stream : other.streams_) stream.handle = -1;
}

Child& Child::operator=(Child&& other) noexcept {
    if (this == &other) return *this;
    release();
    pid_ = other.pid_;
    running_ = std::exchange(other.running_, false);
    input_ = std::exchange(other.input_, -1);
    streams_ = std::move(other.streams_);
    for (Pipe& stream : other.streams_) stream.handle = -1;
    return *this;
}

Child::~Child() {
    release();
}

void Child::release() {
    if (running_) {
        // With all that it started: an ssh's way over another machine is a process of its own.
        ::kill(-pid_, SIGKILL);
        while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
        }
        running_ = false;
    }
    closeInput();
    for (Pipe& stream : streams_) {
        if (stream.handle >= 0) ::close(std::exchange(stream.handle, -1));
    }
}

void Child::send(int signal) const {
    if (running_) ::kill(pid_, signal);
}

bool Child::stopped() const {
    siginfo_t info{};
    return running_ && ::waitid(P_PID, static_cast<id_t>(pid_), &info, WSTOPPED | WNOHANG | WNOWAIT) == 0 &&
           info.si_pid == pid_;
}

std::optional<ChildEnd> Child::reap() {
    if (!running_) return std::nullopt;
    siginfo_t ended{};
    if (::waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT) != 0 || ended.si_pid != pid_)
        return std::nullopt;
    // What it left behind, while its number is surely its own.
    ::kill(-pid_, SIGKILL);
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    running_ = false;
    if (WIFSIGNALED(status)) return ChildEnd{.signalled = true, .value = WTERMSIG(status)};
    return ChildEnd{.signalled = false, .value = WEXITSTATUS(status)};
}

std::vector<std::string> Child::readLines(Stream stream) {
    Pipe& pipe = streams_[stream];
    std::vector<std::string> lines;
    // A bound on how much is taken at once: one talkative child must not keep us from the others.
    for (int round = 0; round < 16 && pipe.handle >= 0; ++round) {
        char buffer[4096];
        const ssize_t got = ::read(pipe.handle, buffer, sizeof(buffer));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) break;
        if (got <= 0) {
            ::close(std::exchange(pipe.handle, -1));
            if (!pipe.partial.empty()) lines.push_back(std::exchange(pipe.partial, {}));
            break;
        }
        for (ssize_t i = 0; i < got; ++i) {
            if (buffer[i] != '\n') pipe.partial.push_back(buffer[i]);
            if (buffer[i] == '\n' || pipe.partial.size() >= kLongestLine)
                lines.push_back(std::exchange(pipe.partial, {}));
        }
    }
    return lines;
}

Expected<void> Child::feed(const void* data, std::size_t bytes) {
    const char* at = static_cast<const char*>(data);
    while (bytes > 0) {
        const ssize_t written = ::write(input_, at, bytes);
        if (written < 0 && errno == EINTR) continue;
        if (written < 0)
            return fail(ErrorCode::kFailed, fmt::format("process {} no longer reads: {}", pid_, std::strerror(errno)));
        at += written;
        bytes -= static_cast<std::size_t>(written);
    }
    return {};
}

void Child::closeInput() {
    if (input_ >= 0) ::close(std::exchange(input_, -1));
}

}  // namespace tessera
