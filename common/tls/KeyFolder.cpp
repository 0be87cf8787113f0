#include "common/tls/KeyFolder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <set>
#include <thread>

#include "common/base/FileHandle.h"

namespace tessera {
namespace {

constexpr std::string_view kEnding = ".pem", kPerson = "person-", kIssued = "issued", kTokens = "tokens",
                           kBundleEnd = "end of keys\n", kEnd = "end", kAuthority = "authority.crt";
constexpr std::string_view kPanel = "panel-";
constexpr std::size_t kPanelDigits = 32;
constexpr std::size_t kMostBytes = std::size_t{16} << 20;

tl::unexpected<Error> systemError(std::string_view what, const std::string& path) {
    const ErrorCode code = errno == ENOENT   ? ErrorCode::kNotFound
                           : errno == EACCES ? ErrorCode::kRefused
                                             : ErrorCode::kFailed;
    return fail(code, fmt::format("{}: {} ({})", path, what, std::strerror(errno)));
}

/// What nobody but the owner may do with a file.
constexpr unsigned kMayLook = 0077, kMayWrite = 0022;

/// Whether it is this user's, or root's, and nobody else may do that.
bool isOwn(const struct stat& info, unsigned nobodyElse) {
    return (info.st_uid == geteuid() || info.st_uid == 0) && (info.st_mode & nobodyElse) == 0;
}

bool writeAll(int file, std::string_view text) {
    while (!text.empty()) {
        const ssize_t count = ::write(file, text.data(), text.size());
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return false;
        text.remove_prefix(static_cast<std::size_t>(count));
    }
    return true;
}

std::vector<std::string_view> parted(std::string_view text, char at) {
    std::vector<std::string_view> parts;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(at, begin), text.size());
        parts.push_back(text.substr(begin, end - begin));
        begin = end + 1;
    }
    return parts;
}

std::optional<DateTime> timeIn(std::string_view word) {
    constexpr std::int64_t kLast = std::chrono::duration_cast<std::chrono::seconds>(DateTime::duration::max()).count();
    std::int64_t seconds = 0;
    const char* const end = word.data() + word.size();
    const auto [stopped, error] = std::from_chars(word.data(), end, seconds);
    if (error != std::errc() || stopped != end) return std::nullopt;
    return DateTime(std::chrono::seconds(std::clamp<std::int64_t>(seconds, 0, kLast)));
}

/// Nothing where it is no line of the file.
std::optional<IssuedKey> keyIn(std::string_view line) {
    const std::vector<std::string_view> words = parted(line, ' ');
    if (words.size() < 3 || words.size() > 4 || words[0].empty()) return std::nullopt;
    const Expected<Identity> holder = parseIdentity(words[1]);
    const std::optional<DateTime> until = timeIn(words[2]);
    if (!holder || !until || (words.size() == 4 && words[3] != "revoked")) return std::nullopt;
    return IssuedKey{.serial = std::string(words[0]), .holder = *holder, .until = *until, .revoked = words.size() == 4};
}

/// Whose token it is stands there as a certificate would say it.
std::optional<KeptToken> tokenIn(std::string_view line) {
    constexpr std::size_t kDigits = 64;
    const std::vector<std::string_view> words = parted(line, ' ');
    if (words.size() < 3 || words.size() > 4 || words[0].size() != kDigits) return std::nullopt;
    const Expected<Identity> holder = parseIdentity(words[1]);
    const std::optional<DateTime> until = timeIn(words[2]);
    if (!holder || holder->kind != Identity::Kind::kPerson || !until) return std::nullopt;
    const std::string panel(words.size() == 4 ? words[3] : "");
    const bool isName = panel.size() == kPanelDigits && panel.find_first_not_of("0123456789abcdef") == panel.npos;
    if (words.size() == 4 && !isName) return std::nullopt;
    return KeptToken{.hash = std::string(words[0]), .pass = {holder->name, holder->role, panel}, .until = *until};
}

/// All lines of a file as values. `what`: how a line is, for people. Without its last line it is torn: what is missing
/// may have said who was revoked.
template <typename Value>
Expected<std::vector<Value>> linesIn(const Expected<std::string>& text, std::optional<Value> (*read)(std::string_view),
                                     const std::string& path, std::string_view what) {
    if (!text) return tl::unexpected(text.error());
    std::vector<std::string_view> lines = parted(*text, '\n');
    lines.pop_back();  // behind the last end of a line
    if (lines.empty() || lines.back() != kEnd || !text->ends_with('\n'))
        return fail(ErrorCode::kBadInput, fmt::format("{}: its last line is not 'end': part of it is missing", path));
    lines.pop_back();
    std::vector<Value> all;
    for (std::size_t i = 0; i < lines.size(); ++i) {
        std::optional<Value> value = read(lines[i]);
        if (!value) return fail(ErrorCode::kBadInput, fmt::format("{}:{}: is not {}", path, i + 1, what));
        all.push_back(std::move(*value));
    }
    return all;
}

void take(const std::vector<IssuedKey>& issued, TlsKeys& keys) {
    for (const IssuedKey& key : issued) {
        if (key.revoked) keys.revoked.insert(key.serial);
        std::erase_if(keys.ends, [&](const KeyEnd& former) { return former.holder == key.holder; });
        if (!key.revoked) keys.ends.push_back({key.holder, key.until});
    }
}

long long secondsOf(DateTime time) {
    return std::chrono::duration_cast<std::chrono::seconds>(time.time_since_epoch()).count();
}

}  // namespace

KeyFolder::KeyFolder(std::string path) : path_(std::move(path)) {
    while (path_.size() > 1 && path_.back() == '/') path_.pop_back();  // the folder above it is another one
}

std::string KeyFolder::fileOf(const Identity& holder) {
    switch (holder.kind) {
        case Identity::Kind::kServer:
            return "server.pem";
        case Identity::Kind::kHost:
            return fmt::format("host-{}{}", holder.name, kEnding);
        case Identity::Kind::kPerson:
            break;
    }
    return fmt::format("{}{}{}", kPerson, holder.name, kEnding);
}

Expected<std::string> KeyFolder::readOwn(const std::string& file) const {
    return read(file, kMayLook, "may read this key");
}

Expected<std::string> KeyFolder::read(const std::string& file, unsigned nobodyElse, std::string_view might) const {
    const std::string path = path_ + "/" + file;
    const FileHandle handle(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (handle.get() < 0) return systemError("cannot be read", path);
    struct stat info {};
    if (::fstat(handle.get(), &info) != 0) return systemError("cannot be read", path);
    if (!S_ISREG(info.st_mode)) return fail(ErrorCode::kBadInput, path + ": is no file");
    if (!isOwn(info, nobodyElse))
        return fail(ErrorCode::kRefused,
                    fmt::format("{0}: others {1}, or it is somebody else's: chmod 600 {0}", path, might));
    std::string text;
    std::array<char, 4096> part{};
    for (ssize_t count = 0; (count = ::read(handle.get(), part.data(), part.size())) != 0;) {
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) return systemError("cannot be read", path);
        text.append(part.data(), static_cast<std::size_t>(count));
        if (text.size() > kMostBytes) return fail(ErrorCode::kBadInput, path + ": is too large for a key");
    }
    return text;
}

Expected<Authority> KeyFolder::authority() const {
    const Expected<std::string> text = readOwn("authority.pem");
    if (!text) return tl::unexpected(text.error());
    Expected<Authority> read = Authority::read(*text);
    if (!read) return failWith(path_ + "/authority.pem", read.error());
    return read;
}

Expected<std::string> KeyFolder::authorityCertificate() const {
    return read(std::string(kAuthority), kMayWrite, "may change this file");
}

Expected<std::vector<IssuedKey>> KeyFolder::issued() const {
    const std::string file(kIssued);
    return linesIn(readOwn(file), &keyIn, path_ + "/" + file, "SERIAL HOLDER SECONDS [revoked]");
}

Expected<std::vector<KeptToken>> KeyFolder::tokens() const {
    const std::string file(kTokens);
    Expected<std::string> text = readOwn(file);
    if (!text && text.error().code == ErrorCode::kNotFound) return std::vector<KeptToken>();
    return linesIn(text, &tokenIn, path_ + "/" + file, "SHA256 HOLDER SECONDS [PANEL]");
}

Expected<TlsKeys> KeyFolder::of(const std::string& file, const std::string& lacking) const {
    TlsKeys keys;
    Expected<std::string> authority = authorityCertificate();
    if (!authority) return tl::unexpected(authority.error());
    Expected<std::string> own = readOwn(file);
    if (!own && own.error().code == ErrorCode::kNotFound)
        return fail(ErrorCode::kNotFound, fmt::format("{}: {}", path_, lacking));
    if (!own) return tl::unexpected(own.error());
    keys.own = std::move(*own);
    keys.authority = std::move(*authority);
    keys.ownFile = path_ + "/" + file;
    keys.authorityFile = path_ + "/" + std::string(kAuthority);
    // Without a text they would be those of somebody who has no key, and comes in by a token.
    if (keys.own.empty()) return fail(ErrorCode::kBadInput, keys.ownFile + ": is empty");
    if (keys.authority.empty()) return fail(ErrorCode::kBadInput, keys.authorityFile + ": is empty");
    return keys;
}

Expected<TlsKeys> KeyFolder::ofServer() const {
    Expected<TlsKeys> keys =
        of("server.pem", "no keys of a server are there: tessera-keys init --wall WALL makes them");
    if (!keys) return keys;
    const Expected<std::vector<IssuedKey>> all = issued();
    if (!all) return tl::unexpected(all.error());
    take(*all, *keys);
    Expected<std::vector<KeptToken>> words = tokens();
    if (!words) return tl::unexpected(words.error());
    for (KeptToken& token : *words) {
        const std::string& panel = token.pass.panel;
        if (!panel.empty() && !keys->panels.contains(panel)) {
            const std::string file = std::string(kPanel) + panel;
            Expected<std::string> text = readOwn(file);
            if (!text || panelName(*text) != panel) {
                if (token.until < std::chrono::system_clock::now()) continue;  // it lets nobody in anyhow
                keys->faults.push_back(
                    fmt::format("the token of '{}' lets nobody in: {}", token.pass.name,
                                text ? path_ + "/" + file + ": is another panel than it was" : text.error().message));
                continue;
            }
            keys->panels.emplace(panel, std::move(*text));
        }
        keys->tokens.push_back(std::move(token));
    }
    return keys;
}

std::vector<std::string> KeyFolder::takeRevoked(TlsKeys& keys) const {
    std::vector<std::string> faults;
    if (const Expected<std::vector<IssuedKey>> all = issued(); all)
        take(*all, keys);
    else
        faults.push_back(all.error().message);
    const Expected<std::vector<KeptToken>> kept = tokens();
    std::error_code ignored;
    if (!kept)
        faults.push_back(kept.error().message);
    else if (std::filesystem::is_directory(path_, ignored))  // one that is not there says nothing about tokens
        std::erase_if(keys.tokens, [&](const KeptToken& token) {
            return std::ranges::find(*kept, token.hash, &KeptToken::hash) == kept->end();
        });
    return faults;
}

std::string KeyFolder::panelName(std::string_view text) {
    return hashOfToken(text).substr(0, kPanelDigits);
}

Expected<TlsKeys> KeyFolder::ofHost(const std::string& name) const {
    return of(fileOf({.wall = {}, .kind = Identity::Kind::kHost, .name = name}),
              fmt::format("no key of the host '{0}' is there: tessera-keys host {0} makes it, on the server", name));
}

Expected<TlsKeys> KeyFolder::ofPerson(const std::string& name) const {
    if (!name.empty())
        return of(
            fileOf({.wall = {}, .kind = Identity::Kind::kPerson, .name = name}),
            fmt::format("no key of '{0}' is there: tessera-keys person {0} --role ROLE makes it, on the server", name));
    std::vector<std::string> files;
    std::error_code error;
    for (std::filesystem::directory_iterator each(path_, error), none; !error && each != none; each.increment(error))
        if (const std::string file = each->path().filename(); file.starts_with(kPerson) && file.ends_with(kEnding))
            files.push_back(file);
    std::ranges::sort(files);
    if (files.size() > 1)
        return fail(ErrorCode::kUsage, fmt::format("{}: the keys of several people are there ({}): say whose", path_,
                                                   fmt::join(files, ", ")));
    return of(files.empty() ? std::string(kPerson) : files.front(),
              "no key of a person is there: tessera-keys person NAME --role ROLE makes one, on the server");
}

std::string KeyFolder::bundleOf(const TlsKeys& keys) {
    return fmt::format("{}{}{}", keys.authority, keys.own, kBundleEnd);
}

Expected<TlsKeys> KeyFolder::readBundle(int descriptor, std::chrono::milliseconds patience) {
    constexpr std::size_t kMostOfABundle = std::size_t{64} << 10;
    const auto until = std::chrono::steady_clock::now() + patience;
    std::string text;
    while (text.find(kBundleEnd) == std::string::npos) {
        const auto left =
            std::chrono::duration_cast<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
        pollfd wait{descriptor, POLLIN, 0};
        const int ready = left.count() <= 0 ? 0 : ::poll(&wait, 1, static_cast<int>(left.count()));
        if (ready < 0 && errno == EINTR) continue;
        if (ready <= 0) return fail(ErrorCode::kNetwork, fmt::format("no keys came within {} ms", patience.count()));
        std::array<char, 4096> part{};
        const ssize_t count = ::read(descriptor, part.data(), part.size());
        if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
        if (count <= 0 || text.size() > kMostOfABundle)
            return fail(ErrorCode::kBadInput, "what came are no keys of tessera-wall");
        text.append(part.data(), static_cast<std::size_t>(count));
    }
    const std::size_t own = std::min(text.find("-----BEGIN PRIVATE KEY-----"), text.size());
    TlsKeys keys;
    keys.authority = text.substr(0, own);
    keys.own = text.substr(own, text.find(kBundleEnd) - own);
    return keys;
}

Expected<KeyFolder::Writer> KeyFolder::Writer::open(const KeyFolder& folder) {
    const std::string& path = folder.path();
    std::error_code ignored;  // what is missing afterwards is said by mkdir
    if (const auto above = std::filesystem::path(path).parent_path(); !above.empty())
        std::filesystem::create_directories(above, ignored);
    if (::mkdir(path.c_str(), 0700) != 0 && errno != EEXIST) return systemError("cannot be made", path);
    struct stat info {};
    if (::stat(path.c_str(), &info) != 0) return systemError("cannot be looked at", path);
    if (!S_ISDIR(info.st_mode) || !isOwn(info, kMayLook))
        return fail(ErrorCode::kRefused,
                    fmt::format("{0} is not a folder of this user alone: chmod 700 {0}, or name another one", path));
    const int lock = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (lock < 0) return systemError("cannot be opened", path);
    for (int tries = 0; ::flock(lock, LOCK_EX | LOCK_NB) != 0; ++tries) {
        constexpr int kMostTries = 500;
        if (errno != EWOULDBLOCK && errno != EINTR) {
            const auto error = systemError("cannot be locked", path);
            ::close(lock);
            return error;
        }
        if (tries == kMostTries) {
            ::close(lock);
            return fail(ErrorCode::kRefused, path + ": another program writes keys there, and does not end");
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return Writer(path, lock);
}

KeyFolder::Writer::~Writer() {
    if (lock_ >= 0) ::close(lock_);
}

Expected<void> KeyFolder::Writer::write(const std::string& file, std::string_view text) const {
    const std::string path = path_ + "/" + file, unfinished = path_ + "/." + file + ".new";
    ::unlink(unfinished.c_str());
    FileHandle handle(::open(unfinished.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (handle.get() < 0) return systemError("cannot be written", path);
    if (!writeAll(handle.get(), text) || ::fsync(handle.get()) != 0 ||
        ::rename(unfinished.c_str(), path.c_str()) != 0) {
        auto error = systemError("cannot be written", path);
        ::unlink(unfinished.c_str());
        return error;
    }
    (void)::fsync(lock_);
    return {};
}

Expected<void> KeyFolder::Writer::rename(const std::string& file, const std::string& to) const {
    const std::string path = path_ + "/" + to;
    if (::rename((path_ + "/" + file).c_str(), path.c_str()) != 0) return systemError("cannot be written", path);
    (void)::fsync(lock_);
    return {};
}

Expected<void> KeyFolder::Writer::write(const std::vector<IssuedKey>& issued) const {
    std::string text;
    for (const IssuedKey& key : issued)
        text += fmt::format("{} {} {}{}\n", key.serial, toUri(key.holder), secondsOf(key.until),
                            key.revoked ? " revoked" : "");
    return write(std::string(kIssued), text + std::string(kEnd) + "\n");
}

Expected<void> KeyFolder::Writer::writeTokens(const std::vector<KeptToken>& tokens) const {
    std::string text;
    for (const KeptToken& token : tokens) {
        const Identity holder{
            .wall = "-", .kind = Identity::Kind::kPerson, .name = token.pass.name, .role = token.pass.role};
        const std::string& panel = token.pass.panel;
        text += fmt::format("{} {} {}{}{}\n", token.hash, toUri(holder), secondsOf(token.until),
                            panel.empty() ? "" : " ", panel);
    }
    const Expected<void> written = write(std::string(kTokens), text + std::string(kEnd) + "\n");
    if (!written) return written;
    std::error_code error;
    for (std::filesystem::directory_iterator each(path_, error), none; !error && each != none; each.increment(error)) {
        const std::string file = each->path().filename();
        const auto isOf = [&](const KeptToken& token) { return std::string(kPanel) + token.pass.panel == file; };
        const bool isPanel = file.starts_with(kPanel) && file.size() == kPanel.size() + kPanelDigits;
        std::error_code ignored;
        if (isPanel && std::ranges::none_of(tokens, isOf)) std::filesystem::remove(each->path(), ignored);
    }
    return written;
}

Expected<std::string> KeyFolder::Writer::writePanel(std::string_view text) const {
    std::string name = panelName(text);
    if (const Expected<void> written = write(std::string(kPanel) + name, text); !written)
        return tl::unexpected(written.error());
    return name;
}

}  // namespace tessera
