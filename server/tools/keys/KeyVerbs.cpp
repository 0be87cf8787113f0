#include "server/tools/keys/KeyVerbs.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <span>

#include "common/base/FileHandle.h"
#include "server/tools/keys/Holders.h"
#include "server/tools/keys/Tokens.h"
#include "server/tools/keys/WallName.h"

namespace tessera {
namespace {

using Kind = Identity::Kind;

constexpr std::string_view kAuthorityKey = "authority.pem", kAuthority = "authority.crt", kBegun = "authority.begun";
constexpr std::chrono::days kSoon{30};

/// How hints call this program.
std::string commandFor(const std::string& keys) {
    return keys == KeysArguments().keys ? "tessera-keys" : "tessera-keys --keys " + keys;
}

std::vector<std::string> namesOfThisMachine() {
    std::vector<std::string> names{"localhost", "127.0.0.1", "::1"};
    std::array<char, 256> host{};
    if (::gethostname(host.data(), host.size() - 1) == 0 && host[0] != '\0' &&
        std::ranges::find(names, host.data()) == names.end())
        names.insert(names.begin(), host.data());
    return names;
}

std::vector<std::string> serverNames(const KeysArguments& arguments) {
    if (arguments.names.empty()) return namesOfThisMachine();
    std::vector<std::string> names;
    for (std::size_t at = 0; at <= arguments.names.size();) {
        const std::size_t end = std::min(arguments.names.find(',', at), arguments.names.size());
        names.push_back(arguments.names.substr(at, end - at));
        at = end + 1;
    }
    return names;
}

/// Of a server whose key is renewed: those that it has, where no others are said.
std::vector<std::string> namesKept(const KeysArguments& arguments, const KeyFolder& folder) {
    const Expected<std::string> pem =
        folder.readOwn(KeyFolder::fileOf({.wall = {}, .kind = Kind::kServer, .name = {}}));
    const Expected<Certificate> former = pem ? Certificate::read(*pem) : tl::unexpected(pem.error());
    return arguments.names.empty() && former ? former->names : serverNames(arguments);
}

std::string knownAs(const std::vector<std::string>& names) {
    return fmt::format("browsers know the server as {}\n", fmt::join(names, ", "));
}

std::string fingerprintLine(const Certificate& authority) {
    return fmt::format("SHA-256 of the authority's certificate: {}\n", authority.fingerprint);
}

/// The folder of the keys while nobody else writes into it, and what was issued by then.
struct OpenKeys {
    KeyFolder folder;
    KeyFolder::Writer writer;
    std::vector<IssuedKey> issued;
};

/// A writer would make a folder that is not there.
Expected<void> checkFolder(const std::string& path) {
    std::error_code ignored;  // where it cannot be looked at there is none for us
    if (std::filesystem::is_directory(path, ignored)) return {};
    return fail(ErrorCode::kNotFound,
                fmt::format("{}: no folder of keys is there: {} init --wall W makes it", path, commandFor(path)));
}

Expected<OpenKeys> openKeys(const std::string& path) {
    if (const Expected<void> there = checkFolder(path); !there) return tl::unexpected(there.error());
    KeyFolder folder(path);
    Expected<KeyFolder::Writer> writer = KeyFolder::Writer::open(folder);
    if (!writer) return tl::unexpected(writer.error());
    Expected<std::vector<IssuedKey>> issued = folder.issued();
    if (!issued) return tl::unexpected(issued.error());
    return OpenKeys{.folder = std::move(folder), .writer = std::move(*writer), .issued = std::move(*issued)};
}

Expected<Authority> openAuthority(const KeyFolder& folder) {
    Expected<Authority> authority = folder.authority();
    if (authority || authority.error().code != ErrorCode::kNotFound) return authority;
    return fail(
        ErrorCode::kNotFound,
        fmt::format("{0}/{1} is not there: keys are made in the folder that has it ({2} init --wall W makes one)",
                    folder.path(), kAuthorityKey, commandFor(folder.path())));
}

Expected<std::string> authorityCertificateIn(const KeyFolder& folder) {
    if (const Expected<void> there = checkFolder(folder.path()); !there) return tl::unexpected(there.error());
    Expected<std::string> pem = folder.authorityCertificate();
    if (pem || pem.error().code != ErrorCode::kNotFound) return pem;
    return fail(ErrorCode::kNotFound, fmt::format("{0}/{1} is not there: {2} init --wall W makes it", folder.path(),
                                                  kAuthority, commandFor(folder.path())));
}

/// A folder that is carried to another machine: keys, and the authority's certificate, never its key.
struct OutFolder {
    KeyFolder folder;
    KeyFolder::Writer writer;
};

Expected<OutFolder> openOut(const std::string& path, const OpenKeys& keys, const Authority& authority) {
    std::error_code ignored;
    // Its lock is ours already: we would wait for ourselves.
    if (std::filesystem::equivalent(path, keys.folder.path(), ignored))
        return fail(ErrorCode::kUsage,
                    fmt::format("--out {}: that is the folder of the keys itself: leave --out away", path));
    KeyFolder folder(path);
    Expected<KeyFolder::Writer> writer = KeyFolder::Writer::open(folder);
    if (!writer) return failWith("--out", writer.error());
    const Expected<std::string> there = folder.authorityCertificate();
    if (!there && there.error().code != ErrorCode::kNotFound) return failWith("--out", there.error());
    if (there) {
        // The keys that are there would let nobody in with another authority's certificate beside them.
        const Expected<Certificate> other = Certificate::read(*there);
        if (!other || other->fingerprint != authority.certificate().fingerprint)
            return fail(
                ErrorCode::kRefused,
                fmt::format("--out {0}: {0}/{1} is of another authority: name another folder", path, kAuthority));
    } else if (Expected<void> written = writer->write(std::string(kAuthority), authority.certificatePem()); !written) {
        return tl::unexpected(written.error());
    }
    return OutFolder{.folder = std::move(folder), .writer = std::move(*writer)};
}

/// Makes a key for each. The server's stays where its server reads it, others go to `out` where there is one.
Expected<std::string> issueTo(std::span<const Identity> holders, const std::vector<std::string>& names, OpenKeys& keys,
                              const Authority& authority, const std::optional<OutFolder>& out) {
    const DateTime now = std::chrono::system_clock::now();
    if (authority.certificate().until <= now)
        return fail(ErrorCode::kRefused,
                    fmt::format("{}: the authority held until {}: make a new one in another folder (init)",
                                keys.folder.path(), toText(authority.certificate().until)));
    std::vector<Authority::Issued> made;
    for (const Identity& holder : holders) {
        Expected<Authority::Issued> one =
            authority.issue(holder, holder.kind == Kind::kServer ? names : std::vector<std::string>(), now);
        if (!one) return tl::unexpected(one.error());
        keys.issued.push_back(
            {.serial = one->certificate.serial, .holder = holder, .until = one->certificate.until, .revoked = false});
        made.push_back(std::move(*one));
    }
    // First, so that there is no key that `list` and `revoke` do not know.
    if (const Expected<void> written = keys.writer.write(keys.issued); !written) return tl::unexpected(written.error());
    std::string said;
    for (std::size_t i = 0; i < made.size(); ++i) {
        const bool away = out && holders[i].kind != Kind::kServer;
        const std::string file = KeyFolder::fileOf(holders[i]);
        const Expected<void> written = (away ? out->writer : keys.writer).write(file, made[i].pem);
        if (!written) return tl::unexpected(written.error());
        said += fmt::format("{}/{}: key of {}, until {}\n", (away ? out->folder : keys.folder).path(), file,
                            describe(holders[i]), toText(made[i].certificate.until));
        if (holders[i].kind == Kind::kServer) said += knownAs(names);
    }
    if (out) said += fmt::format("{}/{}: the authority's certificate\n", out->folder.path(), kAuthority);
    return said;
}

/// What is in use is not replaced unasked.
Expected<void> checkNoneThere(const KeyFolder& folder, const Identity& holder, std::span<const IssuedKey> issued) {
    const Expected<std::string> pem = folder.readOwn(KeyFolder::fileOf(holder));
    if (!pem && pem.error().code == ErrorCode::kNotFound) return {};
    if (!pem) return tl::unexpected(pem.error());
    const Expected<Certificate> there = Certificate::read(*pem);
    if (!there || there->until <= std::chrono::system_clock::now()) return {};
    const auto known = std::ranges::find(issued, there->serial, &IssuedKey::serial);
    if (known != issued.end() && known->revoked) return {};
    const bool otherRole = there->holder && there->holder->role != holder.role;
    return fail(ErrorCode::kRefused,
                fmt::format("{}/{}: there is a key already, good until {}: renew makes another one{}", folder.path(),
                            KeyFolder::fileOf(holder), toText(there->until),
                            otherRole ? fmt::format(" ({} as before; for another role revoke it first)",
                                                    nameOf(there->holder->role))
                                      : ""));
}

Expected<std::string> issueNew(const KeysArguments& arguments, Identity holder) {
    if (const Expected<void> good = checkHolderName(holder.name); !good) return tl::unexpected(good.error());
    Expected<OpenKeys> keys = openKeys(arguments.keys);
    if (!keys) return tl::unexpected(keys.error());
    const Expected<Authority> authority = openAuthority(keys->folder);
    if (!authority) return tl::unexpected(authority.error());
    holder.wall = authority->wall();
    if (const Expected<void> none = checkNoneThere(keys->folder, holder, keys->issued); !none)
        return tl::unexpected(none.error());
    std::optional<OutFolder> out;
    if (!arguments.out.empty()) {
        Expected<OutFolder> opened = openOut(arguments.out, *keys, *authority);
        if (!opened) return tl::unexpected(opened.error());
        if (const Expected<void> none = checkNoneThere(opened->folder, holder, keys->issued); !none)
            return tl::unexpected(none.error());
        out.emplace(std::move(*opened));
    }
    return issueTo(std::array{holder}, {}, *keys, *authority, out);
}

/// A holder of 1024 bytes fits into a line of "issued": names of 64 are to have room behind the wall's.
Expected<void> checkWallName(const Identity& server) {
    constexpr std::size_t kMostBytes = 1024 - 256;
    const std::string uri = toUri(server);
    if (uri.size() <= kMostBytes && parseIdentity(uri)) return {};
    return fail(ErrorCode::kBadInput, fmt::format("the wall's name cannot stand in keys: it is {}",
                                                  server.wall.empty() ? "empty" : "too long"));
}

std::string_view stateAt(DateTime now, DateTime until) {
    return until <= now ? "ended" : until <= now + kSoon ? "ends soon" : "good";
}

using Row = std::array<std::string, 6>;

/// A line each, in columns.
std::string tableOf(std::span<const Row> rows) {
    const auto width = [](std::string_view text) {  // in characters
        return static_cast<std::size_t>(
            std::ranges::count_if(text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
    };
    std::array<std::size_t, std::tuple_size_v<Row>> widths{};
    for (const Row& row : rows)
        for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width(row[i]));
    std::string text;
    for (const Row& row : rows) {
        for (std::size_t i = 0; i + 1 < row.size(); ++i)
            text += row[i] + std::string(widths[i] - width(row[i]) + 2, ' ');
        text += row.back() + "\n";
    }
    return text;
}

Expected<std::vector<IssuedKey>> keysToRenew(const KeysArguments& arguments, std::span<const IssuedKey> issued) {
    std::vector<IssuedKey> chosen;
    if (arguments.holders.empty()) {
        const DateTime now = std::chrono::system_clock::now();
        for (IssuedKey& key : newestOf(issued))
            if (!key.revoked && (arguments.all || stateAt(now, key.until) != "good")) chosen.push_back(std::move(key));
        return chosen;
    }
    for (const std::string& name : arguments.holders) {
        Expected<IssuedKey> key = findHolder(issued, name);
        if (!key) return tl::unexpected(key.error());
        if (key->holder.kind == Kind::kServer && !arguments.out.empty())
            return fail(ErrorCode::kUsage, "--out is for hosts and people: the server's key stays in --keys");
        if (std::ranges::find(chosen, key->serial, &IssuedKey::serial) == chosen.end())
            chosen.push_back(std::move(*key));
    }
    return chosen;
}

Expected<std::string> revokeIn(OpenKeys& keys, const std::string& name) {
    const Expected<std::string> ended = revokeTokens(keys.folder, keys.writer, name);
    if (!ended) return ended;
    const Expected<IssuedKey> found = findHolder(keys.issued, name);
    if (!found && !ended->empty() && found.error().code == ErrorCode::kNotFound) return ended;
    if (!found) return tl::unexpected(found.error());
    const Identity& holder = found->holder;
    if (holder.kind == Kind::kServer)
        return fail(ErrorCode::kRefused,
                    "the server cannot be revoked: hosts and people ask nobody about it. A lost key of the server "
                    "means a new authority (init in another folder) and new keys for all");
    std::size_t count = 0;
    for (IssuedKey& key : keys.issued) {
        if (key.revoked || !isSameHolder(key.holder, holder)) continue;
        key.revoked = true;
        ++count;
    }
    std::string said = fmt::format("{} had been revoked already\n", describe(holder));
    if (count > 0) {
        if (const Expected<void> written = keys.writer.write(keys.issued); !written)
            return tl::unexpected(written.error());
        said =
            fmt::format("revoked {}: {} key{}; the server that reads {}/issued lets nobody in by {}\n",
                        describe(holder), count, count == 1 ? "" : "s", keys.folder.path(), count == 1 ? "it" : "them");
    }
    const std::string path = keys.folder.path() + "/" + KeyFolder::fileOf(holder);
    if (::unlink(path.c_str()) == 0)
        said += fmt::format("removed {}\n", path);
    else if (errno != ENOENT)
        return fail(ErrorCode::kFailed,
                    fmt::format("{}: has been revoked, and cannot be removed ({})", path, std::strerror(errno)));
    return *ended + said;
}

/// Why no server takes this folder of keys as a whole; empty: it does, or the folder is of no server.
std::string faultForServers(const OpenKeys& keys) {
    const auto isServers = [](const IssuedKey& key) { return key.holder.kind == Kind::kServer; };
    if (std::ranges::none_of(keys.issued, isServers)) return {};
    const std::string path =
        keys.folder.path() + "/" + KeyFolder::fileOf({.wall = {}, .kind = Kind::kServer, .name = {}});
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored))
        return fmt::format("{} is not there: {} renew server makes another one", path, commandFor(keys.folder.path()));
    const Expected<TlsKeys> read = keys.folder.ofServer();
    if (!read) return read.error().message;
    const Expected<std::shared_ptr<const TlsContext>> made = TlsContext::make(*read);
    return made ? std::string() : made.error().message;
}

/// A file of its own takes the name: what links of that name lead to stays as it is.
Expected<void> writePublic(const std::string& path, std::string_view text) {
    const auto cannot = [&] {
        return fail(ErrorCode::kFailed, fmt::format("{}: cannot be written ({})", path, std::strerror(errno)));
    };
    std::error_code ignored;
    if (const auto there = std::filesystem::status(path, ignored);
        std::filesystem::exists(there) && !std::filesystem::is_regular_file(there))
        return fail(ErrorCode::kFailed, path + ": is no file (-: to the standard output)");
    const std::filesystem::path name(path);
    const std::string unfinished = name.parent_path() / ("." + name.filename().string() + ".new");
    ::unlink(unfinished.c_str());
    const FileHandle file(::open(unfinished.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0644));
    if (file.get() < 0) return cannot();
    const auto writeAll = [&] {
        while (!text.empty()) {
            const ssize_t count = ::write(file.get(), text.data(), text.size());
            if (count < 0 && errno == EINTR) continue;
            if (count <= 0) return false;
            text.remove_prefix(static_cast<std::size_t>(count));
        }
        return ::fsync(file.get()) == 0;
    };
    if (writeAll() && ::rename(unfinished.c_str(), path.c_str()) == 0) return {};
    auto error = cannot();
    ::unlink(unfinished.c_str());
    return error;
}

}  // namespace

Expected<std::string> issueHost(const KeysArguments& arguments) {
    return issueNew(arguments, {.wall = {}, .kind = Kind::kHost, .name = arguments.holders.front()});
}

Expected<std::string> issuePerson(const KeysArguments& arguments) {
    Identity holder{.wall = {}, .kind = Kind::kPerson, .name = arguments.holders.front()};
    for (const Role role : {Role::kViewer, Role::kEditor, Role::kOperator})
        if (arguments.role == nameOf(role)) holder.role = role;
    return issueNew(arguments, std::move(holder));
}

Expected<std::string> initKeys(const KeysArguments& arguments) {
    const Expected<std::string> wall = nameOfWall(arguments.wall);
    if (!wall) return tl::unexpected(wall.error());
    const Identity server{.wall = *wall, .kind = Kind::kServer, .name = {}};
    if (const Expected<void> good = checkWallName(server); !good) return tl::unexpected(good.error());
    const DateTime now = std::chrono::system_clock::now();
    const Authority authority = Authority::make(*wall, now);
    const std::vector<std::string> names = serverNames(arguments);
    const Expected<Authority::Issued> made = authority.issue(server, names, now);
    if (!made) return tl::unexpected(made.error());

    const KeyFolder folder(arguments.keys);
    const Expected<KeyFolder::Writer> writer = KeyFolder::Writer::open(folder);
    if (!writer) return tl::unexpected(writer.error());
    const auto isThere = [&](std::string_view file) {
        std::error_code ignored;
        return std::filesystem::exists(
            std::filesystem::symlink_status(folder.path() + "/" + std::string(file), ignored));
    };
    // A folder with the certificate alone is that of a server or person, whose keys would be of no use any more; but
    // where an `init` was cut off nobody has any yet.
    for (const std::string_view file : {kAuthorityKey, kAuthority})
        if (isThere(file) && !(file == kAuthority && isThere(kBegun)))
            return fail(ErrorCode::kRefused,
                        fmt::format("{0}/{1}: an authority is there already, and what it made would be of no use any "
                                    "more: name another folder (--keys)",
                                    folder.path(), file));
    // The authority's key comes first, and gets its name last: without that nothing has been made yet.
    const std::vector<IssuedKey> issued{
        {.serial = made->certificate.serial, .holder = server, .until = made->certificate.until, .revoked = false}};
    Expected<void> written = writer->write(std::string(kBegun), authority.pem());
    if (written) written = writer->write(issued);
    // Tokens of an authority that was there before let nobody in by this one.
    if (written && isThere("tokens")) written = writer->writeTokens({});
    if (written) written = writer->write(KeyFolder::fileOf(server), made->pem);
    if (written) written = writer->write(std::string(kAuthority), authority.certificatePem());
    if (written) written = writer->rename(std::string(kBegun), std::string(kAuthorityKey));
    if (!written) return tl::unexpected(written.error());
    return fmt::format(
        "{0}/{1}: key of the authority of the wall '{2}'; who has it can let in anybody\n"
        "{0}/{3}: its certificate, until {4}\n"
        "{0}/{5}: key of the server, until {6}\n"
        "{7}{8}next: tessera-keys --keys {0} host NAME\n",
        folder.path(), kAuthorityKey, *wall, kAuthority, toText(authority.certificate().until),
        KeyFolder::fileOf(server), toText(made->certificate.until), knownAs(names),
        fingerprintLine(authority.certificate()));
}

Expected<std::string> listKeys(const KeysArguments& arguments) {
    const KeyFolder folder(arguments.keys);
    const Expected<std::string> pem = authorityCertificateIn(folder);
    if (!pem) return tl::unexpected(pem.error());
    const Expected<Certificate> authority = Certificate::read(*pem);
    if (!authority) return failWith(fmt::format("{}/{}", folder.path(), kAuthority), authority.error());
    const Expected<std::vector<IssuedKey>> issued = folder.issued();
    if (!issued) return tl::unexpected(issued.error());
    const DateTime now = std::chrono::system_clock::now();
    const auto row = [](std::string_view what, const std::string& name, std::string_view role,
                        const std::string& serial, DateTime until, std::string_view state) {
        return Row{std::string(what), name, std::string(role), serial.substr(0, 8), toText(until), std::string(state)};
    };
    std::vector<Row> rows{{"key of", "name", "role", "serial", "until", "state"}};
    rows.push_back(row("authority", issued->empty() ? "" : issued->front().holder.wall, "", authority->serial,
                       authority->until, stateAt(now, authority->until)));
    for (std::size_t i = 0; i < issued->size(); ++i) {
        const IssuedKey& key = (*issued)[i];
        const bool replaced = std::ranges::any_of(std::span(*issued).subspan(i + 1), [&](const IssuedKey& later) {
            return isSameHolder(later.holder, key.holder);
        });
        std::string_view state = stateAt(now, key.until);
        if (key.revoked)
            state = "revoked";
        else if (replaced && state != "ended")
            state = "replaced";
        rows.push_back(row(wordFor(key.holder.kind), key.holder.name,
                           key.holder.kind == Kind::kPerson ? nameOf(key.holder.role) : "", key.serial, key.until,
                           state));
    }
    const Expected<std::vector<KeptToken>> tokens = tokensIn(folder, now);
    if (!tokens) return tl::unexpected(tokens.error());
    for (const KeptToken& token : *tokens)
        rows.push_back(row("token", token.pass.name,
                           token.pass.panel.empty() ? nameOf(token.pass.role) : std::string_view("panel"), token.hash,
                           token.until, now < token.until ? "good" : "ended"));
    return tableOf(rows);
}

Expected<std::string> revokeKeys(const KeysArguments& arguments) {
    if (arguments.links) return revokeLinks(arguments);
    if (arguments.holders.empty())
        return fail(ErrorCode::kUsage,
                    "revoke: say whose keys and tokens (NAME), or that all links and tokens end (--links)");
    Expected<OpenKeys> keys = openKeys(arguments.keys);
    if (!keys) return tl::unexpected(keys.error());
    Expected<std::string> said = revokeIn(*keys, arguments.holders.front());
    const std::string fault = said ? faultForServers(*keys) : std::string();
    if (!fault.empty())
        fmt::print(stderr,
                   "tessera-keys: warning: {}. A server that runs takes what is revoked all the same, and no other "
                   "change of its keys; none starts until that is mended\n",
                   fault);
    return said;
}

Expected<std::string> renewKeys(const KeysArguments& arguments) {
    Expected<OpenKeys> keys = openKeys(arguments.keys);
    if (!keys) return tl::unexpected(keys.error());
    const Expected<std::vector<IssuedKey>> chosen = keysToRenew(arguments, keys->issued);
    if (!chosen) return tl::unexpected(chosen.error());
    std::vector<Identity> holders;
    for (const IssuedKey& key : *chosen) holders.push_back(key.holder);
    if (!arguments.names.empty() && std::ranges::find(holders, Kind::kServer, &Identity::kind) == holders.end())
        return fail(ErrorCode::kUsage, "--names are the server's, whose key is not renewed: renew server does");
    const Expected<Authority> authority = openAuthority(keys->folder);
    if (!authority) return tl::unexpected(authority.error());
    if (holders.empty())
        return arguments.all ? std::string("there is no key that has not been revoked\n")
                             : fmt::format("no key ends within {} days\n", kSoon.count());
    std::optional<OutFolder> out;
    if (!arguments.out.empty()) {
        Expected<OutFolder> opened = openOut(arguments.out, *keys, *authority);
        if (!opened) return tl::unexpected(opened.error());
        out.emplace(std::move(*opened));
    }
    Expected<std::string> said = issueTo(holders, namesKept(arguments, keys->folder), *keys, *authority, out);
    if (!said) return said;
    for (const IssuedKey& key : *chosen)
        if (key.revoked) *said += fmt::format("{} had been revoked, and is let in again\n", describe(key.holder));
    return said;
}

Expected<std::string> exportAuthority(const KeysArguments& arguments) {
    const KeyFolder folder(arguments.keys);
    const Expected<std::string> pem = authorityCertificateIn(folder);
    if (!pem) return tl::unexpected(pem.error());
    const Expected<Certificate> authority = Certificate::read(*pem);
    if (!authority) return failWith(fmt::format("{}/{}", folder.path(), kAuthority), authority.error());
    if (arguments.file == "-") {
        fmt::print(stderr, "{}", fingerprintLine(*authority));
        return *pem;
    }
    // A slip of the hand would else put the certificate in a key's place.
    const std::filesystem::path parent = std::filesystem::path(arguments.file).parent_path();
    std::error_code ignored;
    if (std::filesystem::equivalent(parent.empty() ? "." : parent, folder.path(), ignored))
        return fail(ErrorCode::kUsage,
                    fmt::format("{}: that is in the folder of the keys: name another place", arguments.file));
    if (const Expected<void> written = writePublic(arguments.file, *pem); !written)
        return tl::unexpected(written.error());
    return fmt::format("{}: certificate of the authority, until {}\n{}", arguments.file, toText(authority->until),
                       fingerprintLine(*authority));
}

}  // namespace tessera
