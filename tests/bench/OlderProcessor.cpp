#include "tests/bench/OlderProcessor.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

namespace tessera {

std::map<std::string, std::vector<double>> ratiosOfOlderProcessor(std::vector<std::string> words) {
    const std::string json =
        (std::filesystem::temp_directory_path() / ("bench-sse41-" + std::to_string(getpid()))).string();
    words.insert(words.end(), {"--json", json});
    std::printf("First the same with sse41 in a process of its own ...\n");
    std::fflush(stdout);
    const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
    std::vector<const char*> arguments{program.c_str()};
    for (const std::string& word : words) arguments.push_back(word.c_str());
    arguments.push_back(nullptr);
    const pid_t child = fork();
    if (child == 0) {
        setenv("TESSERA_ISA", "sse41", 1);
        const int nowhere = open("/dev/null", O_WRONLY);
        dup2(nowhere, STDOUT_FILENO);
        execv(program.c_str(), const_cast<char* const*>(arguments.data()));
        _exit(127);
    }
    int status = 0;
    std::map<std::string, std::vector<double>> out;
    std::ifstream in;
    if (child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0)
        in.open(json);
    const nlohmann::json read = in.is_open() ? nlohmann::json::parse(in, nullptr, false) : nlohmann::json();
    if (!read.is_object())
        std::printf("That did not work; there will be no such column.\n");
    else
        for (const auto& row : read["cases"]) out[row["case"].get<std::string>()].push_back(row["ratio"].get<double>());
    std::error_code ignored;
    std::filesystem::remove(json, ignored);
    return out;
}

}  // namespace tessera
