/// A peer, or ourselves, in a process of its own that is asked by lines and answers with numbers.
#pragma once

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace tessera::bench {

/// Ends with its input. One that cannot start is told by its silence: ignore SIGPIPE.
class SideProcess {
public:
    explicit SideProcess(std::vector<std::string> command) : name_(command.front()) {
        int to[2], from[2];
        // Closed in the other side: an end that it held open would keep this one waiting for the end of its input.
        if (pipe2(to, O_CLOEXEC) != 0 || pipe2(from, O_CLOEXEC) != 0) std::abort();
        std::vector<char*> words;
        for (std::string& word : command) words.push_back(word.data());
        words.push_back(nullptr);
        std::fflush(stdout);
        pid_ = fork();
        if (pid_ == 0) {
            prctl(PR_SET_PDEATHSIG, SIGKILL);
            dup2(to[0], 0);
            dup2(from[1], 1);
            execv(words[0], words.data());
            _exit(127);
        }
        close(to[0]);
        close(from[1]);
        to_ = fdopen(to[1], "w");
        from_ = fdopen(from[0], "r");
    }
    ~SideProcess() {
        std::fclose(to_);  // the side ends with its input
        std::fclose(from_);
        waitpid(pid_, nullptr, 0);
    }
    SideProcess(const SideProcess&) = delete;
    SideProcess& operator=(const SideProcess&) = delete;

    /// Ends this program where there is no such answer.
    std::vector<double> ask(const std::string& what, std::size_t numbers) {
        std::vector<double> answer(numbers);
        bool good = std::fprintf(to_, "%s\n", what.c_str()) > 0 && std::fflush(to_) == 0;
        for (double& number : answer) good = good && std::fscanf(from_, "%lf", &number) == 1;
        if (good) return answer;
        std::fprintf(stderr, "%s did not answer '%s'\n", name_.c_str(), what.c_str());
        std::exit(1);
    }
    /// Whether it has said this word, before anything was asked.
    bool said(const std::string& word) {
        char read[64] = {};
        return std::fscanf(from_, "%63s", read) == 1 && word == read;
    }

private:
    std::string name_;
    pid_t pid_ = -1;
    std::FILE* to_ = nullptr;
    std::FILE* from_ = nullptr;
};

}  // namespace tessera::bench
