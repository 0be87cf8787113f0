#include "deploy/wall/RemoteWall.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "common/base/Version.h"
#include "common/net/OwnAddress.h"
#include "common/wall/WindowLayout.h"
#include "deploy/wall/Machines.h"
#include "deploy/wall/OwnAddress.h"
#include "deploy/wall/Ssh.h"

namespace tessera {

namespace {

/// What stands in front of the first '=', as an option is named.
std::string_view optionOf(std::string_view argument) {
    return argument.starts_with("--") ? argument.substr(0, argument.find('=')) : std::string_view();
}

std::string hostIn(const std::string& destination) {
    return destination.substr(destination.rfind('@') + 1);  // all of it where there is no @
}

/// Without the port; brackets stay.
std::string addressIn(const std::string& listen) {
    return listen.substr(0, listen.rfind(':'));
}

/// Each machine's way back to this one.
Expected<std::vector<std::string>> waysBack(const std::vector<MachineAnswer>& answers) {
    std::vector<std::string> ways;
    for (const MachineAnswer& answer : answers) {
        // What the machine says itself is right where nothing translates addresses in between.
        if (!answer.seesUsAs.empty() && isOwnAddress(answer.seesUsAs)) {
            ways.push_back(answer.seesUsAs);
        } else if (auto towards = addressTowards(hostIn(answer.destination))) {
            ways.push_back(*towards);
        } else if (!answer.lacks.empty()) {
            ways.emplace_back("127.0.0.1");  // nobody knows its name: it will not be reached either
        } else {
            return fail(ErrorCode::kUnsupported, fmt::format("by which address does {} reach this machine? It sees us "
                                                             "as \"{}\", which is none of ours: say --listen ADDR:PORT",
                                                             answer.destination, answer.seesUsAs));
        }
    }
    return ways;
}

bool isAnyAddress(const std::string& address) {
    return address == "0.0.0.0" || address == "[::]";
}

/// Hosts of different pictures would show their seams.
void sayOddPixels(const std::vector<MachineAnswer>& answers, Console& console) {
    std::map<std::string, std::vector<std::string>> hosts;
    for (const MachineAnswer& answer : answers)
        if (!answer.pixels.empty()) hosts[answer.pixels].push_back(answer.host);
    if (hosts.size() < 2) return;
    const auto most = std::ranges::max_element(hosts, {}, [](const auto& group) { return group.second.size(); });
    for (const auto& [pixels, names] : hosts)
        if (pixels != most->first)
            for (const std::string& name : names)
                console.warning(fmt::format("host {} draws other pixels than host {}: its seams will show", name,
                                            most->second.front()));
}

/// Where the server listens, and the address that each host dials.
struct Meeting {
    std::string listen;
    std::map<std::string, std::string> dialled;  ///< by host, without the port
    std::string usual;                           ///< of a host that is not among them
};

Expected<Meeting> chooseMeeting(const std::vector<MachineAnswer>& answers, const std::string& listen) {
    Meeting meeting{.listen = listen, .dialled = {}, .usual = listen.empty() ? "" : addressIn(listen)};
    if (!listen.empty() && !isAnyAddress(meeting.usual)) return meeting;
    const auto ways = waysBack(answers);
    if (!ways) return tl::unexpected(ways.error());
    const ServerAddresses addresses = chooseAddresses(*ways);
    if (listen.empty()) meeting.listen = addresses.listen;
    for (std::size_t i = 0; i < answers.size(); ++i) meeting.dialled[answers[i].host] = addresses.dial[i];
    meeting.usual = addresses.dial.front();
    return meeting;
}

/// `neighbours`: hosts on that machine, this one among them.
RemoteClient remoteClient(const std::string& ssh, const MachineQuestion& question, const MachineAnswer& answer,
                          int neighbours, const std::vector<std::string>& ofAll, const std::string& address,
                          const std::string& keys) {
    std::vector<std::string> more = ofAll;
    if (!keys.empty()) more.insert(more.end(), {"--keys", "-"});
    // Several hosts on one machine share its processors, as those of this one do.
    if (neighbours > 1 && answer.cores > 0)
        more.insert(more.end(), {"--threads", std::to_string(std::max(0, answer.cores / neighbours - 1))});
    std::vector<std::string> arguments = {"--host", question.host, "--while-input",
                                          std::to_string(kPatienceOfClientsSeconds)};
    const std::vector<std::string> merged = mergedArguments(question.machine.arguments, more);
    arguments.insert(arguments.end(), merged.begin(), merged.end());
    return {.destination = question.machine.ssh,
            .command =
                [ssh, machine = question.machine, arguments, address, keys](const std::string& port) {
                    std::vector<std::string> all = {"--server", address + ":" + port};
                    all.insert(all.end(), arguments.begin(), arguments.end());
                    ChildCommand command = overSsh(ssh, machine, scriptOfClient(machine, all));
                    command.firstInput = keys;
                    return command;
                },
            .lacking = !answer.lacks.empty()};
}

}  // namespace

std::vector<std::string> mergedArguments(const std::vector<std::string>& own, const std::vector<std::string>& all) {
    std::set<std::string_view> said;
    for (const std::string& argument : own)
        if (const std::string_view option = optionOf(argument); !option.empty()) said.insert(option);
    std::vector<std::string> merged = own;
    bool taken = true;
    for (const std::string& argument : all) {
        if (const std::string_view option = optionOf(argument); !option.empty()) taken = !said.contains(option);
        if (taken) merged.push_back(argument);
    }
    return merged;
}

std::vector<std::string> withMonitorsOf(const Wall& wall, const std::string& host, std::vector<std::string> arguments) {
    constexpr std::size_t kMostMonitors = 64;  // that --window takes
    std::size_t told = 0, end = 0;             // behind the last of them
    bool inside = false;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        const std::string_view option = optionOf(arguments[i]);
        if (!option.empty()) inside = option == "--window";
        if (!inside) continue;
        end = i + 1;
        const std::string value =
            option.empty() ? arguments[i] : arguments[i].substr(std::min(arguments[i].size(), option.size() + 1));
        if (!value.empty()) ++told;
    }
    if (end == 0) return arguments;
    std::vector<std::string> named;
    std::size_t output = 0;
    const std::vector<Tile> tiles = tilesOf(wall, host);
    for (const Tile& tile : tiles) {
        if (tile.eye == Eye::kRight && partnerOf(tile, tiles)) continue;
        // What begins with '-' would be read as an option there.
        const std::string& monitor = tile.output.monitor;
        if (output++ >= told && told + named.size() < kMostMonitors && !monitor.empty() && monitor[0] != '-')
            named.push_back(monitor);
    }
    arguments.insert(arguments.begin() + static_cast<std::ptrdiff_t>(end), named.begin(), named.end());
    return arguments;
}

Expected<std::optional<RemoteWall>> prepareMachines(const Wall& wall, const RemoteOptions& options, Signals& signals,
                                                    Console& console) {
    const std::optional<std::string> ssh = findProgram(options.ssh);
    if (!ssh) return fail(ErrorCode::kNotFound, fmt::format("{} is not installed, and --start needs it", options.ssh));
    std::vector<MachineQuestion> questions;
    for (const WallHost& host : wall.hosts)
        if (host.machine)
            questions.push_back({.host = host.name,
                                 .machine = *host.machine,
                                 .arguments = withMonitorsOf(
                                     wall, host.name, mergedArguments(host.machine->arguments, options.client))});
    console.note(fmt::format("asking {} {}", questions.size(), questions.size() == 1 ? "machine" : "machines"));
    const auto answers = askMachines(questions, {.ssh = *ssh, .version = versionText("tessera-client")}, signals);
    if (!answers) return std::nullopt;

    std::vector<MachineAnswer> ready;
    std::map<std::string, int> hostsOn;  // by machine
    for (const MachineAnswer& answer : *answers) {
        for (const std::string& lack : answer.lacks)
            console.error(fmt::format("host {} on {}: {}", answer.host, answer.destination, lack));
        if (!answer.lacks.empty()) continue;
        ready.push_back(answer);
        ++hostsOn[answer.destination];
    }
    const std::size_t lacking = answers->size() - ready.size();
    if (lacking > 0 && !options.startAnyway)
        return fail(ErrorCode::kUnsupported,
                    fmt::format("{} of {} hosts cannot be started, so nothing is; --start-anyway goes on without them",
                                lacking, questions.size()));
    if (lacking == wall.hosts.size()) return fail(ErrorCode::kUnsupported, "no host can be started");
    sayOddPixels(ready, console);

    // Whoever lacks something now may be tried later, and is then told what the others are told; where none is ready,
    // what is known from here.
    const auto meeting = chooseMeeting(ready.empty() ? *answers : ready, options.listen);
    if (!meeting) return tl::unexpected(meeting.error());
    RemoteWall remote{.clients = {}, .listen = meeting->listen};
    for (std::size_t i = 0; i < questions.size(); ++i) {
        const Expected<std::string> bundle =
            options.keys != nullptr ? options.keys->bundleOf(questions[i].host) : std::string();
        if (!bundle) return tl::unexpected(bundle.error());
        const auto dialled = meeting->dialled.find(questions[i].host);
        const std::string& address = dialled != meeting->dialled.end() ? dialled->second : meeting->usual;
        remote.clients[questions[i].host] = remoteClient(
            *ssh, questions[i], (*answers)[i], hostsOn[questions[i].machine.ssh], options.client, address, *bundle);
    }
    console.note(options.listen.empty()
                     ? fmt::format("the server listens on {}, where the machines reach it", addressIn(remote.listen))
                     : fmt::format("the server listens on {}", remote.listen));
    return remote;
}

}  // namespace tessera
