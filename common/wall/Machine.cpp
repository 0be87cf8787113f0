#include "common/wall/Machine.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace tessera {

namespace {

constexpr std::size_t kMostOfAMachine = 64;
constexpr std::size_t kLongestDestination = 255;  // of a name of the Internet (RFC 1035, 2.3.4)
constexpr std::size_t kLongestText = 4096;

bool hasControlCharacter(std::string_view text) {
    return std::ranges::any_of(text, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
}

/// Nothing: it can be handed on, quoted.
std::optional<std::string> findTextFault(std::string_view what, const std::string& text) {
    if (text.size() > kLongestText)
        return fmt::format("has {} of {} bytes: at most {} are possible", what, text.size(), kLongestText);
    if (hasControlCharacter(text)) return fmt::format("has a line break or another control character in {}", what);
    return std::nullopt;
}

bool isLetterOrDigit(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

std::optional<std::string> findDestinationFault(const std::string& ssh) {
    if (ssh.empty()) return "has no address: add `ssh: \"user@wall-3\"`";
    if (ssh.size() > kLongestDestination)
        return fmt::format("has an address of {} bytes: at most {} are possible", ssh.size(), kLongestDestination);
    if (ssh.front() == '-') return fmt::format("has the address \"{}\": ssh would take it for an option", ssh);
    const bool known = std::ranges::all_of(ssh, [](char c) {
        return isLetterOrDigit(c) || std::string_view("@._-:%[]").find(c) != std::string_view::npos ||
               static_cast<unsigned char>(c) >= 0x80;
    });
    if (!known)
        return "has an address with a character that none has: write user@wall-3, an address, or a name of ssh's "
               "configuration";
    const std::size_t at = ssh.rfind('@');
    if (at == 0 || at + 1 == ssh.size())
        return fmt::format("has the address \"{}\": something is missing beside the @", ssh);
    // ssh would look for an account of that name only after it had split at the last @.
    if (at != std::string::npos && ssh[at + 1] == '-')
        return fmt::format("has the address \"{}\": ssh would take it for an option", ssh);
    return std::nullopt;
}

bool isVariable(std::string_view name) {
    if (name.empty() || (name.front() >= '0' && name.front() <= '9')) return false;
    return std::ranges::all_of(name, [](char c) { return isLetterOrDigit(c) || c == '_'; });
}

}  // namespace

std::optional<std::string> findMachineFault(const Machine& machine) {
    if (auto fault = findDestinationFault(machine.ssh)) return fault;
    if (machine.port < 0 || machine.port > 65535)
        return fmt::format("has port {}: 1 to 65535 are possible", machine.port);
    if (machine.command.empty() || machine.command.front() == '-')
        return fmt::format("has the command \"{}\": that is no program", machine.command);
    if (auto fault = findTextFault("the command", machine.command)) return fault;
    if (auto fault = findTextFault("the display", machine.display)) return fault;
    if (machine.environment.size() > kMostOfAMachine || machine.arguments.size() > kMostOfAMachine)
        return fmt::format("has {} variables and {} args: at most {} of each are possible", machine.environment.size(),
                           machine.arguments.size(), kMostOfAMachine);
    for (const auto& [name, value] : machine.environment) {
        if (name.size() > kLongestDestination || !isVariable(name))
            return "has a variable whose name no shell knows: letters, digits and _ are possible, no digit in front";
        if (auto fault = findTextFault("variable " + name, value)) return fault;
    }
    for (const std::string& argument : machine.arguments) {
        if (auto fault = findTextFault("args", argument)) return fault;
        for (const std::string_view own : {"--server", "--host", "--while-input"})
            if (argument == own || argument.starts_with(std::string(own) + "="))
                return fmt::format("has {} in args: tessera-wall says that itself", own);
    }
    return std::nullopt;
}

}  // namespace tessera
