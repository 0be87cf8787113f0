/// A real process under test: started, read, waited for with a deadline, ended by its id.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

namespace tessera::test {

/// Both outputs go to one file in the test's folder. The process dies with its Process, and with the test.
class Process {
public:
    Process(const std::string& folder, const std::string& name, std::vector<std::string> command);
    ~Process();
    Process(Process&& other) noexcept;
    Process(const Process&) = delete;
    Process& operator=(Process&&) = delete;

    [[nodiscard]] pid_t pid() const { return pid_; }
    [[nodiscard]] const std::string& name() const { return name_; }
    /// All it has written so far.
    [[nodiscard]] std::string output() const;
    /// Waits until the output holds `text`. The rest of the line behind it; nothing at the deadline or when it ended
    /// without.
    [[nodiscard]] std::optional<std::string> waitForText(const std::string& text, std::chrono::milliseconds timeout);
    /// The exit code, or 128 + signal. Nothing at the deadline.
    [[nodiscard]] std::optional<int> waitForExit(std::chrono::milliseconds timeout);
    void signal(int number) const;
    [[nodiscard]] bool running();

private:
    std::string name_, file_;
    pid_t pid_ = -1;
    std::optional<int> exit_;
};

/// Of the memory of a process, as the kernel counts it. Zero when it has ended.
[[nodiscard]] std::size_t residentBytesOf(pid_t pid);

/// Runs to the end; the exit code is -1 when it did not end in time.
struct Outcome {
    int exitCode = -1;
    std::string output;
};
[[nodiscard]] Outcome run(const std::string& folder, std::vector<std::string> command,
                          std::chrono::milliseconds timeout = std::chrono::seconds(60));

/// A folder of the test's own, gone with it.
class TemporaryFolder {
public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    [[nodiscard]] const std::string& path() const { return path_; }
    /// Writes a file into it and returns its path.
    std::string write(const std::string& name, const std::string& content) const;

private:
    std::string path_;
};

/// Path of one of Tessera's programs.
[[nodiscard]] inline std::string program(const std::string& name) {
    return std::string(TESSERA_BIN_DIR) + "/" + name;
}
[[nodiscard]] std::string readText(const std::string& path);
/// What stands behind `text` in its line; nothing where there is no such line, or it has no end yet.
[[nodiscard]] std::optional<std::string> restOfLine(const std::string& all, const std::string& text);

}  // namespace tessera::test
