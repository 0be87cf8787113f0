#include "server/Entrance.h"

#include <fmt/format.h>
#include <pwd.h>
#include <unistd.h>

#include <array>
#include <chrono>

#include "common/base/Channel.h"
#include "common/base/JournalStream.h"
#include "common/tls/KeyFolder.h"
#include "server/panel/Panel.h"

namespace tessera {
namespace {

/// Of who listens everywhere: for programs of this machine.
std::string nearHost(const std::string& host) {
    return host == "0.0.0.0" ? "127.0.0.1" : host == "::" ? "::1" : host;
}

}  // namespace

std::string nameOfUser() {
    std::array<char, 4096> room{};
    passwd found{};
    passwd* known = nullptr;
    if (getpwuid_r(geteuid(), &found, room.data(), room.size(), &known) == 0 && known != nullptr) return known->pw_name;
    return fmt::format("user {}", geteuid());
}

Expected<std::vector<ServedPanel>> readPanels(const std::vector<std::string>& files) {
    constexpr std::size_t kMost = 16;
    if (files.size() > kMost) return fail(ErrorCode::kUsage, fmt::format("--panel: at most {} may be", kMost));
    std::vector<ServedPanel> panels;
    for (const std::string& file : files) {
        Expected<std::string> text = readPanelFile(file);
        if (!text) return failWith("--panel", text.error());
        const Expected<Panel> panel = parsePanel(*text, file);
        if (!panel) return failWith("--panel", panel.error());
        panels.push_back({file,
                          {freshToken(), KeyFolder::panelName(*text), panel->title},
                          std::make_shared<const std::string>(std::move(*text))});
    }
    return panels;
}

Entrance::Entrance(std::optional<Address> console, DoorReach reach, std::vector<ServedPanel> panels,
                   ServerTokens tokens, std::string wall, std::function<void(const std::string&)> say, Log& log)
    : console_(std::move(console)),
      reach_(std::move(reach)),
      panels_(std::move(panels)),
      wall_(std::move(wall)),
      say_(std::move(say)),
      log_(log),
      tokens_(std::move(tokens)) {}

void Entrance::setFiles(std::shared_ptr<UploadFolder> uploads,
                        std::function<void(const Entrant& who, std::string_view did, const std::string& path)> onFile) {
    uploads_ = std::move(uploads);
    onFile_ = std::move(onFile);
}

void Entrance::open(const Address& server) {
    if (console_) openDoor(server);
    std::optional<Address> console = door_ ? std::optional(door_->address()) : std::nullopt;
    if (console) console->host = nearHost(console->host);
    if (const Expected<void> told = tokens_.tell(server, console); !told) log_.warning(told.error().message);
}

/// Where any port will do the last one does best: links hold.
void Entrance::openDoor(const Address& server) {
    const Address near{nearHost(server.host), server.port};
    DoorOptions options{.listen = *console_,
                        .server = near,
                        .wall = wall_,
                        .tokens = tokens_.tokens(),
                        .owner = nameOfUser(),
                        .reach = reach_,
                        .panels = doorPanels(),
                        .tell = [this](const std::string& words) { log_.warning(words); },
                        .uploads = uploads_,
                        .onFile = onFile_};
    if (console_->port == 0) options.listen.port = tokens_.lastConsolePort();
    Expected<std::unique_ptr<Door>> door = Door::open(options);
    if (!door && options.listen.port != console_->port) {
        options.listen.port = console_->port;
        door = Door::open(options);
    }
    if (!door) return log_.warning(door.error().message);
    door_ = std::move(*door);
}

void Entrance::describe(const std::string& group) const {
    sayLinks();
    if (!group.empty()) say_(fmt::format("token file for the group {}: {}\n", group, tokens_.path()));
}

void Entrance::sayLinks() const {
    if (door_ && leadsToJournal(STDOUT_FILENO)) {
        say_(fmt::format("console: {}; `tessera-ctl link` prints a link that lets in\n", toString(door_->address())));
        for (const ServedPanel& panel : panels_)
            say_(fmt::format("panel {0}: `tessera-keys token NAME --panel {0}` makes a word for its visitors\n",
                             panel.file));
    } else if (door_) {
        say_(fmt::format("console: {}\n", door_->linkWith(tokens_.tokens().of(Role::kOperator))));
        for (const ServedPanel& panel : panels_)
            say_(fmt::format("panel {}: {}\n", panel.file, door_->linkWith(panel.door.word)));
    }
}

void Entrance::keepWatch(const std::stop_token& done, FrameLoop& loop) {
    constexpr std::chrono::milliseconds kBetweenLooks{250};
    Channel<bool> end(1);
    const std::stop_callback wake(done, [&] { end.close(); });
    for (std::string fault; !end.closed(); (void)end.popFor(kBetweenLooks)) fault = look(loop, fault);
}

/// Returns what is wrong with what ends tokens, which is said once; empty: nothing.
std::string Entrance::look(FrameLoop& loop, const std::string& lastFault) {
    const std::string before = tokens_.tokens().of(Role::kOperator);
    const Expected<bool> looked = tokens_.look();
    const std::string fault = looked ? std::string() : looked.error().message;
    if (!fault.empty() && fault != lastFault) log_.warning(fault);
    if (tokens_.tokens().of(Role::kOperator) == before) return fault;
    for (ServedPanel& panel : panels_) panel.door.word = freshToken();
    if (door_) door_->renew(tokens_.tokens(), doorPanels());
    loop.renewAccess(tokens_.tokens());
    log_.info("the links and tokens that were handed out have ended; new ones are made");
    sayLinks();
    return fault;
}

std::vector<DoorPanel> Entrance::doorPanels() const {
    std::vector<DoorPanel> panels;
    for (const ServedPanel& panel : panels_) panels.push_back(panel.door);
    return panels;
}

}  // namespace tessera
