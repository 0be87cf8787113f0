#include "deploy/wall/Ssh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace tessera {

namespace {

/// The program with its variables, as a command of a shell.
std::string callOf(const Machine& machine, const std::vector<std::string>& arguments) {
    std::string call;
    if (!machine.display.empty() || !machine.environment.empty()) {
        call = "env";
        if (!machine.display.empty()) call += " " + shellWord("DISPLAY=" + machine.display);
        for (const auto& [name, value] : machine.environment) call += " " + shellWord(name + "=" + value);
        call += " ";
    }
    call += shellWord(machine.command);
    for (const std::string& argument : arguments) call += " " + shellWord(argument);
    return call;
}

}  // namespace

std::string shellWord(std::string_view text) {
    std::string word = "'";
    for (const char c : text) {
        if (c == '\'')
            word += "'\\''";
        else
            word.push_back(c);
    }
    return word + "'";
}

ChildCommand overSsh(const std::string& ssh, const Machine& machine, const std::string& script) {
    ChildCommand command{.program = ssh, .feedInput = true};
    std::vector<std::string>& a = command.arguments;
    a = {"-T", "-x", "-a", "-o", "BatchMode=yes", "-o", "ConnectTimeout=10",
         // A machine that falls silent is noticed after a quarter of a minute.
         "-o", "ServerAliveInterval=5", "-o", "ServerAliveCountMax=3",
         // Neither through another connection, which could end without this one, nor with its tunnels.
         "-o", "ControlPath=none", "-o", "ClearAllForwardings=yes"};
    if (machine.port != 0) a.insert(a.end(), {"-p", std::to_string(machine.port)});
    // Whatever the account's shell is, the script is for a POSIX one.
    a.insert(a.end(), {"--", machine.ssh, "exec sh -c " + shellWord(script)});
    return command;
}

std::string scriptOfClient(const Machine& machine, const std::vector<std::string>& arguments) {
    return callOf(machine, arguments) + "; exit $?";
}

std::string scriptOfQuestion(const Machine& machine, const std::vector<std::string>& arguments) {
    std::vector<std::string> check = arguments;
    check.emplace_back("--check");
    return fmt::format(
        // What a program says last need not end its line.
        "r() {{ printf '\\n%s\\n' \"tessera-wall: $*\"; }}; r there \"${{SSH_CONNECTION%% *}}\"; {} </dev/null; r "
        "version $?; {} </dev/null; r check $?",
        callOf(machine, {"--version"}), callOf(machine, check));
}

std::string whySshFailed(const std::vector<std::string>& errorLines, const std::string& login) {
    const auto said = [&](std::string_view words) {
        return std::ranges::any_of(errorLines,
                                   [&](const std::string& line) { return line.find(words) != std::string::npos; });
    };
    const std::string last = errorLines.empty() ? "ssh said nothing" : errorLines.back();
    if (said("REMOTE HOST IDENTIFICATION HAS CHANGED"))
        return fmt::format(
            "its host key has changed: where that is right, say `ssh-keygen -R` for it and `{}` once by hand", login);
    if (said("Host key verification failed") || said("No matching host key fingerprint"))
        return fmt::format("its host key is not known here: say `{}` once by hand", login);
    if (said("Permission denied") || said("Too many authentication failures"))
        return fmt::format(
            "it lets nobody in without a password: permission denied; `ssh-copy-id` lays a key there, `{}` tries it",
            login);
    if (said("Could not resolve hostname")) return "nobody knows its name: " + last;
    if (said("Connection refused")) return "no ssh server answers there: " + last;
    if (said("timed out") || said("No route to host") || said("unreachable")) return "it cannot be reached: " + last;
    return "ssh found no way there: " + last;
}

std::string loginByHand(const Machine& machine) {
    return machine.port == 0 ? "ssh " + machine.ssh : fmt::format("ssh -p {} {}", machine.port, machine.ssh);
}

std::string describeRemote(const ChildEnd& end, const std::string& destination) {
    if (!end.signalled && end.value == kSshFailed)
        return fmt::format("is lost: the connection to {} has ended", destination);
    if (!end.signalled && end.value > 128)
        return fmt::format("was killed on {} by signal {} ({})", destination, end.value - 128,
                           ::strsignal(end.value - 128));
    if (!end.signalled && end.value == 127) return fmt::format("is not installed on {}", destination);
    return describe(end);
}

}  // namespace tessera
