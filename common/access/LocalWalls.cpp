#include "common/access/LocalWalls.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <map>
#include <span>
#include <utility>

#include "common/access/ChosenTokens.h"
#include "common/access/WallProtection.h"
#include "common/base/FileHandle.h"
#include "common/base/Hash.h"
#include "common/net/OwnAddress.h"

namespace tessera {
namespace {

constexpr std::string_view kEnding = ".wall";
constexpr int kMostPlaces = 100;          ///< of one wall
constexpr std::size_t kMostBytes = 4096;  ///< of a place
/// Of a server that the system runs (deploy/units): nobody but root makes a folder there.
constexpr const char* kServiceFolder = "/run/tessera";

/// The line of a file that names a server; nothing where there is no such file.
Expected<std::optional<std::string>> lineOfServerFile(const std::string& path) {
    if (path.empty()) return std::nullopt;
    const auto wrong = [&](std::string_view why) {
        return fail(ErrorCode::kUsage, fmt::format("{}: {}; write a line ADDR:PORT, or take the file away", path, why));
    };
    const int opened = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (opened < 0) {
        if (errno == ENOENT || errno == ENOTDIR) return std::nullopt;
        return wrong(std::strerror(errno));
    }
    std::string text(kMostBytes + 1, '\0');
    const ssize_t got = pread(opened, text.data(), text.size(), 0);
    const int fault = errno;
    close(opened);
    if (got < 0) return wrong(std::strerror(fault));
    text.resize(static_cast<std::size_t>(got));
    if (text.size() > kMostBytes) return wrong(fmt::format("it has more than {} bytes", kMostBytes));
    std::optional<std::string> named;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        std::string_view line = std::string_view(text).substr(at, end - at);
        at = end + 1;
        while (!line.empty() && std::isspace(static_cast<unsigned char>(line.front()))) line.remove_prefix(1);
        while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back()))) line.remove_suffix(1);
        if (line.empty() || line.front() == '#') continue;
        if (named) return wrong("it names more than one server");
        named = std::string(line);
    }
    return named ? Expected<std::optional<std::string>>(std::move(named)) : wrong("it names no server");
}

Error systemError(std::string_view what, const std::string& path) {
    return {ErrorCode::kFailed, fmt::format("{}: {}: {}", path, what, std::strerror(errno))};
}

std::string baseFolder() {
    if (const char* said = std::getenv("XDG_RUNTIME_DIR"); said != nullptr && said[0] == '/') return said;
    const std::string users = fmt::format("/run/user/{}", geteuid());
    struct stat info {};
    return lstat(users.c_str(), &info) == 0 && S_ISDIR(info.st_mode) && info.st_uid == geteuid() ? users : "";
}

/// A name that a file may have.
std::string fileName(const std::string& wall) {
    std::string name = wall.substr(0, 64);
    for (char& c : name)
        if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '_') c = '_';
    return name.empty() ? "_" : name;
}

/// As people read it, in one line.
std::string wallLine(const std::string& wall) {
    std::string line = wall.substr(0, 256);
    for (char& c : line)
        if (static_cast<unsigned char>(c) < 0x20) c = ' ';
    return line;
}
/// By which walls are told apart whose lines and files are called alike.
std::string wallMark(const std::string& wall) {
    return fmt::format("{:016x}", hash64(std::as_bytes(std::span(wall))));
}

/// Lines "word rest", the last one "end": what is torn is as if it were not there.
std::map<std::string, std::string> readLines(int file) {
    std::string text(kMostBytes, '\0');
    const ssize_t got = pread(file, text.data(), text.size(), 0);
    text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    std::map<std::string, std::string> lines;
    if (!text.ends_with("\nend\n")) return lines;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        const std::string line = text.substr(at, end - at);
        const std::size_t space = line.find(' ');
        if (space != std::string::npos) lines[line.substr(0, space)] = line.substr(space + 1);
        at = end + 1;
    }
    return lines;
}

std::optional<Address> addressIn(const std::map<std::string, std::string>& lines, const std::string& word) {
    const auto line = lines.find(word);
    if (line == lines.end()) return std::nullopt;
    const Expected<Address> address = parseAddress(line->second);
    return address ? std::optional(*address) : std::nullopt;
}

/// Of an open file description: it goes with the process however that ends, and others can ask for it without taking
/// it.
struct flock wholeFile() {
    struct flock lock {};
    lock.l_type = F_WRLCK;
    lock.l_whence = SEEK_SET;
    return lock;
}
bool lockIt(int file) {
    struct flock lock = wholeFile();
    return fcntl(file, F_OFD_SETLK, &lock) == 0;
}
bool isLocked(int file) {
    struct flock lock = wholeFile();
    return fcntl(file, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

std::string wordOf(Role role) {
    return role == Role::kOperator ? "token" : fmt::format("token-{}", nameOf(role));
}
constexpr std::array kRoles{Role::kViewer, Role::kEditor, Role::kOperator};

/// Words that are none are fresh ones.
AccessTokens tokensIn(const std::map<std::string, std::string>& lines) {
    AccessTokens tokens = AccessTokens::fresh();
    for (const Role role : kRoles)
        if (const auto line = lines.find(wordOf(role)); line != lines.end() && isToken(line->second))
            tokens.of(role) = line->second;
    return tokens;
}

/// Whether people of a group can go through all folders of a path, this one included.
std::optional<std::string> barredFolder(const std::string& folder, gid_t group) {
    for (std::filesystem::path at = std::filesystem::absolute(folder); !at.empty(); at = at.parent_path()) {
        struct stat info {};
        if (stat(at.c_str(), &info) != 0) return at;
        if ((info.st_mode & 0001) == 0 && !(info.st_gid == group && (info.st_mode & 0010) != 0)) return at;
        if (at == at.root_path()) break;
    }
    return std::nullopt;
}

Expected<void> giveToGroup(int file, const std::string& folder, const std::string& group) {
    std::array<char, 4096> room{};
    struct group found {};
    struct group* known = nullptr;
    if (getgrnam_r(group.c_str(), &found, room.data(), room.size(), &known) != 0 || known == nullptr)
        return fail(ErrorCode::kNotFound, fmt::format("--group {}: this machine has no such group", group));
    constexpr mode_t kMayPass = 0711, kMayRead = 0640, kMayList = 0050;
    // Nobody lists the folder, but where it is the group's and they may already.
    struct stat info {};
    const bool mayList =
        stat(folder.c_str(), &info) == 0 && info.st_gid == known->gr_gid && (info.st_mode & kMayList) == kMayList;
    if ((!mayList && chmod(folder.c_str(), kMayPass) != 0) ||
        fchown(file, static_cast<uid_t>(-1), known->gr_gid) != 0 || fchmod(file, kMayRead) != 0)
        return fail(ErrorCode::kRefused, fmt::format("--group {}: {}: {}", group, folder, std::strerror(errno)));
    if (const std::optional<std::string> barred = barredFolder(folder, known->gr_gid))
        return fail(
            ErrorCode::kRefused,
            fmt::format("--group {0}: its people cannot reach the token in {1}, because {2} lets nobody through: "
                        "set XDG_RUNTIME_DIR to a folder that they may pass",
                        group, folder, *barred));
    return {};
}

/// Whether a connection to `peer` ends at who listens at `listening`, all of this machine's addresses among them.
bool leadsTo(const Address& peer, const Address& listening) {
    if (peer.port != listening.port) return false;
    const std::string there = plainAddress(peer.host), here = plainAddress(listening.host);
    if (here == "0.0.0.0" || here == "::") return isOwnAddress(there);
    return there == (here == "localhost" ? "127.0.0.1" : here);
}

/// Open, this user's own, and nobody's to read but a group's.
int openOwn(const std::string& path, int flags, uid_t owner = geteuid()) {
    const int file = open(path.c_str(), flags | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK, 0600);
    if (file < 0) return -1;
    struct stat info {};
    if (fstat(file, &info) == 0 && S_ISREG(info.st_mode) && info.st_uid == owner && (info.st_mode & 0037) == 0)
        return file;
    close(file);
    errno = EPERM;
    return -1;
}

/// All tasks without a session have this one: a variable of one task names no place that others know.
std::string folderOfTasks() {
    return fmt::format("/tmp/tessera-{}", geteuid());
}

std::string pathOfRunFolder() {
    const std::string base = baseFolder();
    if (!base.empty()) return base + "/tessera";
    return folderOfTasks();
}

/// A folder of this user alone.
bool isOwnFolder(const struct stat& info) {
    return S_ISDIR(info.st_mode) && info.st_uid == geteuid() && (info.st_mode & 0026) == 0;
}

}  // namespace

Expected<std::string> runFolder() {
    const std::string folder = pathOfRunFolder();
    if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
        return tl::unexpected(systemError("a folder for this user's walls", folder));
    struct stat info {};
    if (lstat(folder.c_str(), &info) != 0) return tl::unexpected(systemError("cannot be looked at", folder));
    if (isOwnFolder(info)) return folder;
    if (info.st_uid != geteuid())
        return fail(ErrorCode::kRefused,
                    fmt::format("{} is of another user (uid {}), and only that one or root can remove it: "
                                "set XDG_RUNTIME_DIR to a folder of yours",
                                folder, info.st_uid));
    return fail(
        ErrorCode::kRefused,
        fmt::format("{} is not a folder of this user alone (mode 0700): remove it, or set XDG_RUNTIME_DIR", folder));
}

namespace {

/// Those of `runFolders` that are there; none is made.
std::vector<std::string> presentRunFolders() {
    std::vector<std::string> folders{pathOfRunFolder()};
    const std::string users = fmt::format("/run/user/{}", geteuid());
    if (const std::string base = baseFolder(); base.empty() || base == users) {
        folders.insert(folders.end(), {users + "/tessera", folderOfTasks()});
        // Servers of earlier versions that still run.
        if (const char* temporary = std::getenv("TMPDIR"); temporary != nullptr && temporary[0] == '/')
            folders.push_back(fmt::format("{}/tessera-{}", temporary, geteuid()));
    }
    std::vector<std::string> present;
    for (const std::string& folder : folders)
        if (struct stat info{}; std::ranges::find(present, folder) == present.end() &&
                                lstat(folder.c_str(), &info) == 0 && isOwnFolder(info))
            present.push_back(folder);
    return present;
}

/// Those that `owner` has left in a folder, and this user may read.
std::vector<LocalWall> wallsIn(const std::string& folder, uid_t owner) {
    std::vector<LocalWall> walls;
    std::vector<std::string> names;
    std::error_code error;
    for (std::filesystem::directory_iterator each(folder, error), none; !error && each != none; each.increment(error))
        if (const std::string name = each->path().filename(); name.ends_with(kEnding)) names.push_back(name);
    std::ranges::sort(names);
    for (const std::string& name : names) {
        const int file = openOwn(folder + "/" + name, O_RDONLY, owner);
        if (file < 0) continue;
        const std::map<std::string, std::string> lines =
            isLocked(file) ? readLines(file) : std::map<std::string, std::string>();
        close(file);
        const std::optional<Address> server = addressIn(lines, "server");
        if (!server || !lines.contains("wall") || !lines.contains("token") || !isToken(lines.at("token"))) continue;
        walls.push_back({.wall = lines.at("wall"),
                         .server = *server,
                         .console = addressIn(lines, "console"),
                         .tokens = tokensIn(lines),
                         .authority = lines.contains("authority") ? lines.at("authority") : ""});
    }
    return walls;
}

}  // namespace

Expected<std::vector<std::string>> runFolders() {
    const Expected<std::string> own = runFolder();
    if (!own) return tl::unexpected(own.error());
    std::vector<std::string> folders = presentRunFolders();
    if (std::erase(folders, *own) == 0) return fail(ErrorCode::kFailed, *own + ": it was removed meanwhile");
    folders.insert(folders.begin(), *own);
    return folders;
}

Expected<std::vector<LocalWall>> localWalls() {
    const Expected<std::vector<std::string>> folders = runFolders();
    if (!folders) return tl::unexpected(folders.error());
    std::vector<LocalWall> walls;
    for (const std::string& folder : *folders) std::ranges::move(wallsIn(folder, geteuid()), std::back_inserter(walls));
    struct stat service {};
    if (folders->front() == kServiceFolder || lstat(kServiceFolder, &service) != 0 || !S_ISDIR(service.st_mode))
        return walls;
    std::ranges::move(wallsIn(kServiceFolder, service.st_uid), std::back_inserter(walls));
    return walls;
}

Expected<LocalWall> onlyLocalWall() {
    const Expected<std::vector<LocalWall>> walls = localWalls();
    if (!walls) return tl::unexpected(walls.error());
    if (walls->empty())
        return fail(ErrorCode::kNotFound, "no server of this user runs on this machine: say its address, HOST:PORT");
    if (walls->size() == 1) return walls->front();
    std::string all;
    for (const LocalWall& wall : *walls)
        all += fmt::format("{}{} ({})", all.empty() ? "" : ", ", toString(wall.server), wall.wall);
    return fail(ErrorCode::kUsage,
                fmt::format("{} servers of this user run on this machine: say which: {}", walls->size(), all));
}

std::string serverFile() {
    std::string folder;
    if (const char* said = std::getenv("XDG_CONFIG_HOME"); said != nullptr && said[0] == '/')
        folder = said;
    else if (const char* home = std::getenv("HOME"); home != nullptr && home[0] == '/')
        folder = std::string(home) + "/.config";
    return folder.empty() ? folder : folder + "/tessera/server";
}

Expected<ServerMeant> serverMeant(const std::string& said) {
    const auto named = [](const std::string& address, const std::string& by) -> Expected<ServerMeant> {
        const Expected<Address> parsed = parseAddress(address);
        if (!parsed) return by.empty() ? tl::unexpected(parsed.error()) : failWith(by, parsed.error());
        return ServerMeant{*parsed, by};
    };
    if (!said.empty()) return named(said, "");
    if (const char* variable = std::getenv("TESSERA_SERVER"); variable != nullptr && variable[0] != '\0')
        return named(variable, "TESSERA_SERVER");
    const std::string file = serverFile();
    const Expected<std::optional<std::string>> line = lineOfServerFile(file);
    if (!line) return tl::unexpected(line.error());
    if (*line) return named(**line, file);
    const Expected<LocalWall> only = onlyLocalWall();
    return only ? Expected<ServerMeant>(ServerMeant{only->server, {}}) : tl::unexpected(only.error());
}

Expected<std::string> readToken(const std::string& file) {
    const auto wrong = [&](std::string_view why) {
        return fail(ErrorCode::kUsage, fmt::format("the file with a token {}: {}", file, why));
    };
    const int opened = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (opened < 0) return wrong(std::strerror(errno));
    struct stat status {};
    if (fstat(opened, &status) != 0 || !S_ISREG(status.st_mode)) {
        close(opened);
        return wrong("it is no regular file");
    }
    const std::map<std::string, std::string> lines = readLines(opened);
    std::array<char, kMostBytes> text{};
    const ssize_t got = pread(opened, text.data(), text.size(), 0);
    close(opened);
    if (got < 0) return wrong(std::strerror(errno));
    if (const auto line = lines.find("token"); line != lines.end() && isToken(line->second)) return line->second;
    std::string_view word(text.data(), static_cast<std::size_t>(got));
    word = word.substr(0, word.find_first_of("\r\n"));
    if (!isToken(word)) return wrong("its first line is no token (16 to 128 letters, digits, - and _)");
    return std::string(word);
}

Expected<std::string> accessTo(const Address& peer, const std::string& tokenFile) {
    if (!tokenFile.empty()) return readToken(tokenFile);
    if (const char* word = std::getenv("TESSERA_TOKEN"); word != nullptr && word[0] != '\0') {
        if (!isToken(word))
            return fail(ErrorCode::kUsage, "TESSERA_TOKEN is no token (16 to 128 letters, digits, - and _)");
        return std::string(word);
    }
    if (const char* named = std::getenv("TESSERA_TOKEN_FILE"); named != nullptr && named[0] != '\0')
        return readToken(named);
    const Expected<std::vector<LocalWall>> walls = localWalls();
    if (!walls) return std::string();
    const auto wall = std::ranges::find_if(*walls, [&](const LocalWall& each) { return leadsTo(peer, each.server); });
    return wall == walls->end() ? std::string() : wall->tokens.of(Role::kOperator);
}

Expected<std::function<std::string(const std::string& peer)>> accessLater(const std::string& tokenFile, bool sealed) {
    if (const Expected<std::string> now = accessTo({}, tokenFile); !now) return tl::unexpected(now.error());
    return [tokenFile, sealed](const std::string& peer) {
        const Expected<Address> address = parseAddress(peer);
        if (!sealed && !(address && isOwnAddress(plainAddress(address->host)))) return std::string();
        return accessTo(address ? *address : Address(), tokenFile).value_or("");
    };
}

namespace {

std::string lineIn(const std::map<std::string, std::string>& lines, const char* word) {
    const auto line = lines.find(word);
    return line == lines.end() ? std::string() : line->second;
}

/// The service's too, where it is this user's own.
std::vector<std::string> withServiceFolder(std::vector<std::string> folders) {
    struct stat service {};
    if (std::ranges::find(folders, kServiceFolder) == folders.end() && lstat(kServiceFolder, &service) == 0 &&
        S_ISDIR(service.st_mode) && service.st_uid == geteuid())
        folders.emplace_back(kServiceFolder);
    return folders;
}

}  // namespace

Expected<std::vector<LocalWall>> endLocalLinks() {
    const Expected<std::vector<std::string>> folders = runFolders();
    if (!folders) return tl::unexpected(folders.error());
    std::vector<LocalWall> walls;
    for (const std::string& folder : withServiceFolder(*folders)) {
        if (const Expected<void> ended = renewLinksMark(folder); !ended) return tl::unexpected(ended.error());
        std::ranges::move(wallsIn(folder, geteuid()), std::back_inserter(walls));
    }
    std::erase_if(walls, [](const LocalWall& wall) { return !wall.authority.empty(); });
    if (const Expected<void> ended = forgetStoppedWalls(""); !ended) return tl::unexpected(ended.error());
    if (const Expected<void> ended = ChosenTokens::endWithoutKeys(); !ended) return tl::unexpected(ended.error());
    return walls;
}

Expected<void> forgetStoppedWalls(const std::string& authority) {
    const auto isMeant = [&](const std::string& protection) {
        return authority.empty() ? !WallProtection::hasKeys(protection) : WallProtection::isOf(protection, authority);
    };
    for (const std::string& folder : withServiceFolder(presentRunFolders())) {
        std::error_code error;
        for (std::filesystem::directory_iterator each(folder, error), none; !error && each != none;
             each.increment(error)) {
            const std::string path = each->path();
            if (!path.ends_with(kEnding)) continue;
            const FileHandle file(openOwn(path, O_RDWR));
            // The lock is a running server's.
            if (file.get() < 0 || !lockIt(file.get()) || !isMeant(lineIn(readLines(file.get()), "protection")))
                continue;
            if (ftruncate(file.get(), 0) != 0) return tl::unexpected(systemError("cannot be emptied", path));
        }
    }
    return {};
}

namespace {

std::string pathOfPlace(const std::string& folder, const std::string& wall, int place) {
    return fmt::format("{}/{}-{}{}", folder, fileName(wall), place, kEnding);
}

}  // namespace

Expected<std::unique_ptr<LocalWallPlace>> LocalWallPlace::take(const LocalWallWish& wish) {
    const Expected<std::string> folder = runFolder();
    if (!folder) return tl::unexpected(folder.error());
    // First what was left by one that listened alike is taken over; then a place that nobody has had; then any that
    // nobody has now, without its tokens.
    for (int place = 1; place <= 3 * kMostPlaces; ++place) {
        const std::string path = pathOfPlace(*folder, wish.wall, (place - 1) % kMostPlaces + 1);
        const bool alike = place <= kMostPlaces;
        const int file = openOwn(path, alike ? O_RDWR : O_RDWR | O_CREAT);
        if (file < 0 && alike && errno == ENOENT) continue;
        if (file < 0) return tl::unexpected(systemError("what this user's programs read", path));
        // Read again once it is locked: until then another server may have taken it.
        const auto isAlike = [&](const std::map<std::string, std::string>& left) {
            const auto isLeft = [&](const char* word) { return left.contains(word) && left.at(word) == wish.listen; };
            // Earlier versions left no mark.
            const bool isWalls = left.contains("mark") ? left.at("mark") == wallMark(wish.wall)
                                                       : lineIn(left, "wall") == wallLine(wish.wall);
            return isWalls && (isLeft("listen") || isLeft("server"));
        };
        const auto fits = [&] {
            const std::map<std::string, std::string> left = readLines(file);
            return alike ? isAlike(left) : left.empty() || place > 2 * kMostPlaces;
        };
        if (!fits() || !lockIt(file) || !fits()) {  // another one runs there
            close(file);
            continue;
        }
        std::unique_ptr<LocalWallPlace> taken(new LocalWallPlace);
        taken->path_ = path;
        taken->listen_ = wish.listen;
        taken->file_ = file;
        taken->wall_ = wallLine(wish.wall);
        taken->mark_ = wallMark(wish.wall);
        const std::map<std::string, std::string> before =
            alike ? readLines(file) : std::map<std::string, std::string>();
        taken->takeTokens(before, wish);
        taken->console_ = addressIn(before, "console");
        if (taken->console_) taken->lastPort_ = taken->console_->port;
        if (wish.group.empty())
            (void)fchmod(file, 0600);
        else if (const Expected<void> given = giveToGroup(file, *folder, wish.group); !given)
            return tl::unexpected(given.error());
        // Where the one before listened is no longer so.
        if (const Expected<void> kept = taken->write(); !kept) return tl::unexpected(kept.error());
        return taken;
    }
    return fail(ErrorCode::kLimit,
                fmt::format("{} servers of the wall {} run on this machine", kMostPlaces, wish.wall));
}

/// Takes over what was handed out under this protection, but for a token that a person had chosen then.
void LocalWallPlace::takeTokens(const std::map<std::string, std::string>& before, const LocalWallWish& wish) {
    protection_ = wish.protection;
    tokens_ = lineIn(before, "protection") == protection_ ? tokensIn(before) : AccessTokens::fresh();
    chosen_ = wish.given;
    std::string& ofOperator = tokens_.of(Role::kOperator);
    if (!chosen_.empty())
        ofOperator = chosen_;
    else if (lineIn(before, "chosen").find(ofOperator) != std::string::npos)  // earlier versions named several
        ofOperator = freshToken();
}

Expected<void> LocalWallPlace::renewFor(const std::string& protection) {
    protection_ = protection;
    chosen_.clear();
    tokens_ = AccessTokens::fresh();
    return write();
}

Expected<void> LocalWallPlace::tell(const Address& server, const std::optional<Address>& console) {
    server_ = server;
    console_ = console;
    return write();
}

Expected<void> LocalWallPlace::write() const {
    std::string text = fmt::format("wall {}\nmark {}\nlisten {}\n", wall_, mark_, listen_);
    if (server_) text += fmt::format("server {}\n", toString(*server_));
    if (console_) text += fmt::format("console {}\n", toString(*console_));
    if (!authority_.empty()) text += fmt::format("authority {}\n", authority_);
    if (!protection_.empty()) text += fmt::format("protection {}\n", protection_);
    if (!chosen_.empty()) text += fmt::format("chosen {}\n", chosen_);
    for (const Role role : kRoles) text += fmt::format("{} {}\n", wordOf(role), tokens_.of(role));
    text += "end\n";
    if (ftruncate(file_, 0) != 0 || pwrite(file_, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size()))
        return tl::unexpected(systemError("what this user's programs read", path_));
    return {};
}

LocalWallPlace::~LocalWallPlace() {
    if (file_ >= 0) close(file_);
}

}  // namespace tessera
