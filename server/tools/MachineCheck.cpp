#include "server/tools/MachineCheck.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "common/access/LocalWalls.h"
#include "common/base/ChildProgram.h"
#include "common/base/Clock.h"
#include "common/base/FileHandle.h"
#include "common/base/Version.h"
#include "common/confine/Confinement.h"
#include "common/net/PortHolder.h"
#include "server/text/Typesetter.h"

namespace tessera {
namespace {

using State = MachineFinding::State;

constexpr std::chrono::seconds kLongestAnswer{10};
constexpr std::size_t kMostSaid = std::size_t{64} << 10;
constexpr std::uint16_t kUsualPort = 7000;  // of the guides and of deploy/units
constexpr rlim_t kFilesWanted = 1024;       // 64 programs, 256 connections of the console, files, and their reserve
constexpr std::uint64_t kSharedWanted = std::uint64_t{256} << 20, kMemoryWanted = std::uint64_t{2} << 30;

/// What `tessera-client --check` says: facts by their word, and troubles.
struct ClientsWord {
    std::vector<std::pair<std::string, std::string>> facts;
    std::vector<std::string> troubles;

    [[nodiscard]] std::string fact(std::string_view word) const {
        const auto found = std::ranges::find(facts, word, &std::pair<std::string, std::string>::first);
        return found == facts.end() ? "" : found->second;
    }
    [[nodiscard]] std::string firstTrouble() const { return troubles.empty() ? "" : troubles.front(); }
};

ClientsWord askClient(const std::vector<std::string>& options) {
    ClientsWord word;
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return {.facts = {}, .troubles = {std::strerror(errno)}};
    const FileHandle out(ends[0]);
    FileHandle in(ends[1]);
    ChildProgram::Options wanted{.path = pathBesideThisProgram("tessera-client"),
                                 .arguments = {"--check"},
                                 .environment = {},
                                 .files = {{in.get(), STDOUT_FILENO}}};
    wanted.arguments.insert(wanted.arguments.end(), options.begin(), options.end());
    // The desktop, and where its libraries are.
    for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY", "XAUTHORITY", "XDG_RUNTIME_DIR", "HOME", "LD_LIBRARY_PATH"})
        if (const char* value = std::getenv(name)) wanted.environment.push_back(fmt::format("{}={}", name, value));
    Expected<ChildProgram> child = ChildProgram::start(wanted);
    in.close();
    if (!child) return {.facts = {}, .troubles = {child.error().message}};
    std::string text;
    std::array<char, 4096> some{};
    const TimePoint deadline = clockNow() + kLongestAnswer;
    while (text.size() < kMostSaid) {
        const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - clockNow()).count();
        pollfd handle{.fd = out.get(), .events = POLLIN, .revents = 0};
        const int ready = left > 0 ? ::poll(&handle, 1, static_cast<int>(left)) : 0;
        if (ready < 0 && errno == EINTR) continue;
        // A driver that hangs is one of the things that are looked for.
        if (ready == 0) return {.facts = {}, .troubles = {"tessera-client --check does not answer"}};
        const ssize_t got = ::read(out.get(), some.data(), some.size());
        if (got <= 0) break;
        text.append(some.data(), static_cast<std::size_t>(got));
    }
    if (text.empty()) word.troubles.emplace_back("tessera-client --check says nothing: a driver may have crashed it");
    std::istringstream lines(text);
    constexpr std::string_view kFact = "check: ", kTrouble = "trouble ";
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with(kFact)) continue;
        line.erase(0, kFact.size());
        if (line.starts_with(kTrouble)) {
            word.troubles.push_back(line.substr(kTrouble.size()));
            continue;
        }
        const std::size_t space = std::min(line.find(' '), line.size());
        word.facts.emplace_back(line.substr(0, space), line.substr(std::min(space + 1, line.size())));
    }
    return word;
}

MachineFinding drawing() {
    const ClientsWord word = askClient({});
    if (const std::string trouble = word.firstTrouble(); !trouble.empty())
        return {"drawing", State::kLacks, trouble, "apt install tessera-client libosmesa6 libgl1-mesa-dri"};
    return {"drawing", State::kGood, word.fact("surface"), {}};
}

MachineFinding card() {
    const ClientsWord word = askClient({"--surface", "egl"});
    const std::string surface = word.fact("surface");
    const bool software = surface.find("Mesa's software") != std::string::npos;
    if (!surface.empty() && word.troubles.empty() && !software) return {"graphics card", State::kGood, surface, {}};
    return {"graphics card", State::kNote,
            software || word.troubles.empty() ? "there is none that draws: the processor does" : word.firstTrouble(),
            "with a card, install its maker's driver and see that /dev/dri or /dev/nvidia* can be opened by this user"};
}

MachineFinding desktop() {
    const ClientsWord word = askClient({"--surface", "none", "--window"});
    if (const std::string trouble = word.firstTrouble(); !trouble.empty())
        return {"desktop", State::kNote, trouble,
                "log in at the desktop and set DISPLAY; walls without --window need none"};
    std::string monitors;
    for (const auto& [name, rest] : word.facts)
        if (name == "monitor") monitors += (monitors.empty() ? "" : "; ") + rest;
    return {"desktop", State::kGood, monitors, {}};
}

MachineFinding fonts() {
    Text text;
    text.text = "Tessera";
    std::vector<std::string> notes;
    const Expected<TextOutlines> set = Typesetter().set(text, notes);
    if (set) return {"fonts", State::kGood, "letters can be set", {}};
    return {"fonts", State::kLacks, set.error().message, "apt install fonts-dejavu-core"};
}

MachineFinding files() {
    const std::string path = pathBesideThisProgram("tessera-import");
    if (::access(path.c_str(), X_OK) != 0)
        return {"reading files", State::kLacks, fmt::format("{} is missing", path), "apt install tessera-server"};
    const std::vector<std::string> missing = missingForConfinement();
    if (missing.empty())
        return {"reading files", State::kGood, "in a child that is confined by seccomp and Landlock", {}};
    return {"reading files", State::kLacks, missing.front(),
            "use Linux 5.13 or later with lsm=landlock among its options"};
}

/// errno of a connection to this machine itself, to a port that is free just now; 0: there is one. Hosts and programs
/// of this machine come by it.
int loopbackFault() {
    const FileHandle listener(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)),
        dialler(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const place = reinterpret_cast<sockaddr*>(&address);
    if (::bind(listener.get(), place, size) != 0 || ::listen(listener.get(), 1) != 0 ||
        ::getsockname(listener.get(), place, &size) != 0)
        return errno;
    return ::connect(dialler.get(), place, size) == 0 || errno == EINPROGRESS ? 0 : errno;
}

MachineFinding port() {
    const FileHandle socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    constexpr int kYes = 1;
    (void)::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &kYes, sizeof kYes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(kUsualPort);
    address.sin_addr.s_addr = htonl(INADDR_ANY);
    if (const int why = loopbackFault(); why != 0)
        return {"port", State::kLacks, fmt::format("127.0.0.1 cannot be reached: {}", std::strerror(why)),
                "ip link set lo up"};
    if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
        return {"port", State::kGood, fmt::format("{} is free", kUsualPort), {}};
    const int why = errno;
    const std::string holder = why == EADDRINUSE ? holderOfPort(kUsualPort) : std::string();
    return {"port", State::kNote,
            holder.empty() ? fmt::format("{}: {}", kUsualPort, std::strerror(why))
                           : fmt::format("{} is held by {}", kUsualPort, holder),
            "end that program, or say another --listen ADDR:PORT"};
}

MachineFinding openFiles() {
    rlimit limit{};
    (void)::getrlimit(RLIMIT_NOFILE, &limit);
    if (limit.rlim_cur >= kFilesWanted)
        return {"open files", State::kGood, fmt::format("{} may be open", limit.rlim_cur), {}};
    return {"open files", limit.rlim_cur < kFilesWanted / 4 ? State::kLacks : State::kNote,
            fmt::format("only {} may be open", limit.rlim_cur),
            fmt::format("ulimit -n {0}, or `nofile {0}` in /etc/security/limits.conf", kFilesWanted)};
}

MachineFinding priority() {
    rlimit limit{};
    (void)::getrlimit(RLIMIT_RTPRIO, &limit);
    if (limit.rlim_cur >= 2 || ::geteuid() == 0)
        return {"priority", State::kGood, "pictures may be shown ahead of what is drawn", {}};
    return {"priority", State::kNote,
            "threads that show pictures run like any other: beside other load they may be late",
            "`rtprio 2` in /etc/security/limits.conf; units have it"};
}

MachineFinding memory() {
    const auto bytes =
        static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
    const std::string what = fmt::format("{:.1f} GiB, {} processors", static_cast<double>(bytes) / (1 << 30),
                                         std::max(1u, std::thread::hardware_concurrency()));
    if (bytes >= kMemoryWanted) return {"memory", State::kGood, what, {}};
    return {"memory", State::kNote, what, "large models want 2 GiB and more: read them on a larger machine"};
}

MachineFinding sharedMemory() {
    struct statvfs room {};
    if (::statvfs("/dev/shm", &room) != 0 || ::access("/dev/shm", W_OK) != 0)
        return {"shared memory", State::kLacks, "/dev/shm cannot be written to", "mount -t tmpfs tmpfs /dev/shm"};
    const std::uint64_t bytes = room.f_bavail * room.f_frsize;
    const std::string what = fmt::format("{} MiB are free in /dev/shm", bytes >> 20);
    if (bytes >= kSharedWanted) return {"shared memory", State::kGood, what, {}};
    return {"shared memory", State::kNote, what, "mount -o remount,size=1G /dev/shm; of a container: --shm-size 1g"};
}

/// A server leaves there what lets this user's programs in, and does not start where it cannot.
MachineFinding placeForWalls() {
    const std::string cure = "set XDG_RUNTIME_DIR to a folder of this user alone, with room; /run/user/UID is one";
    const Expected<std::string> folder = runFolder();
    if (!folder) return {"run folder", State::kLacks, folder.error().message, cure};
    std::string trial = *folder + "/.check-XXXXXX";
    const FileHandle file(::mkostemp(trial.data(), O_CLOEXEC));
    const std::string some(4096, '\0');
    const ssize_t took = file.get() >= 0 ? ::write(file.get(), some.data(), some.size()) : -1;
    const bool written = took == static_cast<ssize_t>(some.size());
    const int why = took < 0 ? errno : ENOSPC;  // half of it: there is no room for the rest
    if (file.get() >= 0) ::unlink(trial.c_str());
    if (written) return {"run folder", State::kGood, fmt::format("{} takes files", *folder), {}};
    return {"run folder", State::kLacks, fmt::format("{}: {}", *folder, std::strerror(why)), cure};
}

MachineFinding clock() {
    timex asked{};
    const int state = ::adjtimex(&asked);
    if (state >= 0 && state != TIME_ERROR && (asked.status & STA_UNSYNC) == 0)
        return {"clock", State::kGood, "it is synchronised", {}};
    return {"clock", State::kNote, "it is not synchronised: keys of several machines and their logs want it",
            "apt install systemd-timesyncd, or chrony"};
}

MachineFinding ssh() {
    const char* path = std::getenv("PATH");
    std::istringstream folders(path != nullptr ? path : "/usr/bin:/bin");
    for (std::string folder; std::getline(folders, folder, ':');)
        if (::access((folder + "/ssh").c_str(), X_OK) == 0) return {"ssh", State::kGood, folder + "/ssh", {}};
    return {"ssh", State::kNote, "there is none: tessera-wall --start reaches other machines by it",
            "apt install openssh-client"};
}

}  // namespace

std::vector<MachineFinding> checkMachine() {
    return {drawing(),  card(),   desktop(),      fonts(),         files(), port(), openFiles(),
            priority(), memory(), sharedMemory(), placeForWalls(), clock(), ssh()};
}

std::string lineOf(const MachineFinding& finding, bool json) {
    constexpr std::array kNames{"good", "note", "lacks"};
    const std::string state = kNames.at(static_cast<std::size_t>(finding.state));
    if (json)
        return nlohmann::ordered_json(
                   {{"thing", finding.thing}, {"state", state}, {"what", finding.what}, {"cure", finding.cure}})
            .dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
    const std::string cure = finding.cure.empty() ? "" : fmt::format("\n{:<21}-> {}", "", finding.cure);
    return fmt::format("{:<14} {:<6}{}{}", finding.thing, finding.state == State::kLacks ? "LACKS" : state,
                       finding.what, cure);
}

}  // namespace tessera
