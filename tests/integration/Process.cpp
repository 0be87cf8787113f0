#include "tests/integration/Process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include "tests/unit/Eventually.h"

namespace tessera::test {

Process::Process(const std::string& folder, const std::string& name, std::vector<std::string> command) : name_(name) {
    static int counter = 0;
    file_ = folder + "/" + name + "." + std::to_string(counter++) + ".log";
    std::vector<char*> arguments;
    for (std::string& word : command) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const pid_t parent = getpid();
    const int out = open(file_.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0600);
    pid_ = fork();
    if (pid_ == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent) _exit(127);
        dup2(out, 1);
        dup2(out, 2);
        const int nothing = open("/dev/null", O_RDONLY);
        dup2(nothing, 0);
        execv(arguments[0], arguments.data());
        _exit(127);
    }
    close(out);
}

Process::Process(Process&& other) noexcept
    : name_(other.name_), file_(other.file_), pid_(std::exchange(other.pid_, -1)), exit_(other.exit_) {}

Process::~Process() {
    if (pid_ <= 0 || exit_) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
}

std::string Process::output() const {
    return readText(file_);
}

std::optional<std::string> Process::waitForText(const std::string& text, std::chrono::milliseconds timeout) {
    std::optional<std::string> rest;
    (void)eventually(
        [&] {
            const bool ended = !running();
            rest = restOfLine(output(), text);
            return ended || rest;
        },
        timeout);
    return rest;
}

std::optional<int> Process::waitForExit(std::chrono::milliseconds timeout) {
    return eventually([&] { return !running(); }, timeout) ? exit_ : std::nullopt;
}

void Process::signal(int number) const {
    if (pid_ > 0 && !exit_) kill(pid_, number);
}

std::size_t residentBytesOf(pid_t pid) {
    const std::string process = "/proc/" + std::to_string(pid);
    std::ifstream statm(process + "/statm");
    std::size_t total = 0, resident = 0, shared = 0;
    statm >> total >> resident >> shared;
    // Pages of arrays (common/base/PagedBytes.h) count whether they are mapped or not, and once.
    std::size_t paged = 0;
    std::error_code error;
    for (const auto& file : std::filesystem::directory_iterator(process + "/fd", error)) {
        struct stat status {};
        if (std::filesystem::read_symlink(file.path(), error).string().starts_with("/memfd:tessera-pages") &&
            ::stat(file.path().c_str(), &status) == 0)
            paged += static_cast<std::size_t>(status.st_blocks) * 512;
    }
    return (resident - shared) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) + paged;
}

bool Process::running() {
    if (exit_ || pid_ <= 0) return false;
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) != pid_) return true;
    exit_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return false;
}

Outcome run(const std::string& folder, std::vector<std::string> command, std::chrono::milliseconds timeout) {
    const std::string name = std::filesystem::path(command.front()).filename();
    Process process(folder, name, std::move(command));
    const std::optional<int> code = process.waitForExit(timeout);
    return {.exitCode = code.value_or(-1), .output = process.output()};
}

TemporaryFolder::TemporaryFolder() {
    std::string pattern = std::filesystem::temp_directory_path().string() + "/tessera-test-XXXXXX";
    path_ = mkdtemp(pattern.data());
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

std::string TemporaryFolder::write(const std::string& name, const std::string& content) const {
    const std::string path = path_ + "/" + name;
    std::ofstream(path, std::ios::binary) << content;
    return path;
}

std::string readText(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
}

std::optional<std::string> restOfLine(const std::string& all, const std::string& text) {
    const std::size_t at = all.find(text);
    const std::size_t end = at == std::string::npos ? at : all.find('\n', at);
    if (end == std::string::npos) return std::nullopt;
    return all.substr(at + text.size(), end - at - text.size());
}

}  // namespace tessera::test
